"""Hiding effects in a measuring program: the axis stands at each target, and the laser reads it there."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from rtec.blind.axis_run import COUNT_MM, Pass, measure
from rtec.blind.draws import Draw, stream
from rtec.blind.hidden import Hidden, Parameter, hidden_of, rms
from rtec.blind.noise import Readings, noise_of, resolved
from rtec.blind.outside import KINDS
from rtec.blind.plan import Course, Floats, draw_course
from rtec.blind.scenario import Scenario
from rtec.blind.slow_errors import SLOW, Air, Circumstances, sensed_temperature, simulate_air, simulate_temperature
from rtec.blind.static_errors import table_of
from rtec.blind.strength import hide_static
from rtec.metrology import Column


def measure_at_rest(scenario: Scenario, seed: int) -> tuple[list[Column], dict[str, Floats], dict[str, Hidden]]:
    """Measure the axis at rest with what a scenario hides.

    Returns
    -------
    list of Column
        Everything that was read, in order of the readings.
    dict
        Columns that no known quantity names.
    dict
        What was hidden, by name.

    Notes
    -----
    The closed loop runs once, with the sum of the static errors between its encoder and the laser, and lost counts as
    what they do to a controller. What is slow is added to its readings afterwards, and so is the noise: neither
    reaches the encoder, so the loop would do the same with them.

    Examples
    --------
    >>> from rtec.blind.plan import PLANS
    >>> columns, _, hidden = measure_at_rest(Scenario(names=("drift",), plan=PLANS["turned_once"]), 1)
    >>> [column.quantity for column in columns][3:], list(hidden)
    (['target', 'actual', 'feed', 'temperature', 'pressure', 'humidity'], ['drift'])
    """
    plan = scenario.plan
    course = draw_course(plan, stream(seed, Draw.COURSE))
    sigma_mm = plan.sigma_um * 1e-3
    hidden: dict[str, Hidden] = {}
    static = hide_static(scenario, seed, course.target_mm, course.direction.astype(np.float64), hidden)
    shift_mm = np.zeros(course.target_mm.size)
    if "lost_counts" in scenario.wanted:
        shift_mm = _lose_counts(
            course, scenario.wanted["lost_counts"], stream(seed, Draw.EFFECT, "lost_counts"), hidden
        )
    measured = measure(
        course,
        table_of(plan, static),
        shift_mm=shift_mm,
        trace=not {"windup", "reversal_spike"}.isdisjoint(scenario.names),
    )
    heat = simulate_temperature(course, measured.time_s, stream(seed, Draw.HEAT))
    air = simulate_air(course, stream(seed, Draw.WEATHER))
    circumstances = Circumstances(course=course, measured=measured, temperature_degc=heat, air=air)
    deviation_mm = measured.deviation_mm + _slow(scenario.wanted, seed, circumstances, sigma_mm, hidden)
    readings = Readings(
        time_s=measured.time_s, position_mm=course.target_mm, direction=circumstances.direction, run=course.run
    )
    deviation_mm += noise_of(scenario.noise, readings, sigma_mm, stream(seed, Draw.NOISE))
    shown_degc = sensed_temperature(heat, stream(seed, Draw.SENSOR))
    return _columns(course, measured, deviation_mm, shown_degc, air), {"dwell_s": course.turn_dwell_s}, hidden


def _slow(
    wanted: Mapping[str, float], seed: int, circumstances: Circumstances, sigma_mm: float, hidden: dict[str, Hidden]
) -> Floats:
    """Return the sum of the slow errors at each reading, and write down what they are."""
    total_mm = np.zeros(circumstances.course.target_mm.size)
    for name in (name for name in wanted if name in SLOW or name in KINDS):
        draw = SLOW[name] if name in SLOW else KINDS[name].draw
        slow = draw(circumstances, stream(seed, Draw.EFFECT, name))
        factor = wanted[name] * sigma_mm / rms(slow.added_mm)
        total_mm += factor * slow.added_mm
        hidden[name] = hidden_of(name, slow.description, slow.parameters, factor, slow.added_mm, sigma_mm)
    return total_mm


def _lose_counts(
    course: Course, strength_sigma: float, rng: np.random.Generator, hidden: dict[str, Hidden]
) -> Floats:
    """Return by how much the controller is misled at each reading, and write down what was lost.

    With one run the counts go lost as the axis turns, where nothing tells them from play.
    """
    n = course.target_mm.size
    sigma_mm = course.plan.sigma_um * 1e-3
    first = n // 2 if course.plan.runs == 1 else int(rng.integers(n // 4, 3 * n // 4))
    share = 1.0 - first / n
    counts = max(round(strength_sigma * sigma_mm / COUNT_MM / np.sqrt(share * (1.0 - share))), 1)
    counts *= int(rng.choice([-1, 1]))
    shift_mm = np.where(np.arange(n) >= first, counts * COUNT_MM, 0.0)
    hidden["lost_counts"] = Hidden(
        name="lost_counts",
        description="the controller loses counts once, and takes the axis to a place so much further on",
        parameters=(Parameter("counts", float(counts), "count"), Parameter("before_reading", float(first + 1), "")),
        rms_sigma=rms(shift_mm) / sigma_mm,
    )
    return shift_mm


def _columns(course: Course, measured: Pass, deviation_mm: Floats, shown_degc: Floats, air: Air) -> list[Column]:
    return [
        Column("run", "", course.run.astype(np.float64)),
        Column("direction", "", course.direction.astype(np.float64)),
        Column("time", "s", measured.time_s),
        Column("target", "mm", course.target_mm),
        Column("actual", "mm", resolved(course.target_mm + deviation_mm)),
        Column("feed", "mm_s", course.feed_mm_s),
        Column("temperature", "degc", shown_degc),
        Column("pressure", "hpa", np.round(air.pressure_hpa, 1)),
        Column("humidity", "percent", np.round(air.humidity_percent, 0)),
    ]
