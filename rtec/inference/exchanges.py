"""Exchanges: the shapes of a model's effects looked for once more, and effects given up for others."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from rtec.effects._harmonics import WavesShape
from rtec.effects.frequency_grid import is_uneven, stated_base
from rtec.inference.forms import forms_of
from rtec.inference.gate import Gate
from rtec.inference.probes import Probe
from rtec.inference.proposals import Neighbours, bearable, beside, peaks, refine
from rtec.inference.scored import Judge, Scored, replaced

REGROUPED = 3
"""Families with a part of another that are refined: beside periods that are slightly off the first may be wrong."""
EXCHANGES = 4
"""Rounds in which effects of the model found are exchanged for others."""
HOPELESS = 30.0
"""Nats below the best model from which on no other is carried on, where there is one already."""
OUT_OF_REACH = 100.0
"""Nats that are more than an exchange mends: it sets right what the beam has got slightly wrong. In 64 of 229
measurements a model without maps was looked for, and none that stood further behind came near. A wave that is worth
more is no filler beside a wrong one."""
ALIASES = 3
"""Other periods that are tried in the place of a wave on uneven targets."""
HARDLY = 0.1
"""Nats for which no effects are exchanged: so much may lie between two orders in which shapes were refined."""


@dataclass(slots=True, eq=False)
class Exchanges:
    """Ways from one model to another of the same size."""

    gate: Gate
    neighbours: Neighbours = field(init=False)
    judge: Judge = field(init=False)
    _reshaped: dict[tuple[Scored, bool, bool], Scored] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.neighbours, self.judge = self.gate.neighbours, self.gate.judge

    def reshaped(self, model: Scored, *, maps: bool = False, waves: bool = False) -> Scored:
        """Return a model with the shape of each effect looked for once more beside all others.

        Nodes and harmonics where asked: while effects are missing they would follow what these explain.
        """
        key = model, maps, waves
        if key not in self._reshaped:
            self._reshaped[key] = self._moved(model, maps=maps, waves=waves)
        return self._reshaped[key]

    def _moved(self, model: Scored, *, maps: bool, waves: bool) -> Scored:
        conditions, given = self.judge.space.dataset.conditions, self.neighbours.given
        best = model
        for k in range(len(model.choices)):
            effect, shape = best.choices[k]
            if best.choices[k] in given or (effect.is_map and (isinstance(effect, Probe) or not maps)):
                continue
            moved = effect, shape
            if maps if effect.is_map else waves:
                forms = effect.variants(conditions, shape)
                others = [s for i, (e, s) in enumerate(best.choices) if i != k and e is effect]
                sound = [(effect, s) for s in forms if bearable(conditions, effect, s, others)]
                moved = max([moved, *sound], key=lambda form: self.judge.quickly(replaced(best, k, form), best))
                near = [(effect, s) for s in forms_of(effect).closer(conditions, moved[1])]
                moved = max([moved, *near], key=lambda form: self.judge.quickly(replaced(best, k, form), best))
            if not effect.is_map:
                rest = [choice for i, choice in enumerate(best.choices) if i != k]
                colour = best.colour.bounded
                moved = refine(self.judge, moved, beside(self.judge.space, rest, colour), colour)
            trial = self.judge.score(replaced(best, k, moved), best)
            if trial.score > best.score:
                best = trial
        return best

    def exchanged(self, model: Scored) -> Scored:
        """Return a model with effects exchanged for others as long as that makes it likelier."""
        given = self.neighbours.given
        for _ in range(EXCHANGES):
            better = model
            for choice in model.choices:
                if choice in given or choice not in better.choices:
                    continue
                k = better.choices.index(choice)
                rest = self.neighbours.without(better, k)
                others = sorted(self.neighbours.children(rest), key=lambda child: -child.score)[:3]
                others += self.regrouped(better, k)
                others += self.joined(better, k)
                if rest.score > better.score - OUT_OF_REACH:  # a second family may fill what a wrong first one leaves
                    alike = [i for i, c in enumerate(rest.choices) if c[0] is choice[0] and c not in given]
                    others += [other for i in alike for other in self.regrouped(rest, i)]
                for other in sorted(others, key=lambda m: -m.score):
                    if other.score > better.score + HARDLY and self.gate.is_gated(other):
                        moved = self.reshaped(other)
                        better = max(better, self.mended(moved), key=lambda m: m.score)
                        break
            if better.score <= model.score + HARDLY:
                break
            model = better
        return model

    def mended(self, model: Scored) -> Scored:
        """Return a model, or one with another effect for the only one that has not earned its place there."""
        failing = [k for k in range(len(model.choices)) if self.gate.why_not(model, k) is not None]
        if len(failing) != 1:
            return self.gate.earned(model)
        instead = self.neighbours.children(self.neighbours.without(model, failing[0]))
        sound = (m for m in sorted(instead, key=lambda m: -m.score) if self.gate.is_gated(m))
        return next(sound, self.gate.earned(model))

    def regrouped(self, model: Scored, k: int) -> list[Scored]:
        """Return models in which a family holds but a part of what it does, in other company.

        One that is the only one of its kind gives the rest to another, which the scan proposes.
        """
        effect, shape = model.choices[k]
        shapes = forms_of(effect).regrouped(self.judge.space.dataset.conditions, shape)
        if not shapes:
            return []
        trials = [replaced(model, k, (effect, other)) for other in shapes]
        worth = [self.judge.quickly(trial, model) for trial in trials]
        best = [self.judge.score(trials[i], model) for i in np.argsort(worth)[::-1][:REGROUPED]]
        if model.names.count(effect.name) == 1:
            waves = [e for e in self.neighbours.effects_for(model) if e.is_wave]
            best = [max([m, *self.neighbours.proposed(m, waves)], key=lambda child: child.score) for m in best]
        return [self.reshaped(self.reshaped(m)) for m in best if m.score > model.score - HOPELESS]

    def joined(self, model: Scored, k: int) -> list[Scored]:
        """Return the likeliest model in which an effect and another, or a later one of the same, are one of both.

        What else the other did is left to whatever the scan proposes.
        """
        effect, shape = model.choices[k]
        given, forms = self.neighbours.given, forms_of(effect)
        trials = [
            [*(c for j, c in enumerate(model.choices) if j not in (k, i)), (effect, form)]
            for i, (other, theirs) in enumerate(model.choices)
            if (other.name == forms.joins or (i > k and other is effect)) and model.choices[i] not in given
            for form in forms.joined(self.judge.space.dataset.conditions, shape, theirs)
        ]
        if not trials:
            return []
        found = []
        for trial in trials:
            one = self.judge.score(trial, model)
            found.append(one)
            if lost := set(model.names) - set(one.names):
                more = [e for e in self.neighbours.effects_for(one) if e.name not in lost]
                found += self.neighbours.proposed(one, more)
        return [max(found, key=lambda m: m.score)]

    def aliases(self, model: Scored, apart: float) -> list[str]:
        """Return a sentence for each wave on uneven targets that one of another period does as well, within nats."""
        space, found = self.judge.space, []
        c = space.dataset.conditions
        for k, (effect, shape) in enumerate(model.choices if is_uneven(c) else ()):
            if not isinstance(shape, WavesShape) or stated_base(c, shape.period) is not None:
                continue
            back = beside(space, [one for i, one in enumerate(model.choices) if i != k], model.colour.bounded)
            others = (s for s in peaks(space, effect, back, model.colour.bounded) if isinstance(s, WavesShape))
            far = [s.period for s in others if forms_of(effect).crowded(c, s, [shape], np.inf) is None]
            far = [period for period in far if abs(1.0 / period - 1.0 / shape.period) * c.span > 1.0][:ALIASES]
            for period in far if model.choices[k] not in self.neighbours.given else ():
                trial = refine(self.judge, (effect, replace(shape, period=period)), back, model.colour.bounded)
                if self.judge.score(replaced(model, k, trial), model).score > model.score - apart:
                    found.append(
                        f"{effect.name}: at these targets a period of {period:.6g} {c.position_unit} explains the "
                        f"readings as well as one of {shape.period:.6g} {c.position_unit}"
                    )
        return found
