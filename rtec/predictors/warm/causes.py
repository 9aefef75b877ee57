"""What warms what in a machine: the structure of a Bayesian network, stated from the names of its features."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from rtec.errors import ArgumentError, unknown
from rtec.predictors.warm.features import SPINDLE_SPEED, Feature

OUTPUT = "output"
"""The node that is predicted."""
ROOM_WORDS = ("room", "ambient", "air")
"""With which a part of the name of a temperature begins that no part of the machine is at."""

Structure = dict[str, tuple[str, ...]]
"""Causes by the name of what they act on; the name of a feature is ``str(feature)``."""


def causal_structure(features: Sequence[Feature], output_causes: Sequence[str] = ()) -> Structure:
    """Return what is known before any measurement.

    A speed makes heat. What follows a sensor with a lag has that sensor as its cause. A temperature has the room's
    and the slowest heat (of lagged speeds; else heat, else speed) as its causes: two at most, so that its table stays
    small. The output has the causes that are given.

    Raises
    ------
    ArgumentError
        Two features with one name.

    References
    ----------
    Yao et al. 2013, section 3.3: first the network from prior knowledge, then its probabilities from data.

    Examples
    --------
    >>> speed, bearing = Feature(of="spindle_speed", heat=True, lag_s=600.0), Feature(of="temperature_bearing")
    >>> for effect, causes in causal_structure((speed, bearing), ["temperature_bearing"]).items():
    ...     print(effect, "<-", *causes)
    spindle_speed^(5/3) behind by 600 s <-
    temperature_bearing <- spindle_speed^(5/3) behind by 600 s
    output <- temperature_bearing
    """
    names = [str(one) for one in features]
    if len(set(names)) != len(names):
        again = next(name for k, name in enumerate(names) if name in names[:k])
        raise ArgumentError("features", again, "each feature once")
    found = {str(one): tuple(str(cause) for cause in _causes(one, features)) for one in features}
    return {**found, OUTPUT: tuple(output_causes)}


def _causes(one: Feature, features: Sequence[Feature]) -> list[Feature]:
    followed = [other for other in features if other == Feature(of=one.of, heat=one.heat)]
    if one.lag_s > 0.0 and followed:
        return followed
    speeds = [other for other in features if other.of == SPINDLE_SPEED]
    if one.of == SPINDLE_SPEED:
        return [other for other in speeds if other == Feature(of=SPINDLE_SPEED) != one]
    if is_room(one):
        return []
    rooms = [other for other in features if is_room(other)]
    slowest = sorted(speeds, key=lambda other: (other.lag_s, other.heat))[-1:]
    return sorted(rooms, key=lambda other: other.lag_s)[:1] + slowest


def is_room(feature: Feature) -> bool:
    """Return whether a feature is a temperature of the room."""
    return any(part.startswith(ROOM_WORDS) for part in feature.of.split("_")[1:] if feature.of != SPINDLE_SPEED)


def with_stated(known: Structure, stated: Mapping[str, Sequence[str]]) -> Structure:
    """Return a structure in which what a user states takes the place of what is known.

    Raises
    ------
    ArgumentError
        A name that is no feature and not the output.
    """
    for effect, causes in stated.items():
        for name in (effect, *causes):
            if name not in known:
                raise unknown("structure", name, known, noun="feature")
    return {name: tuple(stated.get(name, causes)) for name, causes in known.items()}


def effects_of(name: str, structure: Mapping[str, Sequence[str]]) -> set[str]:
    """Return all that a node acts on, by whatever way, and itself."""
    found = {name}
    while True:
        more = {effect for effect, causes in structure.items() if found & set(causes)} - found
        if not more:
            return found
        found |= more
