"""What a search found, before it is put into words, and the staircase that leads to it."""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
from scipy.special import stdtr

from rtec.dataset.dataset import Dataset
from rtec.effects import Floats, Shape, effect_named
from rtec.inference.answer import EQUAL, adjusted_p, newly
from rtec.inference.fit import fitted_terms, holding_datum, residual_of, values_of
from rtec.inference.model import Model, Term
from rtec.inference.probes import Probe
from rtec.inference.results import Outlier, Step
from rtec.inference.rules import WORTH
from rtec.inference.scored import Scored
from rtec.inference.search import Search
from rtec.inference.space import Choice

BEYOND_DOUBT = 0.001
"""Adjusted probability below which a constant is an offset: that it is a datum is the rule."""
PREDICTS = 0.1
"""Share of the error held out that an effect has to take away where only its form speaks against it."""
WAYS_DOWN = 4
"""Times the effects of a model so many beginnings of an order are tried."""
OFFSET = effect_named("offset")


Way: TypeAlias = tuple[list[Choice], list[Scored]]
"""Effects in an order, and the models on the way, one more."""


@dataclass(frozen=True, slots=True)
class Offset:
    """The constant of the readings, its standard error, and the probability that it is none."""

    value: float
    error: float
    p: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """What a search found, before it is put into words."""

    search: Search
    model: Scored
    """On all rows."""
    scout: Search
    scouted: Scored
    """The search on the rows that were drawn, and what it found; the same where nothing had to be drawn."""
    begun: Model
    """The model that the search began with, fitted."""
    probability: Mapping[str, float]
    """Of each effect that competed."""
    outliers: tuple[Outlier, ...] = ()
    """Readings left out."""
    heldout: Dataset | None = None
    """Another measurement to score on."""
    searched: bool = True
    """False where one effect was added as the user said."""
    offset: Offset | None = None
    """A constant that no effect's own zero explains."""
    approximate: tuple[str, ...] = ()
    """Effects whose form is only nearly right."""

    @property
    def dataset(self) -> Dataset:
        """The readings."""
        return self.search.space.dataset

    @property
    def names_something(self) -> bool:
        """Whether the model holds an effect that was found."""
        return any(c not in self.search.given and not isinstance(c[0], Probe) for c in self.model.choices)

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


def approximated(found: Finding) -> Finding:
    """Return what was found with the effects that only their form speaks against, where they predict much better.

    On real data no form is exact: what takes a tenth of the error held out, as nothing else does, is told, and told
    to be approximate.
    """
    search, gate = found.search, found.search.gate
    changes = any(effect.builds_on for effect, _ in found.model.choices if isinstance(effect, Probe))
    while found.searched and not changes:
        # a probe stands for what is missing, as long as nothing has a name for it
        base = search.judge.score([c for c in found.model.choices if not isinstance(c[0], Probe)], found.model)
        before, names = found.rms_heldout(base), Counter(base.names)
        nearly = []
        for other in list(gate.possible()):
            new = list((Counter(other.names) - names).elements())
            if len(new) == 1 and not names - Counter(other.names) and other.score > base.score + WORTH:
                k = other.choices.index(newly(other, base, new[0]))
                if not isinstance(other.choices[k][0], Probe) and gate.is_nearly_gated(other, k):
                    nearly.append((found.rms_heldout(other), new[0], other))
        error, name, model = min(nearly, key=lambda one: one[0], default=(before, "", base))
        if error > (1.0 - PREDICTS) * before or _rises(found, base, model):
            return found
        search.gate.refused.pop(name, None)
        found = replace(
            found,
            model=model,
            probability={**found.probability, name: 1.0},
            approximate=(*found.approximate, name),
        )
    return found


def in_order(found: Finding) -> tuple[Finding, list[Choice], list[Scored]]:
    """Return the effects in the order in which the held-out error falls fastest, and the models on the way.

    A search leaves no effect in its model that makes the readings or those held out worse, wherever it comes in.
    """
    while True:
        order, models = _ordered(found)
        rises = next((k for k in range(1, len(models)) if _rises(found, models[k - 1], models[k])), None)
        if rises is None or not found.searched:
            return found, order, models
        late = order[len(order) - len(models) + rises :]
        search, model = found.search, found.model
        rests = {choice: search.neighbours.without(model, model.choices.index(choice)) for choice in late}
        worst = min(late, key=lambda choice: found.rms_heldout(rests[choice]))
        search.gate.refused[worst[0].name] = "it raises the error, or that of what was held out"
        found = replace(found, model=rests[worst])


def _rises(found: Finding, before: Scored, after: Scored) -> bool:
    """Return whether a step makes what is left larger, or what was held out."""
    return found.rms_left(after) > found.rms_left(before) or found.rms_heldout(after) > found.rms_heldout(before)


def _ordered(found: Finding) -> Way:
    """Return the effects in the order in which the held-out error falls fastest, on a way that never rises.

    Effects may only help together: where a way ends, the last ones are tried in another order, a few times. Where
    every way ends, the first is gone on, up where it has to.
    """
    held = [choice for choice in found.model.choices if choice in found.search.given]
    tries = itertools.count()

    def go(way: Way, *, up: bool) -> Way | None:
        steps = _steps_on(found, way)
        for choice, model, rises in steps:
            if up or (not rises and next(tries) < WAYS_DOWN * len(found.model.choices)):
                if (ended := go(([*way[0], choice], [*way[1], model]), up=up)) is not None:
                    return ended
        return None if steps else way

    begin: Way = held, [found.search.judge.score(held)]
    ended = go(begin, up=False) or go(begin, up=True)
    assert ended is not None  # noqa: S101 - going up leads to the end
    return ended


