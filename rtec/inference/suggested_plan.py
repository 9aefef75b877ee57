"""A measuring plan for the next experiment: what was measured, changed by what the experiment suggested asks.

The sentence of an experiment says what a person has to do; the plan says as much of it as a plan can say, complete
and with this axis's own numbers, so that it can be read, edited and carried out.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rtec.dataset.dataset import Dataset
from rtec.dataset.unseen import other_step, target_shift
from rtec.effects import Conditions, Observable
from rtec.effects.experiments import Ask
from rtec.errors import ArgumentError
from rtec.inference.experiment import CHANGES_DEGC
from rtec.inference.results import Diagnosis
from rtec.metrology import ExperimentPlan, Heating, Passes, Reading, Spacing, Strokes, Weather, Zero
from rtec.metrology.experiment_plan import MOST_IN_TURN

SPEED_SHARES = (1.0, 0.5, 0.05)
"""Of the speed measured: three feeds, creep among them."""
LOG_SPEED_SHARES = (1.0, 0.5, 0.2)
"""The same of a log in motion, which is longer the slower it goes."""
CREEP_SHARE = 0.01
LOADS_KG = (10.0, 25.0, 50.0)
"""Where none were recorded; a person edits them."""
THREE_HOURS_S = 10_800.0
TURN_DEG = 360.0
_FIVE, _EVEN, _DAYS, _MOST_RUNS = 5, 6, 8, 99
_DENSE_TARGETS = 41
_STEPS_A_PERIOD, _MOST_FINE, _FINE_PERIODS = 20, 401, 2.0
_FEED, _FEED_SPANS_S = 40.0, 2.5
_SHORTEST_DWELL_S, _LONGEST_DWELL_S, _USUAL_DWELL_S = 2.0, 100.0, 6.0
_CHANGES_HPA = 3.0
_PLATEAU_SHARE, _MOST_FEEDS, _APART = 0.02, 6, 0.8
"""Speeds that a log holds: the least share of its readings at each, how many, and how far apart."""
_MOVES = 60
_ROUNDING = 1e-9
_MANY_TURNS = 10
"""Reversals in a run from which on a log goes by short strokes."""


class Suggested(NamedTuple):
    """A plan, or why there is none."""

    plan: ExperimentPlan | None
    reason: str = ""


def suggested_plan(diagnosis: Diagnosis) -> Suggested:
    """Return the plan of the experiment that a diagnosis suggests.

    Returns
    -------
    Suggested
        The plan, or why none can be written: the experiment is no change of a plan (a second instrument), the
        measurement has no places, or the plan would be too large.
    """
    asks = diagnosis.experiment.asks
    if not asks:
        return Suggested(None, f"the experiment is no change of the measuring plan: {diagnosis.experiment.text}")
    try:
        measured = measured_plan(diagnosis.dataset)
        if measured is None:
            return Suggested(None, "the measurement has no targets in mm or degrees, or way in motion, for a plan")
        return Suggested(changed(measured, asks, diagnosis.dataset))
    except ArgumentError as error:
        return Suggested(None, f"the experiment does not fit into one plan: {error}")


def measured_plan(dataset: Dataset) -> ExperimentPlan | None:
    """Return what a measurement was made by, as far as it shows; None where it has no places to measure again.

    Raises
    ------
    ArgumentError
        A measurement beyond the limits of an `ExperimentPlan`.
    """
    c = dataset.coordinates
    if c.position_unit not in ("mm", "deg") or c.places.size < 2 or dataset.coordinate == "velocity":
        return None
    of_drive = dataset.observable is Observable.DRIVE
    if of_drive and not c.moving:  # forces that hold positions, or a table of speeds
        return None
    reading = Reading.DRIVE if of_drive else Reading.MOVING if c.moving else Reading.AT_REST
    start, end = _ends(dataset.conditions)
    runs = int(np.unique(c.run).size)
    passes = Passes.BOTH if c.both_directions else Passes.FORWARD
    plan = ExperimentPlan(
        reading=reading,
        rotary=c.position_unit == "deg",
        start_mm=start,
        span_mm=end - start,
        passes=passes,
        heating=_heating(c, runs),
        weather=_weather(c),
        columns=_columns(dataset, reading),
        runs=1,
        feeds_mm_s=(_rounded(min(_FEED, (end - start) / _FEED_SPANS_S)),),
    )
    if reading is Reading.AT_REST:
        return _at_rest(plan, c, runs)
    turns = _turns(c) / runs
    return replace(
        plan,
        runs=1 if passes is Passes.FORWARD else runs,
        strokes=Strokes.SHORT if turns >= _MANY_TURNS else Strokes.FULL,
        targets=max(round(turns), 2),
        feeds_mm_s=_plateaus(c) or plan.feeds_mm_s,
    )


def _at_rest(plan: ExperimentPlan, c: Conditions, runs: int) -> ExperimentPlan:
    ways = 2 if plan.passes is Passes.BOTH else 1
    targets = max(round(c.rows / (runs * ways)), 2)
    feeds = plan.feeds_mm_s
    if c.velocity is not None and np.abs(c.velocity).max() > 0.0:
        distinct = {_rounded(speed) for speed in np.abs(c.velocity).tolist() if speed > 0.0}
        feeds = tuple(sorted(distinct, reverse=True)[:MOST_IN_TURN])
    dwell = _USUAL_DWELL_S
    if c.time_s is not None and c.rows > 1:
        dwell = float(np.median(np.diff(c.time_s))) - c.span / targets / max(feeds)
    dwell = float(np.round(np.clip(dwell, _SHORTEST_DWELL_S, _LONGEST_DWELL_S), 1))
    overshoot = _rounded(min(plan.overshoot_mm, plan.span_mm / 10.0))
    return replace(
        plan,
        runs=min(runs, _MOST_RUNS),
        targets=targets,
        feeds_mm_s=feeds,
        dwell_s=dwell,
        overshoot_mm=overshoot,
    )


def changed(plan: ExperimentPlan, asks: frozenset[Ask], dataset: Dataset) -> ExperimentPlan:
    """Return a plan with everything that an experiment asks.

    Raises
    ------
    ArgumentError
        The plan would be too large or too long.
    """
    for change in (_directions, _targets, _speeds, _surroundings, _runs, _length):
        plan = change(plan, asks, dataset)
    return plan


def _directions(plan: ExperimentPlan, asks: frozenset[Ask], dataset: Dataset) -> ExperimentPlan:
    if Ask.IN_MOTION in asks and plan.reading is Reading.AT_REST:
        columns = _with(tuple(name for name in plan.columns if name not in ("direction", "dwell", "feed")), "time")
        plan = replace(
            plan, reading=Reading.MOVING, strokes=Strokes.SHORT, targets=_MOVES, columns=_with(columns, "velocity")
        )
    again = plan.in_motion and Ask.FIVE_RUNS in asks
    if (Ask.BOTH_DIRECTIONS in asks or again) and plan.passes is Passes.FORWARD:
        strokes = Strokes.FULL if plan.in_motion else plan.strokes
        plan = replace(plan, passes=Passes.BOTH, strokes=strokes)
    if Ask.BOTH_DIRECTIONS in asks and not plan.in_motion:
        plan = replace(plan, columns=_with(plan.columns, "direction"))
    if Ask.WHOLE_TURN in asks and plan.rotary:
        plan = replace(plan, span_mm=max(TURN_DEG, plan.span_mm), strokes=Strokes.FULL)
    return plan


def _targets(plan: ExperimentPlan, asks: frozenset[Ask], dataset: Dataset) -> ExperimentPlan:
    if Ask.AFTER_REVERSALS in asks:
        plan = replace(plan, spacing=Spacing.DENSE_AT_ENDS, targets=max(plan.targets, _DENSE_TARGETS))
    if Ask.MORE_TARGETS in asks:
        plan = replace(plan, targets=2 * plan.targets)
    if Ask.SHIFTED_TARGETS in asks and (step := other_step(dataset.coordinates)) is not None:
        steps = math.floor(plan.span_mm / step)
        plan = replace(plan, targets=steps + 1, span_mm=steps * step)
    elif Ask.SHIFTED_TARGETS in asks and (once := target_shift(dataset.coordinates)) is not None:
        once = float(f"{once:.4g}")
        apart = plan.span_mm / max(plan.targets - 1, 1)
        steps = max(math.floor((plan.span_mm - 2.0 * once) / apart + _ROUNDING), 1)
        plan = replace(plan, shifts_mm=(0.0, once, 2.0 * once), targets=steps + 1, span_mm=steps * apart)
    c = dataset.coordinates
    stated = [period for period in (c.screw_pitch, c.signal_period, c.revolution) if period is not None]
    if Ask.FINE_STEPS in asks and stated:
        span = min(_FINE_PERIODS * max(stated), plan.span_mm)
        steps = math.ceil(_STEPS_A_PERIOD * span / min(stated))
        plan = replace(plan, span_mm=span, targets=min(steps + 1, _MOST_FINE))
    return plan


def _speeds(plan: ExperimentPlan, asks: frozenset[Ask], dataset: Dataset) -> ExperimentPlan:
    if asks.isdisjoint((Ask.SPEEDS, Ask.CREEP)):
        return plan
    top = max(plan.feeds_mm_s)
    feeds = plan.feeds_mm_s
    shares = LOG_SPEED_SHARES if plan.in_motion else SPEED_SHARES
    if len(feeds) < len(shares) or min(feeds) > shares[-1] * top:
        feeds = tuple(_rounded(share * top) for share in shares)
    if Ask.CREEP in asks and min(feeds) > CREEP_SHARE * top:
        feeds = (*feeds, _rounded(CREEP_SHARE * top))
    column = "velocity" if plan.in_motion else "feed"
    return replace(plan, feeds_mm_s=feeds, columns=_with(plan.columns, column))


def _surroundings(plan: ExperimentPlan, asks: frozenset[Ask], dataset: Dataset) -> ExperimentPlan:
    if Ask.COLD_AND_HOT in asks:
        columns = _with(plan.columns, "time", "temperature")
        plan = replace(plan, heating=Heating.COLD_AND_HOT, columns=columns, runs=max(plan.runs, _EVEN))
    if Ask.OTHER_DAYS in asks:
        columns = _with(plan.columns, "pressure", "humidity")
        plan = replace(plan, weather=Weather.DAYS, columns=columns, runs=max(plan.runs, _DAYS))
    if Ask.LOADS in asks:
        loads = plan.loads_kg if len(plan.loads_kg) > 1 else LOADS_KG
        plan = replace(plan, loads_kg=loads, columns=_with(plan.columns, "load"), runs=max(plan.runs, len(loads)))
    if Ask.TEMPERATURES in asks:
        plan = replace(plan, columns=_with(plan.columns, "time", "temperature"))
    if Ask.ZERO_KEPT in asks:
        plan = replace(plan, zero=Zero.KEPT)
    return plan


def _runs(plan: ExperimentPlan, asks: frozenset[Ask], dataset: Dataset) -> ExperimentPlan:
    fewest = _FIVE if Ask.FIVE_RUNS in asks else plan.runs
    if Ask.MORE_RUNS in asks:
        fewest = min(4 * plan.runs, _MOST_RUNS)
    if Ask.ZERO_KEPT in asks:
        fewest += 1  # a run that keeps its zero shows no other one
    # what takes turns from run to run comes twice, so that it is repeated
    in_turn = max(len(plan.shifts_mm), 1 if plan.in_motion else len(plan.feeds_mm_s))
    fewest = max(fewest, 2 * in_turn if in_turn > 1 else 1)
    if plan.in_motion and plan.passes is Passes.BOTH and Ask.MORE_RUNS not in asks:
        fewest = max(min(fewest, plan.runs), 2)  # a log passes its places many times in each run
    return replace(plan, runs=max(plan.runs, fewest))


def _length(plan: ExperimentPlan, asks: frozenset[Ask], dataset: Dataset) -> ExperimentPlan:
    lacking_s = THREE_HOURS_S - plan.duration_s
    if Ask.THREE_HOURS not in asks or plan.in_motion or lacking_s <= 0.0:
        return plan
    dwell = min(plan.dwell_s + lacking_s / plan.readings, _LONGEST_DWELL_S)
    plan = replace(plan, dwell_s=math.ceil(dwell), columns=_with(plan.columns, "time"))
    again = math.ceil(THREE_HOURS_S * plan.runs / plan.duration_s)
    return replace(plan, runs=min(max(plan.runs, again), _MOST_RUNS))


def _with(columns: tuple[str, ...], *names: str) -> tuple[str, ...]:
    return tuple(dict.fromkeys((*columns, *names)))


def _rounded(value: float) -> float:
    """Return a value with two digits, as people set it."""
    return float(f"{value:.2g}")


def _ends(c: Conditions) -> tuple[float, float]:
    """Return the ends of the places in round numbers of a hundredth of the span; targets within what was measured."""
    step = 10.0 ** math.floor(math.log10(c.span / 100.0))
    low, high = c.places[0] / step, c.places[-1] / step
    first, last = (round(low), round(high)) if c.moving else (math.ceil(low - 1e-6), math.floor(high + 1e-6))
    return float(f"{first * step:.9g}"), float(f"{last * step:.9g}")


def _plateaus(c: Conditions) -> tuple[float, ...]:
    """Return the speeds that a log holds, the fastest first; none where it has no velocity."""
    if c.velocity is None:
        return ()
    speeds = np.abs(c.velocity)
    rounded = [_rounded(speed) for speed in speeds.tolist()]
    values, counts = np.unique(rounded, return_counts=True)
    held = values[(counts >= _PLATEAU_SHARE * speeds.size) & (values > 0.0)]
    if held.size == 0:
        held = np.array([_rounded(float(np.quantile(speeds, 0.95)))])
    found: list[float] = []
    for speed in sorted((float(speed) for speed in held if speed > 0.0), reverse=True):
        if not found or speed < _APART * found[-1]:
            found.append(speed)
    return tuple(found[:_MOST_FEEDS])


def _turns(c: Conditions) -> int:
    if c.direction is None:
        return 0
    ways = c.direction[c.direction != 0.0]
    return int((np.diff(ways) != 0.0).sum())


def _heating(c: Conditions, runs: int) -> Heating:
    changes = any(float(np.ptp(heat)) > CHANGES_DEGC for heat in c.temperatures.values())
    if not changes:
        return Heating.NONE
    return Heating.COLD_AND_HOT if runs > 1 else Heating.ONE_RISE


def _weather(c: Conditions) -> Weather:
    if c.pressure_hpa is None:
        return Weather.STEADY
    return Weather.DAYS if float(np.ptp(c.pressure_hpa)) > _CHANGES_HPA else Weather.ONE_DAY


def _columns(dataset: Dataset, reading: Reading) -> tuple[str, ...]:
    c = dataset.coordinates
    at_rest = reading is Reading.AT_REST
    have = {
        "direction": at_rest and c.direction is not None,
        "time": c.time_s is not None,
        "feed": at_rest and c.velocity is not None,
        "velocity": not at_rest,
        "dwell": any(name.partition("_")[0] == "dwell" for name, _ in dataset.unknown),
        "temperature": bool(c.temperatures),
        "pressure": c.pressure_hpa is not None,
        "humidity": c.humidity_percent is not None,
        "load": c.load is not None,
        dataset.observe: reading is Reading.DRIVE,
    }
    return tuple(name for name, recorded in have.items() if recorded)
