"""Moments in which the firmware is armed: the axis creeps, a step is owed, and the next transition sets it off."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from rtec.signal import EdgeStream
from rtec.verify.envelope.bench import Moment, PhaseSweepBench

_CREEP = 0.23
"""Readings between two transitions of a creeping axis: never a whole reading at rest."""
_EARLY = 0.35
"""Readings before an answer to the PC from which a sweep begins; the work on a reading is done by its answer."""
_WAITING = 0.3
"""Readings behind an answer at which the program waits for a transition."""
_STATES = (0, 1, 3, 2)
_BEFORE, _PARTS = (2, 5, 7), 10
_LISTED = 200
"""Instructions in which a waiting loop must come round twice."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Armed:
    """A moment before the transition that sets off an insertion."""

    moment: Moment
    """Begins with the work on a reading; the whole of the next one may pass without a transition."""
    waiting_ps: int
    """From there until the program waits."""
    direction: int
    sign: int
    """``direction``, ``sign``: of the motion and of the step that is owed."""
    into: int
    """Angle state 0..3 into which the transition leads."""


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
    found: dict[tuple[int, int, int], Armed] = {}
    for direction in (1, -1):
        for sign in (1, -1):
            # which transition it is depends on when the axis begins to move and when the PC asks
            for before, part in itertools.product(_BEFORE, range(_PARTS)):
                armed = _approach(bench, direction, sign, before, part / _PARTS)
                if armed is not None:
                    found.setdefault((direction, sign, armed.into), armed)
                if sum(key[:2] == (direction, sign) for key in found) == len(_STATES):
                    break
    return list(found.values())


def _approach(bench: PhaseSweepBench, direction: int, sign: int, before: int, part: float) -> Armed | None:
    """Creep; ask behind ``before`` transitions; return the last moment before the one that sets off an insertion."""
    board, spacing_ps = bench.board, round(_CREEP * bench.reading_ps)
    board.restore(bench.rested.kept)
    board.idle(until_ps=board.now_ps + round(part * bench.reading_ps))
    state, kept = 0, board.snapshot()
    for made in range(before + 24):
        if made == before:
            board.ask(sign)
        last, kept = kept, board.snapshot()
        at_ps = board.now_ps + spacing_ps // 2
        state = (state + direction) % 4
        edge = EdgeStream([at_ps], [_STATES[state]], initial=int(board.state.ab_in))
        seen = board.process(edge, until_ps=at_ps + spacing_ps // 2)
        if made > before and len(seen) > 1:
            if seen.times_ps[0] < at_ps and bench.design.step_counts > 1:
                kept, state = last, (state - direction) % 4
            return _placed(bench, Moment(kept=kept, at_ps=0, state=(state - direction) % 4), direction, sign)
    return None


def _placed(bench: PhaseSweepBench, moment: Moment, direction: int, sign: int) -> Armed | None:
    """Move a moment on to where a sweep begins; None where the last transition is too near or too long ago."""
    board = bench.board
    board.restore(moment.kept)
    begun_ps, answers = board.now_ps, int(board.state.published)
    board.idle(until_ps=begun_ps + bench.reading_ps)
    answered_ps = (
        int(board.state.published_ps) if board.state.published > answers else begun_ps + bench.reading_ps // 2
    )
    start_ps = answered_ps - round(_EARLY * bench.reading_ps)
    # the reading before must have seen a transition, or this one finds the axis at rest
    if not begun_ps + bench.reading_ps // 10 < start_ps < begun_ps + bench.reading_ps // 2:
        return None
    board.restore(moment.kept)
    board.idle(until_ps=start_ps)
    return Armed(
        moment=Moment(kept=board.snapshot(), at_ps=start_ps, state=moment.state),
        waiting_ps=round((_EARLY + _WAITING) * bench.reading_ps),
        direction=direction,
        sign=sign,
        into=(moment.state + direction) % 4,
    )


def loop_cycles(bench: PhaseSweepBench, armed: Armed) -> int | None:
    """Return the period in cycles of the loop in which the program waits, or None where it does not come round."""
    board = bench.board
    board.restore(armed.moment.kept)
    board.idle(until_ps=armed.moment.at_ps + armed.waiting_ps)
    places = []
    for _ in range(_LISTED):
        board.cpu.step()
        places.append((board.cpu.pc, board.cpu.cycles))
    addresses = np.array([address for address, _ in places])
    for period in range(1, _LISTED // 2):
        if np.array_equal(addresses[-period:], addresses[-2 * period : -period]):
            return places[-1][1] - places[-1 - period][1]
    return None
