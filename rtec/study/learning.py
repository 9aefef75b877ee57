"""Learning the axis: a calibration of its own, a search for its effects from nothing, a predictor made of them."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from rtec.dataset.load import load_dataset
from rtec.dataset.unseen import target_shifts
from rtec.errors import ArgumentError
from rtec.inference.diagnose import diagnose
from rtec.inference.model import Model
from rtec.inference.results import Diagnosis
from rtec.jobs import Tell
from rtec.machine import Machine, MeasuringRun, measuring_run, readings_of, run_machine
from rtec.metrology import Measurement, MeasuringPlan, Readings, joined, measurement_of_readings
from rtec.predictors import BidirectionalTable, Predictor
from rtec.report.results import Learned, LeftOut, Round, TruthScore
from rtec.study.definition import Study
from rtec.study.model_predictor import predictor_of_model, static_part
from rtec.units import MM_PER_INCH

SOURCE = "readings/calibration.csv"
"""File of the report that holds the readings."""
CALIBRATING_S, SEARCHING_S = 1.0, 6.0
"""About what the parts take."""
POSITION_DECIMALS = 4
"""Of an inch, that a measuring program writes."""
_FEWEST_INTERVALS = 2
"""Of a pass: one that is moved has an interval less."""
_PLACES = 50_001
"""At which a model is scored: a hundred thousandth of a travel apart in both directions."""


Teller: TypeAlias = Callable[[str, float], Tell]
"""Returns what is told of the progress of a part: its name, and about the seconds that it takes."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Lesson:
    """What was learned, and the predictor that the PC gets."""

    learned: Learned
    predictor: BidirectionalTable
    left_out: tuple[LeftOut, ...]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Calibration:
    """Readings of the axis as it is, and the machine time that they took."""

    readings: Readings
    machine_s: float


def calibrate(study: Study, machine: Machine, tell: Tell, *, number: int = 1) -> Calibration:
    """Measure the axis as it is: the calibration's program in closed loop, with the study's repeatability.

    Parameters
    ----------
    study, machine
        What is measured.
    tell
        Called with the share done.
    number
        Of the programs that have been carried out on this axis; each has noise of its own.

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
    noise = np.random.default_rng([study.seed, number]).normal(0.0, 1.0, task.target_mm.size)
    readings = readings_of(task, result.deviation_mm + noise * study.repeatability_mm)
    return Calibration(readings=readings, machine_s=result.simulated_s)


def calibration_measurement(readings: Readings, period_mm: float | None) -> Measurement:
    """Return a calibration as a measurement: what the report's file holds and the search is given."""
    facts = {} if period_mm is None else {"screw_pitch": f"{period_mm!r} mm"}
    return replace(measurement_of_readings(readings, facts), source=SOURCE)


def learn(study: Study, machine: Machine, teller: Teller) -> Lesson:
    """Calibrate an axis, find the effects behind the readings, and make a predictor of them.

    The search begins with a perfect axis. Where the targets hide periods, the axis is measured again at the targets
    that the first search asks for, as often as the study allows, and all readings are searched together.

    Parameters
    ----------
    study
        Its true error is used for the scores only.
    machine
        The axis without a correction.
    teller
        Names the parts as they begin.

    Raises
    ------
    ArgumentError
        As for `calibrate`.
    """
    begun = time.perf_counter()
    rounds: list[Round] = []
    plans: tuple[MeasuringPlan, ...] = (study.calibration,)
    programs = 0
    while plans and len(rounds) < study.rounds:
        again = " again" if rounds else ""
        taken = []
        for plan in plans:
            programs += 1
            tell = teller(f"calibrating the axis{again}", CALIBRATING_S)
            taken.append(calibrate(replace(study, calibration=plan), machine, tell, number=programs))
        rounds.append(_searched(study, rounds, plans, taken, teller(f"searching for effects{again}", SEARCHING_S)))
        plans = _asked_for(study, rounds[-1].diagnosis)
    diagnosis = rounds[-1].diagnosis
    predictor, left_out = _predictor(study, diagnosis.model)
    models = [diagnosis.start, *(step.model for step in diagnosis.steps)]
    learned = Learned(
        plan=study.calibration,
        rounds=tuple(rounds),
        points=predictor.forward_positions_mm.size,
        scores=tuple(_score_of_model(study, model) for model in models),
        wall_s=time.perf_counter() - begun,
    )
    return Lesson(learned=learned, predictor=predictor, left_out=left_out)


