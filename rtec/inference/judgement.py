"""What a finished search comes to: the staircase, every candidate with its reason, the verdict."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import stats

from rtec.dataset.dataset import Dataset
from rtec.dataset.unseen import shifted_targets, unseen_periods
from rtec.effects import LIBRARY, Shape, effect_named
from rtec.inference.answer import EQUAL, LEVEL, Rivalry, adjusted_p, chance, is_given, rivalries, wrong_signs
from rtec.inference.chessboard import HELD_OUT_BY
from rtec.inference.detectable import minimum_detectable
from rtec.inference.experiment import experiment_for_more, experiment_for_rivals, experiment_for_unknown
from rtec.inference.fit import fitted_terms, residual_of, values_of
from rtec.inference.leftover import unknown_structure
from rtec.inference.model import Model, Term
from rtec.inference.noise import noise_floor
from rtec.inference.probes import Probe
from rtec.inference.proposals import orthonormal, proposals
from rtec.inference.results import (
    Candidate,
    Cosines,
    Diagnosis,
    Experiment,
    NoiseFloor,
    Outlier,
    Step,
    Unknown,
    Verdict,
)
from rtec.inference.scored import Scored
from rtec.inference.search import Search
from rtec.inference.space import Choice

OFFSET = effect_named("offset")
WANDERS = 16.0
"""Readings over which noise is correlated, from which on it may as well be an effect in time that nobody knows."""
MOSTLY_WHITE = 0.9
"""Share of the noise's variance that is white, from which on the slow rest is of no account."""
HARD_TO_SEE = 3.0
"""Where half of the effects have to exceed so many noise floors to be seen, nothing found means little."""
POSSIBLE = 0.3
"""Probability of an effect that was not accepted from which on nothing found means little."""
_AT_BOUND = 0.01


@dataclass(frozen=True, slots=True)
class Offset:
    """The constant of the readings, its standard error, and the probability that it is none."""

    value: float
    error: float
    p: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """What a search found, before it is put into words.

    Parameters
    ----------
    search, model
        On all rows.
    scout, scouted
        The search on the rows that were drawn, and what it found; the same where nothing had to be drawn.
    begun
        The model that the search began with, fitted.
    probability
        Of each effect that competed.
    outliers
        Readings left out.
    heldout
        Another measurement to score on.
    judged
        Whether the other measurement had a say.
    searched
        False where one effect was added as the user said.
    """

    search: Search
    model: Scored
    scout: Search
    scouted: Scored
    begun: Model
    probability: Mapping[str, float]
    outliers: tuple[Outlier, ...] = ()
    heldout: Dataset | None = None
    searched: bool = True
    offset: Offset | None = None
    """A constant that no effect's own zero explains."""

    @property
    def dataset(self) -> Dataset:
        """The readings."""
        return self.search.space.dataset

    def fitted(self, model: Scored, order: Sequence[Choice] | None = None) -> Model:
        """Return a model as people get it: without probes, its amplitudes fitted beside them, in order."""
        terms, datum = fitted_terms(self.search.judge, model)
        by_choice = {(term.effect, term.shape): term for term in terms if not isinstance(term.effect, Probe)}
        kept = list(by_choice) if order is None else [choice for choice in order if choice in by_choice]
        found = [by_choice[choice] for choice in kept]
        if self.offset is not None:
            constant = Term(effect=OFFSET, shape=Shape(), amplitudes=(datum,), errors=(self.offset.error,))
            return self.begun.with_terms([constant, *found], datum=0.0)
        return self.begun.with_terms(found, datum=datum if found else self.begun.datum)

    def rms_left(self, model: Scored) -> float:
        """Return the RMS of what a model leaves, the zeros of runs taken out where they differ."""
        if not model.choices and self.offset is None:
            return self.dataset.rms(residual_of(self.dataset, self.begun))
        return self.dataset.rms(self.search.judge.left(model))

    def rms_heldout(self, model: Scored) -> float:
        """Return the held-out RMS of a model: on the other measurement, or on the chessboard."""
        if self.heldout is not None:
            return self.heldout.rms(residual_of(self.heldout, self.fitted(model)))
        return self.dataset.rms(self.search.held_out(model))


