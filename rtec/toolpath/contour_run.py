"""The feed drives of the papers, and what came out of a toolpath on them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

import numpy as np
import numpy.typing as npt

from rtec.axis.plants import BallScrew, DriveRun, LinearMotor
from rtec.machine import LoopResult
from rtec.toolpath.feed import FeedLimits, FeedPlan
from rtec.toolpath.path import Path
from rtec.toolpath.pulses import Pulses

Floats = npt.NDArray[np.float64]
LETTERS = "xyz"


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveKind:
    """A feed drive with what its paper plans it by."""

    make: Callable[[], Any]
    limits: FeedLimits
    period_s: float
    """At which commands are interpolated."""


DRIVES: Mapping[str, DriveKind] = MappingProxyType({
    "ball-screw": DriveKind(
        make=BallScrew,
        limits=FeedLimits(velocity_mm_s=300.0, acceleration_mm_s2=2000.0, jerk_mm_s3=50_000.0),
        period_s=1e-3,
    ),
    "linear-motor": DriveKind(
        make=LinearMotor,
        limits=FeedLimits(velocity_mm_s=2500.0, acceleration_mm_s2=25_000.0, jerk_mm_s3=500_000.0),
        period_s=0.25e-3,
    ),
})  # fmt: skip
"""The drives of papers 002 and 004 with their limits (per axis) and interpolation periods."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ContourRun:
    """What came out of a path on a drive. Arrays have the shape (samples,), at the interpolation period."""

    path: Path
    drive: str
    plan: FeedPlan
    axes: Mapping[str, DriveRun]
    """By letter."""
    s_mm: Floats
    """Arc length that is commanded."""
    contour_mm: Floats
    """Distance of the carriages from the path; in the plane positive to the left of the motion."""
    formula_mm: Floats
    """The same by the second-order formula, and..."""
    misprint_mm: Floats
    """...by the formula as the papers print it, whose dimensions do not fit."""
    predicted_mm: Floats | None = None
    """Contour error that models of motion predict, where there are any."""
    limit_mm: float | None = None
    steady: tuple[float, float] | None = None
    """Highest constant feed that keeps the same limit, in mm/s, and the time that the path takes at it, in s."""
    unlimited_s: float | None = None
    """Time that the path takes without the limit."""
    pulses: Pulses | None = None
    """What is between drives and controller."""
    loops: Mapping[str, LoopResult] = field(default_factory=dict)
    """What boxes and receivers did, by letter, where there are pulses."""

    @property
    def time_s(self) -> Floats:
        """Of each sample."""
        return next(iter(self.axes.values())).time_s

    @property
    def stopped_s(self) -> float | None:
        """When the controller stopped an axis, because its following error was too large; None where it did not."""
        last = float(self.time_s[-1])
        return last if last < self.plan.time_s - DRIVES[self.drive].period_s else None

    @property
    def following_mm(self) -> Floats:
        """Distance of the carriages from where they are commanded to be."""
        found: Floats = np.sqrt(sum((run.command_mm - run.load_mm) ** 2 for run in self.axes.values()))
        return found

    @property
    def worst_mm(self) -> float:
        """Largest contour error."""
        return float(np.abs(self.contour_mm).max())

    @property
    def limits_held(self) -> bool:
        """Whether the plan keeps every limit of the axes, and the run its own and that of the contour error."""
        whole = self.plan.audit.passed and self.stopped_s is None
        return bool(whole and (self.limit_mm is None or self.worst_mm <= self.limit_mm))

    @property
    def shares(self) -> dict[str, float]:
        """Largest share of each limit that the plan uses, by its name and the letter of the axis."""
        return {
            f"{kind} {letter}": use.share
            for use in self.plan.audit.uses
            if use.share > 0.0
            for kind, letter in [(use.kind, LETTERS[use.axis] if use.axis >= 0 else "along the path")]
        }

    @property
    def integration_error_nm(self) -> float | None:
        """Bound of the positions' error; with pulses it is not known: two integrations count at other times."""
        return None if self.loops else max(run.integration_error_nm for run in self.axes.values())

    @property
    def prediction(self) -> tuple[float, float] | None:
        """RMS error of the predicted contour error, in um and as a share of the largest following error."""
        if self.predicted_mm is None:
            return None
        rms_mm = float(np.sqrt(np.mean((self.predicted_mm - self.contour_mm) ** 2)))
        return 1e3 * rms_mm, rms_mm / max(float(self.following_mm.max()), 1e-12)

    def document(self) -> dict[str, object]:
        """Return what ``rtec contour --json`` prints."""
        contour, following = 1e3 * np.abs(self.contour_mm), 1e3 * self.following_mm
        off = 1e3 * np.abs(self.formula_mm - self.contour_mm)
        found: dict[str, object] = {
            "path": self.path.name,
            "drive": self.drive,
            "length_mm": self.path.length_mm,
            "time_s": self.plan.time_s,
            "time_without_jerk_limit_s": self.plan.time_without_jerk_limit_s,
            "price_of_jerk_limit": self.plan.price,
            "max_contour_um": float(contour.max()),
            "rms_contour_um": float(np.sqrt(np.mean(contour**2))),
            "max_following_um": float(following.max()),
            "rms_following_um": float(np.sqrt(np.mean(following**2))),
            "formula_error_um": float(np.nanmax(off)),
            "misprint_error_um": float(np.nanmax(1e3 * np.abs(self.misprint_mm - self.contour_mm))),
            "limits_held": self.limits_held,
            "largest_shares": self.shares,
            "integration_error_nm": self.integration_error_nm,
            "limit_um": None if self.limit_mm is None else 1e3 * self.limit_mm,
            "time_unlimited_s": self.unlimited_s,
        }
        if self.steady is not None:
            found |= {"constant_feed_mm_s": self.steady[0], "time_at_constant_feed_s": self.steady[1]}
        if self.prediction is not None:
            found["prediction"] = dict(zip(("rms_error_um", "share_of_following"), self.prediction, strict=True))
        if self.pulses is not None:
            box = self.pulses.injector
            found["pulses"] = {
                "count_um": 1e3 * self.pulses.count_mm,
                "design": None if box is None else box.design.key,
                "stopped_s": self.stopped_s,
                "axes": {letter: _pulse_figures(loop) for letter, loop in self.loops.items()},
            }
        return found


def _pulse_figures(loop: LoopResult) -> dict[str, object]:
    return {
        "encoder_counts": loop.encoder_counts,
        "controller_counts": loop.controller_counts,
        "step_counts": loop.step_counts,
        "corrections_inserted": loop.insertions.inserted,
        "corrections_pending": loop.pending_steps,
        "refused_too_fast": loop.insertions.refused,
        "illegal_transitions": loop.received.illegal_transitions,
        "min_separation_ps": loop.received.min_separation_ps,
        "audit": loop.audit,
    }
