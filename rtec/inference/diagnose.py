"""The search for what is missing: rank, calibrate, add, refit, hold out, test for removal - until nothing is left."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from rtec.dataset.dataset import Dataset
from rtec.dataset.many_rows import looked_at, one_of_every
from rtec.errors import ArgumentError
from rtec.inference.calibration import independent_tests
from rtec.inference.exchange import search
from rtec.inference.fit import fit_model, noise_after
from rtec.inference.heldout import gain_on
from rtec.inference.judgement import judged, nothing_testable
from rtec.inference.model import Model
from rtec.inference.results import Diagnosis
from rtec.inference.selection import coherent, forward, reshaped
from rtec.inference.trial import LEVEL, Search, Trial, first_noise, refitted, trial_of
from rtec.inference.workspace import Choice, Workspace

MOST_ROWS_SEARCHED = 2500
"""Of a log without repeats: its neighbours say nearly the same; the final fit takes them all."""
ROUNDS = 4
"""The noise is estimated again as effects come in; so often at most."""
SETTLED = 0.03
BANS = 12
"""So many effects may be struck out."""

Progress = Callable[[float], None]


def diagnose(
    dataset: Dataset,
    model: Model | None = None,
    heldout: Dataset | None = None,
    *,
    locked: bool = False,
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
        Another measurement, on which effects are judged and the found model is scored; else parts of the first are
        held out.
    locked
        Whether ``heldout`` is only scored, when everything is decided.
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
    dataset = looked_at(dataset)
    start = model if model is not None else Model(observe=dataset.observe, units=dataset.units)
    if start.observe != dataset.observe:
        raise ArgumentError("model", f"a model of {start.observe}", f"one of {dataset.observe}")
    begun = fit_model(dataset, start, all_open=True) if start.terms else start
    base: list[Choice] = [(term.effect, term.shape) for term in begun.terms if term.shape is not None]
    searched = thinned(dataset)
    state = Search(
        dataset=searched,
        heldout=heldout,
        locked=locked,
        start=begun,
        rng=rng,
        workspace=Workspace(searched, first_noise(searched, base), quick=True),
    )
    tell(0.05)
    constant = dataset.never_changes
    if constant or not state.workspace.library:
        return nothing_testable(state, begun, constant)
    state.tests = 1.0
    _find(state, base, tell)
    state.tests = independent_tests(state.workspace.strict, rng)
    for _ in range(BANS):
        if not (_strike_out(state, base) or _made_simpler(state, base)):
            break
    if searched is not dataset or dataset.resample is not None:
        state.dataset = dataset
        choices = refitted(Workspace(dataset, state.workspace.noise), state.kept)
        state.kept = choices
        state.workspace = Workspace(dataset, noise_after(state.workspace, choices, datum=state.workspace.has_datum))
        _confirm(state, base)
    held = {effect.name for effect, _ in state.kept}
    state.rejected = {name: trial for name, trial in state.rejected.items() if name not in held}
    tell(0.7)
    return judged(state, begun, base, rng, tell)


def thinned(dataset: Dataset) -> Dataset:
    """Return what a search looks at of a long log: one of every k rows; where there are repeats, everything.

    Which one of them is drawn: at equal steps a short period would pass for a long one.
    """
    every = -(-dataset.rows // MOST_ROWS_SEARCHED)
    if dataset.has_repeats or every == 1:
        return dataset
    return dataset.take(one_of_every(every, dataset.rows, np.random.default_rng(0)))


def _find(state: Search, base: Sequence[Choice], tell: Progress) -> None:
    """Search, estimate the noise again with what was found taken out, and search again until that changes nothing.

    Without repeats one search has to do: its last residual says what noise is, and the tests are strict.
    """
    choices = list(base)
    for turn in range(ROUNDS):
        choices = refitted(state.workspace, search(state.workspace, base, banned=state.banned, most=state.most))
        noise = noise_after(state.workspace, choices, datum=state.workspace.has_datum)
        settled = abs(np.log(max(noise.sigma / state.workspace.noise.sigma, 1e-12))) < SETTLED
        state.workspace = Workspace(state.dataset, noise, quick=True)
        tell(0.05 + 0.6 * (turn + 1) / ROUNDS)
        if settled or not noise.from_repeats or not any(effect.in_time for effect, _ in choices):
            break
    state.kept = choices


def _made_simpler(state: Search, base: Sequence[Choice]) -> bool:
    """Put a special case in the place of an effect where that predicts the other measurement better."""
    judge = state.judge
    if judge is None:
        return False
    given = {effect.name for effect, _ in base}
    for k, (own, _) in enumerate(state.kept):
        rest = [*state.kept[:k], *state.kept[k + 1 :]]
        for simple in state.workspace.library:
            held = {effect.name for effect, _ in state.kept}
            if own.name in given or simple.name not in own.contains or simple.name in held or simple.name == "offset":
                continue
            best = state.workspace.best_of_scan(simple, state.workspace.background(rest))
            if best is None:
                continue
            trial = refitted(state.workspace, [*rest, (simple, best.shape)])
            before, after = state.model(state.kept), state.model(trial)
            if gain_on(before, after, judge, state.workspace.noise).gain > 0.0:
                state.kept = trial
                state.banned.add(own.name)
                state.removed[own.name] = f"{simple.name} predicts the other measurement better"
                return True
    return False


def _strike_out(state: Search, base: Sequence[Choice]) -> bool:
    """Test each effect for removal, strike the worst off and go on without it; return whether one was struck.

    Effects of the given model stay. What is struck out may have stood where others belong, so these are looked for
    again.
    """
    worst = _worst(state, base)
    if worst is None:
        return False
    k, trial = worst
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
    state.kept = refitted(state.workspace, rest)
    if not state.workspace.noise.from_repeats:
        noise = noise_after(state.workspace, state.kept, datum=state.workspace.has_datum)
        state.workspace = Workspace(state.dataset, noise, quick=True)
    return True


def _worst(state: Search, base: Sequence[Choice]) -> tuple[int, Trial] | None:
    """Return the effect that fails its test for removal most clearly, with its test; None where none fails.

    Where there are repeats the probability decides which is the worst, else the held-out error.
    """
    given = {effect.name for effect, _ in base}
    tested = [k for k, (effect, _) in enumerate(state.kept) if effect.name not in given]
    failed = []
    for k in tested:
        trial = trial_of(state, state.kept, k)
        if not trial.passes and coherent([*state.kept[:k], *state.kept[k + 1 :]]):
            certainty = trial.held_out.gain / max(trial.held_out.error, 1e-300)
            last = state.kept[k][0].name == "offset"  # the datum takes its place: nothing else depends on it
            p = trial.p_adjusted if state.workspace.noise.from_repeats else 0.0
            failed.append((not last, p >= LEVEL, p, -certainty, k, trial))
    if not failed:
        return None
    *_, k, trial = max(failed, key=lambda f: f[:5])
    return k, trial


def _confirm(state: Search, base: Sequence[Choice]) -> None:
    """Strike off what the rows that the search did not look at do not bear out."""
    while (worst := _worst(state, base)) is not None:
        k, trial = worst
        state.rejected[state.kept[k][0].name] = trial
        state.kept = refitted(state.workspace, [*state.kept[:k], *state.kept[k + 1 :]])
        noise = noise_after(state.workspace, state.kept, datum=state.workspace.has_datum)
        state.workspace = Workspace(state.dataset, noise)
