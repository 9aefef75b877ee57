"""What a study hands over: results only, in internal units (mm, s, ps, counts)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rtec.heat.course import HeatCourse
from rtec.inference.results import Diagnosis
from rtec.inference.static_predictor import LeftOut
from rtec.machine import Ending, LoopResult
from rtec.metrology import MeasuringPlan, PositioningFigures, Readings, joined
from rtec.predictors import BidirectionalTable
from rtec.signal import EdgeStream
from rtec.study.definition import Study

if TYPE_CHECKING:
    from rtec.study.heat import HeatStudy

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StudyRow:
    """One way of correcting the axis, measured by the laser."""

    name: str
    """``uncompensated``, ``table``, or the design."""
    title: str
    readings: Readings | None
    """None where the laser could take none: `reason` says why."""
    figures: PositioningFigures | None
    reason: str
    """Why the row is empty, or ended before its time; empty where nothing is amiss."""
    run: LoopResult
    """What the machine counted on the way."""

    @property
    def good(self) -> bool:
        """Return whether the row came to its end and every count is accounted for."""
        return self.run.audit and self.run.ending is Ending.FINISHED and not self.reason


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FeedCurve:
    """Error in motion of one design against the feed."""

    name: str
    feed_mm_s: Floats
    """Shape (n,), ascending."""
    forward_pp_mm: Floats
    reverse_pp_mm: Floats
    forward_rms_mm: Floats
    reverse_rms_mm: Floats
    follows_up_to_mm_s: float
    """Feed up to which window and update rate follow the steepest slope of the error."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class HoldCurve:
    """An axis held at one position while its error grows."""

    name: str
    state: int
    """Angle state 0..3 in which the axis stands."""
    time_s: Floats
    deviation_mm: Floats
    """True position less commanded, relative to the start."""
    inserted: int
    """Insertions made, of either sign."""
    pending_steps: int


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Waveform:
    """The lines before and behind the box around one insertion."""

    name: str
    processor: str
    encoder: EdgeStream
    controller: EdgeStream
    from_ps: int
    to_ps: int
    inserted_ps: tuple[int, ...]
    """Times of the changes that the box made."""
    counts_added: int


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Limit:
    """What limits one design in the study, and where."""

    name: str
    follows_up_to_mm_s: float
    """From window and update rate."""
    gate_refuses_above_mm_s: float
    """From the speed gate."""
    word_holds_mm: float
    """Largest error that the request's word can ask for."""
    largest_error_mm: float
    """Largest error of the study's predictor."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TruthScore:
    """How far a model is from the true error of the axis: the noise-free curve, known because it is emulated."""

    rms_mm: float
    """Over many places, in both directions."""
    worst_mm: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Round:
    """A calibration, and the search in its readings and those of all rounds before it."""

    plan: MeasuringPlan
    readings: Readings
    """Of this round alone."""
    machine_s: float
    """Machine time of this round."""
    missed_mm: Floats
    """These readings less the model of the round before, of a perfect axis at first; shape (readings,)."""
    left_mm: Floats
    """These readings less the model of this round, shape (readings,)."""
    diagnosis: Diagnosis
    score: TruthScore
    """Of the model, all along the travel: between the targets, too."""

    @property
    def missed_rms_mm(self) -> float:
        """Of ``missed_mm``."""
        return _rms(self.missed_mm)

    @property
    def left_rms_mm(self) -> float:
        """Of ``left_mm``."""
        return _rms(self.left_mm)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Learned:
    """What the calibration of an unknown axis showed, in one round or several."""

    rounds: tuple[Round, ...]
    predictor: BidirectionalTable
    """What the PC gets."""
    left_out: tuple[LeftOut, ...]
    """Effects found that it cannot hold."""
    scores: tuple[TruthScore, ...]
    """At the calibration's targets: of the perfect axis that the search began with, and after each of its steps."""
    wall_s: float

    @property
    def plan(self) -> MeasuringPlan:
        """Of the first round."""
        return self.rounds[0].plan

    @property
    def readings(self) -> Readings:
        """Of all rounds."""
        return joined([one.readings for one in self.rounds])

    @property
    def diagnosis(self) -> Diagnosis:
        """The search in the readings of all rounds."""
        return self.rounds[-1].diagnosis


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ShiftRow:
    """One way of correcting a machine that warms, calibrated again and again over a shift."""

    name: str
    """``uncompensated``, ``cold``, ``warm`` or ``speed``."""
    title: str
    time_s: Floats
    """Middle of each calibration, shape (calibrations,)."""
    deviation_mm: Floats
    """Of each reading, shape (calibrations, readings); NaN where the machine was held before it."""
    reason: str
    """Why the row ended before its time; empty where nothing is amiss."""
    run: LoopResult
    """What the machine counted on the way."""

    @property
    def rms_mm(self) -> float:
        """Of all readings that were taken."""
        return _rms(self.deviation_mm[np.isfinite(self.deviation_mm)])

    @property
    def worst_mm(self) -> float:
        """Largest deviation, either way."""
        return float(np.nanmax(np.abs(self.deviation_mm)))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Shift:
    """A machine that warmed over a shift, corrected in several ways."""

    heat: HeatStudy
    course: HeatCourse
    """What it did."""
    rows: tuple[ShiftRow, ...]

    @property
    def good(self) -> bool:
        """Return whether every row came to its end and every count is accounted for."""
        return all(row.run.audit and not row.reason for row in self.rows)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StudyResult:
    """A whole study."""

    study: Study
    """What was carried out, with the predictor that was at work."""
    command: str
    """What runs the study again."""
    facts: tuple[tuple[str, str], ...]
    """What the study is about: label and value, for the reader."""
    learned: Learned | None
    """None where the predictor was given."""
    predictor_score: TruthScore
    """Of what the PC believes, at ``position_mm``: all along the travel."""
    position_mm: Floats
    """Grid of the true error curves, shape (n,)."""
    forward_error_mm: Floats
    reverse_error_mm: Floats
    rows: tuple[StudyRow, ...]
    feed_curves: tuple[FeedCurve, ...]
    hold_curves: tuple[HoldCurve, ...]
    waveforms: tuple[Waveform, ...]
    limits: tuple[Limit, ...]
    wall_s: float
    warnings: tuple[str, ...]
    shift: Shift | None = None
    """What heat does to it; None for a study without a table ``[heat]``."""

    @property
    def good(self) -> bool:
        """Return whether every count of every row is accounted for."""
        return all(row.good for row in self.rows) and (self.shift is None or self.shift.good)


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(values**2)))
