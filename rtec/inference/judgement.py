"""What a finished search comes to: the staircase, every candidate with its reason, the notes, the verdict."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from rtec.dataset.dataset import Dataset
from rtec.dataset.unseen import shifted_targets, unseen_periods
from rtec.inference.answer import (
    EQUAL,
    LEVEL,
    Rivalry,
    at_ends,
    chance,
    is_given,
    probabilities,
    replacement,
    rivalries,
    shared,
    tied_models,
    unchanging,
    wrong_signs,
)
from rtec.inference.breakaway import with_breakaway
from rtec.inference.candidates import (
    absent_from,
    accepted,
    cosines_of,
    doubts_of,
    minimum_detectable,
    proposed_beside,
    settling,
)
from rtec.inference.chessboard import held_out_by, row_by_row
from rtec.inference.completeness import (
    OUTSIDE,
    OUTSIDE_WITH_SIGNS,
    knows_the_floor,
    unknown_by,
)
from rtec.inference.experiment import (
    between,
    experiment_for_likely,
    experiment_for_more,
    experiment_for_rivals,
    experiment_for_unknown,
    experiment_of,
)
from rtec.inference.finding import OFFSET, Finding, approximated, in_order, offset_of, steps_of
from rtec.inference.fit import residual_of
from rtec.inference.forms import forms_of
from rtec.inference.gate import IN_DOUBT, generic
from rtec.inference.learned import learned_curve
from rtec.inference.leftover import unknown_structure
from rtec.inference.noise import noise_floor
from rtec.inference.probes import Probe
from rtec.inference.results import Candidate, Diagnosis, Experiment, NoiseFloor, Unknown, Verdict
from rtec.inference.rules import signs_of
from rtec.inference.scored import Scored, best_of_names
from rtec.inference.search import Search
from rtec.inference.skew import tried_as_skew
from rtec.inference.space import Choice

HARD_TO_SEE = 3.0
"""Where half of the effects have to exceed so many noise floors to be seen, nothing found means little."""
POSSIBLE = 0.3
"""Probability of an effect that was not accepted from which on nothing found means little."""
LIKELY = 0.1
"""Probability of an effect that was not accepted from which on an experiment should tell it from the others."""
WANDERS = 16.0
"""Readings over which noise is correlated, from which on it may as well be an unknown effect in time."""
MOSTLY_WHITE = 0.9
"""Share of the noise's variance that is white, from which on the slow rest is of no account."""
OTHER_TARGETS = "measure once more at other uneven targets: they tell periods that look the same here from each other"
_COMPARED = {True: "means over repeats", False: "means of both directions"}


