"""Tables fitted by least squares, their spacing chosen on readings that they do not see."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.linalg import solveh_banded

from rtec.errors import ArgumentError
from rtec.predictors._columns import Floats
from rtec.predictors.fitting.samples import Samples
from rtec.predictors.tables import SAME_TARGET_MM, Between, BidirectionalTable, UnidirectionalTable

Table = UnidirectionalTable | BidirectionalTable

SPACINGS = 12
"""Tried, from the distance of the targets up to a quarter of the travel, in equal ratios."""
FOLDS = 10
"""Parts of the readings, each foretold by the others: of fewer the gaps are so wide that they decide."""
REPEATED = 0.9
"""Share of the places, in each direction, with more than one reading, from which on repeats say what a table is worth
at all of them."""
_SMOOTH = 1e-3
"""Weight of the second differences beside that of the readings: a point without a reading near it lies on the line of
its neighbours."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SpacedTable:
    """A table, and how good others were."""

    table: Table
    """That with the lowest error on readings that were not seen, fitted to all."""
    spacing_mm: float
    """Distance of its points."""
    tried: tuple[tuple[float, float], ...]
    """Spacing and root mean square on the readings not seen, in mm each, of all that were tried."""


def spaced_table(samples: Samples, kind: type[Table], between: Between, *, seed: int = 0) -> SpacedTable:
    """Return the table whose spacing foretells best what it does not see.

    The readings are drawn into ten parts; tables that are fitted to the others foretell each. Where places are read
    once, as in a second round at other targets, all readings of a place are in one part: repeats of the other places
    say nothing of these, and a table with points that rest on single readings looked as good as they. Where all are
    repeated, single readings are drawn: with a place of the only round its gap would be judged, which no table has.

    Parameters
    ----------
    samples
        At three places or more.
    kind
        Of one direction with a backlash, or of both.
    between
        What it says between its points. Cubics go through points that were fitted as those of straight lines.
    seed
        Draws the parts.

    Raises
    ------
    ArgumentError
        A direction without readings, or readings at fewer places.

    References
    ----------
    Thesis 3.1: controls take a table at fixed intervals.

    Examples
    --------
    >>> x = np.tile(np.arange(0.0, 41.0), 2)
    >>> way = np.repeat([1.0, -1.0], 41)
    >>> line = Samples(position_mm=x, direction=way, error_mm=1e-4 * x + 0.001 * (way < 0))
    >>> found = spaced_table(line, UnidirectionalTable, Between.LINES)
    >>> round(found.table.backlash_mm, 9), bool(abs(found.table.error_mm(20.5, 1) - 0.00205) < 1e-9)
    (0.001, True)
    """
    low, high = samples.span_mm
    steps = np.diff(np.unique(samples.position_mm))
    steps = steps[steps > SAME_TARGET_MM]
    part = _parts(samples, seed)
    if not steps.size or part.max() < 0:
        found = f"{steps.size + 1} between {low:g} and {high:g} mm"
        raise ArgumentError("places", found, "three or more, as each inner one is foretold by others")
    finest, coarsest = float(np.median(steps)), max(0.25 * (high - low), float(np.median(steps)))
    counts = {max(1, round((high - low) / h)) for h in np.geomspace(finest, coarsest, SPACINGS)}
    folds = [(_both(samples.take(part != k)), samples.take(part == k)) for k in range(part.max() + 1)]
    off = {}
    for count in sorted(counts):
        grid = np.linspace(low, high, count + 1)
        left = [unseen.left_by(_table(seen, grid, kind, between)) for seen, unseen in folds]
        off[count] = math.sqrt(float(np.mean(np.concatenate(left) ** 2)))
    best = min(off, key=lambda count: off[count])
    return SpacedTable(
        table=_table(_both(samples), np.linspace(low, high, best + 1), kind, between),
        spacing_mm=(high - low) / best,
        tried=tuple(((high - low) / count, rms) for count, rms in off.items()),
    )


