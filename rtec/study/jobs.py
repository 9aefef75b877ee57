"""Calibrations of the lathe's axis, corrected by a design and measured again, as jobs of a campaign."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache

import numpy as np

from rtec.heat.approach import approach
from rtec.heat.course import HeatCourse
from rtec.injector import Design, Processor
from rtec.metrology import positioning_figures
from rtec.predictors import FORWARD, REVERSE, BidirectionalTable, LatheNetwork, Predictor
from rtec.predictors.layered import TrainedNetworks
from rtec.study.definition import Study, builtin_study
from rtec.study.learning import calibrate
from rtec.study.models import TRUTH
from rtec.study.run import machine_of, measured_row
from rtec.units import PS_PER_MS, PS_PER_US
from rtec.verify.campaign.job import FAILED, PASSED, Choice, JobKind, Number, Parameters, Record

TABLE = "table"
"""What the PC knows of the axis: the mean readings of a calibration."""
_POINTS_A_TURN = 60
_AS_PRINTED = {
    "pitch_map": 1.0, "backlash": 1.0, "cyclic": 1.0, "cyclic_phase_deg": 0.0, "offset_um": 0.0, "scale_um_m": 0.0,
}  # fmt: skip


@cache
def _study() -> Study:
    return builtin_study()


def lathe_error(numbers: Mapping[str, float]) -> Predictor:
    """Return the true error of a lathe like that of the thesis.

    Parameters
    ----------
    numbers
        Three factors of what the printed networks have: ``pitch_map`` of the mean of both directions, about its
        average over the travel; ``backlash`` of the difference between the directions; ``cyclic`` of the error within
        a turn, ``cyclic_phase_deg`` earlier in the turn. ``offset_um``, and ``scale_um_m`` from the start of the
        travel on, are added.

    Returns
    -------
    Predictor
        The printed networks where nothing is changed, else a table of sixty points a turn.

    References
    ----------
    Thesis, section 4.4.2 and Appendix E: one network for the whole length, one for the turn.

    Examples
    --------
    >>> error = lathe_error(_AS_PRINTED | {"offset_um": 10.0})
    >>> round(1000.0 * float(error.error_mm(508.0, FORWARD) - LatheNetwork().error_mm(508.0, FORWARD)), 2)
    10.0
    """
    lathe = LatheNetwork()
    if all(numbers[name] == value for name, value in _AS_PRINTED.items()):
        return lathe
    low, high = lathe.range_mm
    mm = np.linspace(low, high, round((high - low) / lathe.pitch_mm * _POINTS_A_TURN) + 1)
    travel, turn = (
        TrainedNetworks(networks=(one,), range_mm=lathe.range_mm, pitch_mm=lathe.pitch_mm) for one in lathe.networks
    )
    forward, reverse = (travel.error_mm(mm, way) for way in (FORWARD, REVERSE))
    mean, play = (forward + reverse) / 2.0, numbers["backlash"] * (reverse - forward)
    earlier_mm = numbers["cyclic_phase_deg"] / 360.0 * lathe.pitch_mm
    in_turn = low + np.mod(mm - low + earlier_mm, lathe.pitch_mm)
    both = mean.mean() + numbers["pitch_map"] * (mean - mean.mean())
    both += numbers["offset_um"] / 1e3 + numbers["scale_um_m"] / 1e6 * (mm - low)
    return BidirectionalTable.on_grid(
        mm,
        both - play / 2.0 + numbers["cyclic"] * turn.error_mm(in_turn, FORWARD),
        both + play / 2.0 + numbers["cyclic"] * turn.error_mm(in_turn, REVERSE),
    )


def corrected_axis(parameters: Parameters, seed: int, run: int) -> Record:
    """Calibrate the axis of the built-in study, correct it by a design, and measure it: a row of ``rtec run``.

    Parameters
    ----------
    parameters
        Those of `LATHE`. ``model``: ``axis``, the PC knows the true error; ``table``, it knows the mean readings of
        a calibration at ``table_spacing_mm``, ``repeats`` runs of it, without correction and at an even temperature.
        While the corrected axis is measured, it is displaced by up to ``thermal_um`` in first order, and the PC has
        no thermometer. ``duty_error_percent`` is that of A; B has the opposite.
    seed, run
        The seed draws the laser's noise. It is the same in all runs, so that only the parameters make a difference.

    Raises
    ------
    ArgumentError
        Errors that no play can have, or an axis that cannot be calibrated.
    """
    design = Design.named(str(parameters["design"]))
    number = {name: float(value) for name, value in parameters.items() if isinstance(value, int | float)}
    study = replace(_lathe(number, Processor(parameters["processor"])), seed=seed)
    study = replace(study, model=_table(study, number) if parameters["model"] == TABLE else study.axis_error)
    row = measured_row(study, design, _heat(number))
    figures = row.figures
    record: Record = {
        "result": PASSED if row.good else FAILED,
        "outcome": row.run.ending.name.lower(),
        "reason": row.reason,
        "wanted_steps": row.run.wanted_steps,
        "pending_steps": row.run.pending_steps,
    }
    if figures is not None:
        lengths = {key: None if value is None else 1000.0 * value for key, value in figures.lengths.items()}
        record |= {f"{key}_um": lengths[key] for key in ("A", "R", "E", "M", "B", "rms", "cyclic_pp")}
    return record


def _lathe(number: Mapping[str, float], processor: Processor) -> Study:
    """Return the built-in study of another machine."""
    study = _study()
    imperfections = replace(
        study.encoder.imperfections,
        phase_error_deg=number["phase_error_deg"],
        duty_error_a=number["duty_error_percent"] / 100.0,
        duty_error_b=-number["duty_error_percent"] / 100.0,
        jitter_ps=round(number["jitter_ps"]),
    )
    return replace(
        study,
        axis_error=lathe_error(number),
        encoder=replace(study.encoder, count_mm=number["count_um"] / 1000.0, imperfections=imperfections),
        servo=replace(
            study.servo,
            gain_per_s=number["gain_1_s"],
            lag_s=number["lag_ms"] / 1000.0,
            deadband_counts=number["deadband_counts"],
        ),
        handshake=replace(
            study.handshake,
            pc_period_ps=round(number["pc_period_ms"] * PS_PER_MS),
            latency_ps=round(number["latency_us"] * PS_PER_US),
        ),
        processor=processor,
        gate_margin=number["gate_margin"],
        repeatability_mm=number["repeatability_um"] / 1000.0,
    )


def _table(study: Study, number: Mapping[str, float]) -> Predictor:
    """Return what a calibration of the axis says of it."""
    plan, runs = study.plan, round(number["repeats"])
    steps = max(round((plan.end_mm - plan.start_mm) / number["table_spacing_mm"]), 1)
    plan = replace(plan, increment_mm=(plan.end_mm - plan.start_mm) / steps, runs=runs)
    readings, _ = calibrate(replace(study, calibration=plan), machine_of(study), lambda share: None)
    at = positioning_figures(readings).at_targets
    return BidirectionalTable.on_grid(at.target, at.mean_forward, at.mean_backward)


def _heat(number: Mapping[str, float]) -> HeatCourse:
    shift_mm = number["thermal_um"] / 1000.0
    return approach(time_constant_s=60.0 * number["warm_up_min"], shift_mm=shift_mm) if shift_mm else HeatCourse()


LATHE = JobKind(
    does="The lathe's axis is calibrated, corrected by a design and measured by the laser.",
    function=f"{__name__}:corrected_axis",
    parameters=(
        Choice(name="design", words=tuple(design.value for design in Design), default=("c",)),
        Choice(name="processor", words=tuple(one.value for one in Processor), default=(Processor.MCS51.value,)),
        Choice(name="model", words=(TRUTH, TABLE), default=(TRUTH,)),
        Number(name="offset_um", unit="um", low=-1000.0, high=1000.0, default=0.0),
        Number(name="scale_um_m", unit="um/m", low=-1000.0, high=1000.0, default=0.0),
        Number(name="pitch_map", low=-10.0, high=10.0, default=1.0),
        Number(name="backlash", low=0.0, high=10.0, default=1.0),
        Number(name="cyclic", low=0.0, high=10.0, default=1.0),
        Number(name="cyclic_phase_deg", unit="deg", low=-360.0, high=360.0, default=0.0),
        Number(name="thermal_um", unit="um", low=-1000.0, high=1000.0, default=0.0),
        Number(name="warm_up_min", unit="min", low=0.1, high=10_000.0, default=30.0),
        Number(name="count_um", unit="um", low=0.1, high=20.0, default=1.0),
        Number(name="phase_error_deg", unit="deg", low=-40.0, high=40.0, default=0.0),
        Number(name="duty_error_percent", unit="percent", low=-10.0, high=10.0, default=0.0),
        Number(name="jitter_ps", unit="ps", low=0.0, high=1e6, default=0.0, whole=True),
        Number(name="gain_1_s", unit="1/s", low=1.0, high=100.0, default=16.6667),
        Number(name="lag_ms", unit="ms", low=1.0, high=50.0, default=10.0),
        Number(name="deadband_counts", low=0.0, high=20.0, default=0.5),
        Number(name="pc_period_ms", unit="ms", low=2.0, high=100.0, default=10.0),
        Number(name="latency_us", unit="us", low=1.0, high=2000.0, default=100.0),
        Number(name="gate_margin", low=0.0, high=100.0, default=0.15),
        Number(name="table_spacing_mm", unit="mm", low=0.6, high=500.0, default=0.635),
        Number(name="repeats", low=1.0, high=10.0, default=4.0, whole=True),
        Number(name="repeatability_um", unit="um", low=0.0, high=20.0, default=1.0),
    ),
    by=("design",),
)
