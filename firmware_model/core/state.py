"""The state of a processor that has never run."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from firmware_model.core import _layout as at
from firmware_model.isa.parts import Part, Timing


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
