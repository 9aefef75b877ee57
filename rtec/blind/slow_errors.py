"""Errors of the emulated axis that change in time, with temperature or with the way gone.

They lie between encoder and laser like the static ones, but outside the closed loop, which does not feel them: each
is computed from the times at which the laser read, from the path that the encoder took, or from a simulated
temperature, and added to the readings. Over the two seconds of one reading the fastest of them changes by less than a
tenth of the noise.

The numbers of each are drawn by the plan of the axis's first measurement (`Circumstances.plan`); it acts on the
measurement at hand. So the axis keeps them under any other plan.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from rtec.blind.circumstances import REFERENCE_DEGC, Circumstances, approached
from rtec.blind.hidden import Parameter
from rtec.blind.plan import Floats
from rtec.metrology import Zero

RELEASE_MM = 0.02
"""Turning round by this much takes the load off the screw."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SlowError:
    """An error at unit strength at each reading."""

    added_mm: Floats
    """What it adds, shape (n,), in mm."""
    description: str
    """What it does physically."""
    parameters: tuple[Parameter, ...]
    """Its numbers at unit strength."""


def of_height(height: Floats, description: str, *more: Parameter) -> SlowError:
    """Return an error of so many µm at each reading, shape (n,), with its height as the number that scales."""
    first = Parameter("height", 1.0, "um", scales=True)
    return SlowError(added_mm=1e-3 * height, description=description, parameters=(first, *more))


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
    tau_s, excess = _excess(c, rng)
    sign = float(rng.choice([-1.0, 1.0]))
    return SlowError(
        added_mm=sign * 1e-3 * excess,
        description="the structure warms up from the start and grows, towards a steady state",
        parameters=(Parameter("time_constant", tau_s, "s"), Parameter("final", sign, "um", scales=True)),
    )


def warm_up_growth(c: Circumstances, rng: np.random.Generator) -> SlowError:
    """Return a screw that its own friction heats from the start and that grows away from its fixed end at 0 mm."""
    tau_s, excess = _excess(c, rng)
    return SlowError(
        added_mm=1e-6 * c.course.target_mm * excess,
        description="the screw warms up from the start and grows from its fixed end, towards a steady state",
        parameters=(Parameter("time_constant", tau_s, "s"), Parameter("growth", 1.0, "um/m", scales=True)),
    )


def _excess(c: Circumstances, rng: np.random.Generator) -> tuple[float, Floats]:
    """Return the time constant of a warm-up, and how far it is at each reading, from 0 to 1."""
    tau_s = rng.uniform(0.08, 0.22) * c.length_s
    return tau_s, approached(c.measured.time_s, tau_s)


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
    distance_mm = rng.uniform(0.06, 0.16) * c.plan.span_mm
    released = bool(rng.uniform() < 0.5)
    from_what = "from nothing" if released else "from the twist of the motion before"
    return SlowError(
        added_mm=-1e-3 * _when_read(c, _twist(c.measured.path_mm, distance_mm, released)),
        description=f"the screw twists under friction: lost motion that builds up after each reversal, {from_what}",
        parameters=(Parameter("distance", distance_mm, "mm"), Parameter("final", 1.0, "um", scales=True)),
    )


def reversal_spike(c: Circumstances, rng: np.random.Generator) -> SlowError:
    """Return a slide that sticks as it turns round, and is set free over a distance along the path of the encoder."""
    distance_mm = rng.uniform(0.06, 0.16) * c.plan.span_mm
    stuck = np.zeros(c.measured.path_mm.size)
    for at, way, gone_mm in _stretches(c.measured.path_mm):
        stuck[at] = way * np.exp(-gone_mm / distance_mm)
    return SlowError(
        added_mm=-0.5e-3 * _when_read(c, stuck),
        description="the slide sticks as it turns round, and catches up over a distance",
        parameters=(Parameter("distance", distance_mm, "mm"), Parameter("spike", -1.0, "um", scales=True)),
    )


def _when_read(c: Circumstances, along_path: Floats) -> Floats:
    """Return at each reading what goes along with the path of the encoder."""
    at = np.searchsorted(c.measured.path_s, c.measured.time_s, side="right") - 1
    return along_path[at]


def _twist(path_mm: Floats, distance_mm: float, released: bool) -> Floats:
    """Return the twist along a path, from -1 to 1: dz = (way - z) |dx| / distance, released where the axis turns."""
    twist = np.zeros(path_mm.size)
    last = 0.0
    for at, way, gone_mm in _stretches(path_mm):
        first = 0.0 if released else last
        twist[at] = way + (first - way) * np.exp(-gone_mm / distance_mm)
        last = float(twist[at][-1])
    return twist


def _stretches(path_mm: Floats) -> Iterator[tuple[slice, float, Floats]]:
    """Yield each stretch of a path between two turns: where it is, which way it goes, how far it has gone so far."""
    begin = 0
    for end in [*_turning_points(path_mm), path_mm.size]:
        piece = path_mm[begin:end]
        yield slice(begin, end), float(np.sign(piece[-1] - piece[0])), np.abs(piece - piece[0])
        begin = end


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


def run_offset(c: Circumstances, rng: np.random.Generator) -> SlowError:
    """Return a reflector that is clamped anew before each run of each measurement, unless the plan keeps it."""
    runs = c.course.plan.runs
    places = rng.permutation(np.linspace(-1.0, 1.0, max(runs, 2)) + rng.uniform(-0.3, 0.3, max(runs, 2)))
    if c.course.plan.zero is Zero.KEPT and runs > 1:
        places[runs - 1] = places[runs - 2]
    return SlowError(
        added_mm=1e-3 * places[c.course.run - 1],
        description="the reflector is clamped anew before each run",
        parameters=(Parameter("spread", float(np.ptp(places[:runs])), "um", scales=True),),
    )


def moving_bump(c: Circumstances, rng: np.random.Generator) -> SlowError:
    """Return a local error that moves along the axis from run to run, such as dirt pushed along."""
    plan = c.plan
    width_mm = rng.uniform(0.07, 0.12) * plan.span_mm
    share = (np.arange(plan.runs) + rng.uniform(0.2, 0.8, plan.runs)) / plan.runs
    places = plan.start_mm + (0.1 + 0.8 * share) * plan.span_mm
    if rng.uniform() < 0.5:
        places = places[::-1]
    sign = float(rng.choice([-1.0, 1.0]))
    off = (c.course.target_mm - c.by_run(places)) / width_mm
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
DRAWN_ANEW = ("run_offset",)
"""Drawn anew for each measurement: what is set by hand, and no property of the axis."""
