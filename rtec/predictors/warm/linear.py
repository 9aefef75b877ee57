"""A linear function of features, and how sure its coefficients leave it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np

from rtec.errors import ArgumentError
from rtec.predictors._columns import Floats
from rtec.predictors.warm import _plain
from rtec.predictors.warm._linear_kernels import linear_answer


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Linear:
    """A value at the centre of the rows and a slope for each feature.

    Raises
    ------
    ArgumentError
        Shapes that do not fit, or a number that is not finite.

    Notes
    -----
    The variance of the answer is ``noise_sd ** 2 + sum((spread @ (x - centre)) ** 2)``: what no coefficient
    explains, and what the coefficients leave open.

    Examples
    --------
    >>> line = Linear(centre=[20.0], intercept=1.0, slopes=[0.5], noise_sd=0.3, spread=[[0.2]])
    >>> [found.round(3).tolist() for found in line.predict(np.array([[20.0], [22.0]]))]
    [[1.0, 2.0], [0.3, 0.5]]
    """

    kind: ClassVar[str] = "linear"

    centre: Floats
    """Shape (features,): where the value is the intercept."""
    intercept: float
    slopes: Floats
    """Shape (features,); 0 for columns that were left out."""
    noise_sd: float = 0.0
    spread: Floats = field(default_factory=lambda: np.zeros((0, 0)))
    """Shape (directions, features)."""

    def __post_init__(self) -> None:
        centre, slopes = (np.asarray(getattr(self, name), dtype=np.float64) for name in ("centre", "slopes"))
        spread = (
            np.asarray(self.spread, dtype=np.float64).reshape(-1, centre.size) if centre.size else np.zeros((0, 0))
        )
        if centre.ndim != 1 or not centre.size or slopes.shape != centre.shape:
            raise ArgumentError(
                "slopes", f"an array of shape {slopes.shape}", f"one for each of {centre.size} features"
            )
        found = [self.intercept, self.noise_sd, *centre, *slopes, *spread.ravel()]
        if not np.isfinite(found).all() or self.noise_sd < 0.0:
            raise ArgumentError("slopes", "a number that is not finite", "finite numbers, and a noise of 0 or more")
        for name, value in (("centre", centre), ("slopes", slopes), ("spread", spread)):
            object.__setattr__(self, name, value)

    @property
    def parameters(self) -> int:
        """The intercept and the slopes of columns that were not left out."""
        return 1 + int(np.count_nonzero(self.slopes))

    def predict(self, columns: Floats) -> tuple[Floats, Floats]:
        """Return output and standard deviation, shape (rows,) each, of columns, shape (rows, features)."""
        away = np.asarray(columns, dtype=np.float64) - self.centre
        sd = np.sqrt(self.noise_sd**2 + np.square(away @ self.spread.T).sum(axis=1))
        return self.intercept + away @ self.slopes, sd

    @property
    def function(self) -> Callable[..., float]:
        """Compiled, for one row."""
        found: Callable[..., float] = linear_answer
        return found

    @property
    def numbers(self) -> Floats:
        """A new array; its layout stands in ``_linear_kernels.py``."""
        head = [float(self.centre.size), float(len(self.spread)), self.intercept, self.noise_sd]
        return np.concatenate([head, self.centre, self.slopes, self.spread.ravel()])

    @property
    def room(self) -> int:
        """None is needed."""
        return 0

    @property
    def plain(self) -> _plain.Plain:
        """All that `of` needs to build the same function again."""
        return {
            "centre": self.centre.tolist(),
            "intercept": float(self.intercept),
            "slopes": self.slopes.tolist(),
            "noise_sd": float(self.noise_sd),
            "spread": self.spread.ravel().tolist(),
        }

    @classmethod
    def of(cls, plain: Mapping[str, Any]) -> Linear:
        """Build the function from plain data.

        Raises
        ------
        ArgumentError
            A value is missing, no number, or of another length.
        """
        centre = _plain.array(plain, "centre")
        return cls(
            centre=centre,
            intercept=_plain.number(plain, "intercept"),
            slopes=_plain.array(plain, "slopes", centre.size),
            noise_sd=_plain.number(plain, "noise_sd"),
            spread=_plain.array(plain, "spread", least=max(centre.size, 1)),
        )