def judged(found: Finding) -> Diagnosis:
    """Return the diagnosis of a finished search."""
    found = replace(found, offset=offset_of(found))
    if unknown_structure(found.search.judge, found.model)[0] is not None:
        found = approximated(found)
    found, order, ordered = in_order(found)
    if found.searched and found.names_something and found.search is found.scout and not found.approximate:
        instead = _complete_instead(found.search, found.model)
        if found.rms_heldout(instead) < found.rms_heldout(found.model):
            every = {**found.probability, **probabilities(found.search, instead)}
            found = replace(found, model=instead, scouted=instead, probability=every)
            found, order, ordered = in_order(found)
    search, model, dataset = found.search, found.model, found.dataset
    judge, space = search.judge, search.space
    floor = noise_floor(judge, model)
    unknown, p_means = unknown_structure(judge, model)
    approximate = tuple(name for name in found.approximate if name in model.names)
    signs = signs_of(search, model, floor, approximate) if found.searched and found.names_something else ()
    if unknown is None and signs:
        unknown = unknown_by(signs)
    rivals = {
        effect.name: rivalries(found.scout, found.scouted, k)
        for k, (effect, shape) in enumerate(found.scouted.choices)
        if effect.name in model.names and not isinstance(effect, Probe) and (effect, shape) not in search.given
    }
    tied = [r for several in rivals.values() for r in several if not r.permanent]
    every = shared(found.scout, found.scouted, found.probability, rivals)
    inside = 1.0 - (OUTSIDE if unknown is None else OUTSIDE_WITH_SIGNS)
    found = replace(found, probability={name: inside * p for name, p in unchanging(model, every).items()})
    steps = steps_of(found, order, ordered)
    minimum = minimum_detectable(judge, model)
    listed = [accepted(found, step, rivals.get(step.effect, [])) for step in steps]
    proposed = proposed_beside(found)
    absent = absent_from(found, proposed, rivals, minimum)
    fitted = found.fitted(model, order)
    not_testable = {n: r for n, r in space.reasons.items() if r is not None}
    named = bool(steps) and (found.searched or steps[-1].p_adjusted < LEVEL)
    if not found.searched and any(c.p_adjusted < LEVEL for c in absent):
        unknown = None  # where no search was made, what is left may well be an effect of the library
    doubtful = _inconclusive(found, floor, minimum, absent)
    aliases = search.exchanges.aliases(model, EQUAL)
    verdict = _verdict(
        unknown, bool(tied or aliases) and named, named, knows_the_floor(judge, model, floor), doubtful
    )
    diagnosis = Diagnosis(
        verdict=verdict,
        dataset=dataset,
        heldout=found.heldout,
        start=found.begun,
        model=replace(fitted, range=_range(dataset)),
        steps=steps,
        candidates=(*listed, *absent),
        noise=floor,
        rms_before=dataset.rms(residual_of(dataset, found.begun)),
        rms_after=found.rms_left(ordered[-1]),
        rms_heldout=found.rms_heldout(ordered[-1]),
        heldout_by=held_out_by(dataset) if found.heldout is None else found.heldout.source,
        rms_heldout_rows=row_by_row(judge, ordered[-1]) if found.heldout is None else None,
        not_testable=tuple(not_testable.items()),
        minimum_detectable=tuple(minimum.items()),
        lack_of_fit=() if p_means is None else ((_COMPARED[dataset.has_repeats], p_means),),
        unknown=unknown,
        approximate=approximate,
        suspected=tuple(doubts_of(found)),
        cosines=cosines_of(found, proposed),
        experiment=Experiment(text=OTHER_TARGETS)
        if aliases and not tied
        else _experiment(found, unknown, tied, not_testable, minimum, _likely(absent) if not named else ()),
        notes=(*notes_of(found, floor), *aliases),
        rms_heldout_before=found.rms_heldout(judge.score(search.given))
        if found.offset is None
        else dataset.rms(dataset.observed),
        probability={n: p for n, p in found.probability.items() if not n.startswith("any ") and IN_DOUBT not in n}
        | {c.effect: c.probability for c in absent if c.probability > 0.0}
        | ({OFFSET.name: 1.0 - found.offset.p} if found.offset is not None else {}),
        outliers=found.outliers,
        curve=learned_curve(found) if found.searched and verdict is Verdict.UNKNOWN else None,
        unseen_periods=unseen_periods(dataset.coordinates),
    )
    return with_breakaway(tried_as_skew(diagnosis))


def _complete_instead(search: Search, model: Scored) -> Scored:
    """Return a model, or where it is not complete one that is: with a more general effect for a special case of it.

    Of two that explain as much the special case is the answer, but not where it leaves what the other holds.
    """

    def is_complete(one: Scored) -> bool:
        whole = unknown_structure(search.judge, one)[0] is None
        return whole and not signs_of(search, one, noise_floor(search.judge, one))

    def holds_more(other: Scored) -> bool:
        names = replacement(model, other)
        return names is not None and names[0] in forms_of(search.space.dataset.library.named(names[1])).contains

    if is_complete(model):
        return model
    near = best_of_names(m for m in search.gate.near(model) if m.score > model.score - EQUAL).values()
    others = (m for m in near if not generic(m) and holds_more(m) and search.gate.is_gated(m))
    return next((m for m in others if is_complete(m)), model)


def _range(dataset: Dataset) -> tuple[float, float] | None:
    """Return the first and the last position of a measurement; None where it has none."""
    c = dataset.coordinates
    return None if c.time_is_coordinate or c.span == 0.0 else (float(c.position.min()), float(c.position.max()))


