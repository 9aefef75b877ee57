"""A box whose processor runs its firmware, as the kernels of axes want it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from rtec._jit import Record, by_address, new_record
from rtec.axis import Encoder
from rtec.board import Board, Microcontroller
from rtec.board.board import GRACE_READINGS, WINDOW_STEPS
from rtec.errors import ArgumentError
from rtec.injector import InjectorSettings, RealEdges
from rtec.machine import _firmware_kernels
from rtec.requester.settings import HandshakeSettings

_WARM_UP_PS = 2_000_000_000
"""How long the box is on before the machine: Design B's lines are through by then."""


class FirmwareBox:
    """The circuit board of a box, powered up before the axis is switched on, its lines through by then.

    Parameters
    ----------
    injector
        Design and hold latch; the times are the firmware's own.
    microcontroller
        The processor.
    encoder
        Whose levels it sees at home.
    switch_on
        False: its hardware switch forbids corrections.
    start_ps
        When the axis is switched on.
    """

    def __init__(
        self,
        injector: InjectorSettings,
        microcontroller: Microcontroller,
        encoder: Encoder,
        *,
        switch_on: bool,
        start_ps: int = 0,
    ) -> None:
        self.board = Board(
            injector.design,
            microcontroller,
            initial=encoder.level_at_home,
            hold_latch=injector.real_edges is RealEdges.HOLD,
            start_ps=start_ps - _WARM_UP_PS,
        )
        self.board.switch(switch_on)
        self.board.idle(until_ps=start_ps)
        self.board.begin_counting()
        self._rest = new_record(_firmware_kernels.REST)
        snapshot = np.zeros(_firmware_kernels.STATE_BYTES, np.uint8)
        no_queue = np.zeros((0, 3), np.int64)
        board = self.board
        self._parts: Any = board.state, board.cpu.loop, *board.cpu.arrays, no_queue, self._rest, snapshot

    @property
    def cycles_skipped(self) -> int:
        """Return the cycles left out at rest, in whole rounds that change nothing."""
        return int(self._rest.skipped_cycles)

    def of(self, state: Record) -> Any:
        """Return the box for the kernels of an axis whose record is ``state``."""
        return self._parts, by_address(_firmware_kernels.run_firmware, state, self._parts, 0)


def side_by_side(boxes: Sequence[FirmwareBox], state: Record) -> Any:
    """Return copies of several boxes, each part an array with a row for each box.

    So a kernel is compiled once, however many boxes there are.
    """
    circuits, loops, memories, hidden, logs, queues, rests, snapshots = zip(
        *(box._parts for box in boxes),  # noqa: SLF001 - its own kind
        strict=True,
    )
    execute = loops[0][0]
    words, codes = (np.stack([loop[k] for loop in loops]) for k in (1, 2))
    rows = np.rec.array(np.array(circuits)), np.rec.array(np.array(rests))
    stacked = (np.stack(part) for part in (memories, hidden, logs))
    _, run = boxes[0].of(state)
    return (rows[0], (execute, words, codes), *stacked, queues[0], rows[1], np.stack(snapshots)), run


def check_windows(handshake: HandshakeSettings) -> None:
    """Check that a handshake has the windows that stand in the firmware's source.

    Raises
    ------
    ArgumentError
        Other windows.
    """
    if (handshake.window_steps, handshake.grace_readings) != (WINDOW_STEPS, GRACE_READINGS):
        raise ArgumentError(
            "window_steps",
            f"window {handshake.window_steps}, grace {handshake.grace_readings}",
            f"window {WINDOW_STEPS} and grace {GRACE_READINGS} with the firmware",
            "they stand in its source (rtec.inc)",
        )
