"""Ridge regression of several channels on some of the columns, judged by blocks left out: from sums over blocks."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rtec.predictors._columns import Floats

SHARES = tuple(np.geomspace(1e-7, 1.0, 22).tolist())
"""Ridge parameters that are tried, for each row."""
Places = npt.NDArray[np.int64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BlockSums:
    """Products of columns and outputs summed over each block: all that a ridge regression without a block asks for.

    Parameters
    ----------
    gram
        Shape (blocks, columns + 1, columns + 1); the last column is constant.
    right
        Products with the outputs, shape (blocks, columns + 1, channels).
    squares
        Of the outputs, shape (blocks, channels).
    rows
        Of each block, shape (blocks,).

    Examples
    --------
    >>> x = np.arange(8.0)
    >>> sums = BlockSums.of(x[:, None], 3.0 + 2.0 * x[:, None], np.arange(8) // 2)
    >>> bool(sums.errors([0], 1e-12).max() < 1e-6)
    True
    """

    gram: Floats
    right: Floats
    squares: Floats
    rows: Floats

    @classmethod
    def of(cls, columns: Floats, outputs: Floats, block: Places) -> BlockSums:
        """Sum over blocks; columns, shape (rows, columns), are centred, outputs have the shape (rows, channels)."""
        full = np.column_stack([columns - columns.mean(axis=0), np.ones(len(columns))])
        shifted = outputs - outputs.mean(axis=0)
        parts = [block == number for number in np.unique(block)]
        return cls(
            gram=np.array([full[part].T @ full[part] for part in parts]),
            right=np.array([full[part].T @ shifted[part] for part in parts]),
            squares=np.array([(shifted[part] ** 2).sum(axis=0) for part in parts]),
            rows=np.array([np.count_nonzero(part) for part in parts], dtype=np.float64),
        )

    def without(self, block: int) -> BlockSums:
        """Return the sums of all blocks but one."""
        kept = np.arange(self.rows.size) != block
        return BlockSums(
            gram=self.gram[kept], right=self.right[kept], squares=self.squares[kept], rows=self.rows[kept]
        )

    def errors(self, chosen: Sequence[int], share: float) -> Floats:
        """Return the sums of squared errors of each block, predicted from the others, shape (blocks, channels).

        Parameters
        ----------
        chosen
            Columns that the regression sees.
        share
            Ridge parameter for each row; the constant is not penalised.
        """
        at = np.array([*chosen, self.gram.shape[1] - 1])
        gram, right = self.gram[:, at[:, None], at], self.right[:, at]
        penalty = share * np.append(np.ones(at.size - 1), 0.0)
        others = gram.sum(axis=0) - gram
        rows = self.rows.sum() - self.rows
        others = others + np.eye(at.size) * (penalty * rows[:, None])[:, None, :]
        slopes = np.linalg.solve(others, right.sum(axis=0) - right)
        found = self.squares - 2.0 * (slopes * right).sum(axis=1) + (slopes * (gram @ slopes)).sum(axis=1)
        return np.asarray(np.maximum(found, 0.0))

    def rms(self, chosen: Sequence[int], share: float) -> float:
        """Return the root mean square error over all rows and channels, each block predicted from the others."""
        errors = self.errors(chosen, share)
        return float(np.sqrt(errors.sum() / (self.rows.sum() * errors.shape[1])))

    def best_share(self, chosen: Sequence[int], shares: Iterable[float] = SHARES) -> tuple[float, float]:
        """Return the lowest root mean square error by blocks, and its ridge parameter."""
        return min((self.rms(chosen, share), share) for share in shares)
