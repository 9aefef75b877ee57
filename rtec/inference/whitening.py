"""Noise that is correlated from reading to reading, and the transformation that makes it white.

The noise of a reading is a first-order autoregressive process plus a white part, starting anew with each run. Its
innovations, divided by their standard deviation, are white; least squares on innovations is generalised least squares
on readings, at a cost linear in rows.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rtec.effects import Floats
from rtec.inference import _whiten_kernels as kernels


@dataclass(frozen=True, slots=True, kw_only=True)
class Correlation:
    """Correlation of the noise from reading to reading, for a total variance of 1.

    Parameters
    ----------
    rho
        Of the autoregressive part, from one reading to the next, 0..1.
    white
        Share of the white part in the variance, 0..1.
    """

    rho: float = 0.0
    white: float = 0.0

    @property
    def is_white(self) -> bool:
        """Whether readings are independent."""
        return self.rho == 0.0 or self.white == 1.0

    @property
    def to_next(self) -> float:
        """Correlation of one reading with the next."""
        return self.rho * (1.0 - self.white)

    def whitened(self, columns: Floats, segment_starts: NDArray[np.bool_]) -> Floats:
        """Return the standardised innovations of columns, shape (columns, rows).

        Parameters
        ----------
        columns
            Shape (columns, rows) or (rows,); left as they are.
        segment_starts
            Shape (rows,): where a run begins.
        """
        table = np.atleast_2d(columns)
        if self.is_white:
            return table
        place = places(segment_starts)
        gain, sd = self._gains(int(place.max()) + 1)
        done = np.array(table, dtype=np.float64, order="C", copy=True)
        kernels.whiten(done, place, self.rho, gain, sd)
        return done

    def log_determinant(self, segment_starts: NDArray[np.bool_]) -> float:
        """Return the logarithm of the determinant of the correlation matrix."""
        if self.is_white:
            return 0.0
        place = places(segment_starts)
        _, sd = self._gains(int(place.max()) + 1)
        return float(2.0 * np.log(sd)[place].sum())

    def _gains(self, longest: int) -> tuple[Floats, Floats]:
        gain, sd = np.empty(longest), np.empty(longest)
        kernels.gains(self.rho, self.white, longest, gain, sd)
        return gain, sd


def places(segment_starts: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Return the place of each row within its segment, counted from 0.

    Examples
    --------
    >>> places(np.array([True, False, True, False, False])).tolist()
    [0, 1, 0, 1, 2]
    """
    rows = np.arange(segment_starts.size)
    begin = np.maximum.accumulate(np.where(segment_starts, rows, 0))
    return (rows - begin).astype(np.int64)