def _parts(samples: Samples, seed: int) -> npt.NDArray[np.int64]:
    """Return the part that each reading is in, shape (n,); -1 where it is always seen."""
    rng = np.random.default_rng(seed)
    place = samples.place()
    cell = np.unique(2 * place + (samples.direction < 0.0), return_inverse=True)[1]
    count = np.bincount(cell)
    if np.mean(count > 1) > REPEATED:
        order = rng.permutation(samples.rows)
        order = order[np.argsort(cell[order], kind="stable")]
        nth = np.empty(samples.rows, dtype=np.int64)
        nth[order] = np.arange(samples.rows) - np.repeat(np.cumsum(count) - count, count)
        part = (rng.integers(0, FOLDS, count.size)[cell] + nth) % FOLDS
        return np.where(count[cell] > 1, part, -1)
    of_place = np.full(place.max() + 1, -1)
    inner = rng.permutation(np.arange(1, place.max()))
    of_place[inner] = np.arange(inner.size) % FOLDS
    return of_place[place]


def table_of(samples: Samples, like: SpacedTable) -> Table:
    """Return a table of the same kind and spacing, fitted to other readings of the same travel.

    They are all that may be used: those that chose the spacing, and more.
    """
    low, high = samples.span_mm
    count = max(1, round((high - low) / like.spacing_mm))
    return _table(_both(samples), np.linspace(low, high, count + 1), type(like.table), like.table.between)


def _both(samples: Samples) -> dict[int, Samples]:
    ways = dict(samples.ways())
    if len(ways) < 2:
        raise ArgumentError("direction", f"{next(iter(ways)):+d} alone", "readings of both directions")
    return ways


def _table(ways: dict[int, Samples], grid: Floats, kind: type[Table], between: Between) -> Table:
    forward, reverse = ways[1], ways[-1]
    errors = fitted_points(grid, forward)
    if kind is UnidirectionalTable:
        alone = UnidirectionalTable(positions_mm=grid, errors_mm=errors, backlash_mm=0.0, between=between)
        lost = reverse.error_mm - alone.error_mm(reverse.position_mm, -1)
        return UnidirectionalTable(
            positions_mm=grid, errors_mm=errors, backlash_mm=float(lost.mean()), between=between
        )
    return BidirectionalTable.on_grid(grid, errors, fitted_points(grid, reverse), between)


def fitted_points(grid: Floats, samples: Samples) -> Floats:
    """Return errors at equidistant points whose straight lines go through readings by least squares, shape (points,).

    Parameters
    ----------
    grid
        Equidistant positions, ascending, shape (points,), in mm.
    samples
        Readings of one direction, within the grid.

    Examples
    --------
    >>> line = Samples(position_mm=[0.0, 1.0, 3.0, 4.0], direction=np.ones(4), error_mm=[0.0, 0.01, 0.03, 0.04])
    >>> fitted_points(np.array([0.0, 2.0, 4.0]), line).round(9).tolist()
    [0.0, 0.02, 0.04]
    """
    points = grid.size
    piece = np.clip(np.searchsorted(grid, samples.position_mm, side="right") - 1, 0, points - 2)
    right = (samples.position_mm - grid[piece]) / (grid[piece + 1] - grid[piece])
    left = 1.0 - right
    # normal equations of hat functions, and of second differences: upper bands, the diagonal last
    bands = np.zeros((3, points))
    bands[2] += np.bincount(piece, left * left, points) + np.bincount(piece + 1, right * right, points)
    bands[1, 1:] += np.bincount(piece, left * right, points)[:-1]
    answer = np.bincount(piece, left * samples.error_mm, points)
    answer += np.bincount(piece + 1, right * samples.error_mm, points)
    if points > 2:
        for first, weight in ((0, 1.0), (1, -2.0), (2, 1.0)):
            bands[2, first : points - 2 + first] += _SMOOTH * weight * weight
        bands[1, 1 : points - 1] += -2.0 * _SMOOTH
        bands[1, 2:] += -2.0 * _SMOOTH
        bands[0, 2:] += _SMOOTH
    bands[2] += 1e-14
    found: Floats = solveh_banded(bands, answer)
    return found
