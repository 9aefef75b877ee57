"""A model with everything that was found out about it: how likely, under which noise, with which amplitudes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp

from rtec.effects import Floats, Shape
from rtec.inference.colour import NEIGHBOURS, Colour
from rtec.inference.evidence import SCALES, Sums, best_scales, posterior, shifted_scales
from rtec.inference.space import Choice, Part, Space, blocks_of

EVERY_COLOUR = 60
"""Readings up to which every colour of noise is weighed: more of them single a few out."""
FAR = 4.0
"""Nats below the best from which on a colour adds nothing."""
START_COLOUR = Colour(0.6, 0.3)
LANDMARKS, SHORT, HOLLOW = (Colour(), START_COLOUR, Colour(0.9, 0.6), Colour(0.999, 0.01)), 0.8, 60.0
"""From these the noise is looked for, too, where it was found to be slower than ``SHORT`` and they are less than
``HOLLOW`` nats below: between noise that wanders and none at all the way leads through a hollow, and what an effect
explains would stay noise (30 nats in a game)."""
START = 4
"""Place on the ladder of scales from which a new part begins: ten times the noise."""


@dataclass(frozen=True, slots=True, eq=False)
class Scored:
    """A model and what speaks for it.

    Parameters
    ----------
    choices
        Its effects.
    score
        Log marginal likelihood, averaged over colours of noise, less the price of everything that was chosen; nats.
    colour
        The likeliest noise.
    colours
        (colour, log marginal likelihood) of those that were looked at.
    places
        Of each part on the ladder of scales.
    wrong_sign
        Effects that come out below zero although they cannot be.
    """

    choices: tuple[Choice, ...]
    score: float
    colour: Colour
    colours: tuple[tuple[Colour, float], ...]
    places: NDArray[np.int64]
    wrong_sign: tuple[str, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the effects."""
        return tuple(effect.name for effect, _ in self.choices)

    @property
    def key(self) -> frozenset[tuple[str, Shape]]:
        """Models with the same effects in the same shapes are one model."""
        return frozenset((effect.name, shape) for effect, shape in self.choices)


