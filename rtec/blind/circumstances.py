"""What the emulated axis meets while it is measured at rest: its temperature, the air, and what a sensor shows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rtec.blind.axis_run import Pass
from rtec.blind.plan import Course, Floats, Plan
from rtec.heat.course import HeatCourse
from rtec.metrology import Heating, Weather
from rtec.predictors.warm.features import follow

REFERENCE_DEGC = 20.0
_AXIS = "axis"
SENSOR_SIGMA_DEGC, SENSOR_STEP_DEGC = 0.02, 0.01
USUAL_HPA, USUAL_PERCENT = 1013.25, 50.0
"""Air for which the laser assumes its wavelength, with the reference temperature."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Air:
    """The air around the laser at each reading, shape (n,); it has the reference temperature."""

    pressure_hpa: Floats
    humidity_percent: Floats

    @property
    def index_change(self) -> Floats:
        """By how much its refractive index differs from what the laser assumes, shape (n,).

        References
        ----------
        J. A. Stone and J. H. Zimmerman, Index of refraction of air, NIST Engineering Metrology Toolbox, appendix B:
        a formula for the shop floor.
        """

        def index(hpa: Floats, percent: Floats) -> Floats:
            degc = REFERENCE_DEGC
            return 7.86e-4 * hpa / 10.0 / (273.0 + degc) - 1.5e-11 * percent * (degc**2 + 160.0)

        return index(self.pressure_hpa, self.humidity_percent) - index(*np.array([[USUAL_HPA], [USUAL_PERCENT]]))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Circumstances:
    """What slow errors depend on: course, what was measured, heat and air at each reading."""

    course: Course
    measured: Pass
    heat: HeatCourse
    """Of this measurement: the true temperature of the axis at each reading."""
    air: Air
    """Of this measurement."""
    first: Circumstances | None = None
    """Of the axis's first measurement, by which its errors were drawn; None in that measurement itself."""

    @property
    def origin(self) -> Circumstances:
        """Those of the first measurement."""
        return self if self.first is None else self.first

    @property
    def temperature_degc(self) -> Floats:
        """Return the true temperature of the axis at each reading, shape (n,)."""
        return np.asarray(self.heat.thermometers[_AXIS])

    @property
    def plan(self) -> Plan:
        """Plan of the first measurement, by which the numbers of the axis's errors are drawn."""
        return self.origin.course.plan

    @property
    def length_s(self) -> float:
        """How long the first measurement took, likewise."""
        return float(self.origin.measured.time_s[-1])

    def by_run(self, values: Floats) -> Floats:
        """Return at each reading what is drawn for its run; with more runs than values, they begin anew."""
        return values[(self.course.run - 1) % values.size]

    @property
    def direction(self) -> Floats:
        """Of each reading, as floats."""
        return self.course.direction.astype(np.float64)


def simulate_heat(course: Course, time_s: Floats, rng: np.random.Generator) -> HeatCourse:
    """Return the true temperature of the axis, its thermometer without faults, at each reading.

    A body with one time constant, in a room, with a heater that the plan switches.

    Examples
    --------
    >>> from rtec.blind.plan import PLANS, draw_course
    >>> rng = np.random.default_rng(0)
    >>> course = draw_course(PLANS["one_heating"], rng)
    >>> heat = simulate_heat(course, np.arange(21) * 10.0, rng)
    >>> heat.at("axis", 0.0) < heat.at("axis", 100.0) < heat.at("axis", 200.0)
    True
    """
    return HeatCourse(time_s=time_s, thermometers={_AXIS: _temperature(course, time_s, rng)})


def _temperature(course: Course, time_s: Floats, rng: np.random.Generator) -> Floats:
    room = REFERENCE_DEGC + rng.uniform(-0.5, 0.5)
    if course.plan.heating is Heating.NONE:
        return np.full(time_s.size, room)
    rise, span_s = rng.uniform(7.0, 11.0), float(time_s[-1])
    if course.plan.heating is Heating.ONE_RISE:
        return room + rise * approached(time_s, span_s * rng.uniform(2.0, 4.0))
    runs = int(course.run[-1])
    hot = np.arange(runs) % 2 == rng.integers(2)
    ends = np.array([time_s[course.run == run][-1] for run in range(1, runs + 1)])
    tau_s = rng.uniform(0.4, 0.8) * span_s / runs
    heated = np.where(hot, rise, 0.0)[np.minimum(np.searchsorted(ends, time_s, side="right"), runs - 1)]
    before = [0.0 if hot[0] else 0.7 * rise, rise if hot[0] else 0.0]  # at time 0 as it is, and heated from then on
    warmer = follow(np.concatenate([[0.0, 0.0], time_s]), np.concatenate([before, heated]), tau_s, held=True)
    return np.asarray(room + warmer[2:])


def approached(time_s: Floats, tau_s: float) -> Floats:
    """Return how far a body with one time constant is on its way at each time, from 0 to 1."""
    return np.asarray(-np.expm1(-time_s / tau_s))


def simulate_air(course: Course, rng: np.random.Generator) -> Air:
    """Return the air at each reading: in pressure and humidity another on each day, with a trend within it.

    Examples
    --------
    >>> from rtec.blind.plan import PLANS, draw_course
    >>> rng = np.random.default_rng(0)
    >>> air = simulate_air(draw_course(PLANS["weather"], rng), rng)
    >>> bool(np.ptp(air.pressure_hpa) > 10.0)
    True
    """
    runs, weather = course.plan.runs, course.plan.weather
    days = np.linspace(-25.0, 12.0, max(runs, 2)) if weather is Weather.DAYS else np.full(runs, -18.0)
    trend = 0.0 if weather is Weather.STEADY else rng.uniform(0.5, 1.0)
    days = rng.permutation(days + rng.uniform(-2.0, 2.0, days.size)) * (weather is not Weather.STEADY)
    humid = rng.uniform(-15.0, 15.0, days.size) * (weather is Weather.DAYS)
    along = np.linspace(0.0, trend, course.run.size)
    return Air(
        pressure_hpa=USUAL_HPA + days[course.run - 1] + along,
        humidity_percent=USUAL_PERCENT + humid[course.run - 1],
    )


def sensed_temperature(true_degc: Floats, rng: np.random.Generator) -> Floats:
    """Return what a sensor shows: with its noise, in steps of its resolution.

    Examples
    --------
    >>> sensed_temperature(np.array([21.0]), np.random.default_rng(0)).round(2).tolist()
    [21.0]
    """
    noisy = true_degc + rng.normal(0.0, SENSOR_SIGMA_DEGC, true_degc.size)
    return np.round(np.round(noisy / SENSOR_STEP_DEGC) * SENSOR_STEP_DEGC, 2)
