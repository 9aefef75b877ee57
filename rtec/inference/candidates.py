"""Every effect that the data can show: why it was accepted or not, what it looks like, from which size it is seen."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence

import numpy as np

from rtec.effects import Effect, Shape
from rtec.inference.answer import LEVEL, Rivalry, chance
from rtec.inference.finding import Finding
from rtec.inference.forms import forms_of
from rtec.inference.gate import IN_DOUBT
from rtec.inference.probes import Probe
from rtec.inference.proposals import Proposal, beside, orthonormal, proposals
from rtec.inference.results import Candidate, Cosines, Step
from rtec.inference.rules import WORTH
from rtec.inference.scored import Judge, Scored
from rtec.inference.search import Search
from rtec.readable import quantity_text

CHANCE = 0.05
"""Probability of a wave too long for the data from which on it is said what would settle it."""


ERRORS = 1.64
"""Standard errors that the noise may take away: so the effect is found 95 times of 100."""
IN_TIME = 2.0
"""For what changes in time beside slow noise or offsets of the runs, which are fitted together with it."""
RUN_OFFSET = "run_offset"
_SHAPES, _ROWS = 25, 60_000
"""Shapes looked at, and rows of all their columns: of few rows every shape, of many a sample."""


def accepted(found: Finding, step: Step, rivals: Sequence[Rivalry]) -> Candidate:
    """Return an accepted effect as a candidate."""
    words = [step.reason]
    words += [f"collinear with {r.rival} here (cosine {r.cosine:.3f})" for r in rivals if not r.permanent]
    words += [f"not identifiable from {r.rival} with the same instrument" for r in rivals if r.permanent]
    probes = (effect for effect, _ in found.model.choices if isinstance(effect, Probe))
    changes = [what for probe in probes if step.effect in probe.builds_on for what in probe.depends_on]
    words += [f"varies with {what}, as the effect of this name does not" for what in changes]
    return Candidate(
        effect=step.effect,
        accepted=True,
        predicted_rms=step.rms_train,
        achieved_rms=step.rms_train,
        p_adjusted=step.p_adjusted,
        params=step.params,
        tied_with=tuple(r.rival for r in rivals),
        for_ever=tuple(r.rival for r in rivals if r.permanent),
        cosine=max((r.cosine for r in rivals if not r.permanent), default=None),
        reason="; ".join(words),
        probability=found.probability.get(step.effect, 0.0),
    )


def proposed_beside(found: Finding) -> dict[str, Proposal]:
    """Return every other testable effect in the shape that suits the data best beside the model found, by name.

    It is looked for on the rows that the search looked at.
    """
    scout = found.scout
    model = scout.judge.score([c for c in found.scouted.choices if c[0].name in found.model.names])
    rest = [e for e in scout.space.library if e.name not in found.model.names and not isinstance(e, Probe)]
    best: dict[str, Proposal] = {}
    for proposal in proposals(scout.judge, model, rest, least=-np.inf):
        best.setdefault(proposal.choice[0].name, proposal)
    best |= {name: _doubted(scout, name, model) for name in doubts_of(found) if name not in found.model.names}
    return best


def doubts_of(found: Finding) -> list[str]:
    """Return the effects that the data suggest but cannot bear out, and that may well be there."""
    return [name for name in sorted(found.scout.doubts) if found.probability.get(name + IN_DOUBT, 0.0) > CHANCE]


def settling(found: Finding, name: str) -> str:
    """Return what would settle whether an effect in doubt is there."""
    effect, shape = _doubted(found.scout, name, found.scouted).choice
    return forms_of(effect).doubtful(found.scout.space.dataset.conditions, shape) or ""


def _doubted(search: Search, name: str, model: Scored) -> Proposal:
    """Return an effect in the shape which the data suggest most but cannot bear out."""
    conditions = search.space.dataset.conditions
    likeliest = max(
        (m for m in search.judge.seen.values() if name + IN_DOUBT in search.gate.called(m)), key=lambda m: m.score
    )
    own = [c for c in likeliest.choices if c[0].name == name and c not in search.given]
    choice = next(c for c in own if forms_of(c[0]).doubtful(conditions, c[1]))
    return Proposal(choice, likeliest.score - model.score)


def absent_from(
    found: Finding,
    best: Mapping[str, Proposal],
    rivals: Mapping[str, Sequence[Rivalry]],
    minimum: Mapping[str, float],
) -> tuple[Candidate, ...]:
    """Return every other testable effect, ranked beside the model found."""
    search, model, dataset = found.search, found.model, found.dataset
    judge, space = search.judge, search.space
    held = set(model.names)
    rest = [e for e in space.library if e.name not in held and not isinstance(e, Probe)]
    tied_to = {r.rival: (name, r) for name, several in rivals.items() for r in several}
    unit, factor = dataset.units.shown
    listed = []
    in_question = doubts_of(found)
    residual = found.left(model)
    datum = [np.ones((1, dataset.rows))] * space.has_datum
    for effect in rest:
        name = effect.name
        p, left = 1.0, dataset.rms(residual)
        if name in best:
            choice = best[name].choice
            p = chance(judge, model.choices, choice, model)
            raw = space.raw(choice)
            basis = orthonormal(np.vstack([raw, *datum]))
            left = dataset.rms(residual - (basis @ residual) @ basis)
        in_doubt = found.probability.get(name + IN_DOUBT, 0.0)
        probability = max(found.probability.get(name, 0.0), in_doubt)
        if name in in_question:
            reason = f"not accepted: {settling(found, name)}"
        elif name in tied_to:
            reason = f"explains the data as well as {tied_to[name][0]}, in its place"
        elif name in search.gate.refused:
            reason = f"not accepted: {search.gate.refused[name]}"
        else:
            least = quantity_text(minimum[name] * factor, unit, digits=3) if name in minimum else ""
            seen = f"; it would be detected from {least} RMS on" if least else ""
            idle = "not needed" if found.searched else "not added yet"
            reason = f"adjusted p {p:.2g}: not significant{seen}" if p >= LEVEL else f"adjusted p {p:.2g}, {idle}"
        rival = tied_to.get(name)
        listed.append(
            Candidate(
                effect=name,
                predicted_rms=left,
                p_adjusted=p,
                tied_with=(rival[0],) if rival is not None else (),
                cosine=rival[1].cosine if rival is not None else None,
                reason=reason,
                probability=probability,
            )
        )
    for name, (other, rivalry) in tied_to.items():
        if name not in held and name not in {c.effect for c in listed}:
            listed.append(_permanent(found, name, other, rivalry))
    order = {name: -proposal.worth for name, proposal in best.items()}
    return tuple(sorted(listed, key=lambda c: (order.get(c.effect, np.inf), c.effect)))


def _permanent(found: Finding, name: str, other: str, rivalry: Rivalry) -> Candidate:
    """Return an effect that no data can tell from an accepted one."""
    return Candidate(
        effect=name,
        predicted_rms=found.dataset.rms(found.left(found.model)),
        p_adjusted=1.0,
        tied_with=(other,),
        for_ever=(other,),
        cosine=rivalry.cosine,
        reason=f"not identifiable from {other} with the same instrument",
    )


def cosines_of(found: Finding, proposed: Mapping[str, Proposal]) -> Cosines | None:
    """Return how alike the testable effects look on this plan, after projection off a constant.

    Each in the shape that the model has, else in the one that suits the data best; between effects with several
    columns the largest cosine that any two of their contributions can have.
    """
    search = found.search
    shapes = {effect.name: shape for effect, shape in found.model.choices}
    shapes |= {name: proposal.choice[1] for name, proposal in proposed.items()}
    names, bases = [], []
    for effect in search.space.library:
        if effect.name in shapes and not isinstance(effect, Probe):
            basis = orthonormal(
                search.space.view(found.model.colour).project(search.space.raw((effect, shapes[effect.name])))
            )
            if basis.shape[0]:
                names.append(effect.name)
                bases.append(basis)
    if len(names) < 2:
        return None
    table = np.eye(len(names))
    for i, j in itertools.combinations(range(len(names)), 2):
        table[i, j] = table[j, i] = min(1.0, float(np.linalg.norm(bases[i] @ bases[j].T, ord=2)))
    return Cosines(names=tuple(names), cosine=table)


def minimum_detectable(judge: Judge, model: Scored) -> dict[str, float]:
    """Return the RMS contribution of each testable effect that would be found 95 times of 100, in the observed unit.

    Notes
    -----
    An effect of which a share of energy ``l`` (over the noise's variance) is new beside the constant raises the score
    by ``l / 2`` less its price and half a logarithm of the readings for each amplitude, give or take ``sqrt(l)``.
    Of several shapes the least favourable counts.
    """
    return {
        effect.name: found
        for effect in judge.space.library
        if not isinstance(effect, Probe) and (found := detectable(judge, effect, model)) is not None
    }


def detectable(judge: Judge, effect: Effect, model: Scored, only: Shape | None = None) -> float | None:
    """Return the RMS contribution of one effect that would be found, or None where nothing of it would be seen.

    Of ``only`` one of its shapes, or of the least favourable.
    """
    space = judge.space
    back = beside(space, (), model.colour)
    sigma = float(np.sqrt(judge.fit(model, model.colour).variance))
    shapes, sound = space.shapes(effect)
    shapes = [shape for shape, good in zip(shapes, sound, strict=True) if good]
    if only is not None:
        shapes = [only]
    elif effect.is_map:
        shapes = shapes[:1]
    elif len(shapes) > (most := max(_SHAPES, _ROWS // space.dataset.rows)):
        shapes = [shapes[k] for k in np.linspace(0, len(shapes) - 1, most).astype(int)]
    slow = effect.in_time and (RUN_OFFSET in model.names or model.colour.rho > 0.0)
    worst = None
    for shape in shapes:
        raw = space.raw((effect, shape))
        if space.has_datum:
            raw = raw - raw.mean(axis=1, keepdims=True)
        white = space.view(model.colour).whitening.of(raw)
        new = white - (white @ back.basis.T) @ back.basis
        whole, energy = float((white**2).sum()), float((new**2).sum())
        if energy <= 1e-8 * whole or not orthonormal(new).size:
            continue
        price = judge.price((effect, shape)) + 0.5 * raw.shape[0] * float(np.log(max(space.readings, 2)))
        root = ERRORS + float(np.sqrt(ERRORS**2 + 2.0 * (WORTH + price)))
        found = sigma * root * float(np.sqrt((raw**2).sum() / raw.shape[1] / energy)) * (IN_TIME if slow else 1.0)
        worst = found if worst is None else max(worst, found)
    return worst
