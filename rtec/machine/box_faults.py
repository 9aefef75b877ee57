"""Faults of the box on the open path: what begins and ends at a moment, in a modelled box or at a board."""

from __future__ import annotations

from typing import Any

from rtec._jit import Record
from rtec.board._board_kernels import board_ask, board_restart, board_switch
from rtec.injector._kernels import switch
from rtec.machine import _faulty_kernels as kernels
from rtec.machine._fault_kernels import BOX_RESTART, SWITCH_THROWN
from rtec.machine.fault_kinds import FaultRow
from rtec.machine.open_fault_kinds import CLOCK, HUNG, LATCH, OpenFaultRow

_TIMES = ("poll_ps", "poll_offset_ps", "decide_ps", "step_ps", "recover_ps", "latency_ps", "gate_ps", "rest_ps")
"""What a modelled box measures by its clock."""


def change_box(state: Record, board: Any, row: FaultRow, t_ps: int, level: int, *, begins: bool) -> None:
    """Let a fault of the box begin or end.

    Parameters
    ----------
    state
        The open path, its box run up to ``t_ps``.
    board
        The board as kernels of the open path have it, or None for a modelled box.
    row
        The class of the fault, with a code of `rtec.machine.open_fault_kinds.BOX_CODES`.
    t_ps, level
        The moment, and the level code of the lines into the box just before.
    begins
        Whether it begins.
    """
    code = row.code
    if code == CLOCK and isinstance(row, OpenFaultRow):
        _clock(state, board, row.factor if begins else 1.0 / row.factor)
    elif code == LATCH and isinstance(row, OpenFaultRow):
        closed = row.number if begins else 0
        if board is None:
            kernels.set_latch(state.injector, t_ps, level, int(begins), closed)
        else:
            kernels.set_board_latch(board, t_ps, int(begins), closed)
    elif code == SWITCH_THROWN:
        _switch(state, board, t_ps, on=not begins)
    elif not begins:
        _power(state, board, t_ps, on=True)  # what hangs is restarted, too
    elif code == HUNG:
        if board is None:
            kernels.hang(state.injector)
        else:
            kernels.hang_board(board[0], board[3])
    elif state.injector.powered:  # a box without power has no state to lose
        _power(state, board, t_ps, on=False)
        if code == BOX_RESTART:
            _power(state, board, t_ps, on=True)


def _clock(state: Record, board: Any, rate: float) -> None:
    num, den = (1.0 / rate).as_integer_ratio()
    if board is not None:
        kernels.set_board_clock(board[0], board[3], num, den)
        return
    for name in _TIMES:
        state.injector[name] = state.injector[name] * num // den


def _switch(state: Record, board: Any, t_ps: int, *, on: bool) -> None:
    if board is None:
        switch(state.injector, t_ps, int(on), int(state.injector.powered))
    else:
        b, _, mem, h, log, _ = board
        board_switch(b, mem, h, log, t_ps, int(not on), int(b.trip_n))


def _power(state: Record, board: Any, t_ps: int, *, on: bool) -> None:
    if board is None:
        switch(state.injector, t_ps, int(state.injector.enabled), int(on))
        return
    b, _, mem, h, log, _ = board
    state.injector.powered = int(on)
    if not on:
        kernels.cut_board(b, h)
        return
    board_restart(b, mem, h, log, t_ps)
    board_ask(mem, 0, 0)
    state.injector.completed = state.injector.requested = 0
