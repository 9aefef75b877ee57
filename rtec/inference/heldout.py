"""Held-out error: what a model says about readings that its numbers have not seen."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rtec.dataset.dataset import Dataset, Ints
from rtec.effects import Floats
from rtec.inference.fit import opened_model, residual_of
from rtec.inference.model import Model
from rtec.inference.noise import Noise
from rtec.inference.workspace import Choice, Workspace

FOLDS = 5
_STRETCH = 6
"""Readings that are held out together, at least, where runs repeat: neighbours share their noise."""
_MOST_STRETCHES = 10
_PAIRED_ROWS, _MOST_PAIRED = 4, 25
"""Rows of a stretch, at least, and stretches, at most, between which a held-out gain is compared."""
_FEW_ROWS = 100
_CUT = 1e-12


@dataclass(frozen=True, slots=True, kw_only=True)
class HeldOutGain:
    """Fall of the held-out mean square by an effect, and its paired standard error."""

    gain: float
    error: float

    @property
    def passes(self) -> bool:
        """Whether the gain lies above two standard errors."""
        return self.gain > 2.0 * self.error


def folds(dataset: Dataset) -> NDArray[np.int64]:
    """Return the fold of each reading, shape (rows,), by which it is held out.

    Where runs repeat, short stretches of each run are dealt to five folds so that a place that is held out in one run
    is kept in others: what happens once in time (a warm-up, a step) is then neither wholly hidden nor wholly shown.
    Without repeats the folds are the data set's blocks.
    """
    if not dataset.has_repeats:
        return dataset.block
    run = dataset.coordinates.run
    fold = np.zeros(dataset.rows, dtype=np.int64)
    for order, number in enumerate(np.unique(run)):
        rows = np.flatnonzero(run == number)
        stretches = max(2, min(_MOST_STRETCHES, rows.size // _STRETCH))
        for k, part in enumerate(np.array_split(rows, stretches)):
            fold[part] = (k + 2 * order) % FOLDS
    return fold


def held_out_by(dataset: Dataset) -> str:
    """Return what is held out at a time: a ``stretch`` of readings, or a ``run`` of a moving log."""
    return "stretch" if dataset.has_repeats else dataset.held_out_by


def _table(workspace: Workspace, choices: Sequence[Choice], datum: bool) -> Floats:
    parts = [workspace.columns(effect, shape) for effect, shape in choices]
    if datum:
        parts.append(workspace.constant)
    return np.vstack(parts).T if parts else np.empty((workspace.dataset.rows, 0))


def held_out_residual(workspace: Workspace, choices: Sequence[Choice], *, datum: bool) -> Floats:
    """Return the whitened residual of each reading by a fit to the other folds, shape (rows,)."""
    table = _table(workspace, choices, datum)
    residual: Floats = workspace.observed.copy()
    for test, numbers in _fits_without(table, workspace.observed, folds(workspace.dataset)):
        residual[test] -= table[test] @ numbers
    return residual


def _fits_without(table: Floats, observed: Floats, fold: Ints) -> Iterator[tuple[NDArray[np.bool_], Floats]]:
    """Yield the rows of each fold with the fit to all others.

    Normal equations of the whole, less those of the fold: each row is used once for all folds.
    """
    if not table.shape[1]:
        return
    length = np.sqrt((table**2).sum(axis=0))
    length[length == 0.0] = 1.0
    scaled = table / length
    gram, along = scaled.T @ scaled, scaled.T @ observed
    for number in np.unique(fold):
        test = fold == number
        part = scaled[test]
        rest = np.linalg.pinv(gram - part.T @ part, rcond=_CUT, hermitian=True)
        yield test, rest @ (along - part.T @ observed[test]) / length


def gain_of(workspace: Workspace, before: Floats, after: Floats) -> HeldOutGain:
    """Return the held-out gain between two whitened held-out residuals.

    With noise from repeats, the paired error follows from it: the difference of two squares is ``2 e d`` and ``d²``,
    d being the difference of the predictions, so that a step or a warm-up that lives in a few readings is judged by
    these. Without repeats it comes from the spread between stretches.
    """
    return _paired(before, after, workspace.noise)


def _paired(before: Floats, after: Floats, noise: Noise) -> HeldOutGain:
    """Return the mean fall of the squared residual with its paired standard error."""
    falls, difference = before**2 - after**2, before - after
    if not noise.from_repeats and falls.size >= _FEW_ROWS:
        return _between_stretches(falls)
    # where there are few readings without repeats: noise as the model leaves it, correlated as that is
    rho = 0.0 if noise.from_repeats else noise.correlation.to_next
    widen = (1.0 + rho) / max(1.0 - rho, 1e-6)
    error = 2.0 * noise.sigma * float(np.sqrt(difference @ difference * widen))
    return HeldOutGain(gain=float(falls.mean()), error=error / falls.size)


def _between_stretches(falls: Floats) -> HeldOutGain:
    """Return the mean fall of the squared error, and its standard error from the spread between stretches."""
    stretches = max(2, min(_MOST_PAIRED, falls.size // _PAIRED_ROWS))
    means = np.array([part.mean() for part in np.array_split(falls, stretches)])
    return HeldOutGain(gain=float(means.mean()), error=float(means.std(ddof=1) / np.sqrt(means.size)))


def rms_by_folds(workspace: Workspace, choices: Sequence[Choice], *, datum: bool) -> float:
    """Return the held-out RMS in the observed unit inside: every reading is held out once."""
    weights = _table(workspace, choices, datum)
    dataset = workspace.dataset
    raw = [dataset.columns(effect, shape) for effect, shape in choices]
    if datum:
        raw.append(np.ones((dataset.rows, 1)))
    columns = np.hstack(raw) if raw else np.empty((dataset.rows, 0))
    residual = dataset.observed.copy()
    for test, numbers in _fits_without(weights, workspace.observed, folds(dataset)):
        residual[test] -= columns[test] @ numbers
    return float(np.sqrt(np.mean(residual**2)))


def gain_on(before: Model, after: Model, other: Dataset, noise: Noise) -> HeldOutGain:
    """Return the fall of the mean square on another measurement, with its paired standard error."""
    return _paired(residual_of(other, before), residual_of(other, after), noise)


def blocked_rms(dataset: Dataset, model: Model) -> float:
    """Return the RMS of a model on readings that took no part in the fit of what it leaves open.

    Every fold is predicted by the model fitted to the others; a model with nothing open is simply compared.
    """
    opened = opened_model(dataset, model)
    if opened is None:
        return float(np.sqrt(np.mean(residual_of(dataset, model) ** 2)))
    return rms_by_folds(opened.workspace, opened.choices, datum=opened.datum)
