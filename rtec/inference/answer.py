"""From the models that a search has seen to its answer: which effects are sure, and which would do as well."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import fdtrc, logsumexp

from rtec.effects import Effect, Floats
from rtec.effects.own import FunctionEffect
from rtec.inference.forms import forms_of
from rtec.inference.gate import INSEPARABLE
from rtec.inference.probes import Probe
from rtec.inference.proposals import beside, by_chance, falls, orthonormal
from rtec.inference.rules import implausible, misnamed
from rtec.inference.scored import Judge, Scored, best_of_names
from rtec.inference.search import Search
from rtec.inference.space import Choice

SURE = 0.95
"""Probability that is asked of every effect of the answer."""
LEVEL = 0.01
"""Of the adjusted probability below which an effect is accepted."""
AT_END = 0.01
"""Share by which a shape parameter lies beside the end of what was searched."""
EQUAL = 3.0
"""Nats: by less the data do not prefer one of two effects (odds of 20 to 1)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Rivalry:
    """An accepted effect and another that would do in its place."""

    effect: str
    rival: str
    cosine: float
    model: Scored | None = None
    """With the rival in the effect's place."""
    permanent: bool = False
    """No experiment with the same instrument could tell the two apart."""


def settled(search: Search, model: Scored) -> tuple[Scored, dict[str, float]]:
    """Return the best model of which every effect is sure, or tied, and the probability of each effect seen.

    An effect that is neither is no part of an answer: the search goes back to the best model without it. What speaks
    for the others stays what it was: of the models that compete none drops out because another has.
    """
    model = best = simplest(search, model)
    known = every = probabilities(search, best)
    most: dict[str, int] = {}
    while (worst := _worst(search, best, model, every)) is not None:
        name, why = worst
        search.gate.refused[name] = why
        most[name] = model.names.count(name) - 1
        without = (m for m in search.gate.possible() if all(m.names.count(n) <= count for n, count in most.items()))
        ranked = sorted(without, key=lambda m: -m.score)
        model = next((m for m in ranked if search.gate.is_gated(m)), search.judge.score(search.given))
        every = probabilities(search, best, model)
    return model, known | {name: every[name] for name in model.names}


def simplest(search: Search, model: Scored) -> Scored:
    """Return a model that explains the data nearly as well with fewer effects, or with special cases of its own."""
    for other in sorted(search.gate.near(model), key=lambda m: -m.score):
        less = bool(other.choices) and Counter(other.names) < Counter(model.names)
        if (less and _same_span(search, other, model)) or other.score > model.score - EQUAL:
            special = None if less else stood_for(search, other, model)
            if (less or (special is not None and not isinstance(special, Probe))) and search.gate.is_gated(other):
                return simplest(search, other)
    return model


def _same_span(search: Search, one: Scored, other: Scored) -> bool:
    """Return whether two models can say the same of the readings, whatever their priors expect."""
    tables = [np.vstack([part.raw * part.unit for part in search.space.parts_of(m.choices)]) for m in (one, other)]
    ranks = [orthonormal(table).shape[0] for table in (*tables, np.vstack(tables))]
    return len(set(ranks)) == 1


def replacement(model: Scored, other: Scored) -> tuple[str, str] | None:
    """Return the effect of a model for which another has a different one, and that; None where more differs."""
    mine, theirs = Counter(model.names), Counter(other.names)
    lost, new = list((mine - theirs).elements()), list((theirs - mine).elements())
    return (lost[0], new[0]) if len(lost) == len(new) == 1 else None


def limits_of(effect: Effect) -> frozenset[str]:
    """Return the effects of which one is the limit."""
    return frozenset(rival.name for rival in effect.rivals if rival.limit)


def stood_for(search: Search, model: Scored, other: Scored) -> Effect | None:
    """Return the effect of a model in whose place another has one that can do all that it does; None without one.

    Everything else is the same in both. A probe stands for any other: something is missing, whatever it depends on.
    """
    names = replacement(model, other)
    if names is None:
        return None
    own, instead = newly(model, other, names[0]), newly(other, model, names[1])
    generic = isinstance(instead[0], Probe)
    if isinstance(own[0], Probe):
        return own[0] if generic else None
    if not generic:
        covered = own[0].name in forms_of(instead[0]).contains or instead[0].name in limits_of(own[0])
        return own[0] if covered else None
    cosine = _cosine(search.judge, model, model.choices.index(own), search.space.raw(instead))
    return own[0] if cosine > INSEPARABLE else None


