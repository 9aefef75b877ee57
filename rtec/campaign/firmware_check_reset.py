"""A reset at every cycle of an insertion: what stays driven, what the controller sees, does the box come back."""

from __future__ import annotations

from dataclasses import dataclass

from rtec.campaign.firmware_check_bench import Bench, BenchState
from rtec.campaign.firmware_check_contract import HOLD, NOT_HOMED, Failed
from rtec.campaign.firmware_check_trace import insertions

_MARGIN_CYCLES = 16
"""Before the first and behind the last change of the insertion."""

_BACK_READINGS = 5.0


@dataclass(slots=True)
class AfterReset:
    """The worst that a reset has done."""

    tried: int = 0
    worst_counts_off: int = 0
    """What the controller counted, less nothing or a whole step, whichever is nearer."""
    illegal_cycle: int | None = None
    """In which the first reset brought an illegal transition; None where none did."""


def resets(bench: Bench, home: BenchState) -> AfterReset:
    """Reset at every cycle of an insertion at rest, of either sign; return the worst that came of it.

    Raises
    ------
    Failed
        A line is still driven afterwards, or the box does not come back.
    """
    seen = AfterReset()
    for sign in (1, -1):
        first_ps, last_ps = _span(bench, home, sign)
        cycles = range(bench.cycle_at(first_ps) - _MARGIN_CYCLES, bench.cycle_at(last_ps) + _MARGIN_CYCLES + 1)
        before = _asked(bench, home, sign, bench.time_of(cycles[0]))
        for cycle in cycles:
            _one(bench, before, sign, cycle, seen)
    return seen


def _span(bench: Bench, home: BenchState, sign: int) -> tuple[int, int]:
    bench.go_back(home)
    bench.board.ask(sign)
    bench.await_that(lambda: bench.words.completed == sign, readings=8.0)
    found = insertions(bench)
    if not found:
        raise Failed(f"total {sign:+d} at rest: nothing inserted, so no reset could be tried", bench.now_ps)
    return found[0].first_ps, found[0].last_ps


def _asked(bench: Bench, home: BenchState, sign: int, until_ps: int) -> BenchState:
    bench.go_back(home)
    bench.board.ask(sign)
    bench.run_for(until_ps - bench.now_ps)
    return bench.keep()


def _one(bench: Bench, before: BenchState, sign: int, cycle: int, seen: AfterReset) -> None:
    bench.go_back(before)
    if bench.time_of(cycle) > bench.now_ps:
        bench.run_for(bench.time_of(cycle) - bench.now_ps)
    bench.board.ask(0)
    bench.reset()
    when = f"reset in cycle {cycle}, total {sign:+d}"
    rows = len(list(bench.changes(1)))
    bench.run_readings(_BACK_READINGS)
    driven = not bench.design.in_path
    mask = (bench.design.pins if driven else 0) | HOLD
    for changed, _, latch in list(bench.changes(1))[rows:]:
        if ~latch & mask:
            pins = pin_names(1, ~latch & mask)
            raise Failed(f"{when}: {pins} driven low afterwards", bench.time_of(changed))
    if bench.words.message != NOT_HOMED or not bench.valid:
        raise Failed(f"{when}: the box does not come back with NOT_HOMED", bench.now_ps)
    received = bench.received()
    seen.tried += 1
    whole = sign * bench.design.step_counts
    off = min(received.count, received.count - whole, key=abs)
    if abs(off) > abs(seen.worst_counts_off):
        seen.worst_counts_off = off
    if received.illegal_transitions and seen.illegal_cycle is None:
        seen.illegal_cycle = cycle


def pin_names(port: int, bits: int) -> str:
    """Return the names of some pins.

    Examples
    --------
    >>> pin_names(1, 0x81)
    'P1.0, P1.7'
    """
    return ", ".join(f"P{port}.{bit}" for bit in range(8) if bits >> bit & 1)