def learning_s(study: Study) -> float:
    """Return about how long the rounds of a study take, in s, a second one with two programs of its own."""
    return study.rounds * (CALIBRATING_S + SEARCHING_S) + (study.rounds - 1) * CALIBRATING_S


def _searched(
    study: Study, before: list[Round], plans: tuple[MeasuringPlan, ...], taken: list[Calibration], tell: Tell
) -> Round:
    """Search all readings up to those of a new round."""
    new = joined([calibration.readings for calibration in taken])
    whole = joined([*(one.readings for one in before), new])
    diagnosis = diagnose(load_dataset(calibration_measurement(whole, study.period_mm)), progress=tell)
    return Round(
        plans=plans,
        readings=new,
        machine_s=sum(calibration.machine_s for calibration in taken),
        missed_mm=_less(before[-1].diagnosis.model, new) if before else new.deviation_mm,
        left_mm=_less(diagnosis.model, new),
        diagnosis=diagnosis,
        score=score(study, _predictor(study, diagnosis.model)[0], _travel(study)),
    )


def _less(model: Model, readings: Readings) -> NDArray[np.float64]:
    """Return readings less what a model says of their places and directions, shape (readings,)."""
    left = readings.deviation_mm.copy()
    for way in (1, -1):
        there = readings.direction == way
        if there.any():
            left[there] -= static_part(model, readings.target_mm[there], way).error_mm
    return left


def _asked_for(study: Study, diagnosis: Diagnosis) -> tuple[MeasuringPlan, ...]:
    """Return the programs that show what the targets of a search hide: a run each at targets moved by a shift."""
    plan = study.calibration
    shifts = target_shifts(diagnosis.dataset.coordinates)
    intervals = round((plan.end_inch - plan.start_inch) / plan.increment_inch)
    if shifts is None or intervals < _FEWEST_INTERVALS:
        return ()
    moved = [round(shift / MM_PER_INCH % plan.increment_inch, POSITION_DECIMALS) for shift in shifts]
    return tuple(
        replace(
            plan,
            start_inch=plan.start_inch + by,
            end_inch=plan.start_inch + by + (intervals - 1) * plan.increment_inch,
            runs=1,
        )
        for by in moved
        if 0.0 < by < plan.increment_inch
    )


def _predictor(study: Study, model: Model) -> tuple[BidirectionalTable, tuple[LeftOut, ...]]:
    plan = study.calibration
    return predictor_of_model(model, plan.start_inch * MM_PER_INCH, plan.end_inch * MM_PER_INCH)


def _travel(study: Study) -> NDArray[np.float64]:
    """Return places all along the calibration's travel, between its targets, too."""
    plan = study.calibration
    return np.linspace(plan.start_inch * MM_PER_INCH, plan.end_inch * MM_PER_INCH, _PLACES)


def score(study: Study, predictor: Predictor, grid: NDArray[np.float64]) -> TruthScore:
    """Return how far a predictor is from the true error at the places of a grid, in mm, in both directions."""
    return _score([predictor.error_mm(grid, way) - study.axis_error.error_mm(grid, way) for way in (1, -1)])


def _score_of_model(study: Study, model: Model) -> TruthScore:
    grid = study.calibration.targets_inch * MM_PER_INCH
    return _score([static_part(model, grid, way).error_mm - study.axis_error.error_mm(grid, way) for way in (1, -1)])


def _score(off_mm: list[NDArray[np.float64]]) -> TruthScore:
    off = np.concatenate(off_mm)
    return TruthScore(rms_mm=float(np.sqrt(np.mean(off**2))), worst_mm=float(np.abs(off).max()))
