"""A warm machine over a shift: uncorrected, corrected by a cold table, and corrected by what thermometers say."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from rtec.dataset.warm_blocks import blocks_of
from rtec.dataset.warm_log import UM_PER_MM, WarmLog
from rtec.errors import ArgumentError
from rtec.heat.course import HeatCourse
from rtec.heat.duty import Duty, Piece
from rtec.heat.machines import warm_machine
from rtec.jobs import Report, Workers
from rtec.machine import Ending, Machine, MeasuringRun, repeated_run, run_machine
from rtec.predictors import BidirectionalTable
from rtec.predictors.binding import OF_TEMPERATURE
from rtec.predictors.warm.features import SPINDLE_SPEED
from rtec.predictors.warm.regressor import Regressor
from rtec.predictors.warm.warm_axis import WarmAxis
from rtec.predictors.warm.warm_model import WarmModel
from rtec.study.definition import Study
from rtec.study.heat import HeatStudy
from rtec.study.results import Floats, Shift, ShiftRow
from rtec.training.warm_methods import warm_methods
from rtec.training.warm_parts import parts_of
from rtec.training.warm_task import WarmTask

TITLES = {
    "uncompensated": "Uncompensated",
    "cold": "Corrected by the cold table",
    "warm": "Corrected by the temperatures",
    "speed": "Corrected by temperatures and speed",
}
_STANDING = Piece(duration_s=1.0)
_ROW_S = 2.0
_TRAIN_EVERY_S = 60
_BEYOND = 0.02
"""Of the range of an input in training: so much farther out still counts as inside."""


def run_shift(study: Study, heat: HeatStudy, machine: Machine, workers: Workers) -> Shift:
    """Let the machine warm, and calibrate it again and again in closed loop.

    Parameters
    ----------
    study
        With the predictor of the cold axis.
    heat
        What its table ``[heat]`` asks for.
    machine
        The machine of the study, without a box.
    workers
        Who carry out the rows.

    Raises
    ------
    ArgumentError
        A shift that is too short for a calibration, or a predictor that cannot be fitted or does not fit.
    """
    course = course_of(heat, heat.duty)
    cold = BidirectionalTable.sampled_from(study.model, _grid(study))
    task, times = _task(study, heat)
    draws = np.random.default_rng([study.seed, heat.seed]).normal(0.0, 1.0, task.target_mm.size)
    box = replace(machine, heat=course, injector=study.injector(heat.design), model=cold)
    rows = {
        "uncompensated": replace(machine, heat=course),
        "cold": box,
        "warm": replace(box, model=warm_axis(study, heat, cold, course)),
    }
    if heat.speed:
        rows["speed"] = replace(box, model=warm_axis(study, heat, cold, course, sees_speed=True))
    jobs = [
        workers.start(
            f"over the shift: {TITLES[name]}",
            _ROW_S,
            partial(_row, name, each, task, draws * study.repeatability_mm, times),
        )
        for name, each in rows.items()
    ]
    return Shift(heat=heat, course=course, rows=tuple(job.result() for job in jobs))


def shift_s(heat: HeatStudy) -> float:
    """Return about the seconds that it takes."""
    return _ROW_S * (3 + heat.speed)


def course_of(heat: HeatStudy, duty: Duty) -> HeatCourse:
    """Return what the machine does over a duty; before that it stands, as it did when its cold table was measured.

    What has grown counts from there: a spindle at speed is displaced at once, without any heat.
    """
    standing_first = Duty((_STANDING, *duty.pieces))
    found = warm_machine(seed=heat.machine).run(standing_first, seed=heat.seed).course(heat.axis)
    shift_mm, per_mm = (np.asarray(column, dtype=np.float64) for column in (found.shift_mm, found.per_mm))
    return replace(found, shift_mm=shift_mm - shift_mm[0], per_mm=per_mm - per_mm[0])


def warm_axis(
    study: Study, heat: HeatStudy, cold: BidirectionalTable, course: HeatCourse, *, sees_speed: bool = False
) -> WarmAxis:
    """Return the predictor of the warm axis: of files, or fitted to the machine in another duty cycle.

    The cold table is that of the machine as the course begins.
    """
    models = heat.models or _fitted(heat, training_log(study, heat, sees_speed=sees_speed))
    ends_mm = (heat.plan.start_mm, heat.plan.end_mm) if len(models) == 2 else ()
    first = {OF_TEMPERATURE + name: float(np.ravel(values)[0]) for name, values in course.thermometers.items()}
    try:
        return WarmAxis(cold=cold, heat=models, at_mm=ends_mm, reference={**first, SPINDLE_SPEED: 0.0})
    except ArgumentError as error:
        raise error.of("heat.model" if heat.models else f"heat.fit = {heat.fit!r}") from None


def training_log(study: Study, heat: HeatStudy, *, sees_speed: bool) -> WarmLog:
    """Return what was measured of the machine in its training duty, once a minute.

    Displacements are those of the first and the last target, with the noise of the study's readings; one alone where
    the axis does not grow along its travel. Inputs are thermometers, and the speed of the spindle where the predictor
    may see it. Blocks are those of a constant speed.
    """
    course = course_of(heat, heat.training)
    rows = slice(None, None, _TRAIN_EVERY_S)  # of a run in seconds
    time_s, shift_mm, per_mm, rpm = (
        np.asarray(column, dtype=np.float64)[rows]
        for column in (course.time_s, course.shift_mm, course.per_mm, course.spindle_rpm)
    )
    places = {"start": heat.plan.start_mm, "end": heat.plan.end_mm} if per_mm.any() else {"start": 0.0}
    noise = np.random.default_rng(heat.seed).normal(0.0, study.repeatability_mm, (len(places), time_s.size))
    outputs = {
        name: UM_PER_MM * (shift_mm + per_mm * (at_mm - course.fixed_mm) + noise[k])
        for k, (name, at_mm) in enumerate(places.items())
    }
    inputs = {
        OF_TEMPERATURE + name: np.asarray(values, dtype=np.float64)[rows]
        for name, values in course.thermometers.items()
        if name in heat.thermometers or not heat.thermometers
    }
    if sees_speed:
        inputs[SPINDLE_SPEED] = rpm
    blocks = blocks_of(time_s, rpm, np.ones(time_s.size, dtype=np.int64), (0,))
    return WarmLog(
        source="the training duty", time_s=time_s, outputs=outputs, inputs=inputs, blocks=blocks, starts=(0,)
    )


def _fitted(heat: HeatStudy, log: WarmLog) -> tuple[WarmModel, ...]:
    method = next(one for one in warm_methods() if one.name == heat.fit)
    parts = parts_of(log, log)
    fits = method.fit(WarmTask(parts=parts, seed=heat.seed)).channels
    regressors = {name: fit.regressor for name, fit in fits.items() if isinstance(fit.regressor, Regressor)}
    if len(regressors) < len(fits):
        raise ArgumentError("heat.fit", repr(heat.fit), "a method whose model the PC can follow")
    ranges = {}
    for name, values in log.inputs.items():
        low, high = float(values.min()), float(values.max())
        ranges[name] = (low - _BEYOND * (high - low), high + _BEYOND * (high - low))
    return tuple(
        WarmModel(
            features=fit.features,
            regressor=regressors[name],
            begin=parts.begin(fit.features),
            observe=name,
            unit="um",
            ranges={each: ranges[each] for each in dict.fromkeys(one.of for one in fit.features)},
        )
        for name, fit in fits.items()
    )


def _task(study: Study, heat: HeatStudy) -> tuple[MeasuringRun, int]:
    """Return the calibrations over the shift, and how many there are."""
    once = repeated_run(heat.plan, study.limits, every_s=heat.every_s, times=1, shape=study.shape)
    room_s = heat.duty.duration_s - float(once.ends_ps[-1]) / 1e12
    if room_s < 0.0:
        allowed = f"at least {float(once.ends_ps[-1]) / 1e12:.0f} s, which a calibration takes"
        raise ArgumentError("heat.duty", f"{heat.duty.duration_s:g} s", allowed)
    times = 1 + int(room_s // heat.every_s)
    return repeated_run(heat.plan, study.limits, every_s=heat.every_s, times=times, shape=study.shape), times


def _grid(study: Study) -> Floats:
    start, end = study.plan.start_mm, study.plan.end_mm
    return np.linspace(start, end, max(round((end - start) / study.table_interval_mm), 1) + 1)


def _row(name: str, machine: Machine, task: MeasuringRun, noise: Floats, times: int, report: Report) -> ShiftRow:
    result = run_machine(machine, task, progress=report)
    return ShiftRow(
        name=name,
        title=TITLES[name],
        time_s=(task.begins_ps / 1e12).reshape(times, -1).mean(axis=1),
        deviation_mm=(result.deviation_mm + noise).reshape(times, -1),
        reason="" if result.ending is Ending.FINISHED else _reason(result.outside_input, result.simulated_s),
        run=result,
    )


def _reason(outside_input: str, after_s: float) -> str:
    why = f": {outside_input} is outside what the predictor was trained for" if outside_input else ""
    return f"held after {after_s / 60.0:.0f} min{why}"
