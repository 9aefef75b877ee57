"""What methods are fitted to, and what a fit gives."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from rtec.errors import RtecError
from rtec.predictors._columns import Floats
from rtec.predictors.fitting.warm.rows import rms
from rtec.predictors.warm.features import Feature
from rtec.predictors.warm.regressor import RegressorFit
from rtec.training.warm_features import FeatureSet
from rtec.training.warm_parts import Places, WarmParts

_FOLDS = 5
FitRows = Callable[[Floats, Floats, Places], RegressorFit]
"""Fits columns, shape (rows, features), and an output to rows of blocks, shape (rows,) each."""


class NoFigureError(RtecError):
    """A method has none for these data; the message says why."""


class Answers(Protocol):
    """What is asked of a fitted function here; one that is written to a file is a `Regressor`."""

    @property
    def parameters(self) -> int:
        """How many numbers were fitted."""

    def predict(self, columns: Floats) -> tuple[Floats, Floats]:
        """Return output and standard deviation, shape (rows,) each, of columns, shape (rows, features)."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ModelFit:
    """One method, fitted to one channel.

    Parameters
    ----------
    features, regressor
        The model.
    rows
        Rows of the log that the fit saw, shape (rows,).
    left_out
        Their displacement less what a fit without their block says, in um, shape (rows,); None with one block.
    rms_rows_um
        Root mean square of what fits to other random rows leave of rows; None where that was not asked for.
    """

    features: FeatureSet
    regressor: Answers
    rows: Places
    left_out: Floats | None
    rms_rows_um: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WarmFit:
    """One method, fitted to all channels."""

    channels: Mapping[str, ModelFit]
    notes: tuple[str, ...] = ()


@dataclass(slots=True, kw_only=True, eq=False)
class WarmTask:
    """What methods are fitted to, and what earlier ones found.

    Parameters
    ----------
    parts
        The rows.
    seed
        Draws random rows.
    until_s
        On the clock of `time.perf_counter`: when settings are no longer tried.
    lags
        Features that the first-order lags chose, for the methods after them.
    bayes
        What the Bayesian networks are, for the row of their most probable state.
    """

    parts: WarmParts
    seed: int = 0
    until_s: float = np.inf
    lags: FeatureSet | None = None
    bayes: WarmFit | None = None

    @property
    def plain(self) -> FeatureSet:
        """All inputs as they are."""
        return tuple(Feature(of=name) for name in self.parts.log.inputs)

    @property
    def folds(self) -> Places:
        """A random part of each row that a fit sees, as others hold out rows."""
        draws = np.random.default_rng(self.seed)
        return draws.permutation(self.parts.rows.size) % _FOLDS


def fitted(task: WarmTask, features: FeatureSet, rows: Places, fit: FitRows, notes: tuple[str, ...] = ()) -> WarmFit:
    """Fit every channel that is observed to the same features, and once more to random rows."""
    found, said = {}, []
    for name in task.parts.log.outputs:
        found[name], more = fitted_channel(task, name, features, rows, fit)
        said.append((name, more))
    alike = len({more for _, more in said}) == 1
    each = said[0][1] if alike else tuple(f"{name}: {note}" for name, more in said for note in more)
    return WarmFit(channels=found, notes=(*notes, *each))


def fitted_channel(
    task: WarmTask, name: str, features: FeatureSet, rows: Places, fit: FitRows
) -> tuple[ModelFit, tuple[str, ...]]:
    """Fit one channel, and once more to random rows; return it with the notes of the fit."""
    parts = task.parts
    at = np.searchsorted(parts.rows, rows)
    columns, output = parts.columns(features)[at], parts.outputs[name][at]
    one = fit(columns, output, parts.block[at])
    by_rows = rms(fit(columns, output, task.folds[at]).left_out)
    made = ModelFit(features=features, regressor=one.regressor, rows=rows, left_out=one.left_out, rms_rows_um=by_rows)
    return made, one.notes