def judged(found: Finding) -> Diagnosis:
    """Return the diagnosis of a finished search."""
    search, model, dataset = found.search, found.model, found.dataset
    judge, space = search.judge, search.space
    floor = noise_floor(judge, model)
    unknown, p_means = unknown_structure(judge, model, floor.floor)
    found = replace(found, offset=_offset(found))
    order, ordered = _in_order(found)
    steps = _steps(found, order, ordered)
    rivals = {
        effect.name: rivalries(found.scout, found.scouted, k)
        for k, (effect, shape) in enumerate(found.scouted.choices)
        if effect.name in model.names and not isinstance(effect, Probe) and (effect, shape) not in search.given
    }
    tied = [r for several in rivals.values() for r in several if not r.permanent]
    minimum = minimum_detectable(judge, model)
    listed = [_accepted(found, step, rivals.get(step.effect, [])) for step in steps]
    absent = _absent(found, rivals, minimum)
    fitted = found.fitted(model, order)
    not_testable = {n: r for n, r in space.reasons.items() if r is not None}
    named = bool(steps) and (found.searched or steps[-1].p_adjusted < LEVEL)
    if not found.searched and any(c.p_adjusted < LEVEL for c in absent):
        unknown = None  # where no search was made, what is left may well be an effect of the library
    doubtful = _inconclusive(found, floor, minimum, absent)
    return Diagnosis(
        verdict=_verdict(unknown, bool(tied) and named, named, floor.from_repeats, doubtful),
        dataset=dataset,
        heldout=found.heldout,
        start=found.begun,
        model=fitted,
        steps=steps,
        candidates=(*listed, *absent),
        noise=floor,
        rms_before=dataset.rms(residual_of(dataset, found.begun)),
        rms_after=found.rms_left(ordered[-1]),
        rms_heldout=found.rms_heldout(ordered[-1]),
        heldout_by=HELD_OUT_BY if found.heldout is None else found.heldout.source,
        not_testable=tuple(not_testable.items()),
        minimum_detectable=tuple(minimum.items()),
        lack_of_fit=() if p_means is None else (("means over repeats", p_means),),
        unknown=unknown,
        cosines=_cosines(found),
        experiment=_experiment(found, unknown, tied, not_testable, minimum),
        notes=_notes(found, floor),
        rms_heldout_before=found.rms_heldout(judge.score(search.given))
        if found.offset is None
        else dataset.rms(dataset.observed),
        probability={n: p for n, p in found.probability.items() if not n.startswith("any ")}
        | ({OFFSET.name: 1.0 - found.offset.p} if found.offset is not None else {}),
        outliers=found.outliers,
        unseen_periods=unseen_periods(dataset.coordinates),
    )


def _in_order(found: Finding) -> tuple[list[Choice], list[Scored]]:
    """Return the effects in the order in which the held-out error falls fastest, and the models on the way."""
    judge = found.search.judge
    held = [choice for choice in found.model.choices if choice in found.search.given]
    left = [c for c in found.model.choices if c not in found.search.given and not isinstance(c[0], Probe)]
    models = [judge.score(held)]
    while left:
        trials = [judge.score([*held, choice], models[-1]) for choice in left]
        errors = [found.dataset.rms(found.search.held_out(trial)) for trial in trials]
        ready = [not c[0].builds_on or bool(c[0].builds_on & {e.name for e, _ in held}) for c in left]
        k = min(range(len(left)), key=lambda i: (not ready[i], errors[i]))
        held.append(left.pop(k))
        models.append(trials[k])
    return held, models


