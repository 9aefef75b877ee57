"""Errors with a memory outside the library: a reading depends on rests, moves and reversals before."""

from __future__ import annotations

import numpy as np

from rtec.blind.circumstances import Circumstances
from rtec.blind.hidden import Parameter
from rtec.blind.plan import Floats
from rtec.blind.slow_errors import SlowError, of_height


def _begins_s(c: Circumstances) -> Floats:
    """Return when each pass begins, shape (passes,)."""
    return c.measured.time_s[np.unique(c.course.passes, return_index=True)[1]]


def creep_after_rest(c: Circumstances, rng: np.random.Generator) -> SlowError:
    """Return plastic on a guide, which creeps by more the longer the slide rests, and recovers as it moves on."""
    begins = _begins_s(c.origin)
    length_s = float(np.median(np.diff(begins))) if begins.size > 1 else c.length_s
    tau_s = rng.uniform(0.2, 0.4) * length_s
    crept = 1.0 - np.exp(-c.course.turn_dwell_s / rng.uniform(15.0, 40.0))
    signs = rng.permutation(np.where(np.arange(c.plan.runs) % 2, -1.0, 1.0))
    added = c.by_run(signs) * crept * np.exp(-(c.measured.time_s - _begins_s(c)[c.course.passes]) / tau_s)
    return of_height(
        added, "creep after a rest, to the side where the slide stood, that fades", Parameter("recovery", tau_s, "s")
    )


def stick_slip(c: Circumstances, rng: np.random.Generator) -> SlowError:
    """Return a slide that goes in slips of equal length: it stops short by what is left of the last move over one."""
    moved = np.abs(np.diff(c.course.target_mm, prepend=c.course.target_mm[0] - c.course.plan.overshoot_mm))
    gap_mm = c.plan.span_mm / c.plan.targets
    slip_mm = rng.uniform(0.11, 0.17) * gap_mm
    added = -c.direction * (moved / slip_mm % 1.0 - 0.5)
    return of_height(
        added, "the slide stops short by what its slips leave of the last move", Parameter("slip", slip_mm, "mm")
    )


def counting_play(c: Circumstances, rng: np.random.Generator) -> SlowError:
    """Return a nut that works loose: each reversal opens its play by more than the one before."""
    count, last = c.course.passes.astype(np.float64), float(c.origin.course.passes[-1])
    added = -0.5 * c.direction * (count / max(last, 1.0)) ** rng.uniform(2.0, 3.0)
    return of_height(added, "play that grows with each reversal", Parameter("reversals", last, ""))


def flipping_play(c: Circumstances, rng: np.random.Generator) -> SlowError:
    """Return a key that sits on either side of its keyway: the reversal error has another sign in other runs."""
    runs = c.plan.runs
    signs = rng.permutation(np.where(np.arange(runs) % 2, -1.0, 1.0))
    added = -0.5 * c.direction * c.by_run(signs)
    return of_height(
        added, "a reversal error that changes its sign from run to run", Parameter("runs", float(runs), "")
    )


def lost_at_reversals(c: Circumstances, rng: np.random.Generator) -> SlowError:
    """Return a clutch that slips a little at each reversal, more one way than the other: zero wanders by the pass."""
    passes, count = c.course.passes, int(c.origin.course.passes[-1]) + 1
    slips = rng.uniform(0.4, 1.6, count) * np.where(np.arange(count) % 4 < 2, 1.0, -1.0)
    added = np.cumsum(np.resize(slips, int(passes[-1]) + 1))[passes]
    return of_height(added, "a zero that slips at each reversal, to and fro", Parameter("passes", float(count), ""))


def worn_in(c: Circumstances, rng: np.random.Generator) -> SlowError:
    """Return lumps of grease that the slide pushes aside: a place is high when first met and sinks each time."""
    visits = c.course.run.astype(np.float64) - 1.0
    along = (c.course.target_mm - c.plan.start_mm) / c.plan.span_mm
    lumps = np.cos(2.0 * np.pi * rng.uniform(1.5, 3.0) * along + rng.uniform(0.0, 2.0 * np.pi))
    added = lumps * np.exp(-visits / rng.uniform(0.6, 1.0))
    return of_height(added, "lumps of grease that each run flattens", Parameter("runs", float(c.plan.runs), ""))
