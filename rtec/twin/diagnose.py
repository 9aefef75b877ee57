"""The search for what is missing: rank, calibrate, add, refit, hold out, test for removal - until nothing is left."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from rtec.effects import LIBRARY, Floats
from rtec.errors import ArgumentError
from rtec.twin.calibration import adjusted, independent_tests
from rtec.twin.dataset import Dataset
from rtec.twin.detectable import minimum_detectable
from rtec.twin.experiment import experiment_for_more, experiment_for_rivals, experiment_for_unknown
from rtec.twin.fit import (
    fit_model,
    fitted_terms,
    jointly_refitted,
    needs_datum,
    noise_after,
    residual_of,
    shapes_found,
    solved,
    values_of,
)
from rtec.twin.heldout import HeldOutGain, gain_of, gain_on, held_out_residual, rms_by_folds
from rtec.twin.leftover import MATTERS, describe_leftover
from rtec.twin.lookalikes import Rivalry, constant_is_datum, cosines, rivalries
from rtec.twin.model import Model
from rtec.twin.noise import Noise, noise_floor, noise_from_repeats, noise_from_residual
from rtec.twin.results import Candidate, Diagnosis, Experiment, Step, Unknown, Verdict
from rtec.twin.selection import candidates, coherent, forward, reshaped, search, stated_period
from rtec.twin.structure import changes_left, in_time_by_chance, lack_of_fit_of_means
from rtec.twin.workspace import Candidacy, Choice, Workspace

LEVEL = 0.01
BORDERLINE = 0.05
MOST_ROWS_SEARCHED = 5000
"""Of a log without repeats: its neighbours say nearly the same; the final fit takes them all."""
ROUNDS = 4
"""The noise is estimated again as effects come in; so often at most."""
SETTLED = 0.03
BANS = 12
"""So many effects may be struck out."""
MATTERS_WITHOUT_REPEATS = 0.005
"""Share by which an effect has to lower the RMS where there is no noise floor to compare it with."""
HARD_TO_SEE = 3.0
"""Where half of the effects have to exceed so many noise floors to be seen, nothing found means little."""

Progress = Callable[[float], None]


@dataclass(frozen=True, slots=True, kw_only=True)
class Trial:
    """An effect of the model, tested for removal."""

    candidacy: Candidacy
    p_adjusted: float
    held_out: HeldOutGain
    small: bool

    @property
    def passes(self) -> bool:
        """Whether the effect stays."""
        return self.p_adjusted < LEVEL and self.held_out.passes and not self.small

    @property
    def reason(self) -> str:
        """Why it stays or goes."""
        if self.p_adjusted >= LEVEL:
            return f"adjusted p {self.p_adjusted:.2g} is not below {LEVEL:g}"
        if not self.held_out.passes:
            return "the held-out error does not fall by more than two standard errors"
        if self.small:
            return "significant, but too small to matter"
        return f"adjusted p {self.p_adjusted:.2g}, held-out error falls"


@dataclass(slots=True, kw_only=True, eq=False)
class _Search:
    """The state of a search."""

    dataset: Dataset
    heldout: Dataset | None
    start: Model
    workspace: Workspace
    rng: np.random.Generator
    tests: float = 1.0
    kept: list[Choice] = field(default_factory=list)
    rejected: dict[str, Trial] = field(default_factory=dict)
    removed: dict[str, str] = field(default_factory=dict)
    banned: set[str] = field(default_factory=set)
    """Effects that were struck out: the search has to do without."""
    most: dict[str, int] = field(default_factory=dict)
    """How many of a kind are left after one was struck out."""

    def model(self, choices: Sequence[Choice]) -> Model:
        """Return a fitted model."""
        datum = needs_datum(self.workspace, choices)
        terms, zero = fitted_terms(self.workspace, choices, datum=datum)
        return self.start.with_terms(terms, datum=zero)


def diagnose(
    dataset: Dataset,
    model: Model | None = None,
    heldout: Dataset | None = None,
    *,
    seed: int = 0,
    progress: Progress | None = None,
) -> Diagnosis:
    """Find which physical effects a model lacks.

    Parameters
    ----------
    dataset
        The measurement.
    model
        What is known already; its effects are refitted with the ones found. None: nothing.
    heldout
        Another measurement, on which the found model is scored; else parts of the first are held out.
    seed
        Of the draws that calibrate the best of many.
    progress
        Called with the share done.

    Returns
    -------
    Diagnosis
        Verdict, steps, candidates, and everything that the report draws.

    Raises
    ------
    ArgumentError
        A model of another quantity, or one with effects that the data cannot show.
    """
    tell = progress or (lambda share: None)
    rng = np.random.default_rng(seed)
    start = model if model is not None else Model(observe=dataset.observe, units=dataset.units)
    if start.observe != dataset.observe:
        raise ArgumentError("model", f"a model of {start.observe}", f"one of {dataset.observe}")
    begun = fit_model(dataset, start, all_open=True) if start.terms else start
    base: list[Choice] = [(term.effect, term.shape) for term in begun.terms if term.shape is not None]
    searched = thinned(dataset)
    state = _Search(
        dataset=searched, heldout=heldout, start=begun, rng=rng,
        workspace=Workspace(searched, _first_noise(searched, base), quick=True),
    )
    tell(0.05)
    constant = float(np.ptp(dataset.observed)) == 0.0
    if constant or not state.workspace.library:
        return _nothing_testable(state, begun, constant)
    state.tests = 1.0
    _find(state, base, tell)
    state.tests = independent_tests(state.workspace.strict, rng)
    for _ in range(BANS):
        if not _strike_out(state, base):
            break
    if searched is not dataset or dataset.resample is not None:
        state.dataset = dataset
        choices = _refitted(Workspace(dataset, state.workspace.noise), state.kept)
        state.kept = choices
        state.workspace = Workspace(
            dataset, noise_after(state.workspace, choices, datum=state.workspace.has_datum)
        )
    held = {effect.name for effect, _ in state.kept}
    state.rejected = {name: trial for name, trial in state.rejected.items() if name not in held}
    tell(0.7)
    return _judged(state, begun, base, rng, tell)


def thinned(dataset: Dataset) -> Dataset:
    """Return what a search looks at of a long log: every k-th row; where there are repeats, everything."""
    every = -(-dataset.rows // MOST_ROWS_SEARCHED)
    return dataset if dataset.has_repeats or every == 1 else dataset.take(np.arange(0, dataset.rows, every))


def _first_noise(dataset: Dataset, base: Sequence[Choice]) -> Noise:
    found = noise_from_repeats(dataset, base)
    if found is not None:
        return found
    flat = Workspace(dataset, noise_from_residual(dataset, dataset.observed, 0))
    return noise_after(flat, base, datum=flat.has_datum)


def _find(state: _Search, base: Sequence[Choice], tell: Progress) -> None:
    """Search, estimate the noise again with what was found taken out, and search again until that changes nothing.

    Without repeats one search has to do: its last residual says what noise is, and the tests are strict.
    """
    choices = list(base)
    for turn in range(ROUNDS):
        choices = _refitted(state.workspace, search(state.workspace, base, banned=state.banned, most=state.most))
        noise = noise_after(state.workspace, choices, datum=state.workspace.has_datum)
        settled = abs(np.log(max(noise.sigma / state.workspace.noise.sigma, 1e-12))) < SETTLED
        state.workspace = Workspace(state.dataset, noise, quick=True)
        tell(0.05 + 0.6 * (turn + 1) / ROUNDS)
        if settled or not noise.from_repeats or not any(effect.in_time for effect, _ in choices):
            break
    state.kept = choices


def _refitted(workspace: Workspace, choices: list[Choice]) -> list[Choice]:
    stated = [stated_period(workspace, c, [*choices[:k], *choices[k + 1 :]]) for k, c in enumerate(choices)]
    return jointly_refitted(workspace, stated, datum=needs_datum(workspace, stated))


def _strike_out(state: _Search, base: Sequence[Choice]) -> bool:
    """Test each effect for removal, strike the worst off the list and go on without it; return whether one was struck.

    Effects of the given model stay. What is struck out may have stood where others belong, so these are looked for
    again. Where there are repeats the probability decides which is the worst, else the held-out error.
    """
    given = {effect.name for effect, _ in base}
    tested = [k for k, (effect, _) in enumerate(state.kept) if effect.name not in given]
    failed = []
    for k in tested:
        trial = _trial(state, state.kept, k)
        if not trial.passes and coherent([*state.kept[:k], *state.kept[k + 1 :]]):
            certainty = trial.held_out.gain / max(trial.held_out.error, 1e-300)
            last = state.kept[k][0].name == "offset"  # the datum takes its place: nothing else depends on it
            p = trial.p_adjusted if state.workspace.noise.from_repeats else 0.0
            failed.append((not last, p >= LEVEL, p, -certainty, k, trial))
    if not failed:
        return False
    *_, k, trial = max(failed, key=lambda f: f[:5])
    name = state.kept[k][0].name
    state.rejected[name] = trial
    names = [effect.name for effect, _ in state.kept]
    if names.count(name) > 1:
        state.most[name] = names.count(name) - 1
    else:
        state.banned.add(name)
    given_names = [effect.name for effect, _ in base]
    rest = [*state.kept[:k], *state.kept[k + 1 :]]
    library = [effect for effect in state.workspace.library if effect.name not in state.banned]
    state.workspace.most = state.most
    rest = forward(state.workspace, reshaped(state.workspace, rest), library, given=given_names)
    state.kept = _refitted(state.workspace, rest)
    if not state.workspace.noise.from_repeats:
        noise = noise_after(state.workspace, state.kept, datum=state.workspace.has_datum)
        state.workspace = Workspace(state.dataset, noise, quick=True)
    return True


def _trial(state: _Search, choices: Sequence[Choice], k: int) -> Trial:
    """Test choice ``k`` beside the others."""
    workspace = state.workspace
    effect, shape = choices[k]
    rest = [*choices[:k], *choices[k + 1 :]]
    strict = workspace.strict
    tested = strict.judge(effect, shape, strict.beside(rest, effect))
    same = sum(own.name == effect.name for own, _ in choices)
    grid = len(effect.shapes(workspace.conditions)) if same > 1 and workspace.noise.from_repeats else 1
    p = adjusted(strict.p_value(tested), state.tests * grid ** (same - 1))
    correlated = workspace.noise.from_repeats and not workspace.noise.correlation.is_white
    if p < LEVEL and effect.in_time and correlated:
        p = max(p, in_time_by_chance(state.dataset, choices, k, workspace.library, state.rng))
    judged = workspace.judge(effect, shape, workspace.beside(rest, effect))
    return Trial(candidacy=judged, p_adjusted=p, held_out=_held_out(state, rest, choices), small=_small(state, judged))


def _small(state: _Search, judged: Candidacy) -> bool:
    rows = state.dataset.rows
    if state.workspace.noise.from_repeats:
        return bool(np.sqrt(judged.gain / rows) < MATTERS * state.workspace.noise.sigma)
    return bool(np.sqrt(max(1.0 - judged.gain / judged.before, 0.0)) > 1.0 - MATTERS_WITHOUT_REPEATS)


def _held_out(state: _Search, rest: Sequence[Choice], choices: Sequence[Choice]) -> HeldOutGain:
    """Return the held-out gain of ``choices`` over ``rest``, on the other file where there is one."""
    workspace = state.workspace
    if state.heldout is not None and not workspace.noise.from_repeats:
        return gain_on(state.model(rest), state.model(choices), state.heldout)
    names = [effect.name for effect, _ in choices]
    datum = workspace.has_datum and "offset" not in names
    # an offset is judged against nothing in its place; any other effect against a free constant
    before = held_out_residual(
        workspace, rest, datum=datum or (workspace.has_datum and "offset" in [e.name for e, _ in rest])
    )
    return gain_of(workspace, before, held_out_residual(workspace, choices, datum=datum))


def _judged(
    state: _Search, begun: Model, base: Sequence[Choice], rng: np.random.Generator, tell: Progress
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
    p_changes = changes_left(dataset, workspace.noise, ordered, rng) if workspace.noise.from_repeats else {}
    unknown = describe_leftover(workspace, ordered, p_means, p_changes)
    tell(0.9)
    rivals = {
        ordered[k][0].name: rivalries(workspace, ordered, k) for k in range(len(base), len(ordered))
    }
    tied = [r for found in rivals.values() for r in found if r.tied]
    minimum = minimum_detectable(workspace, state.tests)
    found = [_candidate(state, step, rivals.get(step.effect, [])) for step in steps]
    absent = _absent(state, ordered, rivals, minimum)
    borderline = any(LEVEL <= c.p_adjusted < BORDERLINE for c in absent)
    verdict = _verdict(unknown, bool(tied), bool(steps), _inconclusive(state, minimum, borderline))
    fitted = state.model(ordered)
    not_testable = {n: r for n, r in workspace.reasons.items() if r is not None}
    lack = [("means over repeats", p_means)] if p_means is not None else []
    after = _rms(residual_of(dataset, fitted))
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
        rms_before=_rms(residual_of(dataset, begun)),
        rms_after=after,
        rms_heldout=_rms_held_out(state, ordered, fitted),
        heldout_by=dataset.held_out_by if state.heldout is None else state.heldout.source,
        not_testable=tuple(not_testable.items()),
        minimum_detectable=tuple(minimum.items()),
        lack_of_fit=(*lack, *((f"changes in {name}", p) for name, p in p_changes.items())),
        unknown=unknown,
        cosines=cosines(workspace, ordered),
        experiment=_experiment(state, ordered, unknown, tied, not_testable, minimum),
        notes=_notes(state, borderline),
    )


def _in_order(state: _Search, base: Sequence[Choice]) -> list[Choice]:
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


def _steps(state: _Search, begun: Model, base: Sequence[Choice], ordered: Sequence[Choice]) -> tuple[Step, ...]:
    """Return the staircase: each effect added to those before it, everything refitted."""
    steps, before = [], begun
    for count in range(len(base) + 1, len(ordered) + 1):
        choices = _refitted(state.workspace, list(ordered[:count])) if count < len(ordered) else list(ordered)
        fitted = state.model(choices)
        trial = _trial(state, choices, count - 1)
        steps.append(
            Step(
                effect=choices[-1][0].name,
                added=True,
                params=values_of(fitted.terms[-1], fitted),
                rms_train=_rms(residual_of(state.dataset, fitted)),
                rms_heldout=_rms_held_out(state, choices, fitted),
                gain=trial.held_out.gain,
                gain_error=trial.held_out.error,
                p_adjusted=trial.p_adjusted,
                reason=trial.reason,
                model=fitted,
            )
        )
        before = fitted
    return tuple(steps)


def _rms_held_out(state: _Search, choices: Sequence[Choice], fitted: Model) -> float:
    if state.heldout is not None:
        return _rms(residual_of(state.heldout, fitted))
    return rms_by_folds(state.workspace, choices, datum=needs_datum(state.workspace, choices))


def _rms(residual: Floats) -> float:
    return float(np.sqrt(np.mean(residual**2)))


def _predicted_rms(state: _Search, choices: Sequence[Choice], candidacy: Candidacy) -> float:
    """Return the RMS that adding a candidate as it stands would leave, everything else kept in shape."""
    model = [*choices, (candidacy.effect, candidacy.shape)]
    amplitudes, zero = solved(state.workspace, model, datum=needs_datum(state.workspace, model))
    left = state.dataset.observed - zero
    for (effect, shape), numbers in zip(model, amplitudes, strict=True):
        left = left - state.dataset.columns(effect, shape) @ numbers
    return _rms(left)


def _candidate(state: _Search, step: Step, found: Sequence[Rivalry]) -> Candidate:
    """Return an accepted effect as a candidate."""
    terms = step.model.terms
    others: list[Choice] = [(t.effect, t.shape) for t in terms[:-1] if t.shape is not None]
    effect = terms[-1].effect
    best = state.workspace.best_of_scan(effect, state.workspace.beside(others, effect))
    return Candidate(
        effect=step.effect,
        accepted=True,
        predicted_rms=step.rms_train if best is None else _predicted_rms(state, others, best),
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
    state: _Search, ordered: Sequence[Choice], rivals: dict[str, list[Rivalry]], minimum: dict[str, float]
) -> tuple[Candidate, ...]:
    """Return every other testable effect, ranked beside the model found."""
    held = {effect.name for effect, _ in ordered}
    ranked = candidates(state.workspace, ordered, [e for e in state.workspace.library if e.name not in held])
    tied_to = {r.rival: (name, r) for name, found in rivals.items() for r in found if r.tied or r.permanent}
    unit, factor = state.dataset.units.shown
    listed = []
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
            least = f"; from {minimum[name] * factor:.3g} {unit} RMS on it would be found" if name in minimum else ""
            reason = f"adjusted p {p:.2g}: nothing to be seen{least}" if p >= LEVEL else f"adjusted p {p:.2g}, not needed"
        listed.append(
            Candidate(
                effect=name,
                accepted=False,
                predicted_rms=_predicted_rms(state, ordered, candidacy),
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


def _permanent(state: _Search, name: str, other: str, rival: Rivalry, ordered: Sequence[Choice]) -> Candidate:
    """Return an effect that no data can tell from an accepted one."""
    return Candidate(
        effect=name,
        accepted=False,
        predicted_rms=_rms(residual_of(state.dataset, state.model(ordered))),
        achieved_rms=None,
        p_adjusted=1.0,
        params=(),
        tied_with=(other,),
        cosine=rival.cosine,
        reason=f"looks exactly like {other} to the same instrument",
    )


def _inconclusive(state: _Search, minimum: dict[str, float], borderline: bool) -> bool:
    """Return whether data in which nothing was found could not have shown much."""
    if not state.workspace.noise.from_repeats or borderline:
        return True
    sizes = sorted(minimum.values())
    return not sizes or sizes[len(sizes) // 2] > HARD_TO_SEE * state.workspace.noise.sigma


def _verdict(unknown: Unknown | None, tied: bool, found: bool, inconclusive: bool) -> Verdict:
    if unknown is not None:
        return Verdict.UNKNOWN
    if tied:
        return Verdict.TIED
    if found:
        return Verdict.NAMED
    return Verdict.INCONCLUSIVE if inconclusive else Verdict.NONE


def _experiment(
    state: _Search,
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


def _notes(state: _Search, borderline: bool) -> tuple[str, ...]:
    notes = list(state.dataset.notes)
    if not state.workspace.noise.from_repeats:
        notes.append("no condition was repeated: there is no noise floor, and what is left cannot be judged")
    if state.workspace.conditions.time_s is None:
        notes.append("the file has no time: row order counts as time")
    if borderline:
        notes.append(f"an effect with an adjusted p between {LEVEL:g} and {BORDERLINE:g} was not accepted")
    notes += [f"{name} was tried and taken out: {trial.reason}" for name, trial in state.rejected.items()]
    notes += [f"{name} is not listed: {why}" for name, why in state.removed.items()]
    return tuple(notes)


def _nothing_testable(state: _Search, begun: Model, constant: bool) -> Diagnosis:
    """Return the diagnosis of data that can show nothing at all."""
    reasons = {e.name: state.workspace.reasons.get(e.name) for e in LIBRARY if e.name in state.workspace.reasons}
    if constant:
        reasons = dict.fromkeys(reasons, "the observed column never changes")
    left = _rms(residual_of(state.dataset, begun))
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
        rms_heldout=left if state.heldout is None else _rms(residual_of(state.heldout, begun)),
        heldout_by=state.dataset.held_out_by if state.heldout is None else state.heldout.source,
        not_testable=tuple((name, reason) for name, reason in reasons.items() if reason is not None),
        minimum_detectable=(),
        lack_of_fit=(),
        unknown=None,
        cosines=None,
        experiment=experiment_for_more(state.workspace, {k: v for k, v in reasons.items() if v}, {}),
        notes=state.dataset.notes,
    )
