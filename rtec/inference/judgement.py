"""What a finished search comes to: the staircase, every candidate with its reason, the verdict."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from rtec.effects import LIBRARY
from rtec.inference.calibration import adjusted
from rtec.inference.detectable import minimum_detectable
from rtec.inference.experiment import experiment_for_more, experiment_for_rivals, experiment_for_unknown
from rtec.inference.fit import needs_datum, residual_of, solved, values_of
from rtec.inference.heldout import held_out_by
from rtec.inference.leftover import describe_leftover
from rtec.inference.lookalikes import Rivalry, constant_is_datum, cosines, rivalries
from rtec.inference.model import Model
from rtec.inference.noise import noise_floor
from rtec.inference.results import Candidate, Diagnosis, Experiment, Step, Unknown, Verdict
from rtec.inference.selection import candidates
from rtec.inference.structure import changes_left, lack_of_fit_of_means
from rtec.inference.trial import LEVEL, Search, held_out_gain, refitted, rms_held_out, rms_of, trial_of
from rtec.inference.workspace import Candidacy, Choice

BORDERLINE = 0.05
WANDERS = 16.0
"""Readings over which noise is correlated, from which on it may as well be an effect in time that nobody knows."""
HARD_TO_SEE = 3.0
"""Where half of the effects have to exceed so many noise floors to be seen, nothing found means little."""

Progress = Callable[[float], None]


def judged(
    state: Search, begun: Model, base: Sequence[Choice], rng: np.random.Generator, tell: Progress
) -> Diagnosis:
    """Return the diagnosis of a finished search."""
    workspace, dataset = state.workspace, state.dataset
    ordered = _in_order(state, base)
    names = [effect.name for effect, _ in ordered]
    given = [effect.name for effect, _ in base]
    if "offset" in names and "offset" not in given and workspace.noise.from_repeats:
        if constant_is_datum(workspace, ordered):
            ordered = [choice for choice in ordered if choice[0].name != "offset"]
            state.removed["offset"] = "the constant only says where another effect was set to zero: kept as the datum"
    steps = _steps(state, begun, base, ordered)
    tell(0.8)
    p_means = lack_of_fit_of_means(workspace, ordered)
    p_changes = changes_left(dataset, ordered, rng) if workspace.noise.from_repeats else {}
    tell(0.9)
    rivals = {ordered[k][0].name: rivalries(workspace, ordered, k) for k in range(len(base), len(ordered))}
    tied = [r for found in rivals.values() for r in found if r.tied]
    minimum = minimum_detectable(workspace, state.tests)
    found = [_candidate(state, step, rivals.get(step.effect, [])) for step in steps]
    absent = _absent(state, ordered, rivals, minimum)
    borderline = any(LEVEL <= c.p_adjusted < BORDERLINE for c in absent)
    # where no search was made, what is left may well be an effect of the library
    explainable = not state.searched and any(c.p_adjusted < LEVEL for c in absent)
    unknown = None if explainable else describe_leftover(workspace, ordered, p_means, p_changes)
    named = bool(steps) and (state.searched or steps[-1].p_adjusted < LEVEL)
    doubtful = _inconclusive(state, minimum, borderline) or bool(steps)
    verdict = _verdict(unknown, bool(tied) and named, named, doubtful)
    fitted = state.model(ordered)
    not_testable = {n: r for n, r in workspace.reasons.items() if r is not None}
    lack = [("means over repeats", p_means)] if p_means is not None else []
    after = rms_of(residual_of(dataset, fitted))
    tell(1.0)
    return Diagnosis(
        verdict=verdict,
        dataset=dataset,
        heldout=state.heldout,
        start=begun,
        model=fitted,
        steps=steps,
        candidates=(*found, *absent),
        noise=noise_floor(dataset, workspace.noise),
        rms_before=rms_of(residual_of(dataset, begun)),
        rms_after=after,
        rms_heldout=rms_held_out(state, ordered, fitted),
        heldout_by=held_out_by(dataset) if state.heldout is None else state.heldout.source,
        not_testable=tuple(not_testable.items()),
        minimum_detectable=tuple(minimum.items()),
        lack_of_fit=(*lack, *((f"changes in {name}", p) for name, p in p_changes.items())),
        unknown=unknown,
        cosines=cosines(workspace, ordered),
        experiment=_experiment(state, ordered, unknown, tied, not_testable, minimum),
        notes=_notes(state, borderline),
        rms_heldout_before=rms_held_out(state, base, begun),
    )


def _in_order(state: Search, base: Sequence[Choice]) -> list[Choice]:
    """Return the effects in the order in which each explains most beside those before it."""
    given, ordered = len(base), list(state.kept[: len(base)])
    left = list(state.kept[given:])
    while left:
        judged = [
            (state.workspace.judge(e, s, state.workspace.beside(ordered, e)).gain, -k)
            for k, (e, s) in enumerate(left)
        ]
        ordered.append(left.pop(-max(judged)[1]))
    return ordered


def _steps(state: Search, begun: Model, base: Sequence[Choice], ordered: Sequence[Choice]) -> tuple[Step, ...]:
    """Return the staircase: each effect added to those before it, everything refitted.

    What it brings is said of the step; whether it stays was decided beside all the others, by the probability shown.
    """
    steps = []
    for count in range(len(base) + 1, len(ordered) + 1):
        choices = refitted(state.workspace, list(ordered[:count])) if count < len(ordered) else list(ordered)
        fitted = state.model(choices)
        trial, gain = trial_of(state, ordered, count - 1), held_out_gain(state, choices[:-1], choices)
        steps.append(
            Step(
                effect=choices[-1][0].name,
                added=True,
                params=values_of(fitted.terms[-1], fitted),
                rms_train=rms_of(residual_of(state.dataset, fitted)),
                rms_heldout=rms_held_out(state, choices, fitted),
                gain=gain.gain,
                gain_error=gain.error,
                p_adjusted=trial.p_adjusted,
                reason=trial.reason,
                model=fitted,
            )
        )
    return tuple(steps)


def _predictedrms_of(state: Search, choices: Sequence[Choice], candidacy: Candidacy) -> float:
    """Return the RMS that adding a candidate as it stands would leave, everything else kept in shape."""
    model = [*choices, (candidacy.effect, candidacy.shape)]
    amplitudes, zero = solved(state.workspace, model, datum=needs_datum(state.workspace, model))
    left = state.dataset.observed - zero
    for (effect, shape), numbers in zip(model, amplitudes, strict=True):
        left = left - state.dataset.columns(effect, shape) @ numbers
    return rms_of(left)


def _candidate(state: Search, step: Step, found: Sequence[Rivalry]) -> Candidate:
    """Return an accepted effect as a candidate."""
    terms = step.model.terms
    others: list[Choice] = [(t.effect, t.shape) for t in terms[:-1] if t.shape is not None]
    effect = terms[-1].effect
    best = state.workspace.best_of_scan(effect, state.workspace.beside(others, effect))
    return Candidate(
        effect=step.effect,
        accepted=True,
        predicted_rms=step.rms_train if best is None else _predictedrms_of(state, others, best),
        achieved_rms=step.rms_train,
        p_adjusted=step.p_adjusted,
        params=step.params,
        tied_with=tuple(r.rival for r in found if r.tied or r.permanent),
        cosine=max((r.cosine for r in found if not r.permanent), default=None),
        reason=_accepted_reason(step, found),
    )


def _accepted_reason(step: Step, found: Sequence[Rivalry]) -> str:
    words = [step.reason]
    words += [f"cannot be told from {r.rival} here (cosine {r.cosine:.3f})" for r in found if r.tied]
    words += [f"looks like {r.rival} for ever, to the same instrument" for r in found if r.permanent]
    words += [
        f"{r.rival} looks alike (cosine {r.cosine:.3f}), but the data prefer {step.effect}"
        for r in found
        if not (r.tied or r.permanent)
    ]
    return "; ".join(words)


def _absent(
    state: Search, ordered: Sequence[Choice], rivals: dict[str, list[Rivalry]], minimum: dict[str, float]
) -> tuple[Candidate, ...]:
    """Return every other testable effect, ranked beside the model found."""
    held = {effect.name for effect, _ in ordered}
    ranked = candidates(state.workspace, ordered, [e for e in state.workspace.library if e.name not in held])
    tied_to = {r.rival: (name, r) for name, found in rivals.items() for r in found if r.tied or r.permanent}
    unit, factor = state.dataset.units.shown
    unit = unit.replace("um", "µm")
    listed, idle = [], "not needed" if state.searched else "not added yet"
    for candidacy in ranked:
        name = candidacy.effect.name
        strict = state.workspace.strict
        tested = strict.judge(candidacy.effect, candidacy.shape, strict.beside(ordered, candidacy.effect))
        p = adjusted(strict.p_value(tested), state.tests)
        rival = tied_to.get(name)
        earlier = state.rejected.get(name)
        if rival is not None:
            reason = f"explains the data as well as {rival[0]}, in its place"
        elif name in state.removed:
            reason = state.removed[name]
        elif earlier is not None:
            reason = f"tried and taken out again: {earlier.reason}"
        else:
            least = f"; from {minimum[name] * factor:.3g} {unit} RMS on it would show" if name in minimum else ""
            reason = f"adjusted p {p:.2g}: nothing to be seen{least}" if p >= LEVEL else f"adjusted p {p:.2g}, {idle}"
        listed.append(
            Candidate(
                effect=name,
                accepted=False,
                predicted_rms=_predictedrms_of(state, ordered, candidacy),
                achieved_rms=None,
                p_adjusted=p,
                params=(),
                tied_with=(rival[0],) if rival is not None else (),
                cosine=rival[1].cosine if rival is not None else None,
                reason=reason,
            )
        )
    known = {c.effect for c in listed}
    for name, (other, rival_found) in tied_to.items():
        if name not in known and name not in held:
            listed.append(_permanent(state, name, other, rival_found, ordered))
    return tuple(listed)


def _permanent(state: Search, name: str, other: str, rival: Rivalry, ordered: Sequence[Choice]) -> Candidate:
    """Return an effect that no data can tell from an accepted one."""
    return Candidate(
        effect=name,
        accepted=False,
        predicted_rms=rms_of(residual_of(state.dataset, state.model(ordered))),
        achieved_rms=None,
        p_adjusted=1.0,
        params=(),
        tied_with=(other,),
        cosine=rival.cosine,
        reason=f"looks exactly like {other} to the same instrument",
    )


def _inconclusive(state: Search, minimum: dict[str, float], borderline: bool) -> bool:
    """Return whether data in which nothing was found could not have shown much."""
    if not state.workspace.noise.from_repeats or borderline or _correlated_over(state) > WANDERS:
        return True
    sizes = sorted(minimum.values())
    return not sizes or sizes[len(sizes) // 2] > HARD_TO_SEE * state.workspace.noise.sigma


def _correlated_over(state: Search) -> float:
    """Return over how many readings the noise is correlated: there its correlation has fallen to 1 / e."""
    correlation = state.workspace.noise.correlation
    return 0.0 if correlation.is_white else -1.0 / float(np.log(correlation.rho))


def _verdict(unknown: Unknown | None, tied: bool, found: bool, inconclusive: bool) -> Verdict:
    if unknown is not None:
        return Verdict.UNKNOWN
    if tied:
        return Verdict.TIED
    if found:
        return Verdict.NAMED
    return Verdict.INCONCLUSIVE if inconclusive else Verdict.NONE


def _experiment(
    state: Search,
    ordered: Sequence[Choice],
    unknown: Unknown | None,
    tied: Sequence[Rivalry],
    not_testable: dict[str, str],
    minimum: dict[str, float],
) -> Experiment:
    if tied:
        return experiment_for_rivals(state.workspace, ordered, tied[0])
    if unknown is not None:
        return experiment_for_unknown(unknown)
    return experiment_for_more(state.workspace, not_testable, minimum)


def _notes(state: Search, borderline: bool) -> tuple[str, ...]:
    notes = list(dict.fromkeys(state.dataset.notes))
    if state.heldout is not None:
        notes += [f"{state.heldout.source}: {note}" for note in state.heldout.notes if note not in notes]
    if not state.workspace.noise.from_repeats:
        notes.append("no condition was repeated: there is no noise floor, and what is left cannot be judged")
    elif (length := _correlated_over(state)) > WANDERS:
        notes.append(
            f"what differs between repeats wanders over some {length:.0f} readings: it counts as noise, but may be "
            "an effect in time that is not known"
        )
    if borderline:
        notes.append(f"an effect with an adjusted p between {LEVEL:g} and {BORDERLINE:g} was not accepted")
    if not state.searched:
        notes.append("no search was made: what is left is ranked, and rtec diagnose goes on from here")
    notes += [f"{name} was tried and taken out: {trial.reason}" for name, trial in state.rejected.items()]
    notes += [f"{name} is not listed: {why}" for name, why in state.removed.items()]
    return tuple(notes)


def nothing_testable(state: Search, begun: Model, constant: bool) -> Diagnosis:
    """Return the diagnosis of data that can show nothing at all."""
    reasons = {e.name: state.workspace.reasons.get(e.name) for e in LIBRARY if e.name in state.workspace.reasons}
    experiment = experiment_for_more(state.workspace, {k: v for k, v in reasons.items() if v}, {})
    if constant:
        reasons = dict.fromkeys(reasons, "the observed column never changes")
        experiment = Experiment(text=f"see that {state.dataset.observe} is recorded at all, and with enough digits")
    left = rms_of(residual_of(state.dataset, begun))
    return Diagnosis(
        verdict=Verdict.NOT_TESTABLE,
        dataset=state.dataset,
        heldout=state.heldout,
        start=begun,
        model=begun,
        steps=(),
        candidates=(),
        noise=noise_floor(state.dataset, state.workspace.noise),
        rms_before=left,
        rms_after=left,
        rms_heldout=left if state.heldout is None else rms_of(residual_of(state.heldout, begun)),
        heldout_by=held_out_by(state.dataset) if state.heldout is None else state.heldout.source,
        not_testable=tuple((name, reason) for name, reason in reasons.items() if reason is not None),
        minimum_detectable=(),
        lack_of_fit=(),
        unknown=None,
        cosines=None,
        experiment=experiment,
        notes=state.dataset.notes,
    )
