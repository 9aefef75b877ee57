"""Learning the axis: a calibration of its own, a search for its effects from nothing, a predictor made of them."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import replace
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from rtec.dataset.load import load_dataset
from rtec.dataset.unseen import other_step
from rtec.errors import ArgumentError
from rtec.inference.diagnose import diagnose
from rtec.inference.model import Model
from rtec.inference.results import Diagnosis
from rtec.inference.static_predictor import LeftOut, predictor_at_mean, static_part
from rtec.inference.warmth import mean_warmth
from rtec.jobs import Report
from rtec.machine import Machine, MeasuringRun, measuring_run, readings_of, run_machine
from rtec.metrology import Measurement, MeasuringPlan, Readings, joined, measurement_of_readings
from rtec.metrology.measuring_plan import PROGRAM_DECIMALS
from rtec.predictors import BidirectionalTable, Predictor
from rtec.study.definition import Study
from rtec.study.results import Learned, Round, TruthScore

SOURCE = "readings/calibration.csv"
"""File of the report that holds the readings."""
CALIBRATING_S, SEARCHING_S = 1.0, 6.0
"""About what the parts take."""
_WHOLE = 1e-9
_PLACES = 50_001
"""At which a model is scored: a hundred thousandth of a travel apart in both directions."""


Reporter: TypeAlias = Callable[[str, float], Report]
"""Returns what is told of the progress of a part: its name, and about the seconds that it takes."""


def calibrate(study: Study, machine: Machine, report: Report, *, number: int = 1) -> tuple[Readings, float]:
    """Measure the axis as it is: the calibration's program in closed loop; return readings and machine time in s.

    Each program, by its number, has noise of its own.

    Raises
    ------
    ArgumentError
        A program that the axis or the laser cannot carry out.
    """
    task: MeasuringRun = measuring_run(study.calibration, study.limits, shape=study.shape)
    result = run_machine(machine, task, progress=report)
    missing = int(np.count_nonzero(~np.isfinite(result.deviation_mm)))
    if missing:
        raise ArgumentError(
            "calibration",
            f"{missing} of {task.target_mm.size} readings missing ({result.ending.name} after "
            f"{result.simulated_s:.3f} s)",
            "a run in which the axis reaches its targets and stands there longer than the laser's dwell",
            "or a predictor that is given: [predictor] model",
        )
    noise = np.random.default_rng([study.seed, number]).normal(0.0, 1.0, task.target_mm.size)
    readings = readings_of(task, result.deviation_mm + noise * study.repeatability_mm)
    return readings, result.simulated_s


def calibration_measurement(readings: Readings, period_mm: float | None) -> Measurement:
    """Return a calibration as a measurement: what the report's file holds and the search is given."""
    facts = {} if period_mm is None else {"screw_pitch": f"{period_mm!r} mm"}
    return replace(measurement_of_readings(readings, facts), source=SOURCE)


def learn(study: Study, machine: Machine, reporter: Reporter) -> Learned:
    """Calibrate an axis, find the effects behind the readings, and make a predictor of them.

    The search begins with a perfect axis. As often as the study allows, the axis is measured again at targets that
    show what the first ones hide, as the search asks for, and the search goes on with all readings.

    The true error of the study is used for the scores only.

    Raises
    ------
    ArgumentError
        As for `calibrate`.
    """
    begun = time.perf_counter()
    rounds: list[Round] = []
    plan: MeasuringPlan | None = study.calibration
    while plan is not None and len(rounds) < study.rounds:
        again = " again" if rounds else ""
        report = reporter(f"calibrating the axis{again}", CALIBRATING_S)
        taken, machine_s = calibrate(replace(study, calibration=plan), machine, report, number=len(rounds) + 1)
        rounds.append(
            _searched(study, rounds, plan, taken, machine_s, reporter(f"searching for effects{again}", SEARCHING_S))
        )
        plan = second_plan(study.calibration, rounds[-1].diagnosis)
    diagnosis = rounds[-1].diagnosis
    predictor, left_out = _predictor(study, diagnosis)
    models = [diagnosis.start, *(step.model for step in diagnosis.steps)]
    return Learned(
        rounds=tuple(rounds),
        predictor=predictor,
        left_out=left_out,
        scores=tuple(_score_of_model(study, model, diagnosis) for model in models),
        wall_s=time.perf_counter() - begun,
    )


