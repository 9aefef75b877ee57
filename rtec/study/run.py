"""Carrying a study out: every row on the same machine, with the same draws, then the figures."""

from __future__ import annotations

import shlex
import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rtec.errors import ArgumentError
from rtec.machine import LoopResult, Machine, MeasuringRun, measuring_run, readings_of, run_machine
from rtec.metrology import Readings, positioning_figures
from rtec.predictors import BidirectionalTable
from rtec.report.results import StudyResult, StudyRow
from rtec.study.definition import Study
from rtec.study.figures import feed_curve, hold_curve, waveform
from rtec.study.limits import limit_of
from rtec.units import MM_PER_INCH

Progress = Callable[[str, float], None]
TITLES = {
    "uncompensated": "Uncompensated",
    "table": "Controller's own table",
    "original": "Original RTEC",
    "a": "Design A",
    "b": "Design B",
    "c": "Design C",
}


def run_study(study: Study, *, progress: Progress | None = None) -> StudyResult:
    """Run a study and return its results.

    Parameters
    ----------
    study
        What to do.
    progress
        Called with what is being done and the share of the whole that is.

    Raises
    ------
    ArgumentError
        A program that the axis or the laser cannot carry out.
    """
    begun = time.perf_counter()
    base = _machine(study)
    task = measuring_run(study.plan, study.limits, shape=study.shape)
    noise = np.random.default_rng(study.seed).normal(0.0, 1.0, task.target_mm.size) * study.repeatability_mm
    variants = _variants(study, base)
    stages = len(variants) + 2 * len(study.designs) + 1
    done = 0

    def tell(what: str) -> Callable[[float], None]:
        def part(share: float) -> None:
            if progress is not None:
                progress(what, (done + share) / stages)

        part(0.0)
        return part

    rows = []
    for name, machine in variants:
        rows.append(_row(study, name, machine, task, noise, tell(f"measuring: {TITLES[name]}")))
        done += 1
    feeds, holds = [], []
    for design in study.designs:
        machine = replace(base, injector=study.injector(design))
        feeds.append(feed_curve(study, design.value, machine, tell(f"error against feed: {TITLES[design.value]}")))
        done += 1
        holds.append(hold_curve(study, design.value, machine, tell(f"held axis: {TITLES[design.value]}")))
        done += 1
    tell("waveforms")(0.0)
    position = _fine_grid(study)
    return StudyResult(
        study=study.name,
        title=study.title,
        command=f"rtec run {shlex.quote(study.file)}" if study.file else "rtec run",
        unit=study.unit,
        facts=_facts(study, task),
        repeatability_mm=study.repeatability_mm,
        period_mm=study.period_mm,
        position_mm=position,
        forward_error_mm=study.axis_error.error_mm(position, 1),
        reverse_error_mm=study.axis_error.error_mm(position, -1),
        rows=tuple(rows),
        feed_curves=tuple(feeds),
        program_feed_mm_s=study.plan.feed_inch_min * MM_PER_INCH / 60.0,
        hold_curves=tuple(holds),
        hold_growth_mm=study.growth.final_mm,
        waveforms=tuple(waveform(study, design) for design in study.designs),
        limits=tuple(limit_of(study, design) for design in study.designs),
        count_mm=study.encoder.count_mm,
        seed=study.seed,
        wall_s=time.perf_counter() - begun,
        warnings=_warnings(rows),
    )


def _machine(study: Study) -> Machine:
    """Return the axis without any correction."""
    return Machine(
        axis_error=study.axis_error,
        model=study.model,
        encoder=study.encoder,
        servo=study.servo,
        receiver=study.receiver,
        conversation=study.conversation,
        laser=study.laser,
    )


def _variants(study: Study, base: Machine) -> list[tuple[str, Machine]]:
    """Return the rows' machines: uncompensated, the controller's own table, each design."""
    table = BidirectionalTable.sampled_from(study.model, _grid(study))
    variants = [("uncompensated", base), ("table", replace(base, own_table=table))]
    return variants + [(design.value, replace(base, injector=study.injector(design))) for design in study.designs]


def _grid(study: Study) -> NDArray[np.float64]:
    """Return the points of the controller's table: from the first to the last target, at its interval."""
    start, end = study.plan.start_inch * MM_PER_INCH, study.plan.end_inch * MM_PER_INCH
    points = max(round((end - start) / study.table_interval_mm), 1)
    return np.linspace(start, start + points * study.table_interval_mm, points + 1)


