"""The rows that a regressor is fitted to: checked, scaled, and divided into blocks that are left out in turn."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rtec.errors import ArgumentError
from rtec.predictors._columns import Floats

Places = npt.NDArray[np.int64]
CONSTANT = 1e-9
"""A column whose values lie closer together than this share of the largest of them carries nothing but rounding."""
MOST_ROWS = 2000
"""That a dense regressor is fitted to by default: the time it takes grows with the third power."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Rows:
    """Scaled columns, their output, and the rows of each block.

    Columns that are constant are scaled to zero.
    """

    scaled: Floats
    """Shape (rows, features): zero mean, standard deviation 1 times the weight of the column."""
    output: Floats
    blocks: tuple[Places, ...]
    which: Places
    """The block of each row, counted from 0."""
    centre: Floats
    """Mean of each column."""
    per_unit: Floats
    """What a column less its centre is multiplied by; 0 if it is constant."""

    @property
    def notes(self) -> tuple[str, ...]:
        """What was left out, in a sentence."""
        constant = [str(k + 1) for k in np.flatnonzero(self.per_unit == 0.0)]
        if not constant:
            return ()
        one = len(constant) == 1
        return (f"Column{'' if one else 's'} {', '.join(constant)} {'is' if one else 'are'} constant and left out.",)


def rows_of(columns: Floats, output: Floats, block: npt.ArrayLike, weights: npt.ArrayLike = 1.0) -> Rows:
    """Check the rows that a regressor is to be fitted to, and scale them.

    Parameters
    ----------
    columns
        Shape (rows, features), in any units.
    output
        Shape (rows,).
    block
        The block of each row, as any whole number, shape (rows,).
    weights
        Above 0, of each column: what its standard deviation becomes.

    Raises
    ------
    ArgumentError
        Shapes that do not fit, a value that is not finite, fewer than two blocks, constant columns only, or
        weights that are not above 0.

    Examples
    --------
    >>> rows = rows_of(np.array([[1.0, 5.0], [3.0, 5.0]]), np.zeros(2), [7, 8])
    >>> rows.scaled.tolist(), rows.notes
    ([[-1.0, 0.0], [1.0, 0.0]], ('Column 2 is constant and left out.',))
    """
    columns, output = np.asarray(columns, dtype=np.float64), np.asarray(output, dtype=np.float64)
    if columns.ndim != 2 or not columns.shape[1]:
        raise ArgumentError("columns", f"an array of shape {columns.shape}", "one column for each feature")
    labels, weights = np.asarray(block), np.asarray(weights, dtype=np.float64)
    if weights.shape not in {(), columns.shape[1:]} or not ((weights > 0.0) & (weights < np.inf)).all():
        raise ArgumentError("weights", f"{weights}"[:60], "a finite number above 0 for each column")
    for name, array in (("output", output), ("block", labels)):
        if array.shape != columns.shape[:1]:
            raise ArgumentError(
                name, f"an array of shape {array.shape}", f"one value for each of {len(columns)} rows"
            )
    bad = np.flatnonzero(~(np.isfinite(columns).all(axis=1) & np.isfinite(output)))
    if bad.size:
        hint = "leave out the rows in which a sensor failed"
        raise ArgumentError(f"columns, row {bad[0] + 1}", "a value that is not finite", "finite numbers", hint)
    found, which = np.unique(labels, return_inverse=True)
    if found.size < 2:
        hint = "a change of speed, a run or a day starts a block"
        raise ArgumentError("block", f"{found.size} blocks", "at least two: each is predicted from the others", hint)
    centre = columns.mean(axis=0)
    constant = np.ptp(columns, axis=0) <= CONSTANT * np.abs(columns).max(axis=0)
    if constant.all():
        raise ArgumentError("columns", "constant columns", "at least one that varies")
    per_unit = np.zeros(centre.size)
    np.divide(weights, columns.std(axis=0), out=per_unit, where=~constant)
    order = np.argsort(which, kind="stable")
    ends = np.cumsum(np.bincount(which))[:-1]
    return Rows(
        scaled=(columns - centre) * per_unit,
        output=output,
        blocks=tuple(np.split(order, ends)),
        which=which,
        centre=centre,
        per_unit=per_unit,
    )


def thin_by_blocks(block: Sequence[int] | Places, *, every: int = 1, most_rows: int = MOST_ROWS) -> Places:
    """Return the places of rows that are kept, ascending: every k-th row of each block, and not too many of any.

    Parameters
    ----------
    block
        The block of each row, shape (rows,).
    every
        Keep the first of so many rows.
    most_rows
        Keep no more rows than this: the longest blocks are thinned further, evenly.

    Raises
    ------
    ArgumentError
        ``every`` below 1, or fewer rows than blocks.

    Examples
    --------
    >>> thin_by_blocks([1, 1, 1, 1, 1, 1, 2, 2, 2], every=2, most_rows=4).tolist()
    [0, 4, 6, 8]
    """
    found, which = np.unique(np.asarray(block), return_inverse=True)
    if every < 1:
        raise ArgumentError("every", every, "1 (all rows) or more")
    if most_rows < found.size:
        raise ArgumentError("most_rows", most_rows, f"at least {found.size}, one row for each block")
    parts = [np.flatnonzero(which == b)[::every] for b in range(found.size)]
    most = _evenly([part.size for part in parts], most_rows)
    kept = [part[np.linspace(0, part.size - 1, min(most, part.size)).round().astype(np.int64)] for part in parts]
    return np.sort(np.concatenate(kept)).astype(np.int64)


def _evenly(sizes: list[int], most_rows: int) -> int:
    """Return the most rows that each block may keep so that all together are not too many."""
    left, most = most_rows, max(sizes, default=0)
    for done, size in enumerate(sorted(sizes)):
        most = left // (len(sizes) - done)
        if size > most:
            return most
        left -= size
    return max(sizes, default=0)


def rms(values: Floats) -> float:
    """Return the root mean square."""
    return float(np.sqrt(np.mean(np.square(values))))
