"""What compare, diagnose and add find: plain results, without computation."""

from __future__ import annotations

import enum
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from rtec.dataset.dataset import Dataset
from rtec.effects import Floats
from rtec.effects.curve import CurveShape
from rtec.effects.experiments import Ask
from rtec.inference.model import Model


class Verdict(enum.Enum):
    """What a search comes to once it stops."""

    NAMED = "NAMED"
    LIKELY = "LIKELY"
    """As NAMED, but nothing was repeated: there is no noise floor by which to judge what is left."""
    TIED = "TIED"
    NOT_TESTABLE = "NOT_TESTABLE"
    INCONCLUSIVE = "INCONCLUSIVE"
    UNKNOWN = "UNKNOWN"
    NONE = "NONE"


@dataclass(frozen=True, slots=True)
class Value:
    """A parameter as people read it: value ± standard error, with its unit."""

    name: str
    value: float | str
    error: float | None
    unit: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Step:
    """One step of a search: an effect added, everything refitted."""

    effect: str
    params: tuple[Value, ...]
    rms_train: float
    rms_heldout: float
    """RMS of what is left, in training and held out, in the observed unit inside."""
    gain: float
    gain_error: float
    """Fall of the held-out mean square by this step and its paired standard error over the blocks."""
    p_adjusted: float
    """Probability of so large a statistic by noise alone, anywhere in library and scan grid."""
    reason: str
    model: Model
    """After the step."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Candidate:
    """An effect of the library, judged against this measurement."""

    effect: str
    predicted_rms: float
    """Training RMS that the effect would leave beside those found, before everything is fitted again."""
    p_adjusted: float
    reason: str
    accepted: bool = False
    achieved_rms: float | None = None
    """Training RMS after it was added; None where it was not."""
    params: tuple[Value, ...] = ()
    tied_with: tuple[str, ...] = ()
    for_ever: tuple[str, ...] = ()
    """Those of ``tied_with`` that no measurement of this kind tells from it: they are no tie."""
    cosine: float | None = None
    """With the nearest rival, after projection off the rest of the model."""
    probability: float = 0.0
    """Over the models that compete."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class NoiseFloor:
    """Noise of one reading, and where the figure comes from."""

    from_repeats: bool
    sigma: float
    """Standard deviation of a reading about its cell, in the observed unit inside; of the residual where there are no
    repeats."""
    correlation: float
    """From reading to reading."""
    white_share: float
    """Share of the variance that is white; the rest is correlated."""
    degrees_of_freedom: float
    sigma_adjacent: float | None
    """From adjacent repeats only: where it lies clearly below ``sigma``, something changes in time."""

    @property
    def floor(self) -> float | None:
        """Noise floor in the observed unit inside; None where there are no repeats."""
        return self.sigma if self.from_repeats else None

    @property
    def relative_error(self) -> float:
        """Standard error of ``sigma`` as a share of it, of normal noise."""
        return 1.0 / math.sqrt(2.0 * max(self.degrees_of_freedom, 1.0))


@dataclass(frozen=True, slots=True, kw_only=True)
class Unknown:
    """Repeatable structure that nothing in the library explains."""

    depends_on: tuple[str, ...]
    """``position``, ``direction``, ``velocity``, ``time``, ``run`` or the heading of an unknown column."""
    period: float | None
    """Of the strongest line, in position units."""
    frequency_hz: float | None
    description: str


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LearnedCurve:
    """A curve that explains what no effect does."""

    shape: CurveShape
    model: Model
    """The effects found, and the curve."""
    rms: float
    rms_heldout: float
    """Of what is left with it, in the observed unit inside."""
    ways: tuple[int, ...]
    """+1 and -1 of a curve for each direction, 0 of one for both."""
    at: Floats
    """Places along the quantity, shape (places,), in its unit inside."""
    across: Floats
    """Places along the second one, shape (few,); of a curve over one quantity a single 0."""
    values: Floats
    """Shape (ways, few, places), the mean taken out, in the observed unit inside."""
    errors: Floats
    """Standard errors of the same."""
    descriptions: tuple[str, ...]
    """Functions that stay within the band, the simplest first: what it is like, and no names."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Cosines:
    """How alike the effects look on this plan, after projection off a constant: a symmetric matrix."""

    names: tuple[str, ...]
    cosine: NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Experiment:
    """What to measure next, and what the rivals predict there."""

    text: str
    rivals: tuple[str, ...] = ()
    label: str = ""
    """Of the abscissa of the prediction, with its unit."""
    abscissa: Floats | None = None
    predictions: tuple[Floats, ...] = ()
    """Of each rival over ``abscissa``, in the observed unit inside."""
    asks: frozenset[Ask] = frozenset()
    """Of a measuring plan; see `rtec.inference.suggested_plan`."""


@dataclass(frozen=True, slots=True)
class Outlier:
    """A reading that belongs to nothing and was left out."""

    row: int
    """Of the file's readings, from 1."""
    value: float
    """Observed, in its unit inside."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Diagnosis:
    """A whole search."""

    verdict: Verdict
    dataset: Dataset
    heldout: Dataset | None = None
    start: Model
    model: Model
    steps: tuple[Step, ...] = ()
    candidates: tuple[Candidate, ...] = ()
    noise: NoiseFloor
    rms_before: float
    rms_after: float
    rms_heldout: float
    heldout_by: str = ""
    """What was held out: a ``stretch`` or a ``block`` at a time, or the name of the other file."""
    rms_heldout_rows: float | None = None
    """The same as ``rms_heldout`` with single rows held out, where the data have blocks."""
    not_testable: tuple[tuple[str, str], ...] = ()
    minimum_detectable: tuple[tuple[str, float], ...] = ()
    """RMS contribution of each effect that would be found nine times out of ten, in the observed unit inside."""
    lack_of_fit: tuple[tuple[str, float], ...] = ()
    """p of what is left against repeats, by what was looked at."""
    unknown: Unknown | None = None
    cosines: Cosines | None = None
    experiment: Experiment
    notes: tuple[str, ...] = ()
    rms_heldout_before: float = float("nan")
    """Held-out RMS of the model that the search began with."""
    probability: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))
    """Of each effect that competed, by name: accepted or not."""
    outliers: tuple[Outlier, ...] = ()
    approximate: tuple[str, ...] = ()
    """Accepted effects whose form is only nearly right."""
    suspected: tuple[str, ...] = ()
    """Effects that may well be there, and that these data cannot bear out."""
    curve: LearnedCurve | None = None
    """What is left as a curve, where no effect explains it."""
    unseen_periods: tuple[str, ...] = ()
    """Periods that these targets cannot show."""

    @property
    def effects(self) -> tuple[str, ...]:
        """Accepted effects, in the order in which they were found."""
        return self.model.names
