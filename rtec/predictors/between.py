"""What a table says between its points: straight lines, or cubics that never overshoot."""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum

import numpy as np

from rtec.predictors import _kernels
from rtec.predictors._columns import Floats


class Between(Enum):
    """How the error goes from one point of a table to the next."""

    LINES = "linear"
    """Straight lines, as controls have them (thesis 3.1.1)."""
    CUBIC = "cubic"
    """Monotone cubics (Fritsch and Butland 1984): smooth, and between two points never beyond them."""

    @property
    def function(self) -> Callable[..., float]:
        """The compiled function."""
        return _kernels.table_error if self is Between.LINES else _kernels.cubic_error

    def numbers(self, *ways: tuple[Floats, Floats]) -> Floats:
        """Return positions and errors of both directions as the compiled function takes them."""
        return np.concatenate([self._of_one(positions, errors) for positions, errors in ways])

    def _of_one(self, positions: Floats, errors: Floats) -> Floats:
        columns = [np.array([float(positions.size)]), positions, errors]
        if self is Between.CUBIC:
            # a quarter of a second, and most tables are of straight lines
            from scipy.interpolate import PchipInterpolator  # noqa: PLC0415 - as above

            columns.append(PchipInterpolator(positions, errors).derivative()(positions))
        return np.concatenate(columns)
