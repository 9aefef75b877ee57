"""A model: the effects that explain a measured quantity, with the numbers of each."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from rtec.dataset.dataset import Dataset
from rtec.effects import Conditions, Effect, Floats, Shape, Units, WavesShape


@dataclass(frozen=True, slots=True, kw_only=True)
class Term:
    """One effect of a model."""

    effect: Effect
    """From the library."""
    shape: Shape | None = None
    """Period, time constant, nodes, ...; None where a fit has to find them."""
    amplitudes: tuple[float, ...] | None = None
    """In units inside; None where a fit has to find them."""
    errors: tuple[float, ...] | None = None
    """Standard error of each amplitude; None where no fit gave them."""
    covariance: tuple[tuple[float, ...], ...] | None = None
    """Of the amplitudes with each other, shape (amplitudes, amplitudes); None where it is not known, as of a file."""
    shape_errors: tuple[tuple[str, float], ...] = ()
    """Standard error of each refitted shape parameter, by its name."""

    @property
    def name(self) -> str:
        """Name of the effect."""
        return self.effect.name

    @property
    def fitted(self) -> bool:
        """Whether shape and amplitudes are known."""
        return self.shape is not None and self.amplitudes is not None

    @property
    def period(self) -> float | None:
        """Period of a periodic effect, in position units; None of another one, and where a fit has to find it."""
        return self.shape.period if isinstance(self.shape, WavesShape) else None

    @property
    def harmonics(self) -> int:
        """Waves in a period, 1 of an effect that is not periodic."""
        return self.shape.harmonics if isinstance(self.shape, WavesShape) else 1

    def contribution(self, conditions: Conditions) -> Floats:
        """Return what the term adds, shape (rows,), in the observed unit inside; a ValueError if it is not fitted."""
        return self.effect.contribution(conditions, *self._numbers())

    def component(self, dataset: Dataset) -> Floats:
        """Return what the term adds to each reading of a data set, as `contribution` does.

        Where the columns of an effect were filtered and thinned like the observed quantity, so is the contribution.
        """
        shape, amplitudes = self._numbers()
        return dataset.columns(self.effect, shape) @ np.asarray(amplitudes, dtype=np.float64)

    def _numbers(self) -> tuple[Shape, tuple[float, ...]]:
        if self.shape is None or self.amplitudes is None:
            raise ValueError(f"{self.name} is not fitted")
        return self.shape, self.amplitudes


@dataclass(frozen=True, slots=True, kw_only=True)
class Model:
    """Effects in the order in which they were found.

    Parameters
    ----------
    observe
        The column that the model explains: ``deviation``, ``force``, ...
    units
        Units inside.
    terms
        The effects.
    datum
        Constant of the readings that is no effect: where the instrument was set to zero; in the observed unit inside.
    range
        First and last position of the measurement that it was fitted to, in the unit of positions; None where it is
        not known.
    interval
        Half width about what it says in which 90 % of other readings lie, in the observed unit inside; None where it
        is not known.
    """

    observe: str
    units: Units
    terms: tuple[Term, ...] = ()
    datum: float = 0.0
    range: tuple[float, float] | None = None
    interval: float | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the effects, each once, in order."""
        return tuple(dict.fromkeys(term.name for term in self.terms))

    def predict(self, dataset: Dataset) -> Floats:
        """Return datum and contribution of every effect at each reading, shape (rows,), in the observed unit inside.

        Raises
        ------
        ValueError
            A term is not fitted.
        """
        total = np.full(dataset.rows, self.datum)
        for term in self.terms:
            total += term.component(dataset)
        return total

    def with_terms(self, terms: Iterable[Term], datum: float | None = None) -> Model:
        """Return the model with other terms; its error is then unknown."""
        return replace(self, terms=tuple(terms), datum=self.datum if datum is None else datum, interval=None)
