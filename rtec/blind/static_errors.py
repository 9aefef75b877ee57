"""Static errors of the emulated axis: what stands between encoder and slide, by position and direction.

Each is drawn as physics - a screw that is too long, bearings that run out, a nut with play - on a fine grid of
positions; the axis's table holds the sum. Nothing here knows how a diagnosis would fit it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from rtec.blind.hidden import Parameter
from rtec.blind.plan import PITCH_MM, SIGNAL_PERIOD_MM, Floats, Plan
from rtec.predictors import BidirectionalTable, NoError, Predictor

GRID_MM = 0.025
"""Spacing of the axis's table: 80 points in the shortest period."""
_MARGIN_MM = 5.0
JOINT_DEG = 400.0
"""To where a joint turns, from zero: a little more than once."""
_A_TURN = (3, 8)
"""How often a gear in the drive of a rotary axis turns in a turn of that, the last left out."""
SINUSOID_SHARE = 0.75
"""A random curve of which a single sinusoid explains more is drawn again: it would be cyclic."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StaticError:
    """An error at unit strength, in mm, on the grid of its plan."""

    forward_mm: Floats
    reverse_mm: Floats
    """Of each direction, shape (points,); the reverse curve nowhere below the forward curve."""
    description: str
    """What it does physically."""
    parameters: tuple[Parameter, ...]
    """Its numbers at unit strength."""


def _both_ways(curve_mm: Floats, description: str, *parameters: Parameter) -> StaticError:
    return StaticError(forward_mm=curve_mm, reverse_mm=curve_mm, description=description, parameters=parameters)


def grid_of(plan: Plan) -> Floats:
    """Return the positions of the axis's table.

    Examples
    --------
    >>> from rtec.blind.plan import PLANS
    >>> float(grid_of(PLANS["base"])[0])
    14.0
    """
    beyond_mm = plan.overshoot_mm + _MARGIN_MM
    low = plan.start_mm + min(0.0, *plan.shifts_mm) - beyond_mm
    high = plan.end_mm + max(0.0, *plan.shifts_mm) + beyond_mm
    return np.linspace(low, high, round((high - low) / GRID_MM) + 1)


def travel_of(plan: Plan) -> tuple[float, float]:
    """Return the ends of the travel of an axis that was first measured by a plan, in mm, or degrees of a joint.

    Examples
    --------
    >>> from rtec.blind.plan import PLANS
    >>> travel_of(PLANS["base"]), travel_of(PLANS["joint"])
    ((14.0, 326.0), (0.0, 400.0))
    """
    if plan.rotary:
        return 0.0, max(JOINT_DEG, plan.end_mm + plan.overshoot_mm)
    x = grid_of(plan)
    return float(x[0]), float(x[-1])


def scale(plan: Plan, rng: np.random.Generator) -> StaticError:
    """Return a screw that is too long or too short by the same share everywhere."""
    sign = float(rng.choice([-1.0, 1.0]))
    curve = sign * 1e-6 * grid_of(plan)
    return _both_ways(
        curve,
        "the screw's lead is wrong by the same share everywhere",
        Parameter("scale", sign, "um/m", scales=True),
    )


def pitch_map(plan: Plan, rng: np.random.Generator) -> StaticError:
    """Return the accumulated error of a screw whose lead wanders: integrated, smoothed noise without its trend."""
    x = grid_of(plan)
    curve, length_mm = wandering(
        x, plan.span_mm, (0.10, 0.16), lambda y: np.polynomial.Polynomial.fit(x, y, 1)(x), rng
    )
    return _both_ways(
        curve * 1e-3,
        "the screw's lead wanders: a smooth random error along the axis, its straight part removed",
        Parameter("peak_to_peak", float(np.ptp(curve)), "um", scales=True),
        Parameter("length", length_mm, "mm"),
    )


def wandering(
    x: Floats,
    span_mm: float,
    shares: tuple[float, float],
    trend: Callable[[Floats], Floats | np.float64],
    rng: np.random.Generator,
) -> tuple[Floats, float]:
    """Return a smooth random curve of standard deviation 1 that no sinusoid explains, and over which length it turns.

    Parameters
    ----------
    x
        Where, ascending.
    span_mm, shares
        The length is drawn between two shares of the span.
    trend
        What of the curve is taken off.
    rng
        Where the draws come from.
    """
    while True:
        length_mm = rng.uniform(*shares) * span_mm
        curve = smooth_noise(x, length_mm, rng)
        curve -= trend(curve)
        curve /= np.std(curve)
        if sinusoid_share(x, curve) < SINUSOID_SHARE:
            return curve, length_mm


def smooth_noise(x: Floats, length_mm: float, rng: np.random.Generator) -> Floats:
    """Return white noise on a coarse grid, smoothed by a bell of standard deviation ``length_mm``."""
    step = length_mm / 8.0
    margin = 4.0 * length_mm
    places = np.arange(x[0] - margin, x[-1] + margin + step, step)
    noise = rng.normal(size=places.size)
    bell = np.exp(-0.5 * (np.arange(-32, 33) / 8.0) ** 2)
    curve: Floats = np.interp(x, places, np.convolve(noise, bell, mode="same"))
    return curve


def sinusoid_share(x: Floats, curve: Floats) -> float:
    """Return the largest share of a curve's variance that one sinusoid with a free period explains."""
    step = max(x.size // 150, 1)
    at, y = x[::step] - x[0], curve[::step] - curve[::step].mean()
    angle = 2.0 * np.pi * np.arange(0.5, 8.0, 0.1)[:, None] * at / at[-1]
    columns = np.stack([np.ones_like(angle), np.sin(angle), np.cos(angle)], axis=1)
    seen = columns @ y
    explained = (seen * np.linalg.solve(columns @ columns.transpose(0, 2, 1), seen[..., None])[..., 0]).sum(axis=1)
    return float(explained.max() / (y @ y))


def cyclic(plan: Plan, rng: np.random.Generator) -> StaticError:
    """Return a screw that runs eccentrically in its bearings, or a wheel that turns once in many of its turns."""
    x = grid_of(plan)
    on_screw = rng.uniform() < 0.6
    if plan.rotary:
        period = 360.0 / float(rng.integers(*_A_TURN))
    else:
        period = PITCH_MM if on_screw else float(rng.uniform(*plan.wave_shares) * plan.span_mm)
    angle = 2.0 * np.pi * x / period + rng.uniform(0.0, 2.0 * np.pi)
    throw = rng.uniform(0.1, 0.3) if on_screw else 0.02
    # the angle at which something eccentric is read: a fundamental and a second harmonic of throw / 2
    curve = np.arctan2(throw * np.sin(angle), 1.0 + throw * np.cos(angle)) / throw
    if on_screw:
        curve += rng.uniform(0.0, 0.2) * np.sin(2.0 * angle + rng.uniform(0.0, 2.0 * np.pi))
    return _both_ways(
        curve * 1e-3,
        "eccentric screw and a coupling out of line" if on_screw else "eccentric wheel in the drive",
        Parameter("period", period, "deg" if plan.rotary else "mm"),
        Parameter("amplitude", 1.0, "um", scales=True),
    )


def eccentricity(plan: Plan, rng: np.random.Generator) -> StaticError:
    """Return the angle that one head reads on a disc that turns off centre and has become oval.

    The head sees the disc from another side at each angle. Seen from the disc's own centre it stands in a direction
    of its own, and there, on a disc pulled out along one diameter, is the line of yet another angle.
    """
    turned = np.radians(grid_of(plan))
    centre = rng.uniform(0.02, 0.15) * np.exp(2j * np.pi * rng.uniform())  # in radii of the head
    oval, along = abs(centre) * rng.uniform(0.5, 1.5), np.exp(1j * np.pi * rng.uniform())
    head = (np.exp(-1j * turned) - centre) / along
    line = (head.real / (1.0 + oval) + 1j * head.imag / (1.0 - oval)) * along
    # where the head reads too much, the axis stands too low
    curve = np.degrees(np.angle(line * np.exp(1j * turned)))
    curve -= curve.mean()
    curve *= 1e-3 / np.std(curve)
    return _both_ways(
        curve,
        "a disc that turns off centre and is oval, read by one head",
        Parameter("period", 360.0, "deg"),
        Parameter("peak_to_peak", 3600.0 * float(np.ptp(curve)), "arcsec", scales=True),
    )


def interpolation(plan: Plan, rng: np.random.Generator) -> StaticError:
    """Return a scale whose two signals are unequal and not at right angles, read as an angle by the electronics."""
    x = grid_of(plan)
    angle = 2.0 * np.pi * x / SIGNAL_PERIOD_MM
    small = 1e-3
    gain, shear = small * rng.uniform(-0.5, 0.5), small * rng.uniform(-0.5, 0.5)
    offset = small * rng.uniform(0.8, 1.2) * np.exp(2j * np.pi * rng.uniform())
    sine = np.sin(angle + shear) * (1.0 + gain) + offset.imag
    cosine = np.cos(angle) + offset.real
    read = np.arctan2(sine, cosine) - angle
    # where the electronics read too much, the axis stands too low
    curve = -np.angle(np.exp(1j * read)) / small * 1e-3
    curve -= curve.mean()
    return _both_ways(
        curve,
        "the scale's signals have offsets, unequal amplitudes and no right angle between them",
        Parameter("period", SIGNAL_PERIOD_MM, "mm"),
        Parameter("peak", float(np.abs(curve).max()) * 1e3, "um", scales=True),
    )


def backlash(plan: Plan, rng: np.random.Generator) -> StaticError:
    """Return a nut with play: the slide stays behind, whichever way it is pushed."""
    half = np.full(grid_of(plan).size, 0.5e-3)
    return StaticError(
        forward_mm=-half,
        reverse_mm=half,
        description="play of the nut, the same everywhere",
        parameters=(Parameter("play", 1.0, "um", scales=True),),
    )


def backlash_map(plan: Plan, rng: np.random.Generator) -> StaticError:
    """Return a screw worn where it was used most: play that grows and shrinks along the axis."""
    x = grid_of(plan)
    while True:
        wear = smooth_noise(x, rng.uniform(0.10, 0.16) * plan.span_mm, rng)
        wear -= wear.min()
        play = wear / wear.max()
        if 0.45 < np.std(play) / np.sqrt(np.mean(play**2)) and sinusoid_share(x, play) < 0.9:
            break
    play *= 1e-3
    forward = 0.0 if plan.right_forward else 0.5
    return StaticError(
        forward_mm=-forward * play,
        reverse_mm=(1.0 - forward) * play,
        description="play of a worn screw, different along the axis",
        parameters=(
            Parameter("least_play", float(play.min()) * 1e3, "um", scales=True),
            Parameter("largest_play", float(play.max()) * 1e3, "um", scales=True),
        ),
    )


def chirped_cyclic(plan: Plan, rng: np.random.Generator) -> StaticError:
    """Return a periodic error whose period changes along the axis, so that no period fits."""
    x = grid_of(plan)
    share = (x - x[0]) / (x[-1] - x[0])
    start = rng.uniform(1.2, 2.4) * PITCH_MM
    end = start * rng.uniform(0.35, 0.55)
    if rng.uniform() < 0.5:
        start, end = end, start
    # cycles = integral of dx / period, the period changing in proportion to the way
    cycles = (x[-1] - x[0]) / (end - start) * np.log1p((end / start - 1.0) * share)
    curve = np.sin(2.0 * np.pi * cycles + rng.uniform(0.0, 2.0 * np.pi)) * 1e-3
    return _both_ways(
        curve,
        "periodic error whose period changes along the axis",
        Parameter("period_at_start", start, "mm"),
        Parameter("period_at_end", end, "mm"),
        Parameter("amplitude", 1.0, "um", scales=True),
    )


STATIC: Mapping[str, Callable[[Plan, np.random.Generator], StaticError]] = MappingProxyType(
    {
        draw.__name__: draw
        for draw in (
            scale, pitch_map, cyclic, eccentricity, interpolation, backlash, backlash_map, chirped_cyclic,
        )
    }
)  # fmt: skip
"""What draws each static error, by name; the last lies outside the library."""


def table_of(plan: Plan, parts: list[tuple[StaticError, float]]) -> Predictor:
    """Return the axis's true error: the sum of static errors with their strengths.

    Examples
    --------
    >>> from rtec.blind.plan import PLANS
    >>> base = PLANS["base"]
    >>> table_of(base, [(backlash(base, np.random.default_rng(0)), 8.0)]).error_mm(100.0, [1, -1])
    array([-0.004,  0.004])
    """
    if not parts:
        return NoError()
    forward_mm = np.sum([factor * part.forward_mm for part, factor in parts], axis=0)
    reverse_mm = np.sum([factor * part.reverse_mm for part, factor in parts], axis=0)
    return BidirectionalTable.on_grid(grid_of(plan), forward_mm, reverse_mm)


def at_readings(plan: Plan, error: StaticError, position_mm: Floats, direction: Floats) -> Floats:
    """Return what an error at unit strength adds where the axis stands, shape (n,), in mm."""
    x = grid_of(plan)
    added: Floats = np.where(
        direction > 0, np.interp(position_mm, x, error.forward_mm), np.interp(position_mm, x, error.reverse_mm)
    )
    return added
