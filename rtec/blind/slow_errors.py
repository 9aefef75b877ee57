"""Errors of the emulated axis that change in time, with temperature or with the way gone.

They lie between encoder and laser like the static ones, but outside the closed loop, which does not feel them: each
is computed from the times at which the laser read, from the path that the encoder took, or from a simulated
temperature, and added to the readings. Over the two seconds of one reading the fastest of them changes by less than a
tenth of the noise.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from rtec.blind.axis_run import Pass
from rtec.blind.hidden import Parameter
from rtec.blind.plan import Course, Floats, Heating, Weather

REFERENCE_DEGC = 20.0
SENSOR_SIGMA_DEGC, SENSOR_STEP_DEGC = 0.02, 0.01
USUAL_HPA, USUAL_PERCENT = 1013.25, 50.0
"""Air for which the laser assumes its wavelength, with the reference temperature."""
RELEASE_MM = 0.02
"""Turning round by this much takes the load off the screw."""
_STEP_S = 1.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SlowError:
    """An error at unit strength at each reading.

    Parameters
    ----------
    added_mm
        What it adds, shape (n,), in mm.
    description
        What it does physically.
    parameters
        Its numbers at unit strength.
    """

    added_mm: Floats
    description: str
    parameters: tuple[Parameter, ...]


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
            found: Floats = 7.86e-4 * hpa / 10.0 / (273.0 + degc) - 1.5e-11 * percent * (degc**2 + 160.0)
            return found

        return index(self.pressure_hpa, self.humidity_percent) - index(*np.array([[USUAL_HPA], [USUAL_PERCENT]]))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Circumstances:
    """What slow errors depend on: course, what was measured, true temperature and air at each reading."""

    course: Course
    measured: Pass
    temperature_degc: Floats
    air: Air

    @property
    def direction(self) -> Floats:
        """Of each reading, as floats."""
        return self.course.direction.astype(np.float64)


def drift(c: Circumstances, rng: np.random.Generator) -> SlowError:
    """Return a laser, or a mounting, that wanders at a constant rate."""
    sign = float(rng.choice([-1.0, 1.0]))
    return SlowError(
        added_mm=sign * 1e-3 * c.measured.time_s / 3600.0,
        description="laser or mounting drifts at a constant rate",
        parameters=(Parameter("rate", sign, "um/h", scales=True),),
    )


def warm_up(c: Circumstances, rng: np.random.Generator) -> SlowError:
    """Return a structure that friction heats from the start: heat in, heat lost in proportion to its excess."""
    span_s = float(np.ptp(c.measured.time_s))
    tau_s = rng.uniform(0.08, 0.22) * span_s
    sign = float(rng.choice([-1.0, 1.0]))
    excess = first_order(c.measured.time_s, tau_s, lambda _: 1.0, 0.0)
    return SlowError(
        added_mm=sign * 1e-3 * excess,
        description="the structure warms up from the start and grows, towards a steady state",
        parameters=(Parameter("time_constant", tau_s, "s"), Parameter("final", sign, "um", scales=True)),
    )


def first_order(time_s: Floats, tau_s: float, goal: Callable[[float], float], begin: float) -> Floats:
    """Integrate x' = (goal(t) - x) / tau by the midpoint rule in steps of a second; return x at the times.

    Examples
    --------
    >>> first_order(np.array([0.0, 100.0]), 50.0, lambda t: 1.0, 0.0).round(4).tolist()
    [0.0, 0.8646]
    """
    steps = int(np.ceil(time_s[-1] / _STEP_S)) + 2
    states = np.empty(steps)
    state = begin
    for k in range(steps):
        states[k] = state
        wanted = goal((k + 0.5) * _STEP_S)
        half = state + 0.5 * _STEP_S * (wanted - state) / tau_s
        state += _STEP_S * (wanted - half) / tau_s
    at: Floats = np.interp(time_s, np.arange(steps) * _STEP_S, states)
    return at


def simulate_temperature(course: Course, time_s: Floats, rng: np.random.Generator) -> Floats:
    """Return the true temperature of the axis at each reading, shape (n,), in degC.

    A body with one time constant, in a room, with a heater that the plan switches.

    Examples
    --------
    >>> from rtec.blind.plan import PLANS, draw_course
    >>> rng = np.random.default_rng(0)
    >>> course = draw_course(PLANS["one_heating"], rng)
    >>> heat = simulate_temperature(course, np.arange(21) * 10.0, rng)
    >>> bool((np.diff(heat) > 0).all())
    True
    """
    room = REFERENCE_DEGC + rng.uniform(-0.5, 0.5)
    if course.plan.heating is Heating.NONE:
        return np.full(time_s.size, room)
    rise, span_s = rng.uniform(7.0, 11.0), float(time_s[-1])
    if course.plan.heating is Heating.ONE_RISE:
        return first_order(time_s, span_s * rng.uniform(0.8, 1.5), lambda _: room + rise, room)
    runs = int(course.run[-1])
    hot = np.arange(runs) % 2 == rng.integers(2)
    ends = np.array([time_s[course.run == run][-1] for run in range(1, runs + 1)])
    power = np.where(hot, rise, 0.0)
    tau_s = rng.uniform(0.4, 0.8) * span_s / runs
    begin = room + (0.0 if hot[0] else 0.7 * rise)
    return first_order(
        time_s, tau_s, lambda t: room + float(power[min(int(np.searchsorted(ends, t)), runs - 1)]), begin
    )


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


def refraction(c: Circumstances, rng: np.random.Generator) -> SlowError:
    """Return a laser that counts waves of another length than it assumes, along the way it measures."""
    return SlowError(
        added_mm=c.course.target_mm * c.air.index_change,
        description="a laser without compensation counts its waves in another air",
        parameters=(Parameter("share", 1.0, "", scales=True),),
    )


def dead_path(c: Circumstances, rng: np.random.Generator) -> SlowError:
    """Return waves on a way that no motion passes: their number changes with the air."""
    return SlowError(
        added_mm=1.0 * c.air.index_change,
        description="the laser stands away from the zero of the axis: its waves on the way between change",
        parameters=(Parameter("length", 1.0, "mm", scales=True),),
    )


def warm_up_growth(c: Circumstances, rng: np.random.Generator) -> SlowError:
    """Return a screw that its own friction heats from the start and that grows away from its fixed end at 0 mm."""
    tau_s = rng.uniform(0.08, 0.22) * float(np.ptp(c.measured.time_s))
    excess = first_order(c.measured.time_s, tau_s, lambda _: 1.0, 0.0)
    return SlowError(
        added_mm=1e-6 * c.course.target_mm * excess,
        description="the screw warms up from the start and grows from its fixed end, towards a steady state",
        parameters=(Parameter("time_constant", tau_s, "s"), Parameter("growth", 1.0, "um/m", scales=True)),
    )


def sensed_temperature(true_degc: Floats, rng: np.random.Generator) -> Floats:
    """Return what a sensor shows: with its noise, in steps of its resolution.

    Examples
    --------
    >>> sensed_temperature(np.array([21.0]), np.random.default_rng(0)).round(2).tolist()
    [21.0]
    """
    noisy = true_degc + rng.normal(0.0, SENSOR_SIGMA_DEGC, true_degc.size)
    shown: Floats = np.round(np.round(noisy / SENSOR_STEP_DEGC) * SENSOR_STEP_DEGC, 2)
    return shown


def thermal_growth(c: Circumstances, rng: np.random.Generator) -> SlowError:
    """Return an axis that expands away from its fixed end at 0 mm, by its true temperature."""
    return SlowError(
        added_mm=1e-6 * c.course.target_mm * (c.temperature_degc - REFERENCE_DEGC),
        description="the axis expands from its fixed end at 0 mm",
        parameters=(Parameter("expansion", 1.0, "um/m/K", scales=True),),
    )


def thermal_shift(c: Circumstances, rng: np.random.Generator) -> SlowError:
    """Return a bracket between axis and laser that lengthens by its true temperature, whatever the position."""
    sign = float(rng.choice([-1.0, 1.0]))
    bracket_mm, coefficient = 100.0, 10e-6
    grown_mm = bracket_mm * coefficient * (c.temperature_degc - REFERENCE_DEGC)
    return SlowError(
        added_mm=sign * grown_mm,
        description="a bracket between axis and laser lengthens with its temperature",
        parameters=(Parameter("shift", sign, "um/K", scales=True),),
    )


def windup(c: Circumstances, rng: np.random.Generator) -> SlowError:
    """Return a screw that twists under the friction of the slide, more and more after each reversal.

    The twist approaches its final value over a distance, integrated along the path that the encoder took. Turning
    round releases it, or it is carried over and the screw twists back.
    """
    distance_mm = rng.uniform(0.06, 0.16) * c.course.plan.span_mm
    released = bool(rng.uniform() < 0.5)
    twist = _twist(c.measured.path_mm, distance_mm, released)
    at = np.searchsorted(c.measured.path_s, c.measured.time_s, side="right") - 1
    from_what = "from nothing" if released else "from the twist of the motion before"
    return SlowError(
        added_mm=-1e-3 * twist[at],
        description=f"the screw twists under friction: lost motion that builds up after each reversal, {from_what}",
        parameters=(Parameter("distance", distance_mm, "mm"), Parameter("final", 1.0, "um", scales=True)),
    )


def _twist(path_mm: Floats, distance_mm: float, released: bool) -> Floats:
    """Return the twist along a path, from -1 to 1: dz = (sign - z) |dx| / distance, released where the axis turns."""
    twist = np.zeros(path_mm.size)
    begin, last = 0, 0.0
    for end in [*_turning_points(path_mm), path_mm.size]:
        piece = path_mm[begin:end]
        sign = np.sign(piece[-1] - piece[0])
        first = 0.0 if released else last
        twist[begin:end] = sign + (first - sign) * np.exp(-np.abs(piece - piece[0]) / distance_mm)
        begin, last = end, float(twist[end - 1])
    return twist


def _turning_points(path_mm: Floats) -> list[int]:
    """Return the indices from which on a path goes the other way, by more than the release travel."""
    found: list[int] = []
    begin = 0
    while begin < path_mm.size:
        rest = path_mm[begin:] - path_mm[begin]
        away = np.flatnonzero(np.abs(rest) > RELEASE_MM)
        if away.size == 0:
            break
        way = np.sign(rest[away[0]])
        front = np.maximum.accumulate(way * rest)
        turned = np.flatnonzero(front - way * rest > RELEASE_MM)
        if turned.size == 0:
            break
        begin += int(np.argmax(way * rest[: turned[0]])) + 1
        found.append(begin)
    return found


def reversal_spike(c: Circumstances, rng: np.random.Generator) -> SlowError:
    """Return a slide that sticks as it turns round, and is set free over a distance along the path of the encoder."""
    distance_mm = rng.uniform(0.06, 0.16) * c.course.plan.span_mm
    path_mm = c.measured.path_mm
    stuck = np.zeros(path_mm.size)
    begin = 0
    for end in [*_turning_points(path_mm), path_mm.size]:
        piece = path_mm[begin:end]
        stuck[begin:end] = np.sign(piece[-1] - piece[0]) * np.exp(-np.abs(piece - piece[0]) / distance_mm)
        begin = end
    at = np.searchsorted(c.measured.path_s, c.measured.time_s, side="right") - 1
    return SlowError(
        added_mm=-0.5e-3 * stuck[at],
        description="the slide sticks as it turns round, and catches up over a distance",
        parameters=(Parameter("distance", distance_mm, "mm"), Parameter("spike", -1.0, "um", scales=True)),
    )


def run_offset(c: Circumstances, rng: np.random.Generator) -> SlowError:
    """Return a reflector that is clamped anew before each run."""
    runs = c.course.plan.runs
    places = rng.permutation(np.linspace(-1.0, 1.0, max(runs, 2)) + rng.uniform(-0.3, 0.3, max(runs, 2)))
    return SlowError(
        added_mm=1e-3 * places[c.course.run - 1],
        description="the reflector is clamped anew before each run",
        parameters=(Parameter("spread", float(np.ptp(places[:runs])), "um", scales=True),),
    )


def moving_bump(c: Circumstances, rng: np.random.Generator) -> SlowError:
    """Return a local error that moves along the axis from run to run, such as dirt pushed along."""
    plan = c.course.plan
    width_mm = rng.uniform(0.07, 0.12) * plan.span_mm
    share = (np.arange(plan.runs) + rng.uniform(0.2, 0.8, plan.runs)) / plan.runs
    places = plan.start_mm + (0.1 + 0.8 * share) * plan.span_mm
    if rng.uniform() < 0.5:
        places = places[::-1]
    sign = float(rng.choice([-1.0, 1.0]))
    off = (c.course.target_mm - places[c.course.run - 1]) / width_mm
    return SlowError(
        added_mm=sign * 1e-3 * np.exp(-0.5 * off**2),
        description="a local bump that moves along the axis from run to run",
        parameters=(
            Parameter("width", width_mm, "mm"),
            Parameter("from", float(places[0]), "mm"),
            Parameter("to", float(places[-1]), "mm"),
            Parameter("height", sign, "um", scales=True),
        ),
    )


def dwell_reversal(c: Circumstances, rng: np.random.Generator) -> SlowError:
    """Return lost motion that grows with the rest before the reversal, as a contact creeps."""
    tau_s = rng.uniform(8.0, 20.0)
    lost = 1.0 - np.exp(-c.course.turn_dwell_s / tau_s)
    return SlowError(
        added_mm=-0.5e-3 * c.direction * lost,
        description="lost motion at a reversal that grows with the rest before it",
        parameters=(Parameter("time_constant", tau_s, "s"), Parameter("largest", 1.0, "um", scales=True)),
    )


SLOW: Mapping[str, Callable[[Circumstances, np.random.Generator], SlowError]] = MappingProxyType(
    {
        draw.__name__: draw
        for draw in (
            drift, warm_up, warm_up_growth, thermal_growth, thermal_shift, refraction, dead_path, windup,
            reversal_spike, run_offset,
            moving_bump, dwell_reversal,
        )
    }
)  # fmt: skip
"""What draws each slow error, by name; the last two lie outside the library."""
