"""A toolpath run on emulated feed drives: planned, driven, and held against the path.

Each axis is a drive of its own. The contour error is that of the carriages; the feed may be lowered where the error
that the drives' linear answer predicts exceeds a limit, and the run afterwards says whether it is kept.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np
import numpy.typing as npt

from rtec.axis.plants import DriveRun, run_drive
from rtec.errors import ArgumentError
from rtec.machine import LoopResult
from rtec.predictors.motion_file import KnownMotion
from rtec.toolpath.contour_error import Estimate, contour_error, estimate
from rtec.toolpath.contour_run import DRIVES, LETTERS, ContourRun
from rtec.toolpath.feed import FeedPlan, plan_feed
from rtec.toolpath.path import Path
from rtec.toolpath.predicted import LinearAnswer, Prediction, TrainedMotion, predicted_contour
from rtec.toolpath.pulses import Pulses, run_over_pulses

Floats = npt.NDArray[np.float64]
Progress = Callable[[float], None]
Corrector = Mapping[str, Callable[[Floats], Floats]]
"""What is inserted by axis: counts in mm, as a function of times in s."""

_MOST_ROUNDS, _MOST_HALVINGS = 10, 7
_CAUTION = 0.97
"""Of the limit, that the prediction is held to."""
_LEAST_FEED = 0.02
"""Share of the feed below which it is not lowered."""
_MOST_SAMPLES = 5_000_000
"""Of a run: a gigabyte."""
_HOPELESS, _HELPED = 2.0, 0.9
"""Of a limit, and of the error a round before: above both no lower feed will keep the limit."""
_RAPID_MM_S = 1e6
"""Where no F word applies: more than any axis can."""
_PLACES = 4000
"""Along a path, at which the feed is lowered."""


def run_contour(
    path: Path,
    drive: str,
    *,
    limit_mm: float | None = None,
    corrector: Corrector | None = None,
    pulses: Pulses | None = None,
    models: Mapping[str, KnownMotion] | None = None,
    travel_mm: float | None = None,
    feed_mm_s: float | None = None,
    progress: Progress = lambda share: None,
) -> ContourRun:
    """Plan a path for a drive in each axis, run it, and hold the carriages against the path.

    Parameters
    ----------
    path
        In the plane or in space.
    drive
        One of `DRIVES`.
    limit_mm
        Of the contour error: the feed is lowered where the prediction exceeds it.
    corrector
        What is inserted at once and without counts; nothing in an axis that it does not name.
    pulses
        Encoders with counts, errors of the scales, and a box that corrects them; ideal encoders without.
    models
        Of the following error, by letter: what the contour error is predicted by, in place of the drives' linear
        answer in the run without a limit.
    travel_mm
        How far each axis can go.
    feed_mm_s
        Largest feed along the path, which limits of the axes may lower.
    progress
        Called with the share done.

    Raises
    ------
    ArgumentError
        No such drive, a limit or a feed that is not above zero, a path that is wider than the travel, cannot be
        planned or takes too long, both corrector and pulses, models as of `TrainedMotion`, or what
        `run_over_pulses` raises.
    """
    if drive not in DRIVES:
        raise ArgumentError("drive", repr(drive)[:60], f"one of {', '.join(DRIVES)}")
    if limit_mm is not None and not 0.0 < limit_mm < 1e3:
        raise ArgumentError("limit", f"{limit_mm:g} mm", "a length above 0, up to 1 m")
    if corrector is not None and pulses is not None:
        raise ArgumentError("corrector", "given with pulses", "one of them")
    _check_travel(path, travel_mm)
    axes = _Axes(path, drive, corrector, pulses, None if models is None else TrainedMotion(models))
    progress(0.05)
    free = axes.run(axes.plan(feed_mm_s))
    progress(0.3)
    if limit_mm is None or free.worst_mm <= limit_mm:
        progress(1.0)
        return replace(free, limit_mm=limit_mm, unlimited_s=None if limit_mm is None else free.plan.time_s)
    found = _limited(axes, free, limit_mm, progress)
    constant = None if found.worst_mm > _HOPELESS * limit_mm else _steady(axes, free, limit_mm, progress)
    progress(1.0)
    steady = None
    if constant is not None:
        steady = constant[0], constant[1].plan.time_s
        found = constant[1] if found.worst_mm > limit_mm or steady[1] < found.plan.time_s else found
    return replace(found, limit_mm=limit_mm, steady=steady, unlimited_s=free.plan.time_s)


def _check_travel(path: Path, travel_mm: float | None) -> None:
    if travel_mm is None:
        return
    place = path.points(np.linspace(0.0, path.length_mm, _PLACES))
    for letter, width in zip(LETTERS, np.ptp(place, axis=0), strict=False):
        if width > travel_mm:
            found = f"{path.name} is {width:.6g} mm wide in {letter}"
            raise ArgumentError("path", found, f"a path within the travel of {travel_mm:.6g} mm")


@dataclass(frozen=True, slots=True)
class _Axes:
    """A path, the drive in each of its axes, and what a corrector inserts there."""

    path: Path
    drive: str
    corrector: Corrector | None
    pulses: Pulses | None
    trained: TrainedMotion | None

    def plan(self, feed_mm_s: float | Floats | None = None) -> FeedPlan:
        """Return the plan below a feed, or a table of it, and below the F words of a program."""
        path, limits = self.path, DRIVES[self.drive].limits
        if path.feed_limits is None:
            return plan_feed(path, replace(limits, feed_mm_s=feed_mm_s))
        below = replace(limits, feed_mm_s=_RAPID_MM_S if feed_mm_s is None else feed_mm_s)

        def lower(s_mm: Floats) -> Floats:
            words = np.minimum(path.feed_limit_mm_s(s_mm, side=-1), path.feed_limit_mm_s(s_mm, side=1))
            return np.minimum(words, below.feed_at(s_mm))

        return plan_feed(path, replace(limits, feed_mm_s=lower))

    def run(self, plan: FeedPlan) -> ContourRun:
        """Return the path as it is driven."""
        kind, path = DRIVES[self.drive], self.path
        samples = int(np.ceil(plan.time_s / kind.period_s)) + 1
        if samples > _MOST_SAMPLES:
            most = f"at most {_MOST_SAMPLES * kind.period_s:g} s; cut the path, or raise its F words"
            raise ArgumentError("path", f"{plan.time_s:.6g} s", most, problem=f"takes {plan.time_s:.6g} s")
        clock = np.arange(samples) * kind.period_s
        time_s = np.minimum(clock, plan.time_s)
        place, (velocity, acceleration, _) = plan.positions(time_s), plan.axis_motion(time_s)
        axes: dict[str, DriveRun] = {}
        loops: dict[str, LoopResult] = {}
        for k, letter in enumerate(LETTERS[: path.dimensions]):
            if self.pulses is not None:
                axes[letter], loops[letter] = run_over_pulses(
                    kind.make(), kind.period_s, place[:, k], self.pulses, letter
                )
                continue
            inserted = None if self.corrector is None else self.corrector.get(letter)
            axes[letter] = run_drive(
                kind.make(), clock, place[:, k], velocity[:, k], acceleration[:, k], corrector=inserted
            )
        ends = min(run.time_s.size for run in axes.values())
        if ends < samples:
            axes = {letter: run.until(ends) for letter, run in axes.items()}
        load = np.column_stack([run.load_mm for run in axes.values()])
        s_mm = plan.at(time_s[:ends])[0]
        predicted = None
        if self.trained is not None:
            command = np.column_stack([run.command_mm for run in axes.values()])
            reached = command - self.trained.following_mm(plan, time_s[:ends])
            predicted = contour_error(path, s_mm, reached).error_mm
        return ContourRun(
            path=path,
            drive=self.drive,
            plan=plan,
            axes=MappingProxyType(axes),
            s_mm=s_mm,
            contour_mm=contour_error(path, s_mm, load).error_mm,
            formula_mm=estimate(path, s_mm, load, Estimate.SECOND_ORDER),
            misprint_mm=estimate(path, s_mm, load, Estimate.AS_PRINTED),
            predicted_mm=predicted,
            pulses=self.pulses,
            loops=MappingProxyType(loops),
        )


def _limited(axes: _Axes, free: ContourRun, limit_mm: float, progress: Progress) -> ContourRun:
    """Return a run whose feed is lowered where the contour error exceeds a limit; the best of a few rounds."""
    places = np.linspace(0.0, free.path.length_mm, _PLACES)
    prediction: Prediction = axes.trained or LinearAnswer(free)
    top = float(_feed_over_path(free.plan)[1].max())
    feed, found = np.full(places.size, top), free
    for number in range(_MOST_ROUNDS):
        predicted = np.abs(predicted_contour(prediction, free.path, found.plan, places))
        seen = _largest_near(found, places)
        worst = np.maximum(predicted, seen)
        share = np.sqrt(np.clip(_CAUTION * limit_mm / np.maximum(worst, 1e-12), None, 1.0))  # most is of v squared
        now = np.interp(places, *_feed_over_path(found.plan))
        feed = np.where(share < 1.0, np.minimum(feed, np.maximum(now * share, _LEAST_FEED * top)), feed)
        before, found = found, axes.run(axes.plan(np.column_stack([places, feed])))
        progress(0.3 + 0.4 * (number + 1) / _MOST_ROUNDS)
        if found.worst_mm <= limit_mm or _is_hopeless(found.worst_mm, before.worst_mm, limit_mm):
            break
    return found


def _is_hopeless(largest: float, before: float, limit_mm: float) -> bool:
    """Return whether a lower feed no longer helps: what is left is friction's."""
    return largest > _HOPELESS * limit_mm and largest > _HELPED * before


