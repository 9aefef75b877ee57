"""A model with everything that was found out about it: how likely, under which noise, with which amplitudes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp

from rtec.effects import Floats, Shape
from rtec.inference.colour import NEIGHBOURS, Colour
from rtec.inference.evidence import SCALES, Sums, best_scales, posterior
from rtec.inference.forms import is_asked
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
    """A model and what speaks for it."""

    choices: tuple[Choice, ...]
    """Its effects."""
    score: float
    """Log marginal likelihood, averaged over colours of noise, less the price of everything that was chosen; nats."""
    colour: Colour
    """The likeliest noise."""
    colours: tuple[tuple[Colour, float], ...]
    """(colour, log marginal likelihood) of those that were looked at."""
    places: NDArray[np.int64]
    """Of each part on the ladder of scales."""
    wrong_sign: tuple[str, ...] = ()
    """Effects that come out below zero although they cannot be."""

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the effects."""
        return tuple(effect.name for effect, _ in self.choices)

    @property
    def key(self) -> frozenset[tuple[str, Shape]]:
        """Models with the same effects in the same shapes are one model."""
        return frozenset((effect.name, shape) for effect, shape in self.choices)


def replaced(model: Scored, k: int, choice: Choice) -> list[Choice]:
    """Return the choices of a model with another in the place of one."""
    return [*model.choices[:k], choice, *model.choices[k + 1 :]]


def best_of_names(models: Iterable[Scored]) -> dict[tuple[str, ...], Scored]:
    """Return the best model of each set of effects, best first: whether these have earned their place it decides."""
    best: dict[tuple[str, ...], Scored] = {}
    for model in sorted(models, key=lambda m: -m.score):
        best.setdefault(tuple(sorted(model.names)), model)
    return best


@dataclass(slots=True, eq=False)
class ColourSearch:
    """A search for the colour of the noise beside some parts of a model, from the scales in ``begin``."""

    space: Space
    parts: Sequence[Part]
    begin: NDArray[np.int64]
    block: NDArray[np.int64] = field(init=False)
    found: dict[Colour, float] = field(default_factory=dict)
    """Log marginal likelihood of each colour that was looked at."""
    scales: dict[Colour, NDArray[np.int64]] = field(default_factory=dict)
    _sums: dict[Colour, Sums] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.block = blocks_of(self.parts)

    def sums(self, colour: Colour) -> Sums:
        """Return the products of all columns under a colour."""
        if colour not in self._sums:
            self._sums[colour] = self.space.sums(self.parts, colour)
        return self._sums[colour]

    def best(self, start: Colour) -> Colour:
        """Return the likeliest colour that is reached from one; all around it that count are found with it."""
        self._pass_landmarks(self._ascend(start))
        self._spread()
        best = max(self.found, key=lambda c: self.found[c])
        self._look(best, self.scales[best], tune=True)
        return best

    def _look(self, colour: Colour, start: NDArray[np.int64], *, tune: bool) -> float:
        """Return how likely a colour is, with the best scales or those of ``start``."""
        self.scales[colour], value = best_scales(self.sums(colour), self.block, start, together=not tune)
        self.found[colour] = value - 0.5 * self.space.view(colour).log_determinant - colour.rarity
        return self.found[colour]

    def _fresh(self, colours: Sequence[Colour]) -> Iterator[Colour]:
        """Yield those that there are and that nobody has looked at."""
        return (c for c in colours if c not in self.found and c in self.space.colours)

    def _ascend(self, top: Colour) -> Colour:
        """Go from a colour to the likeliest around it, and on from there."""
        start = self.scales.get(top, self.begin)
        while True:
            here, start = self._look(top, start, tune=True), self.scales[top]
            around = {c: self._look(c, start, tune=False) for c in self._fresh(NEIGHBOURS[top])}
            better = {c: v for c, v in around.items() if v > here}
            if not better:
                return top
            top = max(better, key=lambda c: better[c])
            start = self.scales[top]

    def _pass_landmarks(self, reached: Colour) -> None:
        """Go on from the landmarks that are not far below what was reached, where that is slow noise."""
        for other in self._fresh(LANDMARKS if reached.rho > SHORT else ()):
            if self._look(other, self.begin, tune=True) > self.found[reached] - HOLLOW:
                self._ascend(other)

    def _spread(self) -> None:
        """Look at every colour of few readings; of more at those around the ones that still count."""
        least = -np.inf if self.space.readings <= EVERY_COLOUR else max(self.found.values()) - FAR
        pending = [c for c, value in self.found.items() if value > least]
        while pending:
            at = pending.pop()
            for colour in self._fresh(NEIGHBOURS[at]):
                if self._look(colour, self.scales[at], tune=False) > least:
                    pending.append(colour)


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
            value
            - 0.5 * self.space.view(near.colour).log_determinant
            - near.colour.rarity
            - sum(map(self.price, choices))
        )

    def score(self, choices: Sequence[Choice], near: Scored | None = None) -> Scored:
        """Return a model's score, with its noise fitted together with it."""
        key = frozenset((effect.name, shape) for effect, shape in choices)
        if key in self.seen:
            return self.seen[key]
        parts = self.space.parts_of(choices)
        noise = ColourSearch(self.space, parts, self.start_of(parts, near))
        best = noise.best(START_COLOUR if near is None else near.colour)
        every = float(logsumexp(list(noise.found.values()))) - float(np.log(len(self.space.colours)))
        result = Scored(
            choices=tuple(choices),
            score=every - sum(map(self.price, choices)),
            colour=best,
            colours=tuple(sorted(noise.found.items(), key=lambda item: -item[1])),
            places=noise.scales[best],
            wrong_sign=_wrong_sign(choices, noise.sums(best), noise.block, noise.scales[best]),
        )
        self.seen[key] = result
        return result

    def fit(self, model: Scored, colour: Colour | None = None) -> Fit:
        """Return amplitudes of a scored model, weighed by a colour, else as people get them."""
        parts = self.space.parts_of(model.choices)
        colour = self.space.weights(model.colour) if colour is None else colour
        sums = self.space.sums(parts, colour)
        mean, variance = posterior(sums, SCALES[model.places][blocks_of(parts)])
        return Fit(parts=parts, mean=mean, variance=variance)

    def left(self, model: Scored) -> Floats:
        """Return what a model leaves of the readings, shape (rows,), the constant taken out where it is no effect."""
        left: Floats = self.space.dataset.observed - self.fit(model).effects()
        return left - left.mean() if self.space.has_datum else left


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """Amplitudes of a model in units of its parts, and the variance of the noise."""

    parts: Sequence[Part]
    mean: Floats
    variance: float

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
        return (self.mean[self.rows(k)] * part.unit) @ part.raw


def _wrong_sign(
    choices: Sequence[Choice], sums: Sums, block: NDArray[np.int64], places: NDArray[np.int64]
) -> tuple[str, ...]:
    """Return the effects that come out below zero although they cannot be."""
    if not is_asked("sign") or not any(effect.not_negative for effect, _ in choices):
        return ()
    mean = posterior(sums, SCALES[places][block])[0]
    return tuple(
        effect.name
        for k, (effect, _) in enumerate(choices)
        if effect.not_negative and float(mean[block == k].min()) < 0.0
    )