def probabilities(search: Search, best: Scored, answer: Scored | None = None) -> dict[str, float]:
    """Return the probability of each effect over the models that compete with the best: of all that were scored.

    Shapes of one effect are one effect, and what stands for an effect of the ``answer`` (else of the best) counts for
    it. Models in which an effect has not earned its place do not compete; those with a wave too long for the data do,
    though none will be accepted.
    """
    answer = best if answer is None else answer
    models, weights, total = _competing(search, best)
    called = [search.gate.called(other) for other in models]
    stood = [stood_for(search, answer, other) for other in models]
    instead = [None if effect is None else effect.name for effect in stood]
    found = {}
    for name in dict.fromkeys(name for names in (answer.names, *called) for name in names):
        count = max(answer.names.count(name), 1)
        having = np.array([n.count(name) >= count or s == name for n, s in zip(called, instead, strict=True)])
        found[name] = float(np.exp(min(logsumexp(weights[having]) - total, 0.0))) if having.any() else 0.0
    return found


def _competing(search: Search, best: Scored) -> tuple[list[Scored], Floats, float]:
    """Return the models that compete with the best, the logarithms of their weights, and that of their sum."""
    near = search.gate.near(best)
    sound = {n for n, m in best_of_names(near).items() if m is best or search.gate.competes(m)}
    models = [m for m in near if tuple(sorted(m.names)) in {*sound, tuple(sorted(best.names))}]
    weights = np.array([m.score for m in models])
    return models, weights, float(logsumexp(weights))


def _nothing_instead(search: Search, best: Scored, model: Scored, name: str) -> float:
    """Return the probability of models without an effect in which nothing stands in its place."""
    models, weights, total = _competing(search, best)
    rest = Counter(model.names) - Counter([name])
    bare = np.array([Counter(m.names) <= rest for m in models])
    return float(np.exp(logsumexp(weights[bare]) - total)) if bare.any() else 0.0


def _worst(search: Search, best: Scored, model: Scored, every: Mapping[str, float]) -> tuple[str, str] | None:
    """Return the effect that has the least claim to its place in an answer, and why; None where all have one.

    What several effects explain together is certain together: an effect stays where something has to stand in its
    place, whichever it is.
    """
    failing = []
    for k, choice in enumerate(model.choices):
        if choice in search.given:
            continue
        name = choice[0].name
        if every[name] < SURE and not (
            every[name] > 1.0 - SURE
            and (tied_models(search, model, name) or _nothing_instead(search, best, model, name) < 1.0 - SURE)
        ):
            return name, f"its probability is {every[name]:.2f}"
        for what, end in at_ends(search, choice):
            if end == "shortest":
                return name, f"its {what} is the shortest that was searched: these readings do not determine it"
        gain = search.gate.gain(search.neighbours.without(model, k), model).gain
        if adjusted_p(search.judge, model, k) >= LEVEL or gain <= 0.0:
            failing.append((gain, name))
    return (min(failing)[1], "its own significance test fails") if failing else None


def at_ends(search: Search, choice: Choice) -> Iterator[tuple[str, str]]:
    """Yield each shape parameter of an effect that lies at an end of what was searched, and at which one."""
    effect, shape = choice
    if effect.is_wave:
        return
    for tunable in effect.tunables(search.space.dataset.conditions, shape):
        value = float(getattr(shape, tunable.name))
        every = [float(getattr(s, tunable.name)) for s in search.space.shapes(effect)[0]]
        if isinstance(effect, FunctionEffect):  # its author knows where the parameter may lie
            low, high, _ = effect.bounds[tunable.name].inside
            near = AT_END * (high - low)
            if not low + near < value < high - near:
                yield tunable.name.replace("_", " "), "end of the bounds"
        elif every and max(every) > min(every):
            if value >= max(every) * (1.0 - AT_END):
                yield tunable.name.replace("_", " "), "longest"
            elif value <= min(every) * (1.0 + AT_END):
                yield tunable.name.replace("_", " "), "shortest"


def is_given(search: Search, name: str) -> bool:
    """Return whether an effect belongs to the model that the search began with."""
    return any(effect.name == name for effect, _ in search.given)