def _offset(found: Finding) -> Offset | None:
    """Return the constant of the readings where it is an offset of its own, else None.

    A deviation is measured from a datum: an instrument is set to zero at the first reading, or the mean is taken off.
    Only a constant beyond all that the effects found go through is more than their choice of zero.
    """
    judge, dataset = found.search.judge, found.dataset
    if not judge.space.has_datum or any(isinstance(e, Probe) for e, _ in found.model.choices) or found.begun.terms:
        return None
    noise = judge.space.whitening(found.model.colour)
    ones = np.ones((1, dataset.rows))
    fit = judge.fit(found.model)
    error = float(np.sqrt(fit.variance / float((noise.of(ones) ** 2).sum())))
    reach = sum(float(np.ptp(fit.contribution(k))) for k in range(len(fit.parts)))
    _, datum = fitted_terms(judge, found.model)
    beyond = max(abs(float(dataset.observed.mean())) - reach, 0.0)
    p = float(min(1.0, 2.0 * stats.t.sf(beyond / max(error, 1e-300), dataset.rows - 1) * len(judge.space.library)))
    return (
        Offset(datum, error, p)
        if p < LEVEL and dataset.rms(found.search.held_out(judge.score(()))) < dataset.rms(dataset.observed)
        else None
    )


def _constant_step(found: Finding, offset: Offset, before: Scored) -> Step:
    """Return the step of a constant, which comes first."""
    fitted = found.fitted(before)
    return Step(
        effect=OFFSET.name,
        added=True,
        params=values_of(fitted.terms[0], fitted),
        rms_train=found.rms_left(before),
        rms_heldout=found.rms_heldout(before),
        gain=found.dataset.rms(found.dataset.observed) ** 2 - found.rms_heldout(before) ** 2,
        gain_error=0.0,
        p_adjusted=offset.p,
        reason=f"adjusted p {offset.p:.2g}: a constant beyond what any effect's zero explains",
        model=fitted,
    )


def _steps(found: Finding, order: Sequence[Choice], models: Sequence[Scored]) -> tuple[Step, ...]:
    """Return the staircase: each effect added to those before it, everything refitted.

    What it brings is said of the step; whether it stays was decided beside all the others, by the probability shown.
    """
    steps = [] if found.offset is None else [_constant_step(found, found.offset, models[0])]
    search, names = found.search, list(found.model.names)
    for count, (before, after) in enumerate(itertools.pairwise(models), len(order) - len(models) + 2):
        choice = order[count - 1]
        fitted = found.fitted(after, order[:count])
        k = found.model.choices.index(choice)
        p = adjusted_p(search.judge, found.model, k)
        fall = found.rms_heldout(before) ** 2 - found.rms_heldout(after) ** 2
        certain = found.probability.get(choice[0].name, 0.0)
        steps.append(
            Step(
                effect=choice[0].name,
                added=True,
                params=values_of(fitted.terms[-1], fitted),
                rms_train=found.rms_left(after),
                rms_heldout=found.rms_heldout(after),
                gain=fall,
                gain_error=search.gain(before, after).error,
                p_adjusted=p,
                reason=(f"probability {certain:.3f}, " if names.count(choice[0].name) == 1 else "")
                + f"adjusted p {p:.2g}, held-out error {'falls' if fall > 0.0 else 'does not fall'}",
                model=fitted,
            )
        )
    return tuple(steps)


def _accepted(found: Finding, step: Step, rivals: Sequence[Rivalry]) -> Candidate:
    """Return an accepted effect as a candidate."""
    words = [step.reason]
    words += [f"cannot be told from {r.rival} here (cosine {r.cosine:.3f})" for r in rivals if not r.permanent]
    words += [f"looks like {r.rival} for ever, to the same instrument" for r in rivals if r.permanent]
    return Candidate(
        effect=step.effect,
        accepted=True,
        predicted_rms=step.rms_train,
        achieved_rms=step.rms_train,
        p_adjusted=step.p_adjusted,
        params=step.params,
        tied_with=tuple(r.rival for r in rivals),
        cosine=max((r.cosine for r in rivals if not r.permanent), default=None),
        reason="; ".join(words),
        probability=found.probability.get(step.effect, 0.0),
    )