def _inconclusive(
    found: Finding, floor: NoiseFloor, minimum: Mapping[str, float], absent: Sequence[Candidate]
) -> bool:
    """Return whether data in which nothing was found could not have shown much."""
    # odds of twenty to one are too few for a name, and too many for none
    likelier = (m for m in found.scout.gate.possible() if m.score > found.scouted.score + EQUAL and not generic(m))
    possible = any(c.probability > POSSIBLE for c in absent) or any(likelier)
    if not floor.from_repeats or wanders(found.model) or possible:
        return True
    sizes = sorted(minimum.values())
    return not sizes or sizes[len(sizes) // 2] > HARD_TO_SEE * floor.sigma


def _verdict(unknown: Unknown | None, tied: bool, found: bool, floor: bool, inconclusive: bool) -> Verdict:
    if unknown is not None:
        return Verdict.UNKNOWN
    if tied:
        return Verdict.TIED
    if found:
        return Verdict.NAMED if floor else Verdict.LIKELY
    return Verdict.INCONCLUSIVE if inconclusive else Verdict.NONE


def _likely(absent: Sequence[Candidate]) -> list[str]:
    """Return the effects that were not accepted and yet are likely, the likeliest first."""
    likely = [one for one in absent if one.probability > LIKELY]
    return [one.effect for one in sorted(likely, key=lambda one: -one.probability)]


def _experiment(
    found: Finding,
    unknown: Unknown | None,
    tied: Sequence[Rivalry],
    not_testable: dict[str, str],
    minimum: dict[str, float],
    likely: Sequence[str],
) -> Experiment:
    if tied:
        return experiment_for_rivals(found.scout.judge, found.scouted, tied[0], tied[1:])
    for name in doubts_of(found):
        if name in not_testable:  # no reading here shows it: the experiment that separates it does
            return experiment_of([rival.experiment for rival in found.dataset.library.named(name).rivals[:1]])
        return Experiment(text=f"{name}: {settling(found, name)}")
    if unknown is not None:
        return experiment_for_unknown(unknown, found.dataset)
    if len(likely) > 1 and (between := experiment_for_likely(likely)) is not None:
        return between
    return experiment_for_more(found.dataset, not_testable, minimum, shifted_targets(found.dataset.coordinates))


def wanders(model: Scored) -> bool:
    """Return whether a good part of the noise is slow."""
    return model.colour.length > WANDERS and model.colour.white < MOSTLY_WHITE


def notes_of(found: Finding, floor: NoiseFloor) -> tuple[str, ...]:
    """Return the sentences that stand below an answer."""
    notes = list(dict.fromkeys(found.dataset.notes))
    if found.heldout is not None:
        notes += [f"{found.heldout.source}: {note}" for note in found.heldout.notes if note not in notes]
    if found.outliers:
        rows = ", ".join(str(one.row) for one in found.outliers[:8])
        more = f" and {len(found.outliers) - 8} more" if len(found.outliers) > 8 else ""
        notes.append(f"left out as outliers, far from their neighbours: readings {rows}{more}")
    notes += [
        f"{name} would explain much if its amplitude could be negative: is the sign of {found.dataset.observe} "
        "opposite to that of the motion?"
        for name in wrong_signs(found.scout, found.scouted)
    ]
    notes += [
        f"{choice[0].name}: its {what} is at the {end} that was searched; the true value may lie beyond"
        for choice in found.model.choices
        if not is_given(found.search, choice[0].name)
        for what, end in at_ends(found.search, choice)
    ]
    notes += _limits(found)
    notes += [
        f"{choice[0].name}, which was given, explains no more than noise does here (p {p:.2g}): it may not be there"
        for choice in found.search.given
        if (p := _chance_of_given(found, choice)) >= LEVEL
    ]
    colour = found.model.colour
    if not floor.from_repeats:
        notes.append("no condition was repeated: there is no noise floor to judge the residual by")
    elif wanders(found.model):
        notes.append(
            f"the differences between repeats are correlated over about {colour.length:.0f} readings: they count as "
            "noise, but may be an unknown effect in time"
        )
    if not found.searched:
        notes.append("no search was made: the other effects are only ranked; rtec diagnose searches on from here")
    notes += [
        f"{name} was tried and not accepted: {why}"
        for name, why in found.search.gate.refused.items()
        if name in found.dataset.library
        and name not in found.model.names
        and found.probability.get(name, 0.0) > 1.0 / np.exp(EQUAL)
    ]
    return tuple(notes)


def _chance_of_given(found: Finding, choice: Choice) -> float:
    """Return the probability that noise explains as much as an effect of the model given, beside the others."""
    others = [other for other in found.model.choices if other != choice]
    return chance(found.search.judge, others, choice, found.model, chosen=False)


def _limits(found: Finding) -> list[str]:
    """Return a sentence for each accepted effect that may as well be another one near its limit."""
    return [
        f"{rival.name} explains the readings as well as {effect.name}, which is its limit; to tell them apart, "
        f"{between(effect, rival)}"
        for effect, _ in found.scouted.choices
        for rival, _ in tied_models(found.scout, found.scouted, effect.name, limits=True)
    ]
