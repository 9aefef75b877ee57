"""What else has to be said of a finding: outliers, signs, bounds, slow noise."""

from __future__ import annotations

import numpy as np

from rtec.effects import LIBRARY
from rtec.inference.answer import EQUAL, is_given, tied_models, wrong_signs
from rtec.inference.experiment import between
from rtec.inference.finding import Finding
from rtec.inference.results import NoiseFloor
from rtec.inference.scored import Scored

WANDERS = 16.0
"""Readings over which noise is correlated, from which on it may as well be an unknown effect in time."""
MOSTLY_WHITE = 0.9
"""Share of the noise's variance that is white, from which on the slow rest is of no account."""
_AT_BOUND = 0.01


def wanders(model: Scored) -> bool:
    """Return whether a good part of the noise is slow."""
    return model.colour.length > WANDERS and model.colour.white < MOSTLY_WHITE


def notes_of(found: Finding, floor: NoiseFloor) -> tuple[str, ...]:
    """Return the sentences that stand below an answer."""
    notes = list(dict.fromkeys(found.dataset.notes))
    if found.heldout is not None:
        notes += [f"{found.heldout.source}: {note}" for note in found.heldout.notes if note not in notes]
    if found.outliers:
        rows = ", ".join(str(one.row) for one in found.outliers[:8])
        more = f" and {len(found.outliers) - 8} more" if len(found.outliers) > 8 else ""
        notes.append(f"left out as outliers, far from their neighbours: readings {rows}{more}")
    notes += [
        f"{name} would explain much if its amplitude could be negative: is the sign of {found.dataset.observe} "
        "opposite to that of the motion?"
        for name in wrong_signs(found.scout, found.scouted)
    ]
    notes += _at_bounds(found)
    notes += _limits(found)
    colour = found.model.colour
    if not floor.from_repeats:
        notes.append("no condition was repeated: there is no noise floor to judge the residual by")
    elif wanders(found.model):
        notes.append(
            f"the differences between repeats are correlated over about {colour.length:.0f} readings: they count as "
            "noise, but may be an unknown effect in time"
        )
    if not found.searched:
        notes.append("no search was made: the other effects are only ranked; rtec diagnose searches on from here")
    known = {e.name for e in LIBRARY}
    notes += [
        f"{name} was tried and not accepted: {why}"
        for name, why in found.search.gate.refused.items()
        if name in known and name not in found.model.names and found.probability.get(name, 0.0) > 1.0 / np.exp(EQUAL)
    ]
    return tuple(notes)


def _limits(found: Finding) -> list[str]:
    """Return a sentence for each accepted effect that may as well be another one near its limit."""
    return [
        f"{rival.name} explains the readings as well as {effect.name}, which is its limit; to tell them apart, "
        f"{between(effect, rival)}"
        for effect, _ in found.scouted.choices
        for rival, _ in tied_models(found.scout, found.scouted, effect.name, limits=True)
    ]


def _at_bounds(found: Finding) -> list[str]:
    """Return a sentence for each shape parameter that lies at the end of what was searched."""
    notes = []
    space = found.search.space
    for effect, shape in found.model.choices:
        if effect.is_wave or is_given(found.search, effect.name):
            continue
        for tunable in effect.tunables(space.dataset.conditions, shape):
            value = float(getattr(shape, tunable.name))
            every = [float(getattr(s, tunable.name)) for s in space.shapes(effect)[0]]
            if not every or max(every) == min(every):
                continue
            end = "longest" if value >= max(every) * (1.0 - _AT_BOUND) else "shortest"
            if end == "longest" or value <= min(every) * (1.0 + _AT_BOUND):
                what = tunable.name.replace("_", " ")
                notes.append(
                    f"{effect.name}: its {what} is at the {end} that was searched; the true value may lie beyond"
                )
    return notes