def _absent(
    found: Finding, rivals: Mapping[str, Sequence[Rivalry]], minimum: Mapping[str, float]
) -> tuple[Candidate, ...]:
    """Return every other testable effect, ranked beside the model found."""
    search, model, dataset = found.search, found.model, found.dataset
    judge, space = search.judge, search.space
    held = set(model.names)
    rest = [e for e in space.library if e.name not in held and not isinstance(e, Probe)]
    best: dict[str, tuple[float, Choice]] = {}
    for proposal in proposals(judge, model, rest, least=-np.inf):
        best.setdefault(proposal.choice[0].name, (proposal.worth, proposal.choice))
    tied_to = {r.rival: (name, r) for name, several in rivals.items() for r in several}
    unit, factor = dataset.units.shown
    unit = unit.replace("um", "µm")
    listed = []
    residual = residual_of(dataset, found.fitted(model))
    for effect in rest:
        name = effect.name
        p, left = 1.0, dataset.rms(residual)
        if name in best:
            choice = best[name][1]
            p = chance(judge, model.choices, choice, model)
            raw = space.raw(choice)
            table = np.vstack([raw, np.ones((1, raw.shape[1]))]) if space.has_datum else raw
            basis = orthonormal(table)
            left = dataset.rms(residual - (basis @ residual) @ basis)
        probability = found.probability.get(name, 0.0)
        if name in tied_to:
            reason = f"explains the data as well as {tied_to[name][0]}, in its place"
        elif name in search.refused:
            reason = f"not accepted: {search.refused[name]}"
        else:
            least = f"; from {minimum[name] * factor:.3g} {unit} RMS on it would show" if name in minimum else ""
            idle = "not needed" if found.searched else "not added yet"
            reason = f"adjusted p {p:.2g}: nothing to be seen{least}" if p >= LEVEL else f"adjusted p {p:.2g}, {idle}"
        rival = tied_to.get(name)
        listed.append(
            Candidate(
                effect=name,
                accepted=False,
                predicted_rms=left,
                achieved_rms=None,
                p_adjusted=p,
                params=(),
                tied_with=(rival[0],) if rival is not None else (),
                cosine=rival[1].cosine if rival is not None else None,
                reason=reason,
                probability=probability,
            )
        )
    for name, (other, rivalry) in tied_to.items():
        if name not in held and name not in {c.effect for c in listed}:
            listed.append(_permanent(found, name, other, rivalry))
    order = {name: -worth for name, (worth, _) in best.items()}
    return tuple(sorted(listed, key=lambda c: (order.get(c.effect, np.inf), c.effect)))


def _permanent(found: Finding, name: str, other: str, rivalry: Rivalry) -> Candidate:
    """Return an effect that no data can tell from an accepted one."""
    return Candidate(
        effect=name,
        accepted=False,
        predicted_rms=found.dataset.rms(residual_of(found.dataset, found.fitted(found.model))),
        achieved_rms=None,
        p_adjusted=1.0,
        params=(),
        tied_with=(other,),
        cosine=rivalry.cosine,
        reason=f"looks exactly like {other} to the same instrument",
    )


