"""Carrying a study out: every row on the same machine, with the same draws, then the figures."""

from __future__ import annotations

import shlex
import time
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import replace
from functools import partial
from importlib import import_module

import numpy as np
from numpy.typing import NDArray

from rtec.heat.course import HeatCourse
from rtec.injector import Design
from rtec.jobs import Progress, Report, Workers
from rtec.machine import Ending, LoopResult, Machine, MeasuringRun, measuring_run, readings_of, run_machine
from rtec.machine.fault_kinds import FaultCategory
from rtec.machine.faults import Trigger
from rtec.metrology import Readings, positioning_figures
from rtec.predictors import BidirectionalTable
from rtec.study.definition import Study
from rtec.study.figures import feed_curve, hold_curve, limit_of, waveform
from rtec.study.learning import learn, learning_s, score
from rtec.study.models import LATHE, LEARNED, TRUTH
from rtec.study.results import FeedCurve, HoldCurve, Learned, Shift, StudyResult, StudyRow
from rtec.units import PS_PER_S

_MEASURING, _MOVING, _HOLDING = 0.7, 0.6, 0.1
"""Weights of the parts in what is told of the progress: about the seconds that each takes."""
_BELIEFS = {
    LEARNED: "learned: the effects found in the calibration",
    LATHE: "the network that the thesis prints",
    TRUTH: "the true error of the axis",
}
TITLES = {
    "uncompensated": "Uncompensated",
    "table": "Controller's own table",
    **{design.value: design.title for design in Design},
}


def run_study(
    study: Study, *, progress: Progress | None = None, meanwhile: Callable[[Learned], None] | None = None
) -> StudyResult:
    """Run a study and return its results.

    Parameters
    ----------
    study
        What to do.
    progress
        Called with what is being done and the share of the whole that is; from several threads, one at a time.
    meanwhile
        Called with what the calibration showed, while the rows are measured: there is time to draw it.

    Raises
    ------
    ArgumentError
        A program that the axis or the laser cannot carry out.

    Notes
    -----
    Where the predictor has to be learned, the axis is calibrated and diagnosed first. The rows do not depend on each
    other and are measured at the same time, on as many cores as there are; the results are the same on any number.
    """
    begun = time.perf_counter()
    for design in study.designs:
        _troubled(study, _with_box(study, design))  # what cannot be is refused before anything is measured
    designs = len(study.designs)
    learning = learning_s(study) if study.learns else 0.0
    shifts = 0.0 if study.heat is None else import_module("rtec.study.shift").shift_s(study.heat)
    total = learning + (2 + designs) * _MEASURING + designs * (_MOVING + _HOLDING) + shifts
    with Workers(progress, total=total) as workers:
        jobs = _Jobs(study, workers)
        # what does not depend on the predictor begins before it is known
        rows = [jobs.row("uncompensated", _troubled(study, machine_of(study)))]
        holds = [jobs.hold(study, design) for design in study.designs]
        learned = shift = None
        if study.learns:
            learned = learn(study, machine_of(study), workers.reporter)
            study = replace(study, model=learned.predictor, left_out=learned.left_out)
        rows += [jobs.row(name, machine) for name, machine in _corrected(study)]
        feeds = [jobs.feed(study, design) for design in study.designs]
        if learned is not None and meanwhile is not None:
            meanwhile(learned)
        if study.heat is not None:
            shift = import_module("rtec.study.shift").run_shift(study, study.heat, machine_of(study), workers)
        measured = tuple(row.result() for row in rows)
        feed_curves = tuple(feed.result() for feed in feeds)
        hold_curves = tuple(hold.result() for hold in holds)
    return _result(study, jobs.task, measured, feed_curves, hold_curves, learned, shift, begun)


class _Jobs:
    """The runs of a study that threads carry out, with one program and the same draws for all rows."""

    def __init__(self, study: Study, workers: Workers) -> None:
        self.task = measuring_run(study.plan, study.limits, shape=study.shape)
        self._noise = _noise(study, self.task)
        self._period_mm = study.period_mm
        self._workers = workers

    def row(self, name: str, machine: Machine) -> Future[StudyRow]:
        """Measure one way of correcting."""
        job = partial(_row, self._period_mm, name, machine, self.task, self._noise)
        return self._workers.start(f"measuring: {TITLES[name]}", _MEASURING, job)

    def feed(self, study: Study, design: Design) -> Future[FeedCurve]:
        """Move with a design at each feed."""
        job = partial(feed_curve, study, design.value, _with_box(study, design))
        return self._workers.start(f"error against feed: {TITLES[design.value]}", _MOVING, job)

    def hold(self, study: Study, design: Design) -> Future[HoldCurve]:
        """Hold the axis with a design."""
        job = partial(hold_curve, study, design.value, _with_box(study, design))
        return self._workers.start(f"held axis: {TITLES[design.value]}", _HOLDING, job)