def learning_s(study: Study) -> float:
    """Return about how long the rounds of a study take, in s."""
    return study.rounds * (CALIBRATING_S + SEARCHING_S)


def _searched(
    study: Study, before: list[Round], plan: MeasuringPlan, taken: Readings, machine_s: float, report: Report
) -> Round:
    whole = joined([*(one.readings for one in before), taken])
    dataset = load_dataset(calibration_measurement(whole, study.period_mm), library=study.library)
    diagnosis = diagnose(dataset, begin=before[-1].diagnosis.model if before else None, progress=report)
    travel = np.linspace(study.calibration.start_mm, study.calibration.end_mm, _PLACES)
    return Round(
        plan=plan,
        readings=taken,
        machine_s=machine_s,
        missed_mm=_less(before[-1].diagnosis, taken) if before else taken.deviation_mm,
        left_mm=_less(diagnosis, taken),
        diagnosis=diagnosis,
        score=score(study, _predictor(study, diagnosis)[0], travel),
    )


def _less(found: Diagnosis, readings: Readings) -> NDArray[np.float64]:
    """Return readings less what a model says of their places and directions, shape (readings,); of heat, its mean."""
    left = readings.deviation_mm.copy()
    warmth = mean_warmth(found.model, found.dataset)
    for way in (1, -1):
        there = readings.direction == way
        if there.any():
            error_mm, _ = static_part(found.model, readings.target_mm[there], way, warmth)
            left[there] -= error_mm
    return left


def second_plan(plan: MeasuringPlan, diagnosis: Diagnosis) -> MeasuringPlan | None:
    """Return the program that shows what the targets of a search hide; None where it asks for none.

    One run over the same travel, with the targets at the distance that the search asks for.
    """
    step = other_step(diagnosis.dataset.coordinates)
    if step is None:
        return None
    unit_mm, decimals = plan.unit_mm, PROGRAM_DECIMALS[plan.unit_mm]
    increment = round(step / unit_mm, decimals)
    if increment <= round(plan.increment_mm / unit_mm, decimals):
        return None  # a program cannot state a distance that is so little larger
    step_mm = increment * unit_mm
    intervals = math.floor((plan.end_mm - plan.start_mm) / step_mm + _WHOLE)
    return replace(plan, end_mm=plan.start_mm + intervals * step_mm, increment_mm=step_mm, runs=1)


def _predictor(study: Study, found: Diagnosis) -> tuple[BidirectionalTable, tuple[LeftOut, ...]]:
    plan = study.calibration
    return predictor_at_mean(found.model, plan.start_mm, plan.end_mm, found.dataset)


def score(study: Study, predictor: Predictor, grid: NDArray[np.float64]) -> TruthScore:
    """Return how far a predictor is from the true error at the places of a grid, in mm, in both directions."""
    return _score([predictor.error_mm(grid, way) - study.axis_error.error_mm(grid, way) for way in (1, -1)])


def _score_of_model(study: Study, model: Model, found: Diagnosis) -> TruthScore:
    grid, warmth = study.calibration.targets_mm, mean_warmth(model, found.dataset)
    off_mm = [static_part(model, grid, way, warmth)[0] - study.axis_error.error_mm(grid, way) for way in (1, -1)]
    return _score(off_mm)


def _score(off_mm: list[NDArray[np.float64]]) -> TruthScore:
    off = np.concatenate(off_mm)
    return TruthScore(rms_mm=float(np.sqrt(np.mean(off**2))), worst_mm=float(np.abs(off).max()))