def tied_models(search: Search, model: Scored, name: str, *, limits: bool = False) -> list[tuple[Effect, Scored]]:
    """Return the models with another effect in the place of one, between which the data do not decide.

    Compared is what the readings say, without the price of each effect's shapes. Where one effect is a special case
    of the other, the simplest that explains the data wins, and nothing is tied; nor where it is the limit of the
    other and likelier, unless just these are asked for. An effect that is idle there is no rival: another does the
    work beside it.
    """
    own = _spoken(search.judge, model)
    effect = next(e for e, _ in model.choices if e.name == name)
    found: dict[str, tuple[Effect, Scored]] = {}
    for other in sorted(search.judge.seen.values(), key=lambda m: -m.score):
        names = replacement(model, other)
        if names is None or names[0] != name or other.wrong_sign or search.gate.in_doubt(other):
            continue
        if any(misnamed(search.gate, other, k) for k in range(len(other.choices))):
            continue
        rival = next(e for e, _ in other.choices if e.name == names[1])
        special = rival.name in forms_of(effect).contains or name in forms_of(rival).contains
        limit, apart = rival.name in limits_of(effect), abs(_spoken(search.judge, other) - own)
        if limit and other.score > model.score:  # likelier although its shapes are paid for
            limit, apart = False, other.score - model.score
        if special or limit is not limits or isinstance(rival, Probe) or apart > EQUAL:
            continue
        k = other.choices.index(newly(other, model, rival.name))
        if rival.name in found or search.gate.is_idle(other, k) or implausible(search.gate, other, k):
            continue
        if by_chance(search.judge, other, k):
            continue
        found[rival.name] = rival, other
    return list(found.values())


def _spoken(judge: Judge, model: Scored) -> float:
    """Return the log marginal likelihood without the price of what was chosen."""
    return model.score + sum(map(judge.price, model.choices))


def unchanging(model: Scored, every: Mapping[str, float]) -> dict[str, float]:
    """Return the probabilities of effects, each without that of a probe for its change.

    An effect of the library is the same everywhere and always: what changes only resembles it.
    """
    found = dict(every)
    for probe, _ in model.choices:
        for name in probe.builds_on if isinstance(probe, Probe) else ():
            found[name] = min(found.get(name, 0.0), 1.0 - every.get(probe.name, 1.0))
    return found


def rivalries(search: Search, model: Scored, k: int) -> list[Rivalry]:
    """Return what could stand in for effect ``k``: what the data do not prefer it to, and what mimics it."""
    effect, _ = model.choices[k]
    found = []
    for rival, other in tied_models(search, model, effect.name):
        choice = newly(other, model, rival.name)
        cosine = _cosine(search.judge, model, k, search.judge.space.raw(choice))
        found.append(Rivalry(effect=effect.name, rival=rival.name, cosine=cosine, model=other))
    known = {r.rival for r in found}
    maps = (_as_map(search, model, k, rival.name) for rival in effect.rivals if rival.name not in known)
    found += [one for one in maps if one is not None]
    found += [
        Rivalry(effect=effect.name, rival=rival.name, cosine=1.0, permanent=True)
        for rival in effect.rivals
        if rival.lasts(search.space.dataset.conditions)
    ]
    return sorted(found, key=lambda r: -r.cosine)


def alike(judge: Judge, model: Scored, names: Collection[str]) -> Iterator[tuple[Effect, Effect]]:
    """Yield effects of these names in a model, each with one of its card that can do on these data all that it does.

    The data may prefer the one because the other has more amplitudes; they do not tell them apart. Looked at are
    effects without shapes to choose from.
    """
    library = {effect.name: effect for effect in judge.space.library}
    for k, (effect, _) in enumerate(model.choices):
        for rival in effect.rivals if effect.name in names else ():
            other = library.get(rival.name)
            if other is None or rival.permanent or rival.name in model.names:
                continue
            shapes = judge.space.shapes(other)[0]
            if len(shapes) == 1 and _cosine(judge, model, k, judge.space.raw((other, shapes[0]))) > INSEPARABLE:
                yield effect, other


def newly(model: Scored, before: Scored, name: str) -> Choice:
    """Return the effect of a name that a model has and another has not; the first where it has them all."""
    named = [choice for choice in model.choices if choice[0].name == name]
    return next((choice for choice in named if choice not in before.choices), named[0])


