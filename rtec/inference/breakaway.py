"""The force that sets an axis in motion: what dry friction and its fall with speed come to at creep."""

from __future__ import annotations

import math
from dataclasses import replace

from rtec.inference.model import Model
from rtec.inference.results import Diagnosis
from rtec.readable import quantity_text

_PARTS = ("coulomb", "stribeck")


def with_breakaway(diagnosis: Diagnosis) -> Diagnosis:
    """Return a diagnosis with a note on the breakaway, where dry friction and Stribeck friction were found."""
    found = breakaway_of(diagnosis.model)
    if found is None:
        return diagnosis
    unit, factor = diagnosis.dataset.units.shown
    value = quantity_text(factor * found[0], unit, factor * found[1])
    note = f"breakaway: {value} sets the axis in motion (coulomb + stribeck, as if their errors were independent)"
    return replace(diagnosis, notes=(*diagnosis.notes, note))


def breakaway_of(model: Model) -> tuple[float, float] | None:
    """Return the force at which motion begins and its standard error, in the observed unit inside; None without both.

    Notes
    -----
    The errors of the two are added as those of independent numbers. They are opposed, so the true one is smaller.

    Examples
    --------
    >>> from rtec.effects import Units, effect_named
    >>> from rtec.inference.model import Term
    >>> parts = [(effect_named("coulomb"), 0.42, 0.003), (effect_named("stribeck"), 0.08, 0.004)]
    >>> terms = [
    ...     Term(effect=effect, shape=effect.shape_type(), amplitudes=(value,), errors=(error,))
    ...     for effect, value, error in parts
    ... ]
    >>> breakaway_of(Model(observe="current", units=Units("a", "mm", "s"), terms=tuple(terms)))
    (0.5, 0.005)
    """
    terms = {term.name: term for term in model.terms if term.name in _PARTS}
    if set(terms) != set(_PARTS):
        return None
    value, square = 0.0, 0.0
    for term in terms.values():
        if not term.amplitudes or not term.errors:
            return None
        value, square = value + term.amplitudes[0], square + term.errors[0] ** 2
    return value, math.sqrt(square)
