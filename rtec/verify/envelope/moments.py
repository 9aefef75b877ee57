"""Moments in which the firmware is armed: the axis creeps, a step is owed, and the next transition sets it off."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from rtec.board.board import Snapshot
from rtec.verify.envelope.bench import PhaseSweepBench

_CREEP = 0.23
"""Readings between two transitions of a creeping axis: never a whole reading at rest."""
_EARLY = 0.35
"""Readings before an answer to the PC from which a sweep begins; the work on a reading is done by its answer."""
_WAITING = 0.3
"""Readings behind an answer at which the program waits for a transition."""
_KINDS = 4
"""Of transitions."""
_BEFORE, _PARTS = (2, 5, 7), 10
_LISTED = 200
"""Instructions in which a waiting loop must come round twice."""


@dataclass(frozen=True, slots=True, eq=False)
class Armed:
    """A moment before the transition that sets off an insertion: the work on a reading is about to begin.

    The whole of the next one may pass without a transition.
    """

    moment: Snapshot
    direction: int
    sign: int
    """``direction``, ``sign``: of the motion and of the step that is owed."""


def waiting_ps(bench: PhaseSweepBench) -> int:
    """Return how long after such a moment the program waits for a transition."""
    return round((_EARLY + _WAITING) * bench.reading_ps)


def armed_moments(bench: PhaseSweepBench) -> list[Armed]:
    """Return an armed moment of each direction, sign and kind of transition behind which the program inserts.

    It is empty where the program inserts nothing while the axis creeps.

    Examples
    --------
    The Original inserts into state 1 alone, Design C behind each transition:

    >>> from rtec.board import Microcontroller
    >>> from rtec.injector import Design
    >>> processor = Microcontroller.named("8051-12mhz")
    >>> [len(armed_moments(PhaseSweepBench(design, processor))) for design in (Design.ORIGINAL, Design.C)]
    [4, 16]
    """
    armed = []
    for direction, sign in product((1, -1), (1, -1)):
        found: dict[int, Snapshot] = {}
        # which transition it is depends on when the axis begins to move and when the PC asks
        for before, part in product(_BEFORE, range(_PARTS)):
            moment = _approach(bench, direction, sign, before, part / _PARTS)
            if moment is not None:
                found.setdefault(moment.state, moment)
            if len(found) == _KINDS:
                break
        armed += [Armed(moment, direction, sign) for moment in found.values()]
    return armed


def _approach(bench: PhaseSweepBench, direction: int, sign: int, before: int, part: float) -> Snapshot | None:
    """Creep; ask behind ``before`` transitions; return the last moment before the one that sets off an insertion."""
    half_ps = round(_CREEP * bench.reading_ps) // 2
    bench.reset(bench.rested)
    bench.run_for(round(part * bench.reading_ps))
    kept = bench.keep()
    bench.edges(bench.now_ps + half_ps * np.arange(1, 2 * (before + 24), 2), direction)
    for made, at_ps in enumerate(bench.axis.times_ps.tolist()):
        if made == before:
            bench.board.ask(sign)
        last, kept = kept, bench.keep()
        seen = bench.seen_until(at_ps + half_ps)
        if made > before and len(seen) > 1:
            early = seen.times_ps[0] < at_ps and bench.design.step_counts > 1
            return _placed(bench, last if early else kept)
    return None


def _placed(bench: PhaseSweepBench, kept: Snapshot) -> Snapshot | None:
    """Move a moment on to where a sweep begins; None where the last transition is too near or too long ago."""
    bench.reset(kept)
    bench.run_readings(1.0)
    told_ps = bench.told[:, 0]
    answered_ps = int(told_ps[-1]) if told_ps.size else kept.now_ps + bench.reading_ps // 2
    start_ps = answered_ps - round(_EARLY * bench.reading_ps)
    # the reading before must have seen a transition, or this one finds the axis at rest
    if not kept.now_ps + bench.reading_ps // 10 < start_ps < kept.now_ps + bench.reading_ps // 2:
        return None
    bench.reset(kept)
    bench.run_until(start_ps)
    return bench.keep()


def loop_cycles(bench: PhaseSweepBench, armed: Snapshot) -> int | None:
    """Return the period in cycles of the loop in which the program waits, or None where it does not come round."""
    cpu = bench.board.cpu
    bench.reset(armed)
    bench.run_for(waiting_ps(bench))
    places = []
    for _ in range(_LISTED):
        cpu.step()
        places.append((cpu.pc, cpu.cycles))
    addresses = np.array([address for address, _ in places])
    for period in range(1, _LISTED // 2):
        if np.array_equal(addresses[-period:], addresses[-2 * period : -period]):
            return places[-1][1] - places[-1 - period][1]
    return None
