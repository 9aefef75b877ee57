"""Shapes that errors of a machine give to a circle: the radial deviation of a unit error over angle and sense.

With the errors ex and ey of the axes the radial deviation is ex cos + ey sin of the angle. The x axis reverses at 0
and 180 deg, the y axis at 90 and 270 deg.

======================  ===========================  ===============================================================
error                   acts as                      shape
======================  ===========================  ===============================================================
squareness              ex = -a y                    sin 2t in both senses
servo mismatch          ex, ey lag by times          sin 2t that changes its sign with the sense
scaling mismatch        ex = k x, ey = -k y          cos 2t
backlash                ex = -b/2 sign(vx)           a step outwards behind each reversal
lateral play            ey = p/2 sign(vx)            between the senses, nothing at the reversals of the axis
reversal spike          ex sticks, then catches up   a peak outwards behind each reversal
straightness            ey = h (x / R)^2             three lobes
cyclic error            ex = c sin(2 pi x / p)       waves that are shorter where the axis is fast
vibration               waves in time                waves of one length around the circle
master-slave            which axis leads changes     steps at 45, 135, 225 and 315 deg
radius change           bar, temperature, lag        a constant
======================  ===========================  ===============================================================

References
----------
ISO 230-4:2005; the diagnosis names are those of makers' guides. The shapes follow from the second column.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rtec.metrology.ballbar.circle_test import CircleTest, Floats

AXES = "xy"
SPIKE, SCALING, RADIUS = "reversal spike", "scaling mismatch", "radius change"
LATERAL, BY_SENSE = "lateral play", "radius differs by sense"
SPIKE_WIDTHS_DEG = (0.4, 0.6, 0.9, 1.3, 1.9, 2.8, 4.0, 5.6)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Shape:
    """Columns of a fit that stand for one error, for unit values of its numbers."""

    name: str
    columns: Floats
    """Shape (points, numbers)."""
    searched: float = 1.0
    """Over how many values of a parameter it was searched: a chance more for noise to look like it."""
    parameter: float = 0.0
    """Wave number of a cyclic error (2 pi R / period), waves a revolution of a vibration, width in rad of a spike."""
    of: Callable[[CircleTest, float], Shape] | None = None
    """Of a wave: the same on another test, with another parameter."""

    def on(self, test: CircleTest) -> Shape:
        """Return the same on another test, as far as it is a wave."""
        return self if self.of is None else self.of(test, self.parameter)


def along(axis: str, angle: Floats) -> tuple[Floats, Floats]:
    """Return position and cross position of an axis on the unit circle: (cos, sin) of x, (sin, cos) of y."""
    return (np.cos(angle), np.sin(angle)) if axis == "x" else (np.sin(angle), np.cos(angle))


def behind(axis: str, end: int, angle: Floats, sense: Floats) -> Floats:
    """Return how far a point is behind the reversal of an axis at its positive or negative end, 0 to 2 pi."""
    place = (0.0 if axis == "x" else np.pi / 2.0) + (0.0 if end > 0 else np.pi)
    return (sense * (angle - place)) % (2.0 * np.pi)


def lost_motion(axis: str, angle: Floats, sense: Floats, play_mm: float, radius_mm: float) -> Floats:
    """Return the error of an axis with a unit of play: -1/2 in front of its positive end, 1/2 behind it.

    While the play is crossed the axis stands still; where ``play_mm`` is 0 or below, an over-compensation, it is a
    step.
    """
    found = np.zeros(angle.size)
    for end in (1, -1):
        after = behind(axis, end, angle, sense)
        half = after < np.pi
        crossed = np.ones(angle.size)
        if play_mm > 0.0:
            crossed = np.minimum(1.0, radius_mm * (1.0 - np.cos(after)) / play_mm)
        found[half] = end * (crossed[half] - 0.5)
    return found


def static_shapes(test: CircleTest, plays_um: dict[str, float]) -> list[Shape]:
    """Return the shapes without a parameter; ``plays_um`` holds the play of each axis as far as it is known."""
    t, s, radius = test.angle_rad, test.sense, test.radius_mm
    found = [
        Shape(name="squareness", columns=np.sin(2.0 * t)[:, None]),
        Shape(name="servo mismatch", columns=(s * np.sin(2.0 * t))[:, None]),
        Shape(name=SCALING, columns=np.cos(2.0 * t)[:, None]),
        Shape(name="master-slave change-over", columns=np.sign(np.cos(2.0 * t))[:, None]),
        Shape(name=BY_SENSE, columns=s[:, None]),
    ]
    if test.radius_known:
        found.append(Shape(name=RADIUS, columns=np.ones((t.size, 1))))
    for axis in AXES:
        main, cross = along(axis, t)
        sharp = lost_motion(axis, t, s, 0.0, radius)
        lost = lost_motion(axis, t, s, 1e-3 * plays_um.get(axis, 0.0), radius)
        found += [
            Shape(name=f"backlash {axis}", columns=np.column_stack([main * lost, main * main * lost])),
            Shape(name=f"{LATERAL} {axis}", columns=(-cross * sharp)[:, None]),
            Shape(name=f"straightness {axis}", columns=(cross * main**2)[:, None]),
        ]
    return found


def scale_of(test: CircleTest, axis: str) -> Shape:
    """Return a scaling mismatch that is the scale of one axis alone: the mean radius changes with it.

    Its number is that of cos 2t, as of the scaling mismatch that leaves the mean radius as it is.
    """
    main, _ = along(axis, test.angle_rad)
    sign = 2.0 if axis == "x" else -2.0
    return Shape(name=SCALING, columns=(sign * main**2)[:, None])


def spike_shape(test: CircleTest, axis: str, width_rad: float, rising: bool) -> Shape:
    """Return spikes at both ends of an axis that decay over a width, at once or after they have risen."""
    t, s = test.angle_rad, test.sense
    main, _ = along(axis, t)
    columns = []
    for end in (1, -1):
        after = behind(axis, end, t, s) / width_rad
        decay = after * np.exp(1.0 - after) if rising else np.exp(-after)
        columns.append(end * main * decay)
    searched = 2.0 * len(SPIKE_WIDTHS_DEG)
    name = f"{SPIKE} {axis}"
    return Shape(name=name, columns=np.column_stack(columns), searched=searched, parameter=width_rad)


def speed(axis: str, angle: Floats, sense: Floats) -> Floats:
    """Return the velocity of an axis as a share of the feed."""
    return -sense * np.sin(angle) if axis == "x" else sense * np.cos(angle)


def cyclic_shape(test: CircleTest, axis: str, wave_number: float, searched: float) -> Shape:
    """Return a cyclic error of an axis; ``wave_number`` is 2 pi R / period.

    The first two columns belong to the position alone, the other two are proportional to the velocity, as what a
    servo leaves of a periodic force.
    """
    main, _ = along(axis, test.angle_rad)
    moving = main * speed(axis, test.angle_rad, test.sense)
    waves = np.cos(wave_number * main), np.sin(wave_number * main)
    columns = np.column_stack([size * wave for size in (main, moving) for wave in waves])

    def of(other: CircleTest, number: float) -> Shape:
        return cyclic_shape(other, axis, number, searched)

    name = f"cyclic error {axis}"
    return Shape(name=name, columns=columns, searched=searched, parameter=wave_number, of=of)


def vibration_shape(test: CircleTest, along_what: str, waves: float, searched: float) -> Shape:
    """Return waves around the circle, radial or along one axis; each sense has a phase of its own."""
    t, s = test.angle_rad, test.sense
    size = np.ones(t.size) if along_what == "radial" else along(along_what, t)[0]
    parts = [size * (s == sense) * wave(waves * test.turn_rad) for sense in (1.0, -1.0) for wave in (np.cos, np.sin)]

    def of(other: CircleTest, number: float) -> Shape:
        return vibration_shape(other, along_what, number, searched)

    return Shape(name="vibration", columns=np.column_stack(parts), searched=searched, parameter=waves, of=of)


def nuisance(test: CircleTest) -> Floats:
    """Return what is taken out before all: the centre, what differs of it between the senses, an unknown radius."""
    t, s = test.angle_rad, test.sense
    parts = [np.cos(t), np.sin(t), s * np.cos(t), s * np.sin(t)]
    if not test.radius_known:
        parts.append(np.ones(t.size))
    return np.column_stack(parts)
