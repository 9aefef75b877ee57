"""Which pins a firmware drives: all that its design needs, none that is not its own, none after a reset."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from rtec.board._board_kernels import DECODER_RST, HOLD, NOT_VALID
from rtec.board.board import Snapshot
from rtec.verify.bench import Bench, Failed
from rtec.verify.contract.trials import Case
from rtec.verify.firmware.algorithm import Firmware
from rtec.verify.firmware.handshake import NOT_HOMED
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
    design = bench.design
    needed = design.pins | (HOLD if bench.hold_latch and not design.in_path else 0)
    own = {0: 0, 1: design.pins | DECODER_RST | HOLD, 2: 0, 3: NOT_VALID}
    driven = 0
    for case in cases:
        firmware.replay(case.stream.stimulus())
        for port in range(4):
            first = bench.first_latches[port]
            for t_ps, before, latch in [(bench.begun_ps, first, first), *bench.changes(port)]:
                if foreign := ~latch & ~own[port] & 0xFF:
                    why = _OTHERS.get(port, f"design {design.value} has nothing there")
                    raise Failed(f"drives {pin_names(port, foreign)} low: {why}", t_ps)
                driven |= before ^ latch if port == 1 else 0
    missing = f"never drives {pin_names(1, needed & ~driven)}, whatever is asked for"
    bench.require(not needed & ~driven, f"{missing}; design {design.value} inserts with {pin_names(1, needed)}")
    return f"drives {pin_names(1, needed)}, and no pin that is not its own"


@dataclass(slots=True)
class AfterReset:
    """The worst that a reset has done."""

    tried: int = 0
    worst_counts_off: int = 0
    """What the controller counted, less nothing or a whole step, whichever is nearer."""
    illegal_cycle: int | None = None
    """In which the first reset brought an illegal transition; None where none did."""

    def __str__(self) -> str:
        first = self.illegal_cycle
        illegal = "none illegal" if first is None else f"an illegal transition (first in cycle {first})"
        off = f"the controller off by {self.worst_counts_off:+d} counts at worst, {illegal}"
        return f"{self.tried} resets, all lines released; {off}"


def resets(bench: Bench, home: Snapshot) -> AfterReset:
    """Reset at every cycle of an insertion at rest, of either sign; return the worst that came of it.

    Raises
    ------
    Failed
        A line is still driven afterwards, or the box does not come back.
    """
    seen = AfterReset()
    for sign in (1, -1):
        bench.reset(home)
        bench.board.ask(sign)
        bench.await_total(sign, readings=8.0)
        found = insertions(bench)
        bench.require(bool(found), f"total {sign:+d} at rest: nothing inserted, so no reset could be tried")
        first, last = (bench.cycle_at(t_ps) for t_ps in (found[0].first_ps, found[0].last_ps))
        bench.reset(home)
        bench.board.ask(sign)
        bench.run_until(bench.time_of(first - _MARGIN_CYCLES))
        before = bench.keep()
        for cycle in range(first - _MARGIN_CYCLES, last + _MARGIN_CYCLES + 1):
            bench.reset(before)
            _one(bench, sign, cycle, seen)
    return seen


def _one(bench: Bench, sign: int, cycle: int, seen: AfterReset) -> None:
    bench.run_until(bench.time_of(cycle))
    bench.board.ask(0)
    bench.board.reset()
    when = f"reset in cycle {cycle}, total {sign:+d}"
    rows = len(list(bench.changes(1)))
    bench.run_readings(_BACK_READINGS)
    mask = (0 if bench.design.in_path else bench.design.pins) | HOLD
    for t_ps, _, latch in list(bench.changes(1))[rows:]:
        if ~latch & mask:
            raise Failed(f"{when}: {pin_names(1, ~latch & mask)} driven low afterwards", t_ps)
    back = bench.words.message == NOT_HOMED and bench.valid
    bench.require(back, f"{when}: the box does not come back with NOT_HOMED")
    received = bench.received()
    seen.tried += 1
    off = min(received.count, received.count - sign * bench.design.step_counts, key=abs)
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
