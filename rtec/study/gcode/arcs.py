"""Arcs of G-code: centre, angles, and where a coordinate turns round or passes a place."""

from __future__ import annotations

import math
from dataclasses import dataclass

OFF_CENTRE_MM = 0.01
"""Largest difference of the radii at both ends: coordinates in programs are rounded."""
PLANES = {"G17": ("X", "Y", "I", "J"), "G18": ("Z", "X", "K", "I"), "G19": ("Y", "Z", "J", "K")}
"""Axes of a plane, and the words of a centre in them."""
_SAME = 1e-12


@dataclass(frozen=True, slots=True)
class Arc:
    """An arc in a plane, in mm; ``sweep`` is above 0 counterclockwise."""

    centre: tuple[float, float]
    radius: float
    angle: float
    sweep: float

    def at(self, share: float) -> tuple[float, float]:
        """Return the point after a share of the arc."""
        angle = self.angle + share * self.sweep
        return self.centre[0] + self.radius * math.cos(angle), self.centre[1] + self.radius * math.sin(angle)

    def turns(self, axis: int) -> list[float]:
        """Return the shares, ascending and between the ends, at which a coordinate turns round."""
        quarter = 0.0 if axis == 0 else math.pi / 2.0
        return self._shares(quarter, math.pi)

    def passes(self, axis: int, place: float, begin: float, end: float) -> float:
        """Return the share at which a coordinate passes a place between two shares, where it does not turn round."""
        for _ in range(60):
            middle = 0.5 * (begin + end)
            if (self.at(middle)[axis] - place) * (self.at(end)[axis] - place) > 0.0:
                end = middle
            else:
                begin = middle
        return 0.5 * (begin + end)

    def _shares(self, angle: float, every: float) -> list[float]:
        first = math.ceil((min(self.angle, self.angle + self.sweep) - angle) / every)
        last = math.floor((max(self.angle, self.angle + self.sweep) - angle) / every)
        shares = ((angle + k * every - self.angle) / self.sweep for k in range(first, last + 1))
        return sorted(share for share in shares if _SAME < share < 1.0 - _SAME)


def arc_of(
    start: tuple[float, float],
    end: tuple[float, float],
    centre: tuple[float, float] | None,
    radius: float | None,
    *,
    counterclockwise: bool,
) -> Arc | str:
    """Return the arc between two points, of a centre or a radius in mm, or in words why there is none.

    Examples
    --------
    >>> arc = arc_of((10.0, 0.0), (0.0, 10.0), (0.0, 0.0), None, counterclockwise=True)
    >>> round(arc.radius, 9), round(arc.sweep, 6), arc.turns(1)
    (10.0, 1.570796, [])
    """
    sign = 1.0 if counterclockwise else -1.0
    chord = end[0] - start[0], end[1] - start[1]
    length = math.hypot(*chord)
    if centre is None:
        if radius is None:
            return "an arc without a centre and without a radius"
        half = 0.5 * length
        if length == 0.0 or abs(radius) < half - OFF_CENTRE_MM:
            return f"an arc of radius {radius:g} mm between ends {length:g} mm apart"
        height = math.sqrt(max(radius**2 - half**2, 0.0)) * math.copysign(1.0, radius) * sign
        middle = 0.5 * (start[0] + end[0]), 0.5 * (start[1] + end[1])
        centre = middle[0] - height * chord[1] / length, middle[1] + height * chord[0] / length
    radii = math.dist(start, centre), math.dist(end, centre)
    if abs(radii[0] - radii[1]) > OFF_CENTRE_MM or min(radii) < 1e-6:
        return f"an arc that begins with radius {radii[0]:g} mm and ends with {radii[1]:g} mm"
    angles = [math.atan2(point[1] - centre[1], point[0] - centre[0]) for point in (start, end)]
    turned = (sign * (angles[1] - angles[0])) % (2.0 * math.pi)
    sweep = sign * (turned if length > 0.0 else 2.0 * math.pi)
    return Arc(centre=centre, radius=0.5 * (radii[0] + radii[1]), angle=angles[0], sweep=sweep)


def refitted(start: tuple[float, float], end: tuple[float, float], near: tuple[float, float]) -> tuple[float, float]:
    """Return the centre nearest to a point that is as far from both ends."""
    chord = end[0] - start[0], end[1] - start[1]
    square = chord[0] ** 2 + chord[1] ** 2
    if square == 0.0:
        return near
    middle = 0.5 * (start[0] + end[0]), 0.5 * (start[1] + end[1])
    along = ((near[0] - middle[0]) * chord[0] + (near[1] - middle[1]) * chord[1]) / square
    return near[0] - along * chord[0], near[1] - along * chord[1]
