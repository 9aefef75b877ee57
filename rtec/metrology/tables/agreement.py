"""Whether a deviation is what actual position less target is, where a file states all three."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from rtec.metrology.measurement import Column
from rtec.metrology.readings import Floats

_FEWEST = 3
_CLOSE = 0.05
_SLIPS = (
    (-1.0, "target less actual"),
    (1e3, "1000 times actual less target"),
    (1e-3, "a thousandth of actual less target"),
)


def disagreement(columns: Mapping[str, Column]) -> str | None:
    """Return what a deviation is where it is not actual less target but has its shape; None where nothing is wrong.

    A datum that only one of the two has makes no difference, and columns that have little to do with each other (the
    position of an encoder beside the error that a laser saw) are no contradiction.

    Examples
    --------
    >>> target, error = np.array([0.0, 100, 200]), np.array([0.001, -0.002, 0.004])
    >>> named = {"target": target, "actual": target + error, "deviation": -error}
    >>> disagreement({name: Column(name, "mm", values) for name, values in named.items()})
    'target less actual'
    """
    if not {"target", "actual", "deviation"} <= columns.keys():
        return None
    target, actual, deviation = (columns[name] for name in ("target", "actual", "deviation"))
    if len({target.unit, actual.unit, deviation.unit}) > 1 or target.values.size < _FEWEST:
        return None
    said, seen = _centred(deviation.values), _centred(actual.values - target.values)
    size = float(np.abs(said).max())
    slips = (what for factor, what in _SLIPS if size > 0.0 and np.abs(said - factor * seen).max() <= _CLOSE * size)
    return next(slips, None)


def _centred(values: Floats) -> Floats:
    centred: Floats = values - values.mean()
    return centred
