"""Measurements of the lathe's axis, corrected by a design, as jobs of a campaign."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

from rtec.injector import Design
from rtec.study.definition import Study, builtin_study
from rtec.study.run import measured_row
from rtec.units import PS_PER_MS
from rtec.verify.campaign.job import FAILED, PASSED, Choice, JobKind, Number, Parameters, Record


@cache
def _study() -> Study:
    return builtin_study()


def corrected_axis(parameters: Parameters, seed: int, run: int) -> Record:
    """Measure the axis of the built-in study as a design corrects it by the true error: a row of ``rtec run``.

    Parameters
    ----------
    parameters
        ``design``; ``count_um``, ``phase_error_deg``, ``duty_error_percent`` (of A; of B the opposite) and
        ``jitter_ps`` of the encoder; ``gain_1_s``, ``lag_ms``, ``deadband_counts`` of the servo; ``pc_period_ms``;
        ``repeatability_um`` of the laser.
    seed, run
        The seed draws the laser's noise. It is the same in all runs, so that only the parameters make a difference.
    """
    design = Design.named(str(parameters["design"]))
    number = {name: float(value) for name, value in parameters.items() if isinstance(value, int | float)}
    study = _study()
    imperfections = replace(
        study.encoder.imperfections,
        phase_error_deg=number["phase_error_deg"],
        duty_error_a=number["duty_error_percent"] / 100.0,
        duty_error_b=-number["duty_error_percent"] / 100.0,
        jitter_ps=round(number["jitter_ps"]),
    )
    study = replace(
        study,
        encoder=replace(study.encoder, count_mm=number["count_um"] / 1000.0, imperfections=imperfections),
        servo=replace(
            study.servo,
            gain_per_s=number["gain_1_s"],
            lag_s=number["lag_ms"] / 1000.0,
            deadband_counts=number["deadband_counts"],
        ),
        handshake=replace(study.handshake, pc_period_ps=round(number["pc_period_ms"] * PS_PER_MS)),
        repeatability_mm=number["repeatability_um"] / 1000.0,
        seed=seed,
        model=study.axis_error,
    )
    row = measured_row(study, design)
    figures = row.figures
    record: Record = {
        "result": PASSED if row.good else FAILED,
        "outcome": row.run.ending.name.lower(),
        "reason": row.reason,
        "wanted_steps": row.run.wanted_steps,
        "pending_steps": row.run.pending_steps,
    }
    if figures is not None:
        iso = {key: None if value is None else 1000.0 * value for key, value in figures.iso.items()}
        record |= {f"{key}_um": iso[key] for key in ("A", "R", "E", "M", "B")} | {"rms_um": 1000.0 * figures.rms}
    return record


LATHE = JobKind(
    does="The lathe's axis is corrected by a design and measured by the laser, with parameters of one's choice.",
    function=f"{__name__}:corrected_axis",
    parameters=(
        Choice(name="design", words=tuple(design.value for design in Design), default=("c",)),
        Number(name="count_um", unit="um", low=0.1, high=20.0, default=1.0),
        Number(name="phase_error_deg", unit="deg", low=-40.0, high=40.0, default=0.0),
        Number(name="duty_error_percent", unit="percent", low=-10.0, high=10.0, default=0.0),
        Number(name="jitter_ps", unit="ps", low=0.0, high=1e6, default=0.0, whole=True),
        Number(name="gain_1_s", unit="1/s", low=1.0, high=100.0, default=16.6667),
        Number(name="lag_ms", unit="ms", low=1.0, high=50.0, default=10.0),
        Number(name="deadband_counts", low=0.0, high=20.0, default=0.5),
        Number(name="pc_period_ms", unit="ms", low=2.0, high=100.0, default=10.0),
        Number(name="repeatability_um", unit="um", low=0.0, high=20.0, default=1.0),
    ),
    by=("design",),
)
