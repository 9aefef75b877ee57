"""The search for what is missing: a beam of models, each with its noise, that grow, shrink and exchange effects."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np

from rtec.effects import Effect, Shape
from rtec.effects._heat import FollowsHeat
from rtec.inference.block_choice import chosen_by_blocks
from rtec.inference.exchanges import HOPELESS, OUT_OF_REACH, Exchanges
from rtec.inference.forms import forms_of
from rtec.inference.gate import IN_DOUBT, NEGLIGIBLE, Gate, generic
from rtec.inference.probes import Probe, changing
from rtec.inference.proposals import MOST_EFFECTS, Neighbours, bearable, is_within_a_step
from rtec.inference.rules import WORTH
from rtec.inference.scored import Judge, Scored, best_of_names
from rtec.inference.space import Choice

GATED, GATED_GENERIC, UNGATED = 2, 1, 1
"""Models that are carried on: those whose every effect has earned its place, without a probe and with one, and one
that may yet."""
FIRST = 5
"""Effects with which the search begins: where two of them are needed, a third may be likelier than either alone."""
ROUNDING = 1e-6

Progress = Callable[[float], None]


class Search:
    """A search and what it has seen.

    Parameters
    ----------
    judge
        Scores the models.
    given
        Effects of the model that the search begins with: they stay.
    begin
        Effects with which it begins besides: found on fewer readings, and taken out again where these do not bear
        them out.
    refused
        Why an effect that the score asked for was not taken, by name, as far as that is known.
    """

    def __init__(
        self,
        judge: Judge,
        given: tuple[Choice, ...] = (),
        begin: tuple[Choice, ...] = (),
        refused: dict[str, str] | None = None,
    ) -> None:
        self.judge, self.space, self.given, self.begin = judge, judge.space, given, begin
        self.neighbours = Neighbours(judge, given)
        self.gate = Gate(self.neighbours, {} if refused is None else refused)
        self.exchanges = Exchanges(self.gate)
        self.doubts: set[str] = set()
        """Names of effects that the data suggest but cannot bear out."""

    def run(self, tell: Progress) -> Scored:
        """Return the best model in which every effect has earned its place.

        Where it holds a map, it is looked for once more without maps and probes: many columns draw whatever comes
        their way, and stand where several effects would have to come in at once. Where it holds a probe, it is looked
        for once more with waves one by one: a family that brings several periods together hides each of them.
        """
        found = self._climbed(tell, begin=self.begin)
        maps = [choice[0] for choice in found.choices if choice not in self.given and choice[0].is_map]
        if maps and not self.begin and not any(isinstance(effect, Probe) for effect in maps):
            self.neighbours.barred = frozenset(effect.name for effect in self.space.library if effect.is_map)
            other = self._climbed(lambda share: None, found.score - OUT_OF_REACH)
            self.neighbours.barred = frozenset()
            found = max(found, other, key=lambda m: m.score)
        found = self._one_by_one(self.changing(found))
        self._suspect(found)
        ended = self._likelier(found)
        return ended if ended is found else self._one_by_one(ended)

    def _one_by_one(self, found: Scored) -> Scored:
        """Return a model, or a better one with waves one by one where it holds a probe or a wave within a step."""
        waves = [choice for choice in found.choices if choice not in self.given and choice[0].is_wave]
        within = any(is_within_a_step(self.space.dataset.coordinates, shape) for _, shape in waves)
        if not within and not (generic(found) and any(effect.is_wave for effect in self.space.library)):
            return found
        self.neighbours.single = True
        other = self.changing(self._climbed(lambda share: None))
        self.neighbours.single = False
        return max(found, other, key=lambda m: m.score)

    def _likelier(self, found: Scored) -> Scored:
        """Return a model, or the best that was seen on the way and whose every effect has earned its place."""
        while True:
            likelier = (m for m in best_of_names(self.gate.near(found)).values() if m.score > found.score + ROUNDING)
            sound = (self.exchanges.reshaped(m) for m in likelier if self.gate.is_gated(m))
            better = next((m for m in sound if self.gate.is_gated(m)), None)
            if better is None:
                return found
            found = self.exchanges.exchanged(better)

    def _climbed(self, tell: Progress, least: float = -np.inf, begin: Sequence[Choice] = ()) -> Scored:
        """Return the best model that the beam and exchanges reach from ``begin``; exchanges from ``least`` on.

        A probe explains at once what takes several effects: models without one grow beside those with one.
        """
        start = self.judge.score([*self.given, *begin])
        if begin:
            start = self.gate.earned(self.exchanges.reshaped(start, maps=True, waves=True))
        best, beam, reached = {False: start, True: start}, [start], -np.inf
        for depth in range(MOST_EFFECTS):
            gated, ungated = self._sorted_out(self._grown(beam), best, first=depth == 0 and not begin)
            tell(0.05 + 0.6 * (depth + 1) / MOST_EFFECTS)
            tops = {generic(m): m for m in sorted(gated, key=lambda m: m.score)}
            worth = max((m.score - best[kind].score for kind, m in tops.items()), default=0.0)
            best |= {kind: m for kind, m in tops.items() if m.score > best[kind].score + ROUNDING}
            if worth > WORTH:
                beam, reached = [*gated, *ungated], -np.inf
            elif ungated and ungated[0].score > reached + WORTH:
                beam, reached = ungated, ungated[0].score  # effects that only help together
            else:
                break
        found = max(best.values(), key=lambda m: m.score)
        if found.score < least:
            return found
        # what a probe explains at once, effects may explain when their families are grouped in another way
        starts = [found] if best[False] is found else [found, best[False]]
        exchanged = map(self.exchanges.exchanged, starts)
        ends = (self.exchanges.mended(self.exchanges.reshaped(m, maps=True, waves=True)) for m in exchanged)
        return max(ends, key=lambda m: m.score)

    def _grown(self, beam: Sequence[Scored]) -> list[Scored]:
        """Return the models one effect larger, and those without what the new one makes idle; best first."""
        grown: dict[object, Scored] = {}
        for model in beam:
            for child in (*self.neighbours.children(model), *self.neighbours.pairs(model), *self.heated(model)):
                grown[child.key] = child
                if child.score <= model.score:
                    continue
                here = self.judge.quickly(child.choices, child)
                for k in range(len(child.choices) - 1):
                    rest = self.neighbours.rest(child, k)
                    # what an effect explains another noise seldom does: of 6000 removals 2 were worth a look
                    if child.choices[k] in self.given or self.judge.quickly(rest, child) < here - OUT_OF_REACH:
                        continue
                    less = self.judge.score(rest, child)
                    if less.score > child.score:
                        grown[less.key] = less
        return sorted(grown.values(), key=lambda model: -model.score)

    def heated(self, model: Scored) -> list[Scored]:
        """Return models in which what heat does follows the sensors that best foretell blocks left out.

        What several sensors explain is one question: two that only help together are found together.
        """
        heats = [e for e in self.space.library if isinstance(e, FollowsHeat)]
        return [one for effect in heats if self.space.dataset.in_blocks for one in self._followed(model, effect)]

    def _followed(self, model: Scored, effect: Effect) -> Iterator[Scored]:
        """Yield a model with one sensor more each time in the place of what it has of an effect of heat."""
        data = self.space.dataset
        others = [choice for choice in model.choices if choice[0] is not effect or choice in self.given]
        held, shapes = [shape for other, shape in others if other is effect], self.space.shapes(effect)[0]

        def stands(taken: Sequence[int], new: int) -> bool:
            return bearable(data.conditions, effect, shapes[new], [*held, *(shapes[i] for i in taken)])

        chosen = chosen_by_blocks(
            np.vstack([np.ones((1, data.rows)), *(p.raw * p.unit for p in self.space.parts_of(others))]),
            np.vstack([self.space.part_of((effect, shape)).raw[:1] for shape in shapes]),
            data.observed,
            self.gate.board.fold,
            forms_of(effect).at_most - len(held),
            stands,
        )
        for count in range(1, len(chosen) + 1):
            yield self.judge.score([*others, *((effect, shapes[i]) for i in chosen[:count])], model)

    def _sorted_out(
        self, ranked: Sequence[Scored], best: Mapping[bool, Scored], *, first: bool
    ) -> tuple[list[Scored], list[Scored]]:
        """Return the best models whose every effect has earned its place, and the best that may yet.

        Of those with a probe, and of those without one. The ``first`` may be hopeless: another effect helps them.
        """
        gated: list[Scored] = []
        ungated: list[Scored] = []
        for model in ranked:
            kind = generic(model)
            alike = [m for m in gated if generic(m) == kind]
            enough = GATED_GENERIC if kind else FIRST if first else GATED
            if len(alike) == enough or (alike and not first and model.score < best[kind].score - HOPELESS):
                continue
            if first and any(sorted(m.names) == sorted(model.names) for m in alike[1:]):
                continue
            if kind and model.score < best[False].score:  # what a probe explains has been explained without it
                continue
            better = model if alike else self.exchanges.reshaped(model)
            if self.gate.is_gated(better):
                gated.append(better)
            elif len(ungated) < UNGATED and better.score > max(best[kind].score, best[False].score):
                ungated.append(better)
        return gated, ungated

    def changing(self, model: Scored) -> Scored:
        """Return a model with what of its effects changes along the axis, in time or from run to run beside them."""
        while True:
            fit = self.judge.fit(model)
            trials = []
            for k, choice in enumerate(model.choices):
                if not isinstance(choice[0], Probe):
                    part = self.space.part_of(choice)
                    for probe in changing(self.space.dataset, choice[0], fit.contribution(k), part.raw):
                        if probe.name not in model.names:
                            trials.append(self.judge.score([*model.choices, (probe, Shape())], model))
            better = [m for m in trials if m.score > model.score + WORTH and self.gate.is_gated(m)]
            if not better:
                return model
            model = max(better, key=lambda m: m.score)

    def _suspect(self, model: Scored) -> None:
        """Score what the data suggest but cannot bear out in the place of each effect of a model, and of all."""
        start = self.judge.score(self.given)
        taken = [k for k, choice in enumerate(model.choices) if choice not in self.given]
        rests = [self.neighbours.without(model, k) for k in taken]
        for rest in {m.key: m for m in (*rests, start)}.values():
            for effect in (*self.neighbours.effects_for(rest), *self.space.suspected):
                shapes = forms_of(effect).suspects(self.space.dataset.conditions)
                if trials := [[*rest.choices, (effect, shape)] for shape in shapes]:
                    best = max(trials, key=lambda choices: self.judge.quickly(choices, rest))
                    suspect = self.exchanges.reshaped(self.judge.score(best, rest))
                    doubted = effect.name + IN_DOUBT in self.gate.called(suspect)
                    if doubted and suspect.score > model.score - NEGLIGIBLE:
                        self.doubts.add(effect.name)