def _result(
    study: Study,
    task: MeasuringRun,
    rows: tuple[StudyRow, ...],
    feeds: tuple[FeedCurve, ...],
    holds: tuple[HoldCurve, ...],
    learned: Learned | None,
    shift: Shift | None,
    begun: float,
) -> StudyResult:
    """Collect what the report needs; ``study`` holds the predictor that was at work."""
    position = _fine_grid(study)
    return StudyResult(
        study=study,
        command=_command(study),
        facts=_facts(study, task),
        learned=learned,
        shift=shift,
        predictor_score=score(study, study.model, position),
        position_mm=position,
        forward_error_mm=study.axis_error.error_mm(position, 1),
        reverse_error_mm=study.axis_error.error_mm(position, -1),
        rows=rows,
        feed_curves=feeds,
        hold_curves=holds,
        waveforms=tuple(waveform(study, design) for design in study.designs),
        limits=tuple(limit_of(study, design) for design in study.designs),
        wall_s=time.perf_counter() - begun,
        warnings=_warnings(study, rows) + (() if shift is None else _shift_warnings(shift)),
    )


def _command(study: Study) -> str:
    words = ["rtec", "run", *([study.file] if study.file else [])]
    if study.firmware is not None:
        words += ["--firmware", "--processor", study.firmware.name]
    return shlex.join(words)


def machine_of(study: Study) -> Machine:
    """Return the machine of a study without a box."""
    return Machine(
        axis_error=study.axis_error,
        model=study.model,
        encoder=study.encoder,
        servo=study.servo,
        receiver=study.receiver,
        handshake=study.handshake,
        laser=study.laser,
    )


def _with_box(study: Study, design: Design) -> Machine:
    return replace(machine_of(study), injector=study.injector(design), microcontroller=study.firmware)


def _corrected(study: Study) -> list[tuple[str, Machine]]:
    """Return the corrected rows' machines: the controller's own table, each design."""
    table = BidirectionalTable.sampled_from(study.model, _grid(study))
    own = ("table", _troubled(study, replace(machine_of(study), own_table=table)))
    return [own, *((design.value, _troubled(study, _with_box(study, design))) for design in study.designs)]


def _troubled(study: Study, machine: Machine) -> Machine:
    """Return a machine to which happens what the study says; without a box, to its lines alone."""
    if machine.injector is not None:
        return replace(machine, faults=study.faults, probing=study.probing)
    of_lines = tuple(fault for fault in study.faults if fault.kind.category is FaultCategory.ENCODER)
    return replace(machine, faults=tuple(fault for fault in of_lines if fault.trigger is Trigger.AT_ONCE))


def _grid(study: Study) -> NDArray[np.float64]:
    """Return the points of the controller's table: from the first to the last target, at its interval."""
    start, end = study.plan.start_mm, study.plan.end_mm
    points = max(round((end - start) / study.table_interval_mm), 1)
    return np.linspace(start, start + points * study.table_interval_mm, points + 1)


def _fine_grid(study: Study) -> NDArray[np.float64]:
    """Return the points at which the true error is drawn: sixty a period, so that a cycle looks like one."""
    start, end = study.plan.start_mm, study.plan.end_mm
    spacing = (study.period_mm or study.table_interval_mm) / 60.0
    return np.linspace(start, end, min(max(round((end - start) / spacing), 1), 100_000) + 1)


def measured_row(study: Study, design: Design, heat: HeatCourse) -> StudyRow:
    """Measure one row of a study alone: the axis as a design corrects it, by the model that the study holds.

    ``heat`` is what happens to the machine meanwhile.

    Raises
    ------
    ArgumentError
        A program that the axis or the laser cannot carry out.
    """
    task = measuring_run(study.plan, study.limits, shape=study.shape)
    machine = _troubled(study, replace(_with_box(study, design), heat=heat))
    return _row(study.period_mm, design.value, machine, task, _noise(study, task), lambda share: None)


def _noise(study: Study, task: MeasuringRun) -> NDArray[np.float64]:
    """Return what the laser adds to each reading; the same for all rows."""
    draws = np.random.default_rng(study.seed).normal(0.0, 1.0, task.target_mm.size)
    return draws * study.repeatability_mm


def _row(
    period_mm: float | None,
    name: str,
    machine: Machine,
    task: MeasuringRun,
    noise: NDArray[np.float64],
    report: Report,
) -> StudyRow:
    result = run_machine(machine, task, progress=report)
    readings = _readings(task, result, noise)
    return StudyRow(
        name=name,
        title=TITLES[name],
        readings=readings,
        figures=None if readings is None else positioning_figures(readings, period=period_mm),
        reason=_reason(result),
        run=result,
    )


