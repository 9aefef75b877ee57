"""The noise that a model leaves: white, correlated, or both; and how readings are freed of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rtec.dataset.dataset import Dataset
from rtec.effects import Floats

CORRELATIONS = (0.0, 0.3, 0.6, 0.8, 0.9, 0.95, 0.98, 0.99, 0.997, 0.999)
"""From reading to reading: steps of a factor of two or three in length, up to a thousand readings."""
WHITE_SHARES = (0.01, 0.1, 0.3, 0.6, 0.9)
"""Of the variance. Without any white part a correlated noise would foresee the next reading with no error."""
WANDERS_FROM, WANDERING = 0.98, 8.0
"""Nats that noise costs which wanders over fifty readings and more: it competes with all that is slow. At 2, one
effect in five of the noise's own size is taken for noise; at 12, one random walk in fifteen for an effect."""
MOST_CORRELATED, MOST_SLOW = 0.9, 0.7
"""Of a bounded colour, the larger part that is slow."""
SMALL_SHARES = (0.0001,)
"""Of noise that wanders, besides: the steps of a random walk are smaller than a hundredth of where it gets to."""


@dataclass(frozen=True, slots=True)
class Colour:
    """Correlation of the noise from reading to reading, and the share of its variance that is white.

    Examples
    --------
    >>> round(Colour(0.9, 0.3).length, 2), Colour().length
    (9.49, 0.0)
    """

    rho: float = 0.0
    white: float = 1.0

    @property
    def length(self) -> float:
        """Readings after which the correlated part has fallen to 1 / e."""
        return 0.0 if self.rho == 0.0 else -1.0 / float(np.log(self.rho))

    @property
    def rarity(self) -> float:
        """Nats by which a colour is less likely than others before the data have spoken."""
        return WANDERING if self.rho >= WANDERS_FROM else 0.0

    @property
    def bounded(self) -> Colour:
        """The colour under which shapes are scanned and readings held out, of a few, so that scans can be kept.

        No more correlated than it may be, and no more of it slow: noise that was fitted to what a model lacks would
        swallow that, and beside noise slower than a cell of the chessboard nothing shows that shifts all of the cell.
        """
        if self.rho < 0.5:
            return Colour()
        rho = 0.8 if self.rho < MOST_CORRELATED else MOST_CORRELATED
        return Colour(rho, 0.6 if self.white > 1.0 - MOST_SLOW else 0.3)


def _shares(rho: float) -> tuple[float, ...]:
    return (*SMALL_SHARES, *WHITE_SHARES) if rho >= WANDERS_FROM else WHITE_SHARES


COLOURS = (Colour(), *(Colour(rho, white) for rho in CORRELATIONS[1:] for white in _shares(rho)))
"""What the noise may be."""


def _neighbours() -> dict[Colour, tuple[Colour, ...]]:
    """Return the colours next to each on the grid; all of the shortest correlation are next to white noise."""
    shares = (*SMALL_SHARES, *WHITE_SHARES)
    place = {c: (CORRELATIONS.index(c.rho), shares.index(c.white)) for c in COLOURS if c.rho > 0.0}
    at = {where: colour for colour, where in place.items()}
    shortest = tuple(c for c, (i, _) in place.items() if i == 1)
    found = {Colour(): shortest}
    for colour, (i, j) in place.items():
        near = [at[i + di, j + dj] for di, dj in ((-1, 0), (1, 0), (0, -1), (0, 1)) if (i + di, j + dj) in at]
        # where a random walk is as long again, half as much of it is white
        aslant = [at[i + d, j - d] for d in (-1, 1) if (i + d, j - d) in at]
        near += [c for c in aslant if min(c.rho, colour.rho) >= MOST_CORRELATED]
        found[colour] = (*near, *((Colour(),) if colour in shortest else ()))
    return found


NEIGHBOURS = _neighbours()


@dataclass(frozen=True, eq=False)
class Whitening:
    """The filter that makes one colour of noise white for one sequence of readings."""

    gap: Floats
    colour: Colour

    @cached_property
    def _kernel(self) -> Callable[..., None]:
        from rtec.inference._colour_kernels import whiten_rows  # noqa: PLC0415 - loads numba, for searches only

        return whiten_rows

    @cached_property
    def _steps(self) -> tuple[Floats, Floats, Floats, Floats, float]:
        from rtec.inference._colour_kernels import filter_steps  # noqa: PLC0415 - as above

        carry, keep, gain, scale = np.empty((4, self.gap.size))
        total = filter_steps(self.gap, self.colour.rho, self.colour.white, carry, keep, gain, scale)
        return carry, keep, gain, scale, float(total)

    @property
    def log_determinant(self) -> float:
        """Logarithm of the determinant of the covariance, at a total variance of 1."""
        return 0.0 if self.colour.rho == 0.0 else self._steps[-1]

    def of(self, columns: Floats, unit: float = 1.0, without: Floats | None = None) -> Floats:
        """Return columns, shape (columns, rows), times ``unit`` in whitened space: an array of its own.

        A direction ``without`` of length 1 there, shape (1, rows), is taken out of them; none where it has no rows.
        """
        carry, keep, gain, scale, _ = self._steps
        white = np.empty(columns.shape)
        out = np.empty((0, columns.shape[1])) if without is None else without
        # an array that is read only would be of a type of its own, for which the kernel is compiled once more
        taken = np.require(columns, np.float64, ["C", "W"])
        self._kernel(taken, unit, carry, keep, gain, scale, out, white)
        return white

    def coloured(self, columns: Floats) -> Floats:
        """Return the correlation matrix of the noise times columns, shape (columns, rows)."""
        if self.colour.rho == 0.0:
            return columns
        from rtec.inference._colour_kernels import coloured_rows  # noqa: PLC0415 - as above

        slow = np.empty_like(columns)
        coloured_rows(np.ascontiguousarray(columns), self._steps[0], slow)
        return (1.0 - self.colour.white) * slow + self.colour.white * columns


def gaps_of(dataset: Dataset) -> Floats:
    """Return how many readings lie between each and the one before, infinite where a chain begins; shape (rows,).

    A log begins anew with each run, whose pause is unknown; readings at rest are one chain, because what wanders does
    not wait for the end of a run.
    """
    c = dataset.coordinates
    gap = np.concatenate([[np.inf], np.maximum(np.diff(c.order), 1.0)])
    if c.moving:
        gap[1:][np.diff(c.run) != 0] = np.inf
    return gap
