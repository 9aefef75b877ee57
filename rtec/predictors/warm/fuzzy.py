"""A fuzzy network: linear functions, each of which counts around the centre of its rule (Yao et al. 2013, eq. 1)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, ClassVar

import numpy as np

from rtec.errors import ArgumentError, unknown
from rtec.predictors._columns import Floats
from rtec.predictors.warm import _plain
from rtec.predictors.warm._fuzzy_kernels import OUTSIDE, fuzzy_answer


class Conjunction(StrEnum):
    """How the memberships of all components become the weight of a rule."""

    PRODUCT = "product"
    MINIMUM = "minimum"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Fuzzy:
    """A Takagi-Sugeno network over principal components of the features.

    Raises
    ------
    ArgumentError
        Shapes that do not fit, a number that is not finite, or a width that is not above 0.

    Notes
    -----
    ``y = sum_i w_i theta_i' [1, z] / sum_i w_i`` with ``z = axes @ (x - centre)``. A membership is
    ``exp(-(z_j - rules_ij) ** 2 / (2 widths_ij ** 2))``; ``w_i`` is the product of those of a rule, as Yao et al.
    print equation 1, or their minimum, which the sign in it stands for. Where the sum of weights is below 1e-6 the
    row lies outside all rules, and the answer is NaN.

    References
    ----------
    Takagi and Sugeno 1985; Fu and Chen 2004 (principal components).

    Examples
    --------
    >>> two = Fuzzy(centre=[0.0], axes=[[1.0]], rules=[[-1.0], [1.0]], widths=[[1.0], [1.0]],
    ...             consequents=[[0.0, 0.0], [4.0, 0.0]])
    >>> two.predict(np.array([[0.0], [3.0], [99.0]]))[0].round(2).tolist()
    [2.0, 3.99, nan]
    """

    kind: ClassVar[str] = "fuzzy"

    centre: Floats
    """Shape (features,)."""
    axes: Floats
    """Shape (components, features)."""
    rules: Floats
    """Where each rule counts most, shape (rules, components)."""
    widths: Floats
    """Shape (rules, components)."""
    consequents: Floats
    """A constant, and a slope for each component, shape (rules, 1 + components)."""
    conjunction: Conjunction = Conjunction.PRODUCT
    noise_sd: float = 0.0
    spread: Floats = field(default_factory=lambda: np.zeros((0, 0)))
    """What the consequents leave open: shape (directions, rules * (1 + components))."""

    def __post_init__(self) -> None:
        for name in ("centre", "axes", "rules", "widths", "consequents", "spread"):
            array = np.asarray(getattr(self, name), dtype=np.float64)
            if not np.isfinite(array).all():
                raise ArgumentError(name, "a number that is not finite", "finite numbers")
            object.__setattr__(self, name, array)
        if self.centre.ndim != 1 or self.axes.ndim != 2 or self.rules.ndim != 2 or not self.axes.size:
            raise ArgumentError("axes", f"an array of shape {self.axes.shape}", "shape (components, features)")
        rules, components = len(self.rules), len(self.axes)
        for name, shape in (
            ("axes", (components, self.centre.size)),
            ("rules", (max(rules, 1), components)),
            ("widths", (rules, components)),
            ("consequents", (rules, components + 1)),
        ):
            if getattr(self, name).shape != shape:
                raise ArgumentError(name, f"an array of shape {getattr(self, name).shape}", f"shape {shape}")
        if not (self.widths > 0.0).all():
            raise ArgumentError("widths", self.widths.min(), "widths above 0")
        if not 0.0 <= self.noise_sd < np.inf:
            raise ArgumentError("noise_sd", self.noise_sd, "a finite number of 0 or more")
        object.__setattr__(self, "spread", self.spread.reshape(-1, self.consequents.size))

    @property
    def parameters(self) -> int:
        """Consequents, centres and widths of all rules."""
        return self.consequents.size + self.rules.size + self.widths.size

    def predict(self, columns: Floats) -> tuple[Floats, Floats]:
        """Return output and standard deviation, shape (rows,) each, of columns, shape (rows, features)."""
        level = (np.asarray(columns, dtype=np.float64) - self.centre) @ self.axes.T
        parts = parts_of(level, self.rules, self.widths, self.conjunction)
        sd = np.sqrt(self.noise_sd**2 + np.square(parts @ self.spread.T).sum(axis=1))
        return parts @ self.consequents.ravel(), sd

    @property
    def function(self) -> Callable[..., float]:
        """Compiled, for one row."""
        found: Callable[..., float] = fuzzy_answer
        return found

    @property
    def numbers(self) -> Floats:
        """A new array; its layout stands in ``_fuzzy_kernels.py``."""
        sizes = [self.centre.size, *self.rules.shape[::-1], len(self.spread), self.conjunction is Conjunction.MINIMUM]
        arrays = (self.centre, self.axes, self.rules, self.widths, self.consequents, self.spread)
        return np.concatenate([[float(n) for n in sizes], [self.noise_sd], *(array.ravel() for array in arrays)])

    @property
    def room(self) -> int:
        """For the components, and their parts in each rule."""
        return len(self.axes) + 1 + self.consequents.size

    @property
    def plain(self) -> _plain.Plain:
        """All that `of` needs to build the same function again."""
        arrays = ("centre", "axes", "rules", "widths", "consequents", "spread")
        lists: _plain.Plain = {name: getattr(self, name).ravel().tolist() for name in arrays}
        return {**lists, "conjunction": str(self.conjunction), "noise_sd": float(self.noise_sd)}

    @classmethod
    def of(cls, plain: Mapping[str, Any]) -> Fuzzy:
        """Build the function from plain data.

        Raises
        ------
        ArgumentError
            A value is missing, no number, of another length, or a conjunction that is unknown.
        """
        word = plain.get("conjunction")
        if word not in list(Conjunction):
            raise unknown("conjunction", str(word), tuple(Conjunction), noun="conjunction")
        centre = _plain.array(plain, "centre")
        axes = _plain.array(plain, "axes", least=max(centre.size, 1)).reshape(-1, max(centre.size, 1))
        size = max(len(axes), 1)
        rules = _plain.array(plain, "rules", least=size).reshape(-1, size)
        return cls(
            centre=centre,
            axes=axes,
            rules=rules,
            widths=_plain.array(plain, "widths", rules.size).reshape(rules.shape),
            consequents=_plain.array(plain, "consequents", len(rules) * (size + 1)).reshape(len(rules), size + 1),
            conjunction=Conjunction(word),
            noise_sd=_plain.number(plain, "noise_sd"),
            spread=_plain.array(plain, "spread", least=max(len(rules) * (size + 1), 1)),
        )


def parts_of(level: Floats, rules: Floats, widths: Floats, conjunction: Conjunction) -> Floats:
    """Return what the consequents multiply, shape (rows, rules * (1 + components)); NaN outside all rules."""
    square = np.square((level[:, None] - rules) / widths)
    weights = np.exp(-0.5 * (square.max(axis=2) if conjunction is Conjunction.MINIMUM else square.sum(axis=2)))
    whole = weights.sum(axis=1, keepdims=True)
    shares = np.divide(weights, whole, out=np.full_like(weights, np.nan), where=whole >= OUTSIDE)
    terms = np.column_stack([np.ones(len(level)), level])
    found: Floats = (shares[:, :, None] * terms[:, None]).reshape(len(level), -1)
    return found
