"""Where what lags begins: a log, or the PC, may start beside a machine that is warm."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from rtec.errors import ArgumentError
from rtec.predictors._columns import Floats
from rtec.predictors.warm._warm_kernels import BEGIN_HEAD
from rtec.predictors.warm.features import SPINDLE_SPEED, Feature, columns_of


def seen_at_once(features: Sequence[Feature]) -> list[int]:
    """Return the places of the features that tell where the others begin: temperatures as they are."""
    return [k for k, one in enumerate(features) if one.lag_s == 0.0 and one.of != SPINDLE_SPEED]


def lagging(features: Sequence[Feature]) -> list[int]:
    """Return the places of the features that lag."""
    return [k for k, one in enumerate(features) if one.lag_s > 0.0]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Begin:
    """Linear functions of temperatures that tell what lags at a first reading.

    Parameters
    ----------
    features
        Those of a model.
    numbers
        Lowest and highest value, constant, and a slope for each of `seen_at_once`; a row for each of `lagging`.

    Raises
    ------
    ArgumentError
        Another shape, or a number that is not finite.

    Examples
    --------
    >>> features = (Feature(of="temperature_a"), Feature(of="temperature_a", lag_s=600.0))
    >>> begin = Begin(features=features, numbers=np.array([[15.0, 40.0, 1.0, 0.9]]))
    >>> columns = np.array([[30.0, 30.0], [30.0, 30.0]])
    >>> begin.applied(columns, np.array([0.0, 600.0])).round(3).tolist()
    [[30.0, 28.0], [30.0, 29.264]]
    """

    features: tuple[Feature, ...]
    numbers: Floats

    def __post_init__(self) -> None:
        shape = (len(lagging(self.features)), BEGIN_HEAD + len(seen_at_once(self.features)))
        found = np.asarray(self.numbers, dtype=np.float64)
        if found.shape != shape or not np.isfinite(found).all():
            raise ArgumentError("begin", f"numbers of shape {found.shape}", f"finite ones of shape {shape}")
        object.__setattr__(self, "numbers", found)

    def applied(self, columns: Floats, time_s: Floats) -> Floats:
        """Return the columns of a stretch, shape (rows, features), as they are with this beginning.

        Parameters
        ----------
        columns
            As `columns_of` gives them: in balance at the first row.
        time_s
            Of each row.
        """
        low, high, constant, *slopes = self.numbers.T
        told = constant + np.array(slopes).reshape(-1, len(low)).T @ columns[0, seen_at_once(self.features)]
        found = columns.copy()
        for k, state in zip(lagging(self.features), np.clip(told, low, high), strict=True):
            found[:, k] += (state - columns[0, k]) * np.exp(-(time_s - time_s[0]) / self.features[k].lag_s)
        return found


def begun_columns(
    features: tuple[Feature, ...],
    begin: Begin | None,
    time_s: Floats,
    inputs: Mapping[str, Floats],
    starts: tuple[int, ...] = (0,),
) -> Floats:
    """Return the columns of features, shape (rows, features), each stretch with its beginning.

    Parameters
    ----------
    features, time_s, inputs, starts
        As of `columns_of`.
    begin
        None: what lags is in balance at the first row of each stretch.
    """
    found = columns_of(features, time_s, inputs, starts)
    if begin is None:
        return found
    ends = (*starts[1:], time_s.size)
    return np.concatenate([begin.applied(found[a:b], time_s[a:b]) for a, b in zip(starts, ends, strict=True)])
