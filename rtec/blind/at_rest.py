"""Hiding effects in a measuring program: the axis stands at each target, and the laser reads it there."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import NamedTuple

import numpy as np

from rtec.blind.axis_run import COUNT_MM, Pass, measure
from rtec.blind.circumstances import Air, Circumstances, sensed_temperature, simulate_air, simulate_heat
from rtec.blind.draws import Draw, Occasion, stream
from rtec.blind.hidden import Hidden, Parameter, Recorded, hidden_of, rms
from rtec.blind.noise import Readings, noise_of, resolved
from rtec.blind.outside import KINDS
from rtec.blind.own_errors import draw_own
from rtec.blind.plan import Course, Floats, Plan, draw_course
from rtec.blind.scenario import Scenario
from rtec.blind.slow_errors import DRAWN_ANEW, SLOW, SlowError
from rtec.blind.static_errors import table_of
from rtec.blind.strength import hidden_static, static_errors
from rtec.effects.own import FunctionEffect
from rtec.metrology import Column
from rtec.predictors import Predictor

_REMEMBERS = frozenset(("windup", "reversal_spike"))
"""What goes along with the path of the encoder."""


def measure_at_rest(scenario: Scenario, seed: int, plan: Plan, number: int) -> Recorded:
    """Measure the axis at rest with what a scenario hides.

    Parameters
    ----------
    scenario, seed
        What is hidden in the axis; how strong, the plan of the scenario decides.
    plan, number
        What is measured, and the number of the measurement: that of the scenario, and 0, where it is the first.

    Notes
    -----
    The closed loop runs once, with the sum of the static errors between its encoder and the laser, and lost counts as
    what they do to a controller. What is slow is added to its readings afterwards, and so is the noise: neither
    reaches the encoder, so the loop would do the same with them. For a further measurement the first one is run as
    well: its readings decide how strong everything is.

    Examples
    --------
    >>> from rtec.blind.plan import PLANS
    >>> scenario = Scenario(names=("drift",), plan=PLANS["turned_once"])
    >>> record = measure_at_rest(scenario, 1, scenario.plan, 0)
    >>> [column.quantity for column in record.columns][3:], list(record.hidden)
    (['target', 'actual', 'feed', 'temperature', 'pressure', 'humidity'], ['drift'])
    """
    occasion = Occasion(seed=seed, number=number)
    course = first_course = draw_course(scenario.plan, stream(seed, Draw.COURSE))
    static = static_errors(scenario, seed, course.target_mm, course.direction.astype(np.float64))
    table = table_of(scenario.plan, list(static.values()))
    lost = _lost_counts(first_course, scenario, seed)
    c = first = _carried_out(first_course, table, lost, Occasion(seed=seed), scenario)
    if number:
        course = draw_course(plan, occasion.stream(Draw.COURSE))
        c = _carried_out(course, table, lost, occasion, scenario, first)
    sigma_mm = scenario.plan.sigma_um * 1e-3
    hidden = hidden_static(scenario, static, course.target_mm, c.direction)
    if lost is not None:
        hidden["lost_counts"] = _hidden_counts(lost, course.target_mm.size, sigma_mm)
    deviation_mm = c.measured.deviation_mm + _slow(scenario, occasion, c, sigma_mm, hidden)
    readings = Readings(time_s=c.measured.time_s, position_mm=course.target_mm, direction=c.direction, run=course.run)
    deviation_mm += noise_of(scenario.noise, readings, sigma_mm, occasion.stream(Draw.NOISE))
    shown_degc = sensed_temperature(c.temperature_degc, occasion.stream(Draw.SENSOR))
    columns = _columns(course, c.measured, deviation_mm, shown_degc, c.air)
    return Recorded(columns=columns, unknown={"dwell_s": course.turn_dwell_s}, hidden=hidden)


class _Lost(NamedTuple):
    """Counts that go lost once, and after which share of the readings."""

    counts: int
    share: float

    def first(self, readings: int) -> int:
        """Return the first reading, from 0, after they went lost."""
        return round(self.share * readings)

    def shift_mm(self, readings: int) -> Floats:
        """Return by how much the controller is misled at each reading."""
        return np.where(np.arange(readings) >= self.first(readings), self.counts * COUNT_MM, 0.0)


def _carried_out(
    course: Course,
    table: Predictor,
    lost: _Lost | None,
    occasion: Occasion,
    scenario: Scenario,
    first: Circumstances | None = None,
) -> Circumstances:
    measured = measure(
        course,
        table,
        shift_mm=None if lost is None else lost.shift_mm(course.target_mm.size),
        trace=not _REMEMBERS.isdisjoint(scenario.names),
    )
    return Circumstances(
        course=course,
        measured=measured,
        heat=simulate_heat(course, measured.time_s, occasion.stream(Draw.HEAT)),
        air=simulate_air(course, occasion.stream(Draw.WEATHER)),
        first=first,
    )


def _slow(
    scenario: Scenario, occasion: Occasion, c: Circumstances, sigma_mm: float, hidden: dict[str, Hidden]
) -> Floats:
    """Return the sum of the slow errors at each reading, and write down what they are."""
    total_mm, draws = np.zeros(c.course.target_mm.size), _draws_of(scenario)
    for name in (name for name in scenario.names if name in draws):
        slow = first = draws[name](c.origin, stream(occasion.seed, Draw.EFFECT, name))
        if c.first is not None:
            anew = name in DRAWN_ANEW
            rng = occasion.stream(Draw.EFFECT, name) if anew else stream(occasion.seed, Draw.EFFECT, name)
            slow = draws[name](c, rng)
        factor = scenario.wanted[name] * sigma_mm / rms(first.added_mm)
        total_mm += factor * slow.added_mm
        hidden[name] = hidden_of(name, slow.description, slow.parameters, factor, rms(slow.added_mm), sigma_mm)
    return total_mm


def _draws_of(scenario: Scenario) -> Mapping[str, Callable[[Circumstances, np.random.Generator], SlowError]]:
    """Return what draws each slow error, by name: of the game, and of the player's own."""
    own = {effect.name: partial(draw_own, effect) for effect in scenario.own if isinstance(effect, FunctionEffect)}
    return {**{name: kind.draw for name, kind in KINDS.items()}, **SLOW, **own}