@dataclass(eq=False)
class Judge:
    """Scores models of one data set, and remembers them."""

    space: Space
    seen: dict[frozenset[tuple[str, Shape]], Scored] = field(default_factory=dict)
    _tried: dict[tuple[str, Shape], float] = field(default_factory=dict)

    def price(self, choice: Choice) -> float:
        """Return what choosing an effect in a shape costs, in nats: it is one of so many."""
        effect, shape = choice
        key = effect.name, shape
        if key not in self._tried:
            families = len(self.space.library)
            self._tried[key] = float(np.log(families * max(effect.tried(self.space.dataset.conditions, shape), 1.0)))
        return self._tried[key]

    def start_of(self, parts: Sequence[Part], near: Scored | None) -> NDArray[np.int64]:
        """Return the scales from which a model begins: those of the model that it grew out of."""
        known: dict[Part, int] = {}
        if near is not None:
            known = {p: int(k) for p, k in zip(self.space.parts_of(near.choices), near.places, strict=True)}
        return np.array([known.get(p, START) for p in parts], dtype=np.int64)

    def quickly(self, choices: Sequence[Choice], near: Scored) -> float:
        """Return the score of a model under the noise of another that it grew out of, and that alone."""
        parts = self.space.parts_of(choices)
        sums = self.space.sums(parts, near.colour)
        _, value = best_scales(sums, blocks_of(parts), self.start_of(parts, near))
        return (
            value - 0.5 * self.space.log_determinant(near.colour) - near.colour.rarity - sum(map(self.price, choices))
        )

    def score(self, choices: Sequence[Choice], near: Scored | None = None) -> Scored:
        """Return a model's score, with its noise fitted together with it."""
        key = frozenset((effect.name, shape) for effect, shape in choices)
        if key in self.seen:
            return self.seen[key]
        space = self.space
        parts = space.parts_of(choices)
        block = blocks_of(parts)
        found: dict[Colour, float] = {}
        scales: dict[Colour, NDArray[np.int64]] = {}
        begin = self.start_of(parts, near)
        sums = cache(lambda colour: space.sums(parts, colour))

        def look(colour: Colour, start: NDArray[np.int64], *, tune: bool) -> float:
            scales_from = best_scales if tune else shifted_scales
            scales[colour], value = scales_from(sums(colour), block, start)
            found[colour] = value - 0.5 * space.log_determinant(colour) - colour.rarity
            return found[colour]

        def fresh(colour: Colour) -> list[Colour]:
            return [c for c in NEIGHBOURS[colour] if c not in found and c in space.colours]

        def ascend(top: Colour) -> Colour:
            """Go from a colour to the likeliest around it, and on from there."""
            start = scales.get(top, begin)
            while True:
                here, start = look(top, start, tune=True), scales[top]
                better = {c: v for c in fresh(top) if (v := look(c, start, tune=False)) > here}
                if not better:
                    return top
                top = max(better, key=lambda c: better[c])
                start = scales[top]

        reached = ascend(START_COLOUR if near is None else near.colour)
        if reached.rho > SHORT:
            for other in LANDMARKS:
                if other not in found and other in space.colours:
                    if look(other, begin, tune=True) > found[reached] - HOLLOW:
                        ascend(other)
        if space.readings <= EVERY_COLOUR:
            least = -np.inf
        else:  # the colours around those that still count
            least = max(found.values()) - FAR
        pending = [c for c, value in found.items() if value > least]
        while pending:
            at = pending.pop()
            for colour in fresh(at):
                if look(colour, scales[at], tune=False) > least:
                    pending.append(colour)
        best = max(found, key=lambda c: found[c])
        look(best, scales[best], tune=True)
        total = (
            float(logsumexp(list(found.values()))) - float(np.log(len(space.colours))) - sum(map(self.price, choices))
        )
        result = Scored(
            choices=tuple(choices),
            score=total,
            colour=best,
            colours=tuple(sorted(found.items(), key=lambda item: -item[1])),
            places=scales[best],
            wrong_sign=_wrong_sign(choices, sums(best), block, scales[best]),
        )
        self.seen[key] = result
        return result

    def fit(self, model: Scored, colour: Colour | None = None) -> Fit:
        """Return amplitudes of a scored model, weighed by a colour, else as people get them."""
        parts = self.space.parts_of(model.choices)
        colour = self.space.weights(model.colour) if colour is None else colour
        sums = self.space.sums(parts, colour)
        deviations = _ladder()[model.places][blocks_of(parts)]
        mean, covariance, variance = posterior(sums, deviations)
        return Fit(parts=parts, mean=mean, covariance=covariance, variance=variance, deviations=deviations)

    def left(self, model: Scored) -> Floats:
        """Return what a model leaves of the readings, shape (rows,), the constant taken out where it is no effect."""
        left: Floats = self.space.dataset.observed - self.fit(model).effects()
        return left - left.mean() if self.space.has_datum else left


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """Amplitudes of a model in units of its parts, what is known of them, and the variance of the noise."""

    parts: Sequence[Part]
    mean: Floats
    covariance: Floats
    """Over the noise's variance."""
    variance: float
    deviations: Floats

    def rows(self, k: int) -> NDArray[np.bool_]:
        """Return which columns belong to part ``k``."""
        found: NDArray[np.bool_] = blocks_of(self.parts) == k
        return found

    def effects(self) -> Floats:
        """Return what the effects add to the readings, shape (rows,); 0 without effects."""
        return np.asarray(sum(self.contribution(k) for k in range(len(self.parts))))

    def contribution(self, k: int) -> Floats:
        """Return what part ``k`` adds to the readings, shape (rows,), in the observed unit inside."""
        part = self.parts[k]
        added: Floats = (self.mean[self.rows(k)] * part.unit) @ part.raw
        return added


def _wrong_sign(
    choices: Sequence[Choice], sums: Sums, block: NDArray[np.int64], places: NDArray[np.int64]
) -> tuple[str, ...]:
    """Return the effects that come out below zero although they cannot be."""
    if not any(effect.not_negative for effect, _ in choices):
        return ()
    mean = posterior(sums, _ladder()[places][block])[0]
    return tuple(
        effect.name
        for k, (effect, _) in enumerate(choices)
        if effect.not_negative and float(mean[block == k].min()) < 0.0
    )


def _ladder() -> Floats:
    return SCALES
