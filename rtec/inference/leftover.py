"""What is left that nothing in the library explains: what it depends on, and its strongest line."""

from __future__ import annotations

import numpy as np
from scipy.special import chdtrc

from rtec.dataset.dataset import Dataset
from rtec.effects import Floats
from rtec.effects._harmonics import harmonic_columns
from rtec.effects.frequency_grid import frequencies
from rtec.inference.noise import compared_cells, lack_of_fit
from rtec.inference.probes import Probe
from rtec.inference.proposals import Beside, falls
from rtec.inference.results import Unknown
from rtec.inference.scored import Judge, Scored

MATTERS = 0.2
"""Share of the noise floor below which repeatable structure is of no interest, however significant."""
OF_EXPLAINED, OF_EXPLAINED_IN_MOTION = 0.02, 0.1
"""Share of what was explained below which a leftover is a hair: no effect has exactly the form of its formula. In a
log velocity and acceleration are derived from positions through a filter, which rounds each start and stop: emulated
lags leave up to a twelfth."""
SIGNIFICANT = 0.0005
"""At 0.005 three of two hundred emulated measurements were called unknown when all that was hidden had been found."""
_LINE = 1e-3
_MOST_LINES = 1500
_DIRECTION_SHARE = 0.25


def unknown_structure(judge: Judge, model: Scored) -> tuple[Unknown | None, float | None]:
    """Return what structure is left, or None where what is left is noise; and the probability that it fits.

    A probe that earned its place in the model is structure without a name.
    """
    probes = [effect for effect, _ in model.choices if isinstance(effect, Probe)]
    depends = [name for probe in probes for name in probe.depends_on]
    tested = lack_of_fit(judge, model)
    period = None
    repeats = False
    if tested is not None:
        hair = OF_EXPLAINED_IN_MOTION if judge.space.dataset.conditions.moving else OF_EXPLAINED
        least = max(MATTERS * tested[2], hair * float(np.std(judge.fit(model).effects())))
        repeats = tested[0] < SIGNIFICANT and tested[1] > least
    if repeats:
        left = judge.left(model)
        left = left - left.mean()
        depends += _position_or_direction(judge.space.dataset, left)
        period = _strongest_period(judge.space.dataset, left)
    p = None if tested is None else tested[0]
    if not depends:
        return None, p
    depends = list(dict.fromkeys(depends))
    c = judge.space.dataset.conditions
    line = "" if period is None else f"; the strongest line has a period of {period:.4g} {c.position_unit}"
    again = "repeats from run to run" if judge.space.dataset.has_repeats else "is the same in both directions"
    how = again if repeats else "is explained by no effect of the library"
    return Unknown(
        depends_on=tuple(depends),
        period=period,
        frequency_hz=1.0 / period if period is not None and c.time_is_coordinate else None,
        description=f"the residual depends on {', '.join(depends)} and {how}{line}",
    ), p


def _position_or_direction(dataset: Dataset, left: Floats) -> list[str]:
    """Return whether what repeats is common to both directions, differs between them, or both."""
    c = dataset.coordinates
    if not dataset.has_repeats or not c.both_directions or c.direction is None:
        return ["position"]
    member = dataset.cell >= 0
    edges = np.quantile(c.position[member], np.linspace(0.0, 1.0, 33)[1:-1])
    place = np.searchsorted(np.unique(edges), c.position[member], side="right")
    both = _variance_by(place, left[member])
    differing = _variance_by(place, left[member] * np.sign(c.direction[member]))
    return ["position", "direction"] if differing > _DIRECTION_SHARE * max(both, differing) else ["position"]


def _variance_by(number: np.ndarray, values: Floats) -> float:
    count = np.bincount(number)
    means = np.bincount(number, weights=values) / np.maximum(count, 1)
    return float(np.mean(means[count > 0] ** 2))


def _strongest_period(dataset: Dataset, left: Floats) -> float | None:
    """Return the period of the strongest line in position, where there is one above chance.

    Looked at are the means over repeats: what repeats without a wave would be one by as many repeats.
    """
    grid = frequencies(dataset.coordinates)[:_MOST_LINES]
    cells = compared_cells(dataset)
    member = cells >= 0
    cell, count = np.unique(cells[member], return_inverse=True, return_counts=True)[1:]
    if not grid.size or count.size > 20 * _MOST_LINES:
        return None
    position, left = (
        np.bincount(cell, weights=values[member]) / count for values in (dataset.coordinates.position, left)
    )
    left = left - left.mean()
    waves = np.stack([harmonic_columns(position, 1.0 / f, 1).T for f in grid])
    fall = falls(waves, Beside(np.ones((1, left.size)) / np.sqrt(left.size), left, float(left @ left)))
    k = int(np.argmax(fall))
    spread = float(left @ left - fall[k]) / max(left.size - 3, 1)
    p = grid.size * float(chdtrc(2, fall[k] / max(spread, 1e-300)))
    return float(1.0 / grid[k]) if p < _LINE else None
