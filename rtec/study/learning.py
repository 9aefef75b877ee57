"""Learning the axis: a calibration of its own, a search for its effects from nothing, a predictor made of them."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rtec.dataset.load import load_dataset
from rtec.errors import ArgumentError
from rtec.inference.diagnose import diagnose
from rtec.inference.model import Model
from rtec.jobs import Tell
from rtec.machine import Machine, MeasuringRun, measuring_run, readings_of, run_machine
from rtec.metrology import Measurement, Readings, measurement_of_readings
from rtec.predictors import BidirectionalTable, Predictor
from rtec.report.results import Learned, LeftOut, TruthScore
from rtec.study.definition import Study
from rtec.study.model_predictor import predictor_of_model, static_part
from rtec.units import MM_PER_INCH

SOURCE = "readings/calibration.csv"
"""File of the report that holds the readings."""
_OWN_DRAWS = 1
"""Beside the study's seed: the calibration's noise is not that of the rows."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Lesson:
    """What was learned, and the predictor that the PC gets."""

    learned: Learned
    predictor: BidirectionalTable
    left_out: tuple[LeftOut, ...]


def calibrate(study: Study, machine: Machine, tell: Tell) -> Readings:
    """Measure the axis as it is: the calibration's program in closed loop, with the study's repeatability.

    Raises
    ------
    ArgumentError
        A program that the axis or the laser cannot carry out.
    """
    task: MeasuringRun = measuring_run(study.calibration, study.limits, shape=study.shape)
    result = run_machine(machine, task, progress=tell)
    missing = int(np.count_nonzero(~np.isfinite(result.deviation_mm)))
    if missing:
        raise ArgumentError(
            "calibration",
            f"{missing} of {task.target_mm.size} readings missing ({result.ending.name} after "
            f"{result.simulated_s:.3f} s)",
            "a run in which the axis reaches its targets and stands there longer than the laser's dwell",
            "or a predictor that is given: [predictor] model",
        )
    noise = np.random.default_rng([study.seed, _OWN_DRAWS]).normal(0.0, 1.0, task.target_mm.size)
    return readings_of(task, result.deviation_mm + noise * study.repeatability_mm)


def calibration_measurement(readings: Readings, period_mm: float | None) -> Measurement:
    """Return a calibration as a measurement: what the report's file holds and the search is given."""
    facts = {} if period_mm is None else {"screw_pitch": f"{period_mm!r} mm"}
    return replace(measurement_of_readings(readings, facts), source=SOURCE)


def learn(study: Study, readings: Readings, tell: Tell) -> Lesson:
    """Find the effects behind a calibration, beginning with a perfect axis, and make a predictor of them.

    Parameters
    ----------
    study
        Its true error is used for the score only.
    readings
        Of the calibration.
    tell
        Called with the share done.
    """
    begun = time.perf_counter()
    diagnosis = diagnose(load_dataset(calibration_measurement(readings, study.period_mm)), progress=tell)
    low, high = study.calibration.start_inch * MM_PER_INCH, study.calibration.end_inch * MM_PER_INCH
    predictor, left_out = predictor_of_model(diagnosis.model, low, high)
    models = [diagnosis.start, *(step.model for step in diagnosis.steps)]
    learned = Learned(
        plan=study.calibration,
        readings=readings,
        diagnosis=diagnosis,
        points=predictor.forward_positions_mm.size,
        scores=tuple(_score_of_model(study, model) for model in models),
        wall_s=time.perf_counter() - begun,
    )
    return Lesson(learned=learned, predictor=predictor, left_out=left_out)


def score(study: Study, predictor: Predictor, grid: NDArray[np.float64]) -> TruthScore:
    """Return how far a predictor is from the true error at the places of a grid, in mm, in both directions."""
    return _score([predictor.error_mm(grid, way) - study.axis_error.error_mm(grid, way) for way in (1, -1)])


def _score_of_model(study: Study, model: Model) -> TruthScore:
    grid = study.calibration.targets_inch * MM_PER_INCH
    return _score([static_part(model, grid, way).error_mm - study.axis_error.error_mm(grid, way) for way in (1, -1)])


def _score(off_mm: list[NDArray[np.float64]]) -> TruthScore:
    off = np.concatenate(off_mm)
    return TruthScore(rms_mm=float(np.sqrt(np.mean(off**2))), worst_mm=float(np.abs(off).max()))