def _feed_over_path(plan: FeedPlan) -> tuple[Floats, Floats]:
    time_s = np.linspace(0.0, plan.time_s, _PLACES)
    s_mm, feed, *_ = plan.at(time_s)
    return s_mm, feed


def _largest_near(run: ContourRun, places: Floats) -> Floats:
    """Return the largest contour error that a run had near each place, shape (places,), in mm."""
    nearest = np.clip(np.searchsorted(places, run.s_mm), 0, places.size - 1)
    found = np.zeros(places.size)
    np.maximum.at(found, nearest, np.abs(run.contour_mm))
    reach = max(places.size // 200, 1)
    padded = np.pad(found, reach, mode="edge")
    windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * reach + 1)
    largest: Floats = windows.max(axis=1)
    return largest


def _steady(axes: _Axes, free: ContourRun, limit_mm: float, progress: Progress) -> tuple[float, ContourRun] | None:
    """Return the highest constant feed that keeps a limit, and its run; None where none does."""
    low, high = 0.0, float(_feed_over_path(free.plan)[1].max())
    best: tuple[float, ContourRun] | None = None
    for number in range(_MOST_HALVINGS):
        feed = (low + high) / 2.0 if best is not None or number else high / 4.0
        plan = axes.plan(feed)
        if plan.time_s > _MOST_SAMPLES * DRIVES[free.drive].period_s:
            break
        run = axes.run(plan)
        if run.worst_mm <= limit_mm:
            low, best = feed, (feed, run)
        else:
            high = feed
        progress(0.7 + 0.3 * (number + 1) / _MOST_HALVINGS)
    return best
