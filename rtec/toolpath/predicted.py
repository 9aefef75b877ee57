"""The following error of a plan, predicted: by the linear answer of a run, or by models trained on logs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from rtec.errors import ArgumentError
from rtec.predictors.motion_file import FOLLOWING_ERROR, MM_OF, KnownMotion
from rtec.predictors.sequences import Sequences
from rtec.toolpath.contour_error import contour_error
from rtec.toolpath.contour_run import LETTERS, ContourRun
from rtec.toolpath.feed import FeedPlan
from rtec.toolpath.path import Path

Floats = npt.NDArray[np.float64]
_PLACES = 40_000
"""Along a path, at which a plan's times are known."""
_SIGNS = {FOLLOWING_ERROR: 1.0, "deviation": -1.0}
_DERIVED = ("velocity", "acceleration")


class Prediction(Protocol):
    """What an axis lacks of its command."""

    def following_mm(self, plan: FeedPlan, time_s: Floats) -> Floats:
        """Return command less carriage of each axis at times of a plan, shape (n, axes)."""


class LinearAnswer:
    """Following errors as sums of velocity, acceleration and jerk, by least squares over a run.

    What friction and cogging do is not in it.
    """

    def __init__(self, run: ContourRun) -> None:
        """Fit each axis."""
        known = _terms(run.plan, run.time_s)
        axes = enumerate(run.axes.values())
        fits = [np.linalg.lstsq(known[:, :, k], axis.command_mm - axis.load_mm, rcond=None)[0] for k, axis in axes]
        self._numbers = np.column_stack(fits)

    def following_mm(self, plan: FeedPlan, time_s: Floats) -> Floats:
        """Return command less carriage of each axis at times of a plan, shape (n, axes)."""
        found: Floats = np.einsum("nta,ta->na", _terms(plan, time_s), self._numbers)
        return found


@dataclass(frozen=True, slots=True, eq=False)
class TrainedMotion:
    """Following errors by models of motion (``rtec train --dynamic``), from the commands alone, in free run.

    Raises
    ------
    ArgumentError
        A model of something else than a following error, or one that needs more than the commanded motion.
    """

    models: Mapping[str, KnownMotion]
    """By letter of the axis."""

    def __post_init__(self) -> None:
        for letter, known in self.models.items():
            head = known.head
            if head.observe not in _SIGNS or head.unit not in MM_OF:
                found = f"of {head.observe} in {head.unit or 'no unit'}"
                raise ArgumentError(f"model of {letter}", found, "a model of the following error, in um or mm")
            beyond = [name for name in head.names if name not in _DERIVED]
            if beyond:
                allowed = "inputs that a plan has: velocity and acceleration"
                raise ArgumentError(f"model of {letter}", f"with the input {beyond[0]}", allowed)

    def following_mm(self, plan: FeedPlan, time_s: Floats) -> Floats:
        """Return command less carriage of each axis at times of a plan, shape (n, axes).

        Raises
        ------
        ArgumentError
            An axis without a model.
        """
        found = np.empty((time_s.size, plan.positions(0.0).shape[1]))
        for k, letter in enumerate(LETTERS[: found.shape[1]]):
            if letter not in self.models:
                raise ArgumentError("model", f"none of axis {letter}", "one for each axis of the path")
            known = self.models[letter]
            period_s = known.head.period_s
            clock = np.arange(int(np.ceil(plan.time_s / period_s)) + 1) * period_s
            # as a log has them: differences of what is commanded
            velocity = np.gradient(plan.positions(clock)[:, k], period_s)
            motion = {"velocity": velocity, "acceleration": np.gradient(velocity, period_s)}
            data = Sequences(
                inputs=np.column_stack([motion[name] for name in known.head.names]),
                output=np.zeros(clock.size),
                names=known.head.names,
                period_s=period_s,
                unit=known.head.unit,
            )
            scale = _SIGNS[known.head.observe] * MM_OF[known.head.unit]
            found[:, k] = np.interp(time_s, clock, scale * known.model.free_run(data))
        return found


def predicted_contour(prediction: Prediction, path: Path, plan: FeedPlan, s_mm: Floats) -> Floats:
    """Return the contour error that is predicted at places of a path, shape (n,), in mm, signed in the plane."""
    reached = path.points(s_mm) - prediction.following_mm(plan, time_at(plan, s_mm))
    return contour_error(path, s_mm, reached).error_mm


def time_at(plan: FeedPlan, s_mm: Floats) -> Floats:
    """Return when a plan is at places of its path, shape (n,), in s."""
    times = np.linspace(0.0, plan.time_s, _PLACES)
    return np.interp(s_mm, plan.at(times)[0], times)


def _terms(plan: FeedPlan, time_s: Floats) -> Floats:
    """Return velocity, acceleration and jerk of the axes at times, shape (n, 3, axes)."""
    return np.stack(plan.axis_motion(np.minimum(time_s, plan.time_s)), axis=1)
