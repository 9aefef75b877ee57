"""The search for what is missing: a beam of models, each with its noise, that grow, shrink and exchange effects."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.special import logsumexp

from rtec.effects import Effect, Floats, Shape
from rtec.inference.chessboard import Board, HeldOutGain, board_of, gain_between, held_out_residual
from rtec.inference.probes import Probe, changing
from rtec.inference.proposals import bearable, beside, proposals, refine
from rtec.inference.scored import Fit, Judge, Scored
from rtec.inference.space import Choice, Space

WORTH = 5.0
"""Nats by which an effect has to raise the score before it enters: at 3.5 the prototype gave false names."""
ALIKE = 0.99
"""Cosine from which on two effects are the same on a plan."""
SHARPER = 3.0
"""Nats by which a sudden change has to be likelier than a gradual one."""
MATTERS = 0.15
"""Of what is left, that an effect's contribution has to have beside the others: less is of no interest."""
MATTERS_IN_TIME = 2.0
"""The same of a course in time without a name: noise that wanders has a slow half and a quick one, about as large. In
50 games of noise alone such a course had up to 1.3 of what was left; weather that was hidden had 2.7 and more."""
MATTERS_WITHOUT_REPEATS = 0.02
"""Of what there was at the start, where no floor says what is noise: in a smooth log the least is significant. So it
is for effects in time in every log: a derived velocity is a little off where the motion begins."""
GATED, GATED_GENERIC, UNGATED = 2, 1, 1
"""Models that are carried on: those whose every effect has earned its place, without a probe and with one, and one
that may yet."""
PROMISING = 24
"""Proposals of the scan that are weighed under the model's noise."""
CLOSER, CLOSER_GENERIC = 6, 2
"""Proposals beside each model that are scored with their own noise; probes among them, which have many columns."""
MOST_EFFECTS = 9
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
ROUNDING = 1e-6
HARDLY = 0.1
"""Nats for which no effects are exchanged: so much may lie between two orders in which shapes were refined."""
NEGLIGIBLE = 9.0
"""Nats below the model found from which on another has no say in how sure its effects are."""
IN_DOUBT = " in doubt"
SURE = 0.95
"""Probability that is asked of every effect of the answer."""

Progress = Callable[[float], None]


