"""What a search found, before it is put into words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from rtec.dataset.dataset import Dataset
from rtec.effects import Floats, Shape, effect_named
from rtec.inference.fit import fitted_terms, holding_datum, residual_of
from rtec.inference.model import Model, Term
from rtec.inference.probes import Probe
from rtec.inference.results import Outlier
from rtec.inference.scored import Scored
from rtec.inference.search import Search
from rtec.inference.space import Choice

OFFSET = effect_named("offset")


@dataclass(frozen=True, slots=True)
class Offset:
    """The constant of the readings, its standard error, and the probability that it is none."""

    value: float
    error: float
    p: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """What a search found, before it is put into words.

    Parameters
    ----------
    search, model
        On all rows.
    scout, scouted
        The search on the rows that were drawn, and what it found; the same where nothing had to be drawn.
    begun
        The model that the search began with, fitted.
    probability
        Of each effect that competed.
    outliers
        Readings left out.
    heldout
        Another measurement to score on.
    searched
        False where one effect was added as the user said.
    """

    search: Search
    model: Scored
    scout: Search
    scouted: Scored
    begun: Model
    probability: Mapping[str, float]
    outliers: tuple[Outlier, ...] = ()
    heldout: Dataset | None = None
    searched: bool = True
    offset: Offset | None = None
    """A constant that no effect's own zero explains."""

    @property
    def dataset(self) -> Dataset:
        """The readings."""
        return self.search.space.dataset

    def fitted(self, model: Scored, order: Sequence[Choice] | None = None) -> Model:
        """Return a model as people get it: without probes, its amplitudes fitted beside them, in order."""
        terms, datum = fitted_terms(self.search.judge, model)
        by_choice = {(term.effect, term.shape): term for term in terms if not isinstance(term.effect, Probe)}
        kept = list(by_choice) if order is None else [choice for choice in order if choice in by_choice]
        found = [by_choice[choice] for choice in kept]
        if self.offset is not None:
            constant = Term(effect=OFFSET, shape=Shape(), amplitudes=(datum,), errors=(self.offset.error,))
            return self.begun.with_terms([constant, *found], datum=0.0)
        return holding_datum(self.begun.with_terms(found, datum=datum if found else self.begun.datum))

    def left(self, model: Scored) -> Floats:
        """Return what a model as people get it leaves of the readings, shape (rows,)."""
        return residual_of(self.dataset, self.fitted(model))

    def rms_left(self, model: Scored) -> float:
        """Return the RMS of what a model leaves."""
        if not model.choices and self.offset is None:
            return self.dataset.rms(residual_of(self.dataset, self.begun))
        return self.dataset.rms(self.search.judge.left(model))

    def rms_heldout(self, model: Scored) -> float:
        """Return the held-out RMS of a model: on the other measurement, or on the chessboard."""
        if self.heldout is not None:
            return self.heldout.rms(residual_of(self.heldout, self.fitted(model)))
        return self.dataset.rms(self.search.gate.held_out(model))