def _fine_grid(study: Study) -> NDArray[np.float64]:
    """Return the points at which the true error is drawn: sixty a period, so that a cycle looks like one."""
    start, end = study.plan.start_inch * MM_PER_INCH, study.plan.end_inch * MM_PER_INCH
    spacing = (study.period_mm or study.table_interval_mm) / 60.0
    return np.linspace(start, end, min(max(round((end - start) / spacing), 1), 100_000) + 1)


def _row(
    study: Study,
    name: str,
    machine: Machine,
    task: MeasuringRun,
    noise: NDArray[np.float64],
    progress: Callable[[float], None],
) -> StudyRow:
    """Measure one row."""
    result = run_machine(machine, task, progress=progress)
    if not np.isfinite(result.deviation_mm).any():
        off = "audit holds" if result.audit else f"{result.audit_counts} counts off"
        raise ArgumentError(
            f"row {name}",
            f"no reading ({result.ending.name} after {result.simulated_s:.3f} s, {off})",
            "a run in which the axis reaches its targets and stands there longer than the laser's dwell",
            "counts lost at too high a speed lead it astray; a fault or a held machine ends the run",
        )
    readings = _readings(task, result, noise)
    return StudyRow(
        name=name,
        title=TITLES[name],
        readings=readings,
        figures=positioning_figures(readings, period=study.period_mm),
        step_counts=result.step_counts,
        corrections_inserted=result.insertions.inserted,
        corrections_pending=abs(result.pending_steps),
        beyond_word_steps=result.beyond_word_steps,
        illegal_transitions=result.received.illegal_transitions,
        refused=result.refused,
        refused_too_fast=result.insertions.refused,
        audit=result.audit,
        audit_counts=result.audit_counts,
        ending=result.ending.name,
        exchanges=result.exchanges,
        simulated_s=result.simulated_s,
        wall_s=result.wall_s,
    )


def _readings(task: MeasuringRun, result: LoopResult, noise: NDArray[np.float64]) -> Readings:
    """Return the laser's readings; a run that was held or faulted, or led astray by lost counts, has those it has."""
    if result.ending.name == "FINISHED" and result.audit:
        return readings_of(task, result.deviation_mm + noise)
    taken = np.isfinite(result.deviation_mm)
    return Readings(
        target_mm=task.target_mm[taken],
        deviation_mm=(result.deviation_mm + noise)[taken],
        direction=task.direction[taken],
        run=task.run[taken],
    )


def _warnings(rows: list[StudyRow]) -> tuple[str, ...]:
    """Return each warning once."""
    seen: dict[str, None] = {}
    for row in rows:
        seen.update(dict.fromkeys(row.figures.warnings))
        if row.corrections_pending:
            seen[f"{row.title}: {row.corrections_pending} steps are pending at the end"] = None
        if row.beyond_word_steps:
            seen[f"{row.title}: the request's word is too small by {row.beyond_word_steps} steps"] = None
    return tuple(seen)


def _facts(study: Study, task: MeasuringRun) -> tuple[tuple[str, str], ...]:
    """Return the study in words."""
    plan, talk = study.plan, study.conversation
    noise = f"{study.repeatability_mm * 1000:g} µm standard deviation of a reading, seed {study.seed}"
    return (
        ("Targets", f"{plan.start_inch:g} to {plan.end_inch:g} inch every {plan.increment_inch:g} inch"),
        ("Readings", f"{task.target_mm.size} in {plan.runs} bidirectional runs, dwell {plan.dwell_s:g} s"),
        ("Feed", f"{plan.feed_inch_min:g} inch/min, overshoot {plan.overshoot_inch:g} inch"),
        ("Laser", f"mean of the second half of {study.laser.dwell_s:g} s"),
        ("Repeatability", noise if study.repeatability_mm else "none: readings without noise"),
        ("Encoder", f"{study.encoder.count_mm * 1000:g} µm a count, angle state {study.encoder.home_state} at home"),
        ("Servo", f"Kv {study.servo.gain_per_s:.4g} 1/s, lag {study.servo.lag_s * 1000:g} ms"),
        ("Box", f"processor {study.processor.value}, real edges inside an insertion: {study.real_edges.value}"),
        (
            "Conversation",
            f"window ±{talk.window_steps} steps, box every {talk.box_period_ps / 1e9:g} ms, "
            f"PC every {talk.pc_period_ps / 1e9:g} ms, latency {talk.latency_ps / 1e6:g} µs",
        ),
        ("Controller", f"filter of {study.receiver.delay_ps / 1000:g} ns, x4, {study.receiver.counter_bits} bits"),
    )
