"""The state of the processor at reset."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from firmware_model.core import _layout as at
from firmware_model.isa.parts import Part, Timing

_RESET = {at.SP: 0x07, at.P0: 0xFF, at.P1: 0xFF, at.P2: 0xFF, at.P3: 0xFF}
"""Reset values that are not 0 (MCS-51 User's Manual 1994, chapter 3, "Reset", table 8)."""


def new_hidden(part: Part, timing: Timing) -> NDArray[np.int64]:
    """Return the hidden state of a part that has never run.

    Examples
    --------
    >>> from firmware_model.isa.parts import PARTS, TIMINGS
    >>> int(new_hidden(PARTS["8051"], TIMINGS["12-clock"])[at.TOP])
    127
    """
    hidden = np.zeros(at.HIDDEN, dtype=np.int64)
    hidden[at.TOP] = part.iram_bytes - 1
    hidden[at.TICK] = timing.cycles_per_tick
    hidden[at.RECOGNISE] = timing.recognition_cycles
    hidden[at.CALL] = timing.call_cycles
    hidden[at.HAS_TIMER2] = part.has_timer2
    watch(hidden)
    return hidden


def watch(hidden: NDArray[np.int64]) -> None:
    """Mark the latches that the loop must look at: inputs of timers and interrupts, all where they are recorded."""
    if hidden[at.LOG_ROOM]:
        hidden[at.WATCHED : at.WATCHED + 4] = 0xFF
    else:
        hidden[at.WATCHED : at.WATCHED + 4] = (0, 3 if hidden[at.HAS_TIMER2] else 0, 0, 0x3C)
        hidden[at.WATCHED : at.WATCHED + 4] |= hidden[at.STOPPING : at.STOPPING + 4]


def reset(memory: NDArray[np.uint8], hidden: NDArray[np.int64]) -> None:
    """Reset registers and hidden state; both RAMs, the pins and the count of cycles stay as they are.

    The manual: reset does not affect internal RAM. Time goes on, so that a reset can be tried in any cycle of a run.
    """
    memory[0x180:0x200] = 0
    for place, value in _RESET.items():
        memory[place] = value
    for index in (at.PC, at.SERVING, at.HOLD, at.STOP, at.FAULT, at.SEND_LEFT, at.RECEIVE_LEFT, at.OUTPUT_AT):
        hidden[index] = 0
    hidden[[at.SEND_AT, at.RECEIVE_AT, at.DROPPED, at.DROPPED + 1]] = at.NEVER
    hidden[[at.OVERFLOWS_1, at.OVERFLOWS_2]] = 0
    hidden[at.STAMP : at.STAMP + 6] = hidden[at.CYCLES]
    hidden[at.SYNCED] = hidden[at.CYCLES]
    levels = int(memory[at.PINS + 3]) & 0x3C
    if hidden[at.HAS_TIMER2]:
        levels |= (int(memory[at.PINS + 1]) & 3) << 8
    # what stands at the pins at reset is no edge
    hidden[[at.LEVELS, at.SEEN]] = levels
    hidden[at.LEVELS_AT] = hidden[at.CYCLES]
