"""What an effect has to show to earn its place in a model: worth, size, sign, held-out gain."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from scipy.special import logsumexp

from rtec.effects import Floats, Observable
from rtec.inference.chessboard import Board, HeldOutGain, board_of, gain_between, held_out_residual
from rtec.inference.forms import forms_of, is_asked
from rtec.inference.probes import Probe
from rtec.inference.proposals import Neighbours
from rtec.inference.rules import MATTERS, WORTH, Against, implausible, objections
from rtec.inference.scored import Judge, Scored
from rtec.inference.space import Space

INSEPARABLE = 0.99
"""Cosine above which no search tells two effects apart on a plan: stricter than collinear, which is told."""
MATTERS_WITHOUT_REPEATS = 0.02
"""Of what there was at the start, where no floor says what is noise: in a smooth log the least is significant. So it
is for effects in time in every log: a derived velocity is a little off where the motion begins."""
NEGLIGIBLE = 9.0
"""Nats below the model found from which on another has no say in how sure its effects are."""
IN_DOUBT = " in doubt"
SOUND = Against.SIGN, Against.FORM, Against.EVIDENCE
"""What speaks against none of the effects of a model that competes."""


@dataclass(slots=True, eq=False)
class Gate:
    """The gate that every effect of a model has to pass; ``refused`` says why one was not taken, by name."""

    neighbours: Neighbours
    refused: dict[str, str] = field(default_factory=dict)
    judge: Judge = field(init=False)
    space: Space = field(init=False)
    free: Judge = field(init=False)
    """Scores models under any noise, that of a log, too."""
    board: Board = field(init=False)
    _held: dict[Scored, Floats] = field(default_factory=dict)
    _gated: dict[Scored, bool] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.judge = self.neighbours.judge
        self.space = self.judge.space
        dataset = self.space.dataset
        self.board = board_of(dataset)
        self.free = Judge(Space(dataset, any_noise=True)) if dataset.conditions.moving else self.judge

    def held_out(self, model: Scored) -> Floats:
        """Return the held-out residual of a model, shape (rows,)."""
        if model not in self._held:
            self._held[model] = held_out_residual(self.judge, model, self.board)
        return self._held[model]

    def gain(self, before: Scored, after: Scored) -> HeldOutGain:
        """Return the fall of the held-out error from one model to another."""
        return gain_between(self.judge, self.held_out(before), self.held_out(after), after, self.board)

    def size(self, model: Scored, k: int) -> float:
        """Return the RMS contribution of an effect beside the others, in units of what the model leaves."""
        fit = self.judge.fit(model)
        added = fit.contribution(k)
        others = [part.raw for i, part in enumerate(fit.parts) if i != k]
        if self.space.has_datum:
            others.append(np.ones((1, added.size)))
        if others:
            table = np.vstack(others)
            table = table / np.maximum(np.sqrt((table**2).sum(axis=1, keepdims=True)), 1e-300)
            added = added - np.linalg.lstsq(table.T, added, rcond=1e-9)[0] @ table
        least = float(np.mean(self.judge.left(model) ** 2)) + 1e-300
        dataset, in_time = self.space.dataset, model.choices[k][0].in_time
        if not dataset.has_repeats or (in_time and dataset.conditions.moving):
            least = max(least, (MATTERS_WITHOUT_REPEATS / MATTERS) ** 2 * float(np.var(dataset.observed)))
        return float(np.sqrt(np.mean(added**2) / least))

    def is_idle(self, model: Scored, k: int) -> bool:
        """Return whether a model is as good without effect ``k``."""
        return model.score <= self.neighbours.without(model, k).score or self.size(model, k) < MATTERS

    def why_not(self, model: Scored, k: int) -> str | None:
        """Return why an effect does not earn its place in a model, or None where it does."""
        if model.choices[k] in self.neighbours.given:
            return None
        return next(objections(self, model, k, Against.DOUBT, *SOUND), None)

    def is_nearly_gated(self, model: Scored, k: int) -> bool:
        """Return whether only its form speaks against effect ``k`` of a model, and nothing against the others."""
        effect, _ = model.choices[k]
        # a map of a force follows whatever a motion lacks at its places
        follows_all = effect.is_map and effect.observable is Observable.DRIVE
        formal = any(objections(self, model, k, Against.FORM)) and not any(objections(self, model, k, Against.DOUBT))
        others = (i for i in range(len(model.choices)) if i != k)
        return (
            formal
            and not follows_all
            and not any(objections(self, model, k, Against.EVIDENCE))
            and all(self.why_not(model, i) is None for i in others)
        )

    def worth(self, model: Scored, k: int, rest: Scored) -> float:
        """Return the nats by which an effect, or any collinear one, raises the score over that of the ``rest``.

        Where a poor plan cannot tell them apart, each has but its share of what speaks for all of them.
        """
        rivals = {rival.name for rival in model.choices[k][0].rivals} - set(rest.names)
        alone = model.score - rest.score
        if alone >= WORTH or alone + np.log1p(len(rivals)) < WORTH:
            return alone
        own, best = self._shown(model, k), {model.choices[k][0].name: model.score}
        for other in self.neighbours.children(rest):
            added = next(i for i, choice in enumerate(other.choices) if choice not in rest.choices)
            name = other.choices[added][0].name
            if name not in rivals or other.wrong_sign or self.in_doubt(other) or implausible(self, other, added):
                continue
            theirs = self._shown(other, added)
            if own @ theirs > INSEPARABLE * np.linalg.norm(own) * np.linalg.norm(theirs):
                best[name] = max(other.score, best.get(name, -np.inf))
        return float(logsumexp(list(best.values()))) - rest.score

    def _shown(self, model: Scored, k: int) -> Floats:
        """Return what effect ``k`` adds, shape (rows,), the constant taken out where it is no effect."""
        added = self.judge.fit(model).contribution(k)
        return added - added.mean() if self.space.has_datum else added

    def is_gated(self, model: Scored) -> bool:
        """Return whether every effect of a model has earned its place."""
        if model not in self._gated:
            # the last came last: the model without it is known
            reasons = ((k, self.why_not(model, k)) for k in reversed(range(len(model.choices))))
            k, why = next((found for found in reasons if found[1] is not None), (0, None))
            self._gated[model] = why is None
            if why is not None:
                self.refused.setdefault(model.choices[k][0].name, why)
        return self._gated[model]

    def earned(self, model: Scored) -> Scored:
        """Return a model without the effects that have not earned their place in it, the worst taken out first."""
        while True:
            failing = {}
            for k in range(len(model.choices)):
                if model.choices[k] not in self.neighbours.given:
                    gain = self.gain(self.neighbours.without(model, k), model).gain
                    worse = "the held-out error does not fall" if gain <= 0.0 and is_asked("held-out gain") else None
                    why = self.why_not(model, k) or worse
                    if why is not None:
                        failing[k] = gain, why
            if not failing:
                return model
            worst = min(failing, key=lambda k: failing[k])
            self.refused[model.choices[worst][0].name] = failing[worst][1]
            model = self.neighbours.without(model, worst)

    def possible(self) -> Iterator[Scored]:
        """Return the models seen that hold what was given, and no effect of the wrong sign."""
        given = set(self.neighbours.given)
        return (m for m in self.judge.seen.values() if not m.wrong_sign and given <= set(m.choices))

    def near(self, model: Scored) -> list[Scored]:
        """Return the models seen that a model cannot dismiss: likelier ones, and those hardly less likely."""
        return [m for m in self.possible() if m.score > model.score - NEGLIGIBLE]

    def called(self, model: Scored) -> tuple[str, ...]:
        """Return the names of a model's effects; those that the data cannot bear out are said to be in doubt."""
        c, given = self.space.dataset.conditions, self.neighbours.given
        found = ((e, (e, shape) not in given and forms_of(e).doubtful(c, shape)) for e, shape in model.choices)
        return tuple(effect.name + IN_DOUBT if doubt else effect.name for effect, doubt in found)

    def in_doubt(self, model: Scored) -> bool:
        """Return whether the data cannot bear out an effect of a model, however well it fits."""
        return self.called(model) != model.names

    def competes(self, model: Scored) -> bool:
        """Return whether only doubts speak against the effects of a model: that a course in time is small is one."""
        given = self.neighbours.given
        return self.is_gated(model) or (
            (self.in_doubt(model) or generic(model))
            and all(c in given or not any(objections(self, model, k, *SOUND)) for k, c in enumerate(model.choices))
        )


def generic(model: Scored) -> bool:
    """Return whether a model holds a probe."""
    return any(isinstance(effect, Probe) for effect, _ in model.choices)