def shared(
    search: Search, model: Scored, every: Mapping[str, float], rivals: Mapping[str, Sequence[Rivalry]]
) -> dict[str, float]:
    """Return the probabilities of effects, those of tied ones shared by what the readings say of each.

    That one of them has more shapes to choose from makes it no less likely where the data do not decide; but it does
    where one is the limit of the other, and could have had any of these shapes.
    """
    found = dict(every)
    limits = {effect.name: limits_of(effect) for effect, _ in model.choices}
    for name, several in rivals.items():
        # a rival that stands in the model as well is there either way, and is told of by its own probability
        instead = {r.rival: r.model for r in several if r.model is not None and r.rival not in limits[name]}
        others = [rival for rival in instead if rival not in model.names]
        if instead and name in found:
            together = min(1.0, found[name] + sum(found.get(rival, 0.0) for rival in others))
            spoken = np.array([_spoken(search.judge, m) for m in (model, *instead.values())])
            share = np.exp(spoken - spoken.max())
            each = dict(zip((name, *instead), (together * share / share.sum()).tolist(), strict=True))
            found |= {one: p for one, p in each.items() if one == name or one in others}
    return found


def _as_map(search: Search, model: Scored, k: int, name: str) -> Rivalry | None:
    """Return a map of this name that holds all that effect ``k`` does, with as few nodes as it takes, or None.

    On this plan the two would be told apart by the number of nodes alone.
    """
    effect, _ = model.choices[k]
    rest = search.neighbours.without(model, k)
    for other in search.neighbours.effects_for(rest):
        if other.name == name and other.is_map and effect.name not in forms_of(other).contains:
            for shape in search.space.shapes(other)[0]:
                cosine = _cosine(search.judge, model, k, search.space.raw((other, shape)))
                if cosine > INSEPARABLE:
                    instead = search.judge.score([*rest.choices, (other, shape)], model)
                    return Rivalry(effect=effect.name, rival=name, cosine=cosine, model=instead)
    return None


def _cosine(judge: Judge, model: Scored, k: int, raw: Floats) -> float:
    """Return the cosine between effect ``k`` and the best that other columns can do in its place."""
    space = judge.space
    table = [space.view(model.colour).project(space.raw(c)) for i, c in enumerate(model.choices) if i != k]
    basis = orthonormal(np.vstack(table)) if table else np.empty((0, space.dataset.rows))
    own = space.view(model.colour).project(judge.fit(model).contribution(k)[None, :])[0]
    own = own - (basis @ own) @ basis
    other = space.view(model.colour).project(raw)
    other = orthonormal(other - (other @ basis.T) @ basis)
    energy = float(own @ own)
    return 0.0 if energy <= 0.0 else min(1.0, float(np.linalg.norm(other @ own) / np.sqrt(energy)))


def adjusted_p(judge: Judge, model: Scored, k: int) -> float:
    """Return the bootstrap-null probability that noise explains as much as effect ``k`` beside the others, anywhere.

    Notes
    -----
    F-test in whitened space under the noise of the whole model, adjusted by Bonferroni with weights: every effect has
    an equal share of the level, and within it every shape. That is the price which the score asks for the effect.
    """
    others = [choice for i, choice in enumerate(model.choices) if i != k]
    return chance(judge, others, model.choices[k], model)


def chance(judge: Judge, others: Sequence[Choice], choice: Choice, model: Scored, *, chosen: bool = True) -> float:
    """Return the probability of what one effect explains beside others, under a model's noise.

    It is adjusted for all from which the effect and its shape were chosen, unless they were given.
    """
    space = judge.space
    columns = space.white(space.part_of(choice), model.colour)
    back = beside(space, others, model.colour)
    fall = float(falls(columns[None], back)[0])
    q = columns.shape[0]
    below = max(space.dataset.rows - back.basis.shape[0] - q, 1)  # the constant is in the basis
    ratio = (fall / q) / max((back.rss - fall) / below, 1e-300)
    return float(min(1.0, fdtrc(q, below, ratio) * np.exp(judge.price(choice) if chosen else 0.0)))


def wrong_signs(search: Search, model: Scored) -> tuple[str, ...]:
    """Return the effects that would explain much if they could be below zero: the sensor's sign may be opposite.

    There is no such effect where another one that cannot be below zero was found: its sign is right.
    """
    own = [effect for effect, shape in model.choices if (effect, shape) not in search.given]
    if any(effect.not_negative and effect.name not in model.wrong_sign for effect in own):
        return ()
    found = {
        name: m.score
        for m in search.judge.seen.values()
        for name in m.wrong_sign
        if len(m.wrong_sign) == 1 and set(m.names) - {name} <= set(model.names) and m.score > model.score + EQUAL
    }
    return tuple(sorted(found, key=lambda name: -found[name]))