def _steps_on(found: Finding, way: Way) -> list[tuple[Choice, Scored, bool]]:
    """Return what may come next on a way, the best first: an effect, the model with it, whether an error rises."""
    order, models = way
    names = {effect.name for effect, _ in order}
    steps: list[tuple[bool, bool, float, int, Choice, Scored]] = []
    for choice in found.model.choices:
        if choice not in order and not isinstance(choice[0], Probe):
            model = found.search.judge.score([*order, choice], models[-1])
            ready = not choice[0].builds_on or bool(choice[0].builds_on & names)
            error = found.dataset.rms(found.search.gate.held_out(model))
            steps.append((_rises(found, models[-1], model), not ready, error, len(steps), choice, model))
    return [(choice, model, rises) for rises, _, _, _, choice, model in sorted(steps, key=lambda step: step[:4])]


def offset_of(found: Finding) -> Offset | None:
    """Return the constant of the readings where it is an offset of its own, else None.

    A deviation is measured from a datum: an instrument is set to zero at the first reading, or the mean is taken off.
    Only a constant beyond all that the effects found go through is more than their choice of zero.
    """
    judge, dataset = found.search.gate.free, found.dataset
    if not judge.space.has_datum or any(isinstance(e, Probe) for e, _ in found.model.choices) or found.begun.terms:
        return None
    ones = np.ones((1, dataset.rows))
    model = judge.score(found.model.choices)
    fit = judge.fit(model)
    best = model.colours[0][1]
    # of all noises that the readings leave possible the one that hides a constant best; what wanders more slowly than
    # any of them is larger than its steps say
    least = float(np.mean(judge.left(model) ** 2))
    error = max(
        float(
            np.sqrt(
                max(judge.fit(model, colour).variance, least)
                / (judge.space.view(colour).whitening.of(ones) ** 2).sum()
            )
        )
        for colour, likelihood in model.colours
        if likelihood > best - EQUAL
    )
    reach = sum(float(np.ptp(fit.contribution(k))) for k in range(len(fit.parts)))
    _, datum = fitted_terms(judge, found.model)
    beyond = max(abs(float(dataset.observed.mean())) - reach, 0.0)
    if dataset.coordinates.time_is_coordinate:  # what began at zero is no constant
        beyond = min(beyond, abs(float(dataset.observed[0])))
    p = float(min(1.0, 2.0 * stdtr(dataset.rows - 1, -beyond / max(error, 1e-300)) * len(judge.space.library)))
    if p >= BEYOND_DOUBT:
        return None
    held_out = found.search.gate.held_out(judge.score(()))
    return Offset(datum, error, p) if dataset.rms(held_out) < dataset.rms(dataset.observed) else None


def _constant_step(found: Finding, offset: Offset, before: Scored) -> Step:
    fitted = found.fitted(before)
    return Step(
        effect=OFFSET.name,
        params=values_of(fitted.terms[0], fitted),
        rms_train=found.rms_left(before),
        rms_heldout=found.rms_heldout(before),
        gain=found.dataset.rms(found.dataset.observed) ** 2 - found.rms_heldout(before) ** 2,
        gain_error=0.0,
        p_adjusted=offset.p,
        reason=f"adjusted p {offset.p:.2g}: a constant beyond what any effect's zero explains",
        model=fitted,
    )


def steps_of(found: Finding, order: Sequence[Choice], models: Sequence[Scored]) -> tuple[Step, ...]:
    """Return the staircase: each effect added to those before it, everything refitted.

    What it brings is said of the step; whether it stays was decided beside all the others, by the probability shown.
    """
    steps = [] if found.offset is None else [_constant_step(found, found.offset, models[0])]
    search, names = found.search, list(found.model.names)
    error = found.rms_heldout(found.model) if order else 0.0
    for count, (before, after) in enumerate(itertools.pairwise(models), len(order) - len(models) + 2):
        choice = order[count - 1]
        fitted = found.fitted(after, order[:count])
        k = found.model.choices.index(choice)
        p = adjusted_p(search.judge, found.model, k)
        fall = found.rms_heldout(before) ** 2 - found.rms_heldout(after) ** 2
        certain = found.probability.get(choice[0].name, 0.0)
        needed = found.rms_heldout(search.neighbours.without(found.model, k)) > error
        steps.append(
            Step(
                effect=choice[0].name,
                params=values_of(fitted.terms[-1], fitted),
                rms_train=found.rms_left(after),
                rms_heldout=found.rms_heldout(after),
                gain=fall,
                gain_error=search.gate.gain(before, after).error,
                p_adjusted=p,
                reason=(f"probability {certain:.3f}, " if names.count(choice[0].name) == 1 else "")
                + f"adjusted p {p:.2g}, held-out error {'lower' if needed else 'not lower'} with it",
                model=fitted,
            )
        )
    return tuple(steps)
