"""The conditions that a measuring plan would give, before anybody carries it out."""

from __future__ import annotations

from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rtec.dataset.dataset import Dataset
from rtec.effects import Conditions, Floats, distance_since_reversal
from rtec.metrology import ExperimentPlan, Heating, Passes
from rtec.metrology.plan_program import readings_of_plan

_RISE_S = 1800.0
"""Over which a machine warms up by a share of 1 - 1/e."""
_MOST_SAMPLES = 4000


def planned_conditions(plan: ExperimentPlan, dataset: Dataset) -> Conditions:
    """Return the conditions of each reading of a plan on the axis of a measurement, as far as a plan says them.

    Heat, air and load go from the lowest to the highest that was measured. Of a log at most 4000 samples are made.

    Examples
    --------
    >>> from rtec.dataset.load import load_dataset
    >>> from rtec.metrology import measurement_of_columns
    >>> x = [0.0, 50.0, 100.0, 100.0, 50.0, 0.0]
    >>> way = [1, 1, 1, -1, -1, -1]
    >>> data = load_dataset(measurement_of_columns({"target_mm": x, "deviation_um": x, "direction": way}))
    >>> c = planned_conditions(ExperimentPlan(runs=2, targets=3, start_mm=0.0, span_mm=100.0), data)
    >>> c.position[:6].tolist(), c.run.max().item(), c.direction[3:6].tolist()
    ([0.0, 50.0, 100.0, 100.0, 50.0, 0.0], 2, [-1.0, -1.0, -1.0])
    """
    position, direction, run, time_s, velocity, acceleration = (_log if plan.in_motion else _at_rest)(plan, dataset)
    c = dataset.conditions
    share = _course(plan, run, time_s)
    load = None
    if c.load is not None:
        in_turn = np.resize(plan.loads_kg, plan.runs)[run - 1] if plan.loads_kg else None
        load = _between(c.load, (run - 1) / max(plan.runs - 1, 1)) if in_turn is None else in_turn
    spindle = None if c.spindle_rpm is None else _between(c.spindle_rpm, share)
    air = None if c.pressure_hpa is None else _between(c.pressure_hpa, share)
    return Conditions(
        position=position,
        position_unit=c.position_unit,
        run=run,
        direction=direction if c.direction is not None or plan.passes is Passes.BOTH else None,
        time_s=time_s if c.time_s is not None or "time" in plan.columns else None,
        velocity=velocity if c.velocity is not None or len(plan.feeds_mm_s) > 1 else None,
        acceleration=acceleration if c.acceleration is not None else None,
        since_reversal=distance_since_reversal(position, direction, run, moving=plan.in_motion),
        temperatures=MappingProxyType({name: _between(heat, share) for name, heat in c.temperatures.items()}),
        spindle_rpm=spindle,
        pressure_hpa=air,
        humidity_percent=None if c.humidity_percent is None else _between(c.humidity_percent, share),
        load=load,
        others=MappingProxyType({name: _between(values, share) for name, values in c.others.items()}),
        reference_temperature_degc=c.reference_temperature_degc,
        screw_pitch=c.screw_pitch,
        signal_period=c.signal_period,
        revolution=c.revolution,
        moving=plan.in_motion,
    )


class _Course(NamedTuple):
    """What an axis does at each reading, shape (rows,)."""

    position: Floats
    direction: Floats
    run: NDArray[np.int64]
    time_s: Floats
    velocity: Floats
    acceleration: Floats


def _at_rest(plan: ExperimentPlan, dataset: Dataset) -> _Course:
    every = list(readings_of_plan(plan))
    place = np.array([one.target_mm for one in every])
    way = np.array([float(one.direction) for one in every])
    run = np.array([one.run for one in every], dtype=np.int64)
    feed = np.array([one.feed_mm_s for one in every])
    first = np.array([one.first for one in every])
    turning = max(plan.turn_dwells_s) + 2.0 * plan.overshoot_mm / feed
    back = plan.span_mm / feed if plan.passes is Passes.FORWARD else 0.0
    gone = np.abs(np.diff(place, prepend=place[0])) / feed
    taken = plan.dwell_s + np.where(first, turning + back, gone)
    return _Course(place, way, run, np.cumsum(taken), way * feed, np.zeros(place.size))


def _log(plan: ExperimentPlan, dataset: Dataset) -> _Course:
    """Return strokes of even acceleration, as a log of them would show them."""
    c = dataset.conditions
    known = np.abs(c.acceleration) if c.acceleration is not None else np.zeros(1)
    brisk = float(np.quantile(known, 0.99)) or 10.0 * max(plan.feeds_mm_s)
    turns: list[tuple[float, ...]] = []
    at, clock = plan.start_mm, 0.0
    for one in readings_of_plan(plan):
        length = abs(one.target_mm - at)
        peak = min(one.feed_mm_s, float(np.sqrt(length * brisk)))
        lasts = length / peak + peak / brisk
        turns.append((one.run, at, one.direction, peak, brisk, clock, lasts))
        at, clock = one.target_mm, clock + lasts
    times = np.linspace(0.0, clock, _MOST_SAMPLES, endpoint=False)
    number, start, way, tops, rate, begins, durations = (np.array(column) for column in zip(*turns, strict=True))
    k = np.searchsorted(begins, times, side="right") - 1
    top, pull, ways = tops[k], rate[k], way[k]
    t = times - begins[k]
    left = durations[k] - t
    ramp = top / pull
    speed = np.minimum(np.minimum(t, left) * pull, top)
    whole = top * (durations[k] - ramp)
    gone = np.where(t < ramp, 0.5 * pull * t**2, top * (t - ramp / 2.0))
    gone = np.where(left < ramp, whole - 0.5 * pull * left**2, gone)
    push = np.where(t < ramp, pull, np.where(left < ramp, -pull, 0.0))
    return _Course(start[k] + ways * gone, ways, number[k].astype(np.int64), times, ways * speed, ways * push)


def _course(plan: ExperimentPlan, run: NDArray[np.int64], time_s: Floats) -> Floats:
    """Return how warm the machine is at each reading, from 0 to 1."""
    if plan.heating is Heating.COLD_AND_HOT:
        return ((run - 1) % 2).astype(np.float64)
    if plan.heating is Heating.ONE_RISE:
        rise: Floats = -np.expm1(-time_s / _RISE_S)
        return rise
    return np.full(run.size, 0.5)


def _between(values: Floats, share: Floats) -> Floats:
    """Return values from the lowest to the highest that was measured."""
    known = values[np.isfinite(values)]
    low, high = (float(known.min()), float(known.max())) if known.size else (0.0, 0.0)
    found: Floats = low + (high - low) * share
    return found
