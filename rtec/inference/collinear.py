"""Which effects are collinear on the plan that was measured, and which are not identifiable on any."""

from __future__ import annotations

import math

from rtec.effects import Effect, effect_named
from rtec.errors import ArgumentError
from rtec.inference.forms import forms_of
from rtec.inference.results import Candidate, Cosines

COLLINEAR = 0.95
"""Cosine above which two effects explain the same data equally well."""


def collinear_pairs(cosines: Cosines | None) -> list[tuple[str, str, float]]:
    """Return the pairs of effects with a cosine above 0.95 in size, the most alike first.

    Examples
    --------
    >>> import numpy as np
    >>> table = np.array([[1.0, -0.99, 0.2], [-0.99, 1.0, 0.5], [0.2, 0.5, 1.0]])
    >>> collinear_pairs(Cosines(names=("scale", "drift", "backlash"), cosine=table))
    [('scale', 'drift', -0.99)]
    """
    if cosines is None:
        return []
    pairs = [
        (first, second, float(cosines.cosine[i, j]))
        for i, first in enumerate(cosines.names)
        for j, second in enumerate(cosines.names[:i])
        if math.isfinite(cosines.cosine[i, j]) and abs(cosines.cosine[i, j]) > COLLINEAR
    ]
    return sorted(((second, first, cosine) for first, second, cosine in pairs), key=lambda pair: -abs(pair[2]))


def effect_or_none(name: str) -> Effect | None:
    """Return the effect of that name, or None where the library has none."""
    try:
        return effect_named(name)
    except ArgumentError:
        return None


def nested(name: str, other: str) -> bool:
    """Return whether one of two effects is a special case of the other, so that the simpler one wins.

    Examples
    --------
    >>> nested("backlash", "backlash_map"), nested("scale", "drift")
    (True, False)
    """
    pairs = ((effect_or_none(name), other), (effect_or_none(other), name))
    return any(effect is not None and second in forms_of(effect).contains for effect, second in pairs)


def tied_groups(candidates: tuple[Candidate, ...]) -> list[tuple[str, ...]]:
    """Return the effects that explain the data equally, group by group.

    What no experiment with the same instrument can tell apart is no tie: it is so in every measurement.
    """
    groups: dict[frozenset[str], tuple[str, ...]] = {}
    for candidate in candidates:
        others = [other for other in candidate.tied_with if other not in candidate.for_ever]
        if others:
            group = (candidate.effect, *others)
            groups.setdefault(frozenset(group), group)
    return list(groups.values())


def not_identifiable(candidates: tuple[Candidate, ...]) -> list[tuple[str, str]]:
    """Return accepted effects, each with one that it is not identifiable from."""
    return [
        (candidate.effect, other) for candidate in candidates if candidate.accepted for other in candidate.for_ever
    ]