@dataclass(slots=True, eq=False)
class Search:
    """A search and what it has seen.

    Parameters
    ----------
    judge
        Scores the models.
    given
        Effects of the model that the search begins with: they stay.
    """

    judge: Judge
    given: tuple[Choice, ...] = ()
    begin: tuple[Choice, ...] = ()
    """Effects with which it begins besides: found on fewer readings, and taken out again where these do not bear
    them out."""
    board: Board = field(init=False)
    refused: dict[str, str] = field(default_factory=dict)
    """Why an effect that the score asked for was not taken, by name."""
    doubts: set[str] = field(default_factory=set)
    """Names of effects that the data suggest but cannot bear out."""
    barred: frozenset[str] = frozenset()
    """Effects that are not looked for."""
    single: bool = False
    """Whether waves are looked for one by one, and not as families of harmonics."""
    _children: dict[object, list[Scored]] = field(default_factory=dict)
    _reshaped: dict[tuple[int, bool, bool], tuple[Scored, Scored]] = field(default_factory=dict)
    _held: dict[int, tuple[Scored, Floats]] = field(default_factory=dict)
    _gated: dict[int, tuple[Scored, bool]] = field(default_factory=dict)
    free: Judge = field(init=False)
    """Scores models under any noise, that of a log, too."""

    def __post_init__(self) -> None:
        """Lay the chessboard; see what noise there may be."""
        dataset = self.judge.space.dataset
        self.board = board_of(dataset)
        self.free = Judge(Space(dataset, any_noise=True)) if dataset.conditions.moving else self.judge

    @property
    def space(self) -> Space:
        """The data."""
        return self.judge.space

    def held_out(self, model: Scored) -> Floats:
        """Return the held-out residual of a model, shape (rows,)."""
        key = id(model)
        if key not in self._held:
            self._held[key] = (model, held_out_residual(self.judge, model, self.board))
        return self._held[key][1]

    def gain(self, before: Scored, after: Scored) -> HeldOutGain:
        """Return the fall of the held-out error from one model to another."""
        return gain_between(self.judge, self.held_out(before), self.held_out(after), after, self.board)

    def effects_for(self, model: Scored) -> list[Effect]:
        """Return the effects that may be added to a model."""
        names = list(model.names)
        return [
            effect
            for effect in self.space.library
            if names.count(effect.name) < effect.at_most
            and effect.name not in self.barred
            and not (effect.builds_on and not effect.builds_on & set(names))
        ]

    def without(self, model: Scored, k: int) -> Scored:
        """Return a model without its effect ``k``, and without what builds on that."""
        return self.judge.score(self._rest(model, k), model)

    def _rest(self, model: Scored, k: int) -> list[Choice]:
        """Return the choices of that."""
        rest = [choice for i, choice in enumerate(model.choices) if i != k]
        held = {effect.name for effect, _ in rest}
        return [c for c in rest if not c[0].builds_on or c[0].builds_on & held or c in self.given]

    def size(self, model: Scored, k: int, fit: Fit | None = None) -> float:
        """Return the RMS contribution of an effect beside the others, in units of what the model leaves."""
        fit = self.judge.fit(model) if fit is None else fit
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
        return model.score <= self.without(model, k).score or self.size(model, k) < MATTERS

    def why_not(self, model: Scored, k: int) -> str | None:
        """Return why an effect does not earn its place in a model, or None where it does."""
        effect, shape = model.choices[k]
        if model.choices[k] in self.given:
            return None
        doubt = effect.doubtful(self.space.dataset.conditions, shape)
        if isinstance(effect, Probe) and effect.in_time and self.size(model, k) < MATTERS_IN_TIME:
            doubt = f"below {MATTERS_IN_TIME:g} of what is left, as noise that wanders is"
        return doubt or next(self._objections(model, k), None)

    def _objections(self, model: Scored, k: int) -> Iterator[str]:
        """Yield what speaks against an effect of a model, what is cheap to find out first."""
        effect, shape = model.choices[k]
        conditions = self.space.dataset.conditions
        others = [s for i, (e, s) in enumerate(model.choices) if i != k and e.name == effect.name]
        finest = min((e.finest(s) for e, s in model.choices if effect.name in e.contains), default=np.inf)
        fit = self.judge.fit(model)
        for why in (
            effect.crowded(conditions, shape, others, finest),
            "it would have to be below zero" if effect.name in model.wrong_sign else None,
            self.implausible(model, k),
            self.misnamed(model, k),
        ):
            if why is not None:
                yield why
        rest = self.without(model, k)
        if (worth := self.worth(model, k, rest)) < WORTH:
            yield f"what it explains is worth {worth:.1f} nats, less than the {WORTH:g} asked for"
        if effect.in_time and self.free is not self.judge:
            if self.free.score(model.choices).score - self.free.score(rest.choices).score < WORTH:
                yield "noise that wanders explains as much"
        if self.size(model, k, fit) < MATTERS:
            yield f"below {MATTERS:g} of what is left"
        if self.plainer(model, k) is not model:
            yield "a simpler form foretells as well what was held out"
        for softer in effect.softer(conditions, shape):
            instead = self.judge.score(replaced(model, k, (effect, softer)), model)
            if instead.score > model.score - SHARPER:
                yield "a gradual change explains as much"
        if not self.gain(rest, model).passes:
            yield "the held-out error does not fall"

    def worth(self, model: Scored, k: int, rest: Scored) -> float:
        """Return the nats by which an effect, or any of its look-alikes, raises the score over that of the ``rest``.

        Where a poor plan cannot tell them apart, each has but its share of what speaks for all of them.
        """
        rivals = {rival.name for rival in model.choices[k][0].rivals} - set(rest.names)
        alone = model.score - rest.score
        if alone >= WORTH or alone + np.log1p(len(rivals)) < WORTH:
            return alone
        own, best = self._shown(model, k), {model.choices[k][0].name: model.score}
        for other in self.children(rest):
            added = next(i for i, choice in enumerate(other.choices) if choice not in rest.choices)
            name = other.choices[added][0].name
            if name not in rivals or other.wrong_sign or self.in_doubt(other) or self.implausible(other, added):
                continue
            theirs = self._shown(other, added)
            if own @ theirs > ALIKE * np.linalg.norm(own) * np.linalg.norm(theirs):
                best[name] = max(other.score, best.get(name, -np.inf))
        return float(logsumexp(list(best.values()))) - rest.score

    def _shown(self, model: Scored, k: int) -> Floats:
        """Return what effect ``k`` adds, shape (rows,), the constant taken out where it is no effect."""
        added = self.judge.fit(model).contribution(k)
        return added - added.mean() if self.space.has_datum else added

    def implausible(self, model: Scored, k: int) -> str | None:
        """Return why the fit of an effect of a model is no such effect, whatever it explains, or None."""
        (effect, shape), fit = model.choices[k], self.judge.fit(model)
        return effect.implausible(self.space.dataset.conditions, shape, fit.mean[fit.rows(k)])

    def misnamed(self, model: Scored, k: int) -> str | None:
        """Return why an effect of a model has another name beside the others, or None."""
        fit, (effect, shape) = self.judge.fit(model), model.choices[k]
        sizes = [fit.mean[fit.rows(i)] * fit.parts[i].unit for i in range(len(model.choices))]
        others = {e.name: size for i, ((e, _), size) in enumerate(zip(model.choices, sizes, strict=True)) if i != k}
        return effect.misnamed(shape, sizes[k], others)

    def is_gated(self, model: Scored) -> bool:
        """Return whether every effect of a model has earned its place."""
        key = id(model)
        if key not in self._gated:
            self._gated[key] = (model, True)
            for k in reversed(range(len(model.choices))):  # the last came last: the model without it is known
                why = self.why_not(model, k)
                if why is not None:
                    self.refused.setdefault(model.choices[k][0].name, why)
                    self._gated[key] = (model, False)
                    break
        return self._gated[key][1]

    def children(self, model: Scored) -> list[Scored]:
        """Return the models one effect larger that the scan proposes, scored."""
        key = model.key, self.barred, self.single
        if key not in self._children:
            self._children[key] = self._proposed(model, self.effects_for(model))
        return self._children[key]

    def _proposed(self, model: Scored, effects: Iterable[Effect]) -> list[Scored]:
        """Return the models with one of the effects besides that the scan proposes, scored."""
        if len(model.choices) >= MOST_EFFECTS:
            return []
        found = proposals(self.judge, model, effects, families=not self.single)
        generic = [p.choice for p in found if isinstance(p.choice[0], Probe)]
        promising = [p.choice for p in found if p.choice not in generic][:PROMISING]
        worth = {choice: self.judge.quickly([*model.choices, choice], model) for choice in (*generic, *promising)}
        closer = sorted(worth, key=lambda choice: -worth[choice])[:CLOSER]
        probes = [choice for choice in closer if isinstance(choice[0], Probe)]
        return [self.judge.score([*model.choices, c], model) for c in closer if c not in probes[CLOSER_GENERIC:]]

    def reshaped(self, model: Scored, *, maps: bool = False, waves: bool = False) -> Scored:
        """Return a model with the shape of each effect looked for once more beside all others.

        Nodes and harmonics where asked: while effects are missing they would follow what these explain.
        """
        key = id(model), maps, waves
        if key not in self._reshaped:
            self._reshaped[key] = model, self._moved(model, maps=maps, waves=waves)
        return self._reshaped[key][1]

    def _moved(self, model: Scored, *, maps: bool, waves: bool) -> Scored:
        """Return the same, looked for."""
        conditions = self.space.dataset.conditions
        best = model
        for k in range(len(model.choices)):
            effect, shape = best.choices[k]
            if best.choices[k] in self.given or (effect.is_map and (isinstance(effect, Probe) or not maps)):
                continue
            moved = effect, shape
            if maps if effect.is_map else waves:
                forms = effect.variants(conditions, shape)
                others = [s for i, (e, s) in enumerate(best.choices) if i != k and e is effect]
                sound = [(effect, s) for s in forms if bearable(conditions, effect, s, others)]
                moved = max([moved, *sound], key=lambda form: self.judge.quickly(replaced(best, k, form), best))
                near = [(effect, s) for s in effect.closer(conditions, moved[1])]
                moved = max([moved, *near], key=lambda form: self.judge.quickly(replaced(best, k, form), best))
            if not effect.is_map:
                rest = [choice for i, choice in enumerate(best.choices) if i != k]
                colour = best.colour.bounded
                moved = refine(self.judge, moved, beside(self.space, rest, colour), colour)
            trial = self.judge.score(replaced(best, k, moved), best)
            if trial.score > best.score:
                best = trial
            best = self.plainer(best, k)
        return best

    def plainer(self, model: Scored, k: int) -> Scored:
        """Return a model with the plainer form of effect ``k`` unless what was held out asks for its own.

        Where little is repeated, the score follows each start and stop of a log.
        """
        effect, shape = model.choices[k]
        form = effect.plainer(shape) if model.choices[k] not in self.given else None
        if form is None:
            return model
        instead = self.judge.score(replaced(model, k, (effect, form)), model)
        return model if self.gain(instead, model).passes else instead

    def run(self, tell: Progress) -> Scored:
        """Return the best model in which every effect has earned its place.

        Where it holds a map, it is looked for once more without maps and probes: many columns draw whatever comes
        their way, and stand where several effects would have to come in at once. Where it holds a probe, it is looked
        for once more with waves one by one: a family that brings several periods together hides each of them.
        """
        found = self._climbed(tell, begin=self.begin)
        maps = [choice[0] for choice in found.choices if choice not in self.given and choice[0].is_map]
        if maps and not self.begin and not any(isinstance(effect, Probe) for effect in maps):
            self.barred = frozenset(effect.name for effect in self.space.library if effect.is_map)
            other = self._climbed(lambda share: None, found.score - OUT_OF_REACH)
            self.barred = frozenset()
            found = max(found, other, key=lambda m: m.score)
        found = self.changing(found)
        if generic(found) and any(effect.is_wave for effect in self.space.library):
            self.single = True
            found = max(found, self.changing(self._climbed(lambda share: None)), key=lambda m: m.score)
            self.single = False
        self._suspect(found)
        while True:
            likelier = (m for m in best_of_names(self.near(found)).values() if m.score > found.score + ROUNDING)
            sound = (self.reshaped(m) for m in likelier if self.is_gated(m))
            better = next((m for m in sound if self.is_gated(m)), None)
            if better is None:
                return found
            found = self.exchanged(better)

    def _suspect(self, model: Scored) -> None:
        """Score what the data suggest but cannot bear out in the place of each effect of a model, and of all."""
        start = self.judge.score(self.given)
        rests = [self.without(model, k) for k, choice in enumerate(model.choices) if choice not in self.given]
        for rest in {m.key: m for m in (*rests, start)}.values():
            for effect in (*self.effects_for(rest), *self.space.suspected):
                trials = [[*rest.choices, (effect, s)] for s in effect.suspects(self.space.dataset.conditions)]
                if trials:
                    best = max(trials, key=lambda choices: self.judge.quickly(choices, rest))
                    suspect = self.reshaped(self.judge.score(best, rest))
                    if effect.name + IN_DOUBT in self.called(suspect) and suspect.score > model.score - NEGLIGIBLE:
                        self.doubts.add(effect.name)

    def called(self, model: Scored) -> tuple[str, ...]:
        """Return the names of a model's effects; those that the data cannot bear out are said to be in doubt."""
        c = self.space.dataset.conditions
        return tuple(
            effect.name + IN_DOUBT if (effect, shape) not in self.given and effect.doubtful(c, shape) else effect.name
            for effect, shape in model.choices
        )

    def in_doubt(self, model: Scored) -> bool:
        """Return whether the data cannot bear out an effect of a model, however well it fits."""
        return self.called(model) != model.names

    def competes(self, model: Scored) -> bool:
        """Return whether only doubts speak against the effects of a model: that a course in time is small is one."""
        return self.is_gated(model) or (
            (self.in_doubt(model) or generic(model))
            and all(c in self.given or not any(self._objections(model, k)) for k, c in enumerate(model.choices))
        )

    def _climbed(self, tell: Progress, least: float = -np.inf, begin: Sequence[Choice] = ()) -> Scored:
        """Return the best model that the beam and exchanges reach from ``begin``; exchanges from ``least`` on.

        A probe explains at once what takes several effects: models without one grow beside those with one.
        """
        start = self.judge.score([*self.given, *begin])
        if begin:
            start = self.earned(self.reshaped(start, maps=True, waves=True))
        best, beam, reached = {False: start, True: start}, [start], -np.inf
        for depth in range(MOST_EFFECTS):
            gated, ungated = self._sorted_out(self._grown(beam), best)
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
        ends = [self.earned(self.reshaped(self.exchanged(m), maps=True, waves=True)) for m in starts]
        return max(ends, key=lambda m: m.score)

    def earned(self, model: Scored) -> Scored:
        """Return a model without the effects that have not earned their place in it, the worst taken out first."""
        while True:
            failing = {}
            for k in range(len(model.choices)):
                if model.choices[k] not in self.given:
                    gain = self.gain(self.without(model, k), model).gain
                    why = self.why_not(model, k) or ("the held-out error does not fall" if gain <= 0.0 else None)
                    if why is not None:
                        failing[k] = gain, why
            if not failing:
                return model
            worst = min(failing, key=lambda k: failing[k])
            self.refused[model.choices[worst][0].name] = failing[worst][1]
            model = self.without(model, worst)

    def _grown(self, beam: Sequence[Scored]) -> list[Scored]:
        """Return the models one effect larger, and those without what the new one makes idle; best first."""
        grown: dict[object, Scored] = {}
        for model in beam:
            for child in self.children(model):
                grown[child.key] = child
                if child.score <= model.score:
                    continue
                here = self.judge.quickly(child.choices, child)
                for k in range(len(child.choices) - 1):
                    rest = self._rest(child, k)
                    # what an effect explains another noise seldom does: of 6000 removals 2 were worth a look
                    if child.choices[k] in self.given or self.judge.quickly(rest, child) < here - OUT_OF_REACH:
                        continue
                    less = self.judge.score(rest, child)
                    if less.score > child.score:
                        grown[less.key] = less
        return sorted(grown.values(), key=lambda model: -model.score)

    def _sorted_out(self, ranked: Sequence[Scored], best: Mapping[bool, Scored]) -> tuple[list[Scored], list[Scored]]:
        """Return the best models whose every effect has earned its place, and the best that may yet.

        Of those with a probe, and of those without one.
        """
        gated: list[Scored] = []
        ungated: list[Scored] = []
        for model in ranked:
            kind = generic(model)
            alike = [m for m in gated if generic(m) == kind]
            enough = GATED_GENERIC if kind else GATED
            if len(alike) == enough or (alike and model.score < best[kind].score - HOPELESS):
                continue
            if kind and model.score < best[False].score:  # what a probe explains has been explained without it
                continue
            better = model if alike else self.reshaped(model)
            if self.is_gated(better):
                gated.append(better)
            elif len(ungated) < UNGATED and better.score > max(best[kind].score, best[False].score):
                ungated.append(better)
        return gated, ungated

    def possible(self) -> Iterator[Scored]:
        """Return the models seen that hold what was given, and no effect of the wrong sign."""
        given = set(self.given)
        return (m for m in self.judge.seen.values() if not m.wrong_sign and given <= set(m.choices))

    def near(self, model: Scored) -> list[Scored]:
        """Return the models seen that a model cannot dismiss: likelier ones, and those hardly less likely."""
        return [m for m in self.possible() if m.score > model.score - NEGLIGIBLE]

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
            better = [m for m in trials if m.score > model.score + WORTH and self.is_gated(m)]
            if not better:
                return model
            model = max(better, key=lambda m: m.score)

    def exchanged(self, model: Scored) -> Scored:
        """Return a model with effects exchanged for others as long as that makes it likelier."""
        for _ in range(EXCHANGES):
            better = model
            for choice in model.choices:
                if choice in self.given or choice not in better.choices:
                    continue
                k = better.choices.index(choice)
                rest = self.without(better, k)
                others = sorted(self.children(rest), key=lambda child: -child.score)[:3]
                others += self.regrouped(better, k)
                others += self.joined(better, k)
                if rest.score > better.score - OUT_OF_REACH:  # a second family may fill what a wrong first one leaves
                    alike = [i for i, c in enumerate(rest.choices) if c[0] is choice[0] and c not in self.given]
                    others += [other for i in alike for other in self.regrouped(rest, i)]
                for other in sorted(others, key=lambda m: -m.score):
                    if other.score > better.score + HARDLY and self.is_gated(other):
                        better = max(better, self.earned(self.reshaped(other)), key=lambda m: m.score)
                        break
            if better.score <= model.score + HARDLY:
                break
            model = better
        return model

    def regrouped(self, model: Scored, k: int) -> list[Scored]:
        """Return models in which a family holds but a part of what it does, in other company.

        One that is the only one of its kind gives the rest to another, which the scan proposes.
        """
        effect, shape = model.choices[k]
        shapes = effect.regrouped(self.space.dataset.conditions, shape)
        if not shapes:
            return []
        trials = [replaced(model, k, (effect, other)) for other in shapes]
        worth = [self.judge.quickly(trial, model) for trial in trials]
        best = [self.judge.score(trials[i], model) for i in np.argsort(worth)[::-1][:REGROUPED]]
        if model.names.count(effect.name) == 1:
            waves = [e for e in self.effects_for(model) if e.is_wave]
            best = [max([m, *self._proposed(m, waves)], key=lambda child: child.score) for m in best]
        return [self.reshaped(self.reshaped(m)) for m in best if m.score > model.score - HOPELESS]

    def joined(self, model: Scored, k: int) -> list[Scored]:
        """Return the likeliest model in which an effect and another, or a later one of the same, are one of both.

        What else the other did is left to whatever the scan proposes.
        """
        effect, shape = model.choices[k]
        trials = [
            [*(c for j, c in enumerate(model.choices) if j not in (k, i)), (effect, form)]
            for i, (other, theirs) in enumerate(model.choices)
            if (other.name in effect.joins or (i > k and other is effect)) and model.choices[i] not in self.given
            for form in effect.joined(self.space.dataset.conditions, shape, theirs)
        ]
        if not trials:
            return []
        found = []
        for trial in trials:
            one = self.judge.score(trial, model)
            lost = set(model.names) - set(one.names)
            more = self._proposed(one, [e for e in self.effects_for(one) if e.name not in lost]) if lost else []
            found += [one, *more]
        return [max(found, key=lambda m: m.score)]


def generic(model: Scored) -> bool:
    """Return whether a model holds a probe."""
    return any(isinstance(effect, Probe) for effect, _ in model.choices)


def best_of_names(models: Iterable[Scored]) -> dict[tuple[str, ...], Scored]:
    """Return the best model of each set of effects, best first: whether these have earned their place it decides."""
    best: dict[tuple[str, ...], Scored] = {}
    for model in sorted(models, key=lambda m: -m.score):
        best.setdefault(tuple(sorted(model.names)), model)
    return best


def replaced(model: Scored, k: int, choice: Choice) -> list[Choice]:
    """Return the choices of a model with another in the place of one."""
    return [*model.choices[:k], choice, *model.choices[k + 1 :]]
