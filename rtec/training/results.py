"""What a comparison of predictors gives: a row each, and the best of them."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np
import numpy.typing as npt

from rtec.inference.model import Model
from rtec.predictors import Predictor
from rtec.predictors.fitting.samples import Samples
from rtec.predictors.fitting.training import Course
from rtec.training.parts import Parts

ALIKE = 0.1
"""Two held-out errors that differ by no more than this share are as good as each other."""


class Kind(Enum):
    """What a predictor is made of; of nothing where a row shows how large the error is that the others foretell."""

    NONE = "none"
    TABLE = "table"
    GEOMETRY = "geometry"
    MODEL = "model"
    NETWORK = "network"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Row:
    """One predictor.

    Parameters
    ----------
    name, kind
        What it is, such as ``table bi-directional linear``, a table.
    predictor
        None where there is none; ``reason`` says why.
    rms_train_mm, rms_heldout_mm, worst_heldout_mm
        Root mean square error on the readings that it was fitted to and on those held out, and the largest.
    rms_sure_mm
        On the readings of the training part that tell how sure it is: no fit sees them. None without any.
    train_s
        What the fit took.
    eval_ns
        What the error at one place takes.
    parameters
        Numbers that were fitted.
    interval_mm
        Half width of the interval about what it says in which 90 % of readings at other places lie (split-conformal);
        infinite where too few places tell.
    coverage
        Share of the readings held out that lie in their interval.
    notes
        What else is to be said of it, in sentences.
    reason
        Why it has no figures.
    courses
        How its networks were trained.
    tried
        Spacings of a table that were tried, and the error of each, in mm.
    model
        Effects behind it, where it is made of them.
    """

    name: str
    kind: Kind
    predictor: Predictor | None = None
    rms_train_mm: float | None = None
    rms_heldout_mm: float | None = None
    worst_heldout_mm: float | None = None
    rms_sure_mm: float | None = None
    train_s: float | None = None
    eval_ns: float | None = None
    parameters: int | None = None
    interval_mm: float | None = None
    coverage: float | None = None
    notes: tuple[str, ...] = ()
    reason: str | None = None
    courses: tuple[Course, ...] = ()
    tried: tuple[tuple[float, float], ...] = ()
    model: Model | None = None

    def left_mm(self, samples: Samples) -> npt.NDArray[np.float64]:
        """Return what the predictor leaves of readings, in mm, shape (n,); all of them where there is none."""
        if self.predictor is None:
            return samples.error_mm
        return samples.left_by(self.predictor)

    @property
    def works(self) -> bool:
        """Whether it has a figure, and is a predictor."""
        return self.rms_heldout_mm is not None and self.kind is not Kind.NONE


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PredictorComparison:
    """All predictors of one measurement.

    Parameters
    ----------
    source
        The measurement.
    parts
        What each part of it was for.
    rows
        In the order in which they were asked for.
    pitch_mm
        Travel of a turn of the screw, None where it is not stated.
    noise_mm
        Of one reading, from repeats; None without.
    notes
        On the measurement, in sentences.
    axis
        Number of the axis, None where the measurement does not say it.
    interrupted
        Whether it was ended before every training had come to its end.
    """

    source: str
    parts: Parts
    rows: tuple[Row, ...]
    pitch_mm: float | None
    noise_mm: float | None
    notes: tuple[str, ...]
    interrupted: bool
    axis: int | None = None

    @property
    def ranked(self) -> tuple[Row, ...]:
        """Rows with a figure, the lowest held-out error first; then those without, in their order."""
        return tuple(sorted(self.rows, key=lambda row: (row.rms_heldout_mm is None, row.rms_heldout_mm or 0.0)))

    @property
    def best(self) -> Row | None:
        """The predictor with the lowest held-out error."""
        return next((row for row in self.ranked if row.works), None)

    @property
    def chosen(self) -> Row | None:
        """The predictor that the training part alone chooses: none of what judges has a say in it."""
        able = [row for row in self.rows if row.works and row.rms_sure_mm is not None]
        return min(able, key=lambda row: row.rms_sure_mm or 0.0, default=None)

    def best_of(self, kind: Kind) -> Row | None:
        """Return the row of a kind with the lowest held-out error; None where no such row has one."""
        return next((row for row in self.ranked if row.kind is kind and row.rms_heldout_mm is not None), None)

    def is_as_good(self, row: Row) -> bool:
        """Return whether the held-out error of a row is at most a tenth above that of the best predictor."""
        return self.best is not None and _heldout(row) <= (1.0 + ALIKE) * _heldout(self.best)

    @property
    def is_worth_it(self) -> bool:
        """Whether the best predictor leaves less than nine tenths of what no correction leaves."""
        bare = self.best_of(Kind.NONE)
        return bare is None or (self.best is not None and _heldout(self.best) <= (1.0 - ALIKE) * _heldout(bare))

    def named(self, name: str) -> Row | None:
        """Return the row of a name."""
        return next((row for row in self.rows if row.name == name), None)


def _heldout(row: Row) -> float:
    return row.rms_heldout_mm or 0.0
