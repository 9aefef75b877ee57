"""Held-out error: what a model says about readings that its numbers have not seen, on a chessboard of the plan."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rtec.dataset.dataset import Dataset
from rtec.dataset.passes import passages
from rtec.effects import Floats
from rtec.inference.colour import Whitening
from rtec.inference.evidence import SCALES
from rtec.inference.scored import Judge, Scored
from rtec.inference.space import blocks_of

STRETCH, BLOCK = "stretch", "block"
"""What is held out together: a section of one pass, or a block of the data where they have blocks."""
MOST_BLOCKS = 30
"""Of more blocks, several are held out at a time."""
FOLDS = 8
SECTIONS = 8
"""Of the positions, or of the time where there are none; of a single pass twice as many."""
SINGULAR = 1e-5
"""Ratio of pivots below which columns count as dependent."""
KNIGHT = 3
"""By so many folds the sections of a pass are shifted against those of the pass before: every place that is held out
in one pass is seen in others."""


@dataclass(frozen=True, slots=True, eq=False)
class Board:
    """Cells of the plan, and the fold with which each is held out; both of shape (rows,)."""

    cell: NDArray[np.int64]
    fold: NDArray[np.int64]

    @property
    def cells(self) -> int:
        """Number of cells."""
        return int(self.cell.max()) + 1


def passes_of(dataset: Dataset) -> NDArray[np.int64]:
    """Return the number of the pass of each reading, 0, 1, ...: one way along the axis, in one run; shape (rows,)."""
    c, way = dataset.coordinates, None
    if c.direction is not None and (moving := np.flatnonzero(c.direction)).size:
        last = np.searchsorted(moving, np.arange(dataset.rows), side="right") - 1
        way = np.sign(c.direction[moving[np.maximum(last, 0)]])
    return passages(c.run, way)


def held_out_by(dataset: Dataset) -> str:
    """Return what of a data set is held out together, by its name."""
    return BLOCK if dataset.in_blocks else STRETCH


def board_of(dataset: Dataset) -> Board:
    """Return the chessboard of a data set, pass by section of position; or its blocks, one by one.

    Cells of fewer readings than a fortieth of a pass do not occur: a log that turns round often has its passes put
    together, a tenth of the rows each.
    """
    c = dataset.coordinates
    if dataset.block is not None and dataset.in_blocks:
        cell = np.unique(dataset.block, return_inverse=True)[1].astype(np.int64)
        return Board(cell=cell, fold=cell % MOST_BLOCKS)
    passage = passes_of(dataset)
    most = 4 * FOLDS
    if passage[-1] + 1 > most:
        passage = passage * most // (passage[-1] + 1)
    where = c.position if np.ptp(c.position) > 0.0 and not c.time_is_coordinate else c.clock
    if passage[-1] == 0 or np.ptp(where) == 0.0:
        count = min(2 * SECTIONS, dataset.rows)
        section = np.arange(dataset.rows) * count // dataset.rows
        return Board(cell=section, fold=section % min(FOLDS, count))
    edges = np.quantile(where, np.linspace(0.0, 1.0, SECTIONS + 1)[1:-1])
    section = np.searchsorted(edges, where, side="right")
    fold = (section + KNIGHT * passage) % FOLDS
    cell = np.unique(passage * SECTIONS + section, return_inverse=True)[1]
    return Board(cell=cell.astype(np.int64), fold=fold.astype(np.int64))


def row_by_row(judge: Judge, model: Scored) -> float | None:
    """Return the RMS of readings held out as if neighbours told nothing of each other; None without blocks.

    It is what others publish, and says little about another duty cycle.
    """
    dataset = judge.space.dataset
    if not dataset.in_blocks:
        return None
    row = np.arange(dataset.rows) % FOLDS
    return dataset.rms(held_out_residual(judge, model, Board(cell=row, fold=row)))


def held_out_residual(judge: Judge, model: Scored, board: Board) -> Floats:
    """Return what each reading is off by a fit to the other folds, shape (rows,), in the observed unit inside.

    Normal equations of the whole less those of the fold, so that each reading is used once for all folds; amplitudes
    are held towards zero by the same prior as in the search. The zero of a run is that of its other folds.
    """
    space, dataset = judge.space, judge.space.dataset
    parts = space.parts_of(model.choices)
    deviations = np.append(SCALES, 0.0)[model.places][blocks_of(parts)] if parts else np.empty(0)
    whiten = space.view(space.weights(model.colour.bounded)).whitening.of
    white = [whiten(part.raw, part.unit) for part in parts]
    raw = [part.raw * part.unit for part in parts]
    used = deviations > 0.0
    precision = np.where(used, 1.0 / np.where(used, deviations, 1.0) ** 2, 0.0)
    if space.has_datum:
        white.append(whiten(np.ones((1, dataset.rows))))
        raw.append(np.ones((1, dataset.rows)))
        precision, used = np.append(precision, 1e-12), np.append(used, True)
    if not white or not used.any():
        return dataset.observed.copy()
    table, columns = np.vstack(white)[used], np.vstack(raw)[used]
    precision = precision[used]
    observed = whiten(dataset.observed[None, :])[0]
    tests = [board.fold == number for number in np.unique(board.fold)]
    held = [table[:, test] for test in tests]
    inner = table @ table.T + np.diag(precision) - np.array([part @ part.T for part in held])
    along = table @ observed - np.array([part @ observed[test] for part, test in zip(held, tests, strict=True)])
    residual = dataset.observed.copy()
    for test, numbers in zip(tests, _solved(inner, along), strict=True):
        residual[test] -= numbers @ columns[:, test]
    return residual


def _solved(inner: Floats, along: Floats) -> Floats:
    """Return the solutions of normal equations, shape (folds, columns); the shortest where columns are dependent."""
    try:
        pivots = np.diagonal(np.linalg.cholesky(inner), axis1=1, axis2=2)
        sound = bool((pivots.min(axis=1) > SINGULAR * pivots.max(axis=1)).all())
    except np.linalg.LinAlgError:
        sound = False
    if sound:  # a tenth of the time
        return np.asarray(np.linalg.solve(inner, along[:, :, None])[:, :, 0], np.float64)
    each = zip(inner, along, strict=True)
    return np.array([np.linalg.lstsq(one, wanted, rcond=1e-13)[0] for one, wanted in each])


@dataclass(frozen=True, slots=True)
class HeldOutGain:
    """What an effect gains on readings that were held out."""

    gain: float
    """Fall of the mean square, in the observed unit inside squared."""
    error: float
    """Its standard error between cells."""
    nats: float
    """Rise of the log density of the readings held out, their noise as correlated within a cell as it is."""
    without_best: float
    """The same without the cell that gains most."""

    @property
    def passes(self) -> bool:
        """Whether what was held out is foretold better, and not in a single cell alone."""
        return self.nats > 0.0 and self.without_best > 0.0


def gain_between(judge: Judge, before: Floats, after: Floats, model: Scored, board: Board) -> HeldOutGain:
    """Return the gain between two held-out residuals, the noise being that of ``model``.

    Within a cell readings at rest are judged with the noise as correlated as it is, those of a log as they are; each
    cell begins anew, because the readings before it may have been seen. A paired t-test over cells would be wrong: a
    reversal error may act in one or two of them.
    """
    n = before.size
    gap = judge.space.gap.copy()
    gap[1:][np.diff(board.cell) != 0] = np.inf
    colour = judge.space.weights(model.colour.bounded)
    white = Whitening(gap, colour).of(np.vstack([before, after]))
    variance = judge.fit(model, colour).variance
    nats = np.bincount(board.cell, weights=white[0] ** 2 - white[1] ** 2, minlength=board.cells) / (2.0 * variance)
    fall = np.bincount(board.cell, weights=before**2 - after**2, minlength=board.cells)
    spread = float(np.sqrt(np.sum((fall - fall.mean()) ** 2) * fall.size / max(fall.size - 1, 1)))
    return HeldOutGain(
        gain=float(fall.sum()) / n,
        error=spread / n,
        nats=float(nats.sum()),
        without_best=float(nats.sum() - nats.max()),
    )
