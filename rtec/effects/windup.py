"""A reversal error that builds up over a distance: an elastic drive against friction."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from rtec.effects._ladders import ladder
from rtec.effects.conditions import Conditions, Floats
from rtec.effects.protocol import Card, Over, Quantity, ScannedEffect, Shape, Tunable, own_shape, parameter

FEWEST_DISTANCES = 4
CLOSE = 0.27
"""Share of the span within which these distances have to lie: a quarter, and a little for irregular targets."""
BEGUN_APART = 3
"""Places from which runs in one direction have to begin, so that what happens after a reversal is no map."""
HIDDEN = 8.0
"""Of the first distance: what changes over less is over before it, and is collinear with any other such distance."""
FARTHEST = 0.15
"""Overshoot that is looked for, in distances: with a longer one the drive is wound up before the first reading, and
what is left of its course is collinear with backlash."""


@dataclass(frozen=True, slots=True)
class WindupShape(Shape):
    """Over which distance the drive winds up, whether it starts from the wind-up of the motion before, and where.

    ``overshoot`` is the way from the reversal back to the last reading before it, which a table of targets does not
    hold: a measuring program goes past its last target before it turns. ``settled`` says that a log in motion
    begins wound up, as where the last motion before it went the same way.
    """

    distance: float = field(default=1.0, metadata=parameter(Quantity.POSITION, "distance"))
    carried: bool = field(default=False, metadata=parameter(Quantity.CHOICE, "carried over the reversal"))
    overshoot: float = field(default=0.0, metadata=parameter(Quantity.POSITION, "overshoot"))
    settled: bool = field(default=False, metadata=parameter(Quantity.CHOICE, "wound up before the log began"))


def too_sparse(conditions: Conditions) -> str | None:
    """Return why data cannot show what happens after a reversal, or None."""
    if not conditions.both_directions and not _begun_apart(conditions):
        return f"one direction only, and not from {BEGUN_APART} places far apart"
    near = CLOSE * conditions.span
    count = int((distances(conditions) <= near).sum())
    if count >= FEWEST_DISTANCES:
        return None
    unit = conditions.position_unit
    return f"{count} distances within {near:.3g} {unit} after a reversal only: at least {FEWEST_DISTANCES} needed"


class AfterReversal(ScannedEffect):
    """Base of the reversal errors that change over a distance after the reversal."""

    over = Over.REVERSAL
    data_checks = (too_sparse,)


class Windup(AfterReversal):
    """Half of a reversal error that has grown to 63 % one distance after the reversal.

    Notes
    -----
    ``deviation = windup / 2 * direction * (1 - exp(-since_reversal / distance))``: the solution of
    ``d(deviation) / d(travel) = (windup / 2 * direction - deviation) / distance`` started from nothing at each
    reversal, as where an overshoot on the way back has unwound the drive. Carried over, it starts from the full
    wind-up of the motion before, and the last factor is ``1 - 2 exp(-since_reversal / distance)``. Where the axis
    turned beyond the last reading, ``since_reversal`` is longer by the overshoot.

    Examples
    --------
    >>> way, gone = np.array([1.0, 1.0, -1.0]), np.array([0.0, 2.0, 2.0])
    >>> c = Conditions(
    ...     position=gone, position_unit="mm", run=np.ones(3, dtype=np.int64), direction=way, since_reversal=gone
    ... )
    >>> Windup().contribution(c, WindupShape(2.0), [-0.02]).round(5).tolist()
    [0.0, -0.00632, 0.00632]
    """

    name = "windup"
    shape_type = WindupShape
    card = Card(
        title="Wind-up after reversal",
        formula="`windup/2 · d · (1 − exp(−r/distance))`",
        needs=(
            "both directions, or runs in one that begin at several places, with readings at four distances at least "
            "in the first quarter after a reversal"
        ),
        plot=(
            "After each reversal the deviation goes over from one branch to the other along one exponential of the "
            "distance since the reversal."
        ),
        cause=(
            "Friction winds up an elastic drive (long screw, belt, gear train) or deforms seals and guideways before "
            "they slide (presliding)."
        ),
        consequence="Short moves after a reversal fall short; small circles are flattened.",
        action=(
            "Reduce friction or stiffen the drive; approach targets from one side with a run-up longer than the "
            "wind-up distance."
        ),
        invariant_to="position of the reversal, feed and time.",
        source="Dahl (1968); thesis, section 4.2: the run-up begins beyond the first target.",
    )

    def shapes(self, conditions: Conditions) -> Sequence[Shape]:
        """Return distances from half the shortest seen to a fifth of the span; longer: collinear with scale."""
        gone = distances(conditions)
        if gone.size < FEWEST_DISTANCES:
            return []
        least = shortest(conditions)
        here = [WindupShape(distance) for distance in ladder(least, max(conditions.span / 5, least))]
        if not conditions.moving:
            return here
        remembered = [replace(shape, carried=True) for shape in here]
        return [*here, *remembered, *(replace(shape, settled=True) for shape in remembered)]

    def variants(self, conditions: Conditions, shape: Shape) -> Sequence[Shape]:
        """Return the shape started from nothing and carried over, turned at the last reading and beyond it."""
        if conditions.moving:  # a log in motion holds the reversal itself
            return [shape]
        distance = own_shape(shape, WindupShape).distance
        lower = [distance * step for step in (1.0, 0.75, 0.55)]  # carried over, the same curve has a shorter distance
        here = [WindupShape(distance), *(WindupShape(way, carried=True) for way in lower)]
        return [*here, *(WindupShape(w.distance, w.carried, 0.1 * w.distance) for w in here)]

    def tunables(self, conditions: Conditions, shape: Shape) -> Sequence[Tunable]:
        """Return the distance, free by a half, up to a fifth of the span: beyond, it is collinear with a scale.

        An overshoot that there is, too, from none to a share of the distance.
        """
        own = own_shape(shape, WindupShape)
        top = max(conditions.span / 5, own.distance)
        least = min(max(own.distance / 1.5, shortest(conditions)), own.distance)
        found = (Tunable("distance", least, min(own.distance * 1.5, top)),)
        return (
            (*found, Tunable("overshoot", 0.0, max(own.overshoot, FARTHEST * own.distance)))
            if own.overshoot > 0.0
            else found
        )

    def scan(self, conditions: Conditions, shapes: Sequence[Shape]) -> Floats:
        way = self._needed(conditions.direction, "directions of approach")
        gone = self._needed(conditions.since_reversal, "distances since the last reversal")
        own = [own_shape(shape, WindupShape) for shape in shapes]
        distances = np.array([shape.distance for shape in own])[:, None]
        missing = np.array([2.0 if shape.carried else 1.0 for shape in own])[:, None]
        beyond = np.array([shape.overshoot for shape in own])[:, None]
        built = 1.0 - missing * np.exp(-(gone + beyond) / distances)
        added: Floats = built * (way / 2)
        remembers = np.array([shape.carried for shape in own]) & conditions.moving
        if remembers.any():
            added[remembers] = _remembered(conditions, [shape for shape in own if shape.carried]) / 2
        return added[:, None, :]


def _remembered(conditions: Conditions, shapes: Sequence[WindupShape]) -> Floats:
    """Return what a log in motion has wound up when it remembers its whole way, -1 to 1; shape (shapes, rows)."""
    from rtec.effects._windup_kernels import wind_up  # noqa: PLC0415 - loads numba, for logs only

    conditions, rows = conditions.path
    way = np.zeros(conditions.rows) if conditions.direction is None else np.sign(conditions.direction)
    first = np.array([float(shape.settled) for shape in shapes])[:, None] * way
    distances = np.array([shape.distance for shape in shapes])
    found = np.empty((len(shapes), conditions.rows))
    wind_up(conditions.position, conditions.motion_begins, first, distances, found)
    return found[:, rows]


def unseen_distances(conditions: Conditions) -> Sequence[float]:
    """Return distances over which something may change after a reversal where readings are too far apart to tell."""
    gone = distances(conditions)
    if conditions.moving or not conditions.both_directions or not gone.size or too_sparse(conditions) is None:
        return ()
    return ladder(gone[0] / HIDDEN, max(conditions.span / 5, gone[0]))


def _begun_apart(conditions: Conditions) -> bool:
    """Return whether runs begin at places far apart: what follows the way since then is no function of position."""
    begins = np.concatenate([[True], np.diff(conditions.run) != 0])
    places = np.unique(conditions.position[begins])
    return not conditions.moving and places.size >= BEGUN_APART and np.ptp(places) >= CLOSE * conditions.span


def shortest(conditions: Conditions) -> float:
    """Return the shortest distance over which something after a reversal can be seen to change.

    Half the shortest distance of a reading at rest. Of a log the way that it goes, as a rule, in its first two
    readings after a reversal: what changes over less is over between two readings, and is collinear with play.
    """
    gone = distances(conditions)
    least = float(gone[0]) / 2.0 if gone.size else 0.0
    since = conditions.since_reversal
    if not conditions.moving or since is None:
        return least
    first = np.flatnonzero(np.diff(since) < 0.0) + 1
    first = first[first + 2 < since.size]
    return max(least, float(np.median(since[first + 2]))) if first.size else least


def distances(conditions: Conditions) -> Floats:
    """Return the distinct distances after a reversal above zero, ascending."""
    if conditions.since_reversal is None:
        return np.empty(0)
    gone = np.unique(np.round(conditions.since_reversal, 9))
    return gone[gone > 0]
