"""The noise of a model: the likeliest colour, and all others that still have a say."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from rtec.inference.colour import NEIGHBOURS, Colour
from rtec.inference.evidence import Sums, best_scales, shifted_scales
from rtec.inference.space import Part, Space, blocks_of

EVERY_COLOUR = 60
"""Readings up to which every colour of noise is weighed: more of them single a few out."""
FAR = 4.0
"""Nats below the best from which on a colour adds nothing."""
START_COLOUR = Colour(0.6, 0.3)
LANDMARKS, SHORT, HOLLOW = (Colour(), START_COLOUR, Colour(0.9, 0.6), Colour(0.999, 0.01)), 0.8, 60.0
"""From these the noise is looked for, too, where it was found to be slower than ``SHORT`` and they are less than
``HOLLOW`` nats below: between noise that wanders and none at all the way leads through a hollow, and what an effect
explains would stay noise (30 nats in a game)."""


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
        scales_from = best_scales if tune else shifted_scales
        self.scales[colour], value = scales_from(self.sums(colour), self.block, start)
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