def _lost_counts(course: Course, scenario: Scenario, seed: int) -> _Lost | None:
    """Draw how many counts go lost and when; with one run as the axis turns, where nothing tells them from play."""
    if "lost_counts" not in scenario.wanted:
        return None
    rng = stream(seed, Draw.EFFECT, "lost_counts")
    n, plan = course.target_mm.size, course.plan
    if plan.lost_share is not None:
        first = round(plan.lost_share * n)
    else:
        first = n // 2 if plan.runs == 1 else int(rng.integers(n // 4, 3 * n // 4))
    share = 1.0 - first / n
    wanted_mm = scenario.wanted["lost_counts"] * plan.sigma_um * 1e-3
    counts = max(round(wanted_mm / COUNT_MM / np.sqrt(share * (1.0 - share))), 1)
    return _Lost(counts * int(rng.choice([-1, 1])), first / n)


def _hidden_counts(lost: _Lost, readings: int, sigma_mm: float) -> Hidden:
    before = float(lost.first(readings) + 1)
    return Hidden(
        name="lost_counts",
        description="the controller loses counts once, and takes the axis to a place so much further on",
        parameters=(Parameter("counts", float(lost.counts), "count"), Parameter("before_reading", before, "")),
        rms_sigma=rms(lost.shift_mm(readings)) / sigma_mm,
    )


def _columns(course: Course, measured: Pass, deviation_mm: Floats, shown_degc: Floats, air: Air) -> list[Column]:
    length = "deg" if course.plan.rotary else "mm"
    return [
        Column("run", "", course.run.astype(np.float64)),
        Column("direction", "", course.direction.astype(np.float64)),
        Column("time", "s", measured.time_s),
        Column("target", length, course.target_mm),
        Column("actual", length, resolved(course.target_mm + deviation_mm)),
        Column("feed", f"{length}_s", course.feed_mm_s),
        Column("temperature", "degc", shown_degc),
        Column("pressure", "hpa", np.round(air.pressure_hpa, 1)),
        Column("humidity", "percent", np.round(air.humidity_percent, 0)),
    ]
