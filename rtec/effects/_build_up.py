"""Friction that builds up over a distance after a reversal: asperities, seals and gears bend before they slip."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TypeVar

import numpy as np

from rtec.effects._ladders import ladder
from rtec.effects.conditions import Conditions, Floats
from rtec.effects.protocol import Observable, Over, Quantity, ScannedEffect, Shape, Tunable, own_shape, parameter
from rtec.effects.viscous import one_speed_each_way

LONGEST = 1 / 30
"""Of the span: what builds up over a longer way is collinear with a force that depends on position."""
FEWEST_READINGS = 8
"""Within the shortest distance that is tried: with fewer, the build-up is over before it shows."""
STEP = 1.5
"""Of the ladder of distances: two neighbours have a cosine of 0.99 and more over any way."""


@dataclass(frozen=True, slots=True)
class BuildUpShape(Shape):
    """Over which distance friction builds up, 0 for at once; and from where.

    From nothing, as where the drive lets go before it turns; or carried over the reversal, from the friction of the
    motion before.
    """

    distance: float = field(default=0.0, metadata=parameter(Quantity.POSITION, "distance of build-up"))
    carried: bool = field(default=False, metadata=parameter(Quantity.CHOICE, "carried over the reversal"))


_B = TypeVar("_B", bound=BuildUpShape)


class BuildsUp(ScannedEffect):
    """Friction that is there at once, or builds up over a distance after each reversal."""

    over = Over.VELOCITY
    observable = Observable.DRIVE
    not_negative = True

    def at_once(self, conditions: Conditions) -> Sequence[BuildUpShape]:
        """Return the shapes that are there at once."""
        return (BuildUpShape(),)

    def shapes(self, conditions: Conditions) -> Sequence[Shape]:
        """Return friction that is there at once, then distances over which it builds up."""
        return [form for shape in self.at_once(conditions) for form in _build_ups(conditions, shape)]

    def tried(self, conditions: Conditions, shape: Shape) -> float:
        """Return the number of shapes, of those alone that are there at once for one of them: it is no choice."""
        own = own_shape(shape, BuildUpShape)
        build_ups = len(_build_ups(conditions, own)) if own.distance > 0.0 else 1
        return float(len(self.at_once(conditions)) * build_ups)

    def variants(self, conditions: Conditions, shape: Shape) -> Sequence[Shape]:
        """Return a build-up and none of it; of none every build-up, as beside other effects another may show."""
        plain = without_build_up(shape)
        return _build_ups(conditions, own_shape(shape, BuildUpShape)) if plain is None else [plain, shape]

    def tunables(self, conditions: Conditions, shape: Shape) -> Sequence[Tunable]:
        distance = own_shape(shape, BuildUpShape).distance
        return (Tunable("distance", distance / STEP, distance * STEP),) if distance > 0.0 else ()

    def scan(self, conditions: Conditions, shapes: Sequence[Shape]) -> Floats:
        way = self._needed(conditions.direction, "directions of motion")
        return _built_up(conditions, way, [own_shape(shape, BuildUpShape) for shape in shapes])[:, None, :]


def without_build_up(shape: Shape) -> BuildUpShape | None:
    """Return the friction that is there at once; None of one that is."""
    own = own_shape(shape, BuildUpShape)
    return replace(own, distance=0.0, carried=False) if own.distance > 0.0 else None


def _build_ups(conditions: Conditions, shape: _B) -> list[_B]:
    """Return a shape that is there at once, and over distances, from nothing and carried.

    None of these at one speed each way: what grows while the axis gets up to speed may as well be viscous friction.
    """
    gone = conditions.since_reversal
    if gone is None or conditions.direction is None or one_speed_each_way(conditions):
        return [shape]
    near = np.sort(gone[(gone > 0.0) & (conditions.direction != 0.0)])
    longest = LONGEST * conditions.span
    if near.size < FEWEST_READINGS or near[FEWEST_READINGS - 1] >= longest:
        return [shape]
    shortest = max(float(near[FEWEST_READINGS - 1]), 1e-3 * longest)
    scanned = ladder(shortest, longest, STEP)
    return [shape, *(replace(shape, distance=way, carried=carried) for carried in (False, True) for way in scanned)]


def _built_up(conditions: Conditions, direction: Floats, shapes: Sequence[BuildUpShape]) -> Floats:
    """Return the share of dry friction at each reading with the sign of the motion, shape (shapes, rows).

    Notes
    -----
    Over the way r since the reversal ``direction * (1 - exp(-r / distance))``; carried over, the solution of
    ``d(share) / d(way) = (direction - share) / distance`` along all strokes, from nothing where motion begins. The
    way is that since the reversal, which noise of the position does not turn round: along every reading, noise to and
    fro would wear the build-up down.
    """
    found = np.tile(direction.astype(np.float64), (len(shapes), 1))
    soft = [k for k, shape in enumerate(shapes) if shape.distance > 0.0]
    gone = conditions.since_reversal
    if not soft or gone is None:
        return found
    fresh = [k for k in soft if not shapes[k].carried]
    if fresh:
        distance = np.array([shapes[k].distance for k in fresh])[:, None]
        found[fresh] *= -np.expm1(-gone / distance)
    if carried := [k for k in soft if shapes[k].carried]:
        found[carried] = np.abs(direction) * _carried(conditions, [shapes[k].distance for k in carried])
    return found


def _carried(conditions: Conditions, distances: Sequence[float]) -> Floats:
    """Return the share of friction that remembers the strokes before, -1 to 1; shape (distances, rows)."""
    from rtec.effects._windup_kernels import wind_up  # noqa: PLC0415 - loads numba, for forces only

    whole, rows = conditions.path
    gone, direction = whole.since_reversal, whole.direction
    if gone is None or direction is None:
        return np.zeros((len(distances), conditions.rows))
    turned = whole.motion_begins | (gone == 0.0)
    stroke = np.cumsum(turned) * (float(gone.max()) + 1.0)
    farthest = np.maximum.accumulate(gone + stroke) - stroke
    way = np.where(turned, farthest, np.diff(farthest, prepend=0.0)) * np.sign(direction)
    found = np.empty((len(distances), whole.rows))
    wind_up(np.cumsum(way), whole.motion_begins, np.zeros_like(found), np.array(distances), found)
    return found[:, rows]
