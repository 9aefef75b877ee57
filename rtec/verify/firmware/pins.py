"""Which pins a firmware drives: all that its design needs, none that is not its own, none after a reset."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from rtec.verify.contract.trials import Case
from rtec.verify.firmware.algorithm import Firmware
from rtec.verify.firmware.bench import Bench, BenchState
from rtec.verify.firmware.contract import DECODER_RST, HOLD, NOT_HOMED, NOT_VALID, Failed
from rtec.verify.firmware.trace import insertions

_OTHERS = {0: "P0 is the bus", 2: "port 2 has to stay FFh for MOVX @Ri", 3: "inputs and bus of port 3 stay high"}
_MARGIN_CYCLES = 16
"""Before the first and behind the last change of the insertion."""

_BACK_READINGS = 5.0


def pins(firmware: Firmware, cases: Iterable[Case]) -> str:
    """Play insertions at rest in every state, and look at all latches.

    Raises
    ------
    Failed
        A pin of the design is never driven, or another one is.
    """
    bench = firmware.bench
    needed = bench.design.pins | (HOLD if bench.hold_latch and not bench.design.in_path else 0)
    own = {0: 0, 1: bench.design.pins | DECODER_RST | HOLD, 2: 0, 3: NOT_VALID}
    driven = 0
    for case in cases:
        firmware.replay(case.stream.stimulus())
        for port in range(4):
            _own_alone(bench, port, ~bench.first_latches[port] & ~own[port] & 0xFF, bench.begun_ps)
            for cycle, before, latch in bench.changes(port):
                driven |= before ^ latch if port == 1 else 0
                _own_alone(bench, port, ~latch & ~own[port] & 0xFF, bench.time_of(cycle))
    missing = needed & ~driven
    if missing:
        raise Failed(
            f"never drives {pin_names(1, missing)}, whatever is asked for; design {bench.design.value} inserts with "
            f"{pin_names(1, needed)}",
            bench.now_ps,
        )
    return f"drives {pin_names(1, needed)}, and no pin that is not its own"


def _own_alone(bench: Bench, port: int, foreign: int, t_ps: int) -> None:
    """Refuse pins that are low and are not the design's own."""
    if foreign:
        why = _OTHERS.get(port, f"design {bench.design.value} has nothing there")
        raise Failed(f"drives {pin_names(port, foreign)} low: {why}", t_ps)


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