def _cosines(found: Finding) -> Cosines | None:
    """Return how alike the testable effects look on this plan, after projection off a constant.

    Each in the shape that the model has, else in the one that suits the data best; between effects with several
    columns the largest cosine that any two of their contributions can have.
    """
    search = found.search
    shapes = {effect.name: shape for effect, shape in found.model.choices}
    rest = [e for e in search.space.library if e.name not in shapes and not isinstance(e, Probe)]
    for proposal in proposals(search.judge, found.model, rest, least=-np.inf):
        shapes.setdefault(proposal.choice[0].name, proposal.choice[1])
    names, bases = [], []
    for effect in search.space.library:
        if effect.name in shapes and not isinstance(effect, Probe) and not effect.is_datum:
            basis = orthonormal(
                search.space.project(search.space.raw((effect, shapes[effect.name])), found.model.colour)
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


def _inconclusive(
    found: Finding, floor: NoiseFloor, minimum: Mapping[str, float], absent: Sequence[Candidate]
) -> bool:
    """Return whether data in which nothing was found could not have shown much."""
    wanders = _wanders(found.model)
    possible = any(c.probability > POSSIBLE for c in absent)
    if not floor.from_repeats or wanders or possible:
        return True
    sizes = sorted(minimum.values())
    return not sizes or sizes[len(sizes) // 2] > HARD_TO_SEE * floor.sigma


def _wanders(model: Scored) -> bool:
    """Return whether a good part of the noise is slow."""
    return model.colour.length > WANDERS and model.colour.white < MOSTLY_WHITE


def _verdict(unknown: Unknown | None, tied: bool, found: bool, floor: bool, inconclusive: bool) -> Verdict:
    if unknown is not None:
        return Verdict.UNKNOWN
    if tied:
        return Verdict.TIED
    if found:
        return Verdict.NAMED if floor else Verdict.LIKELY
    return Verdict.INCONCLUSIVE if inconclusive else Verdict.NONE


def _experiment(
    found: Finding,
    unknown: Unknown | None,
    tied: Sequence[Rivalry],
    not_testable: dict[str, str],
    minimum: dict[str, float],
) -> Experiment:
    if tied:
        return experiment_for_rivals(found.scout.judge, found.scouted, tied[0])
    if unknown is not None:
        return experiment_for_unknown(unknown)
    return experiment_for_more(found.dataset, not_testable, minimum, shifted_targets(found.dataset.coordinates))


def _notes(found: Finding, floor: NoiseFloor) -> tuple[str, ...]:
    notes = list(dict.fromkeys(found.dataset.notes))
    if found.heldout is not None:
        notes += [f"{found.heldout.source}: {note}" for note in found.heldout.notes if note not in notes]
    if found.outliers:
        rows = ", ".join(str(one.row) for one in found.outliers[:8])
        more = f" and {len(found.outliers) - 8} more" if len(found.outliers) > 8 else ""
        notes.append(f"left out as outliers, far from what their neighbours say: readings {rows}{more}")
    notes += [
        f"{name} would have to be below zero, and would then explain much: is the sign of {found.dataset.observe} "
        "opposite to that of the motion?"
        for name in wrong_signs(found.scout, found.scouted)
    ]
    notes += _at_bounds(found)
    colour = found.model.colour
    if not floor.from_repeats:
        notes.append("no condition was repeated: there is no noise floor, and what is left cannot be judged")
    elif _wanders(found.model):
        notes.append(
            f"what differs between repeats wanders over some {colour.length:.0f} readings: it counts as noise, but "
            "may be an effect in time that is not known"
        )
    if found.model.zeros:
        notes.append("the runs differ by a constant each: their zeros count as noise")
    if not found.searched:
        notes.append("no search was made: what is left is ranked, and rtec diagnose goes on from here")
    known = {e.name for e in LIBRARY}
    notes += [
        f"{name} was tried and not accepted: {why}"
        for name, why in found.search.refused.items()
        if name in known and name not in found.model.names and found.probability.get(name, 0.0) > 1.0 / np.exp(EQUAL)
    ]
    return tuple(notes)


def _at_bounds(found: Finding) -> list[str]:
    """Return a sentence for each shape parameter that lies at the end of what was searched."""
    notes = []
    space = found.search.space
    for effect, shape in found.model.choices:
        if effect.is_wave or is_given(found.search, effect.name):
            continue
        for tunable in effect.tunables(space.dataset.conditions, shape):
            value = float(getattr(shape, tunable.name))
            every = [float(getattr(s, tunable.name)) for s in space.shapes(effect)[0]]
            if not every or max(every) == min(every):
                continue
            end = "longest" if value >= max(every) * (1.0 - _AT_BOUND) else "shortest"
            if end == "longest" or value <= min(every) * (1.0 + _AT_BOUND):
                what = tunable.name.replace("_", " ")
                notes.append(
                    f"{effect.name}: its {what} is at the {end} that was searched; the true one may lie beyond"
                )
    return notes