def _readings(task: MeasuringRun, result: LoopResult, noise: NDArray[np.float64]) -> Readings | None:
    """Return the laser's readings; a run that was held or faulted, or led astray by lost counts, has those it has."""
    if result.ending.name == "FINISHED" and result.audit:
        return readings_of(task, result.deviation_mm + noise)
    taken = np.isfinite(result.deviation_mm)
    if not taken.any():
        return None
    return Readings(
        target_mm=task.target_mm[taken],
        deviation_mm=(result.deviation_mm + noise)[taken],
        direction=task.direction[taken],
        run=task.run[taken],
    )


def _reason(result: LoopResult) -> str:
    """Return why a row is empty, or ended before its time; nothing where it is whole."""
    if result.firmware_fault is not None:
        return f"the firmware stopped: {result.firmware_fault}; 'rtec firmware check' says where it fails"
    after = f"after {result.simulated_s:.3f} s"
    if result.ending is Ending.HELD:
        return f"held by the PC {after}; the box says {result.status.name}"
    if result.ending is Ending.FAULTED:
        return f"stopped by the controller {after}: an illegal transition, or a drive without an answer"
    if not np.isfinite(result.deviation_mm).any():
        off = "every count is right" if result.audit else f"its count is off by {result.audit_counts}"
        return f"the axis never stood at a target for the laser's dwell; {off}"
    return ""


def _warnings(study: Study, rows: tuple[StudyRow, ...]) -> tuple[str, ...]:
    seen = {f"the predictor does without {left.effect}: {left.why}": None for left in study.left_out}
    for row in rows:
        if row.figures is not None:
            seen.update(dict.fromkeys(row.figures.warnings))
        for fired in row.run.fired:
            if fired.times == 0:
                seen[f"{row.title}: a fault took no effect, so its row shows nothing of it: {fired.fault}"] = None
        if row.reason:
            seen[f"{row.title}: {'no reading: ' if row.readings is None else ''}{row.reason}"] = None
        if row.run.pending_steps:
            seen[f"{row.title}: {abs(row.run.pending_steps)} steps are pending at the end"] = None
        if row.run.beyond_word_steps:
            seen[f"{row.title}: the request's word is too small by {row.run.beyond_word_steps} steps"] = None
    return tuple(seen)


def _shift_warnings(shift: Shift) -> tuple[str, ...]:
    return tuple(f"over the shift, {row.title}: {row.reason}" for row in shift.rows if row.reason)


def _box_pace(study: Study) -> str:
    if study.firmware is not None:
        return "box at its firmware's pace"
    return f"box every {study.handshake.box_period_ps / 1e9:g} ms"


def _facts(study: Study, task: MeasuringRun) -> tuple[tuple[str, str], ...]:
    plan, talk = study.plan, study.handshake
    noise = f"{study.repeatability_mm * 1000:g} µm standard deviation of a reading, seed {study.seed}"
    return (
        ("Predictor", _BELIEFS.get(study.predictor) or study.predictor),
        ("Targets", f"{plan.start_mm:g} to {plan.end_mm:g} mm every {plan.increment_mm:g} mm"),
        ("Readings", f"{task.target_mm.size} in {plan.runs} bidirectional runs, dwell {plan.dwell_s:g} s"),
        ("Feed", f"{60.0 * plan.feed_mm_s:g} mm/min, overshoot {plan.overshoot_mm:g} mm"),
        ("Laser", f"mean of the second half of {study.laser.dwell_s:g} s"),
        ("Repeatability", noise if study.repeatability_mm else "none: readings without noise"),
        ("Encoder", f"{study.encoder.count_mm * 1000:g} µm a count, angle state {study.encoder.home_state} at home"),
        ("Servo", f"Kv {study.servo.gain_per_s:.4g} 1/s, lag {study.servo.lag_s * 1000:g} ms"),
        ("Box", f"processor {study.box_processor}, real edges inside an insertion: {study.real_edges.value}"),
        (
            "Handshake",
            f"window ±{talk.window_steps} steps, {_box_pace(study)}, "
            f"PC every {talk.pc_period_ps / 1e9:g} ms, latency {talk.latency_ps / 1e6:g} µs",
        ),
        *(() if study.heat is None else (("Warm machine", str(study.heat)),)),
        *(("Fault", str(fault)) for fault in study.faults),
        *(
            ("Probing", f"from {a / PS_PER_S:g} s to {b / PS_PER_S:g} s: nothing is corrected")
            for a, b in study.probing
        ),
        ("Controller", f"filter of {study.receiver.delay_ps / 1000:g} ns, x4, {study.receiver.counter_bits} bits"),
    )
