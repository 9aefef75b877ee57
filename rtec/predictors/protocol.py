"""What every predictor offers: its error at a position, and itself as packed numbers for the compiled loops."""

from __future__ import annotations

from abc import ABC, abstractmethod
from enum import Enum
from typing import Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt

from rtec.errors import ArgumentError
from rtec.predictors import _kernels

Floats = npt.NDArray[np.float64]

FORWARD = 1
"""Direction of motion towards larger positions."""
REVERSE = -1
"""Direction of motion towards smaller positions."""


class Outside(Enum):
    """What to say of a position outside the range for which the predictor was made."""

    HOLD = "hold"
    """Hold the error of the nearest end (thesis 3.1.1)."""
    REFUSE = "refuse"
    """Raise an error that names the position."""


@runtime_checkable
class Predictor(Protocol):
    """Error of an axis as a function of position and direction.

    The error is the deviation, actual minus target, in mm (ISO 230-2). It is what was measured; a compensation is its
    negative.
    """

    @property
    def kind(self) -> int:
        """Kind for ``predict_mm``: 0 none, 1 table, 2 network."""

    @property
    def packed(self) -> Floats:
        """A new one-dimensional array for ``predict_mm``; its layout stands in ``_kernels.py``."""

    @property
    def range_mm(self) -> tuple[float, float]:
        """Lowest and highest position, in mm, for which both directions are known."""

    def error_mm(
        self, position_mm: npt.ArrayLike, direction: npt.ArrayLike, *, outside: Outside = Outside.HOLD
    ) -> Floats:
        """Return the error in mm at each position."""


class PackedPredictor(ABC):
    """Base of the predictors of this package: the error follows from the packed numbers."""

    __slots__ = ()

    @property
    @abstractmethod
    def kind(self) -> int:
        """Kind for ``predict_mm``: 0 none, 1 table, 2 network."""

    @property
    @abstractmethod
    def packed(self) -> Floats:
        """A new one-dimensional array for ``predict_mm``; its layout stands in ``_kernels.py``."""

    @property
    @abstractmethod
    def range_mm(self) -> tuple[float, float]:
        """Lowest and highest position, in mm, for which both directions are known."""

    def error_mm(
        self, position_mm: npt.ArrayLike, direction: npt.ArrayLike, *, outside: Outside = Outside.HOLD
    ) -> Floats:
        """Return the error, actual minus target, at each position.

        Parameters
        ----------
        position_mm
            Positions in mm, of any shape.
        direction
            +1 forward or -1 reverse, of a shape that broadcasts with the positions.
        outside
            What to do with positions outside ``range_mm``.

        Returns
        -------
        numpy.ndarray
            Errors in mm, of the broadcast shape.

        Raises
        ------
        ArgumentError
            A position that is not a finite number, a direction other than +1 and -1, shapes that do not fit, or, with
            ``Outside.REFUSE``, a position outside the range.

        Examples
        --------
        >>> NoError().error_mm([0.0, 12.5], FORWARD)
        array([0., 0.])
        """
        position = _numbers("position_mm", position_mm)
        way = _directions(direction)
        try:
            position, way = np.broadcast_arrays(position, way)
        except ValueError:
            raise ArgumentError("direction", f"shape {way.shape}", f"a shape that fits {position.shape}") from None
        if outside is Outside.REFUSE:
            self._refuse_outside(position)
        x_mm = np.array(position, dtype=np.float64).ravel()
        error = np.empty_like(x_mm)
        _kernels.predict_many(self.kind, self.packed, x_mm, np.array(way, dtype=np.int64).ravel(), error)
        return error.reshape(position.shape)

    def _refuse_outside(self, position_mm: Floats) -> None:
        low, high = self.range_mm
        beyond = position_mm[(position_mm < low) | (position_mm > high)]
        if beyond.size:
            raise ArgumentError(
                "position_mm",
                f"{beyond.flat[0]:.12g} mm",
                f"{low:.12g} to {high:.12g} mm, the range of the predictor",
                "stay inside, or hold the error at the ends",
            )

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self) or not isinstance(other, PackedPredictor):
            return NotImplemented
        return self.range_mm == other.range_mm and np.array_equal(self.packed, other.packed)

    def __hash__(self) -> int:
        return hash((type(self), self.packed.tobytes()))


class NoError(PackedPredictor):
    """Predictor of a perfect axis: zero everywhere.

    Examples
    --------
    >>> float(NoError().error_mm(25.4, REVERSE))
    0.0
    """

    __slots__ = ()

    @property
    def kind(self) -> int:
        """Kind for ``predict_mm``."""
        return _kernels.NONE

    @property
    def packed(self) -> Floats:
        """One number that is not read."""
        return np.zeros(1)

    @property
    def range_mm(self) -> tuple[float, float]:
        """All positions."""
        return (-np.inf, np.inf)

    def __repr__(self) -> str:
        return "NoError()"


def _numbers(name: str, values: npt.ArrayLike) -> Floats:
    """Return ``values`` as float64, or say which is no finite number."""
    try:
        array = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        raise ArgumentError(name, repr(values)[:60], "finite numbers") from None
    bad = array[~np.isfinite(array)]
    if bad.size:
        raise ArgumentError(name, bad.flat[0], "finite numbers")
    return array


def _directions(direction: npt.ArrayLike) -> npt.NDArray[np.int64]:
    way = _numbers("direction", direction)
    bad = way[np.abs(way) != 1.0]
    if bad.size:
        raise ArgumentError("direction", f"{bad.flat[0]:g}", "+1 (forward) or -1 (reverse)")
    return way.astype(np.int64)
