"""A least-squares support vector machine with a Gaussian kernel (Yao et al. 2013, section 3.2)."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt
from scipy.linalg import cholesky, solve_triangular

from rtec.errors import ArgumentError
from rtec.predictors._columns import Floats
from rtec.predictors.warm import _plain
from rtec.predictors.warm._lssvm_kernels import ls_svm_answer

MOST_LANDMARKS = 96
"""Rows by which the standard deviation is told."""
KNOWN = 1e-6
"""Variance, as a share of the prior one, at which a row is told by the landmarks before it."""
LEAST = 1e-9
"""Width and gamma."""
AT_ONCE = 1 << 21
"""Kernel values that are computed at once."""


@dataclass(frozen=True, kw_only=True, eq=False)
class LsSvm:
    """A sum of Gaussian bells around the rows of the training, perhaps a slope, and a bias.

    Raises
    ------
    ArgumentError
        Shapes that do not fit, a number that is not finite, or a width or gamma that is not above 0.

    Notes
    -----
    ``f(x) = sum_i alpha_i K(x, x_i) + b`` with ``K(x, z) = exp(-abs(x - z) ** 2 / (2 width ** 2)) + linear * x'z`` of
    scaled columns (Yao et al. 2013, equation 6, who do not name their kernel). What the linear parts add up to is
    kept as slopes. Far from all rows the bells are silent, and the slopes go on.

    The standard deviation is that of the Gaussian process with the same mean, a bias of which nothing is known
    before, and a variance of the noise of ``noise_sd ** 2 / gamma``. It is computed from the landmarks: rows taken
    greedily, each where those before leave most open. What they do not tell counts as open.

    References
    ----------
    Suykens et al. 2002, Least Squares Support Vector Machines; Rasmussen and Williams 2006, section 2.7 (bias) and
    8.3 (landmarks).

    Examples
    --------
    >>> bell = LsSvm(centre=[0.0], per_unit=[1.0], width=1.0, gamma=1e6, points=[[-1.0], [1.0]], alpha=[-1.0, 1.0],
    ...              bias=5.0, noise_sd=2.0)
    >>> [found.round(3).tolist() for found in bell.predict(np.array([[0.0], [1.0], [9.0]]))]
    [[5.0, 5.865, 5.0], [1.191, 0.003, 2.504]]
    """

    kind: ClassVar[str] = "ls-svm"

    centre: Floats
    """Shape (features,)."""
    per_unit: Floats
    """Shape (features,): what a column less its centre is multiplied by; 0 for columns that were left out."""
    width: float
    """Of the bells, in scaled columns."""
    gamma: float
    """Weight of the residuals against the smoothness."""
    points: Floats
    """Scaled rows of the training, shape (rows, features)."""
    alpha: Floats
    """Shape (rows,)."""
    bias: float
    slopes: Floats = field(default_factory=lambda: np.zeros(0))
    """Of scaled columns, shape (features,); empty: none."""
    noise_sd: float = 0.0
    """Standard deviation of the bells before anything is measured; 0: not known."""
    linear: float = 0.0
    """Weight of the linear kernel against the bells."""

    def __post_init__(self) -> None:
        features, rows = np.size(self.centre), np.size(self.alpha)
        if not np.size(self.slopes):
            object.__setattr__(self, "slopes", np.zeros(features))
        one = (features,)
        shapes = {"centre": one, "per_unit": one, "slopes": one, "alpha": (rows,), "points": (rows, features)}
        for name, shape in shapes.items():
            array = np.asarray(getattr(self, name), dtype=np.float64)
            if array.shape != shape or not array.size:
                raise ArgumentError(name, f"an array of shape {array.shape}", f"shape {shape}, and none of them 0")
            if not np.isfinite(array).all():
                raise ArgumentError(name, "a number that is not finite", "finite numbers")
            object.__setattr__(self, name, array)
        for name, least in (
            ("width", LEAST),
            ("gamma", LEAST),
            ("noise_sd", 0.0),
            ("linear", 0.0),
            ("bias", -np.inf),
        ):
            value = getattr(self, name)
            if not (value >= least and np.isfinite(value)):
                raise ArgumentError(name, value, f"a finite number of at least {least:g}")

    @property
    def parameters(self) -> int:
        """A multiplier for each row, the bias, and slopes that are not zero."""
        return self.alpha.size + 1 + int(np.count_nonzero(self.slopes))

    def predict(self, columns: Floats) -> tuple[Floats, Floats]:
        """Return output and standard deviation, shape (rows,) each, of columns, shape (rows, features)."""
        scaled = (np.asarray(columns, dtype=np.float64) - self.centre) * self.per_unit
        found, sd = np.empty(len(scaled)), np.empty(len(scaled))
        at_once = max(AT_ONCE // self.alpha.size, 1)
        for first in range(0, len(scaled), at_once):
            part = slice(first, first + at_once)
            alike = kernel_between(scaled[part], self.points, self.width)
            found[part] = alike @ self.alpha + scaled[part] @ self.slopes + self.bias
            sd[part] = self.noise_sd * self._known.sd(scaled[part], alike) if self.noise_sd else 0.0
        return found, sd

    @functools.cached_property
    def _known(self) -> _Known:
        return _Known.of(self.points, self.width, self.linear, self.gamma)

    @property
    def function(self) -> Callable[..., float]:
        """Compiled, for one row."""
        found: Callable[..., float] = ls_svm_answer
        return found

    @property
    def numbers(self) -> Floats:
        """A new array; its layout stands in ``_lssvm_kernels.py``."""
        known = self._known
        sizes = [float(n) for n in (self.centre.size, self.alpha.size, known.places.size)]
        head = [*sizes, 0.5 / self.width**2, self.bias, self.noise_sd, known.noise, known.bias_weight, self.linear]
        triangles = [known.places.astype(np.float64), known.root.ravel(), known.left.ravel(), known.pull]
        columns = [self.centre, self.per_unit, self.slopes]
        return np.concatenate([head, *columns, self.points.ravel(), self.alpha, *triangles])

    @property
    def room(self) -> int:
        """For a scaled row, its kernel values, and what the landmarks tell."""
        return self.centre.size + self.alpha.size + self._known.places.size

    @property
    def plain(self) -> _plain.Plain:
        """All that `of` needs to build the same function again."""
        return {
            "centre": self.centre.tolist(),
            "per_unit": self.per_unit.tolist(),
            "width": float(self.width),
            "gamma": float(self.gamma),
            "points": self.points.ravel().tolist(),
            "alpha": self.alpha.tolist(),
            "bias": float(self.bias),
            "slopes": self.slopes.tolist(),
            "noise_sd": float(self.noise_sd),
            "linear": float(self.linear),
        }

    @classmethod
    def of(cls, plain: Mapping[str, Any]) -> LsSvm:
        """Build the function from plain data.

        Raises
        ------
        ArgumentError
            A value is missing, no number, or of another length.
        """
        centre, alpha = _plain.array(plain, "centre"), _plain.array(plain, "alpha")
        return cls(
            centre=centre,
            per_unit=_plain.array(plain, "per_unit", centre.size),
            width=_plain.number(plain, "width", above=0.0),
            gamma=_plain.number(plain, "gamma", above=0.0),
            points=_plain.array(plain, "points", centre.size * alpha.size).reshape(alpha.size, centre.size),
            alpha=alpha,
            bias=_plain.number(plain, "bias"),
            slopes=_plain.array(plain, "slopes", centre.size),
            noise_sd=_plain.number(plain, "noise_sd"),
            linear=_plain.number(plain, "linear"),
        )


def kernel_between(left: Floats, right: Floats, width: float) -> Floats:
    """Return the Gaussian kernel of scaled rows, shape (rows of the left, rows of the right)."""
    found: Floats = left @ right.T
    found *= 2.0
    found -= np.einsum("ij,ij->i", left, left)[:, None]
    found -= np.einsum("ij,ij->i", right, right)
    np.minimum(found, 0.0, out=found)
    found *= 0.5 / width**2
    return np.exp(found, out=found)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Known:
    """What the rows of a training tell about any other row, by a few landmarks among them."""

    places: npt.NDArray[np.int64]
    points: Floats
    """Of the landmarks."""
    linear: float
    root: Floats
    """Lower Cholesky factor of the landmarks' kernel."""
    left: Floats
    """Lower triangle: of what the landmarks tell, the root of what the rows leave open."""
    pull: Floats
    """What the kernel of each landmark takes of the bias."""
    bias_weight: float
    """One over the variance of the bias, in units of the prior variance."""
    noise: float
    """Variance of the noise in the same units."""

    @classmethod
    def of(cls, points: Floats, width: float, linear: float, gamma: float) -> _Known:
        places, columns = _landmarks(points, width, linear)
        inner = cholesky(np.eye(places.size) + gamma * (columns.T @ columns), lower=True)
        left = solve_triangular(inner, np.eye(places.size), lower=True)
        total = columns.sum(axis=0)
        pull = gamma * (left.T @ (left @ total))
        open_part = np.ones(len(points)) - columns @ pull  # gamma times this: the inverse of the kernel, times 1
        return cls(
            places=places,
            points=points[places],
            linear=linear,
            root=np.tril(columns[places]),
            left=np.tril(left),
            pull=pull,
            bias_weight=gamma * float(open_part @ open_part) + float(pull @ pull),
            noise=1.0 / gamma,
        )

    def sd(self, asked: Floats, alike: Floats) -> Floats:
        """Return standard deviations in units of the prior one, of scaled rows and their bells with all rows."""
        whole = alike[:, self.places] + self.linear * (asked @ self.points.T)
        known = solve_triangular(self.root, whole.T, lower=True)
        prior = 1.0 + self.linear * np.square(asked).sum(axis=1)
        square = self.noise + np.maximum(prior - np.square(known).sum(axis=0), 0.0)
        square += np.square(self.left @ known).sum(axis=0) + np.square(1.0 - self.pull @ known) / self.bias_weight
        found: Floats = np.sqrt(square)
        return found


def _landmarks(points: Floats, width: float, linear: float) -> tuple[npt.NDArray[np.int64], Floats]:
    """Return where landmarks stand, and the pivoted Cholesky factor of the kernel, shape (rows, landmarks)."""
    most = min(MOST_LANDMARKS, len(points))
    columns, places = np.zeros((len(points), most)), np.zeros(most, dtype=np.int64)
    open_part = 1.0 + linear * np.square(points).sum(axis=1)
    least = KNOWN * open_part.max()
    for k in range(most):
        at = int(np.argmax(open_part))
        if open_part[at] < least:
            return places[:k], columns[:, :k]
        column = kernel_between(points, points[at : at + 1], width)[:, 0] + linear * (points @ points[at])
        column -= columns[:, :k] @ columns[at, :k]
        columns[:, k] = column / np.sqrt(open_part[at])
        open_part -= np.square(columns[:, k])
        open_part[at] = 0.0
        places[k] = at
    return places, columns
