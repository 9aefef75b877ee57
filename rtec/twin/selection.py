"""Which effects belong in a model: forward with every form of each effect, backward, and by exchange."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from scipy.optimize import minimize_scalar

from rtec.effects import Effect, Shape
from rtec.twin.score import Background
from rtec.twin.workspace import Candidacy, Choice, Workspace, is_map

MOST_EFFECTS = 12
MOST_OF_A_KIND = 6
"""Families of periods that a model may hold."""
MOST_STEPS_IN_TIME = 2
"""Lost counts more often than that explain anything; then something else is wrong."""
REFINED = 5
"""So many of the best candidates of a scan are looked at in all their forms."""
SHARE_OF_PLACES = 0.55
"""Functions of position with more parameters than this share of the places fit anything: nothing is left to test."""
EXCHANGES = 4
STATED = 6.0
"""Twice the log-likelihood that a stated period may lack against a period found by scanning."""


def fits_places(workspace: Workspace, choices: Sequence[Choice]) -> bool:
    """Return whether what a model says about position can still be tested by the places measured."""
    functions = [(effect, shape) for effect, shape in choices if _place_parameters(effect, shape) > 1]
    if len(functions) < 2 and not any(not is_map(effect) for effect, _ in functions):
        return True  # a single map is limited by its own ladder of nodes
    room = SHARE_OF_PLACES * workspace.conditions.places.size
    both = sum(_place_parameters(e, s) for e, s in choices if e.name not in ("backlash", "backlash_map", "windup"))
    by_direction = sum(
        _place_parameters(e, s)
        for e, s in choices
        if e.name in ("backlash", "backlash_map", "windup") or getattr(s, "by_direction", False)
    )
    return max(both, by_direction) <= room


def _place_parameters(effect: Effect, shape: Shape) -> int:
    """Return how many parameters an effect spends on dependence upon position."""
    if is_map(effect):
        return len(getattr(shape, "nodes", ()))
    if hasattr(shape, "period"):
        return 2 * int(getattr(shape, "harmonics", 1)) + 1
    return {"scale": 1, "backlash": 1, "windup": 2}.get(effect.name, 0)


def refined(workspace: Workspace, candidate: Candidacy, others: Sequence[Choice], back: Background) -> Candidacy:
    """Return the best form of a candidate: harmonics, directions, nodes, and the place between grid points."""
    effect = candidate.effect
    if effect.name == "offset":
        return candidate
    best = candidate
    tuned = tuned_shape(workspace, effect, candidate.shape, back)
    for shape in effect.variants(workspace.conditions, tuned):
        if fits_places(workspace, [*others, (effect, shape)]):
            found = workspace.judge(effect, shape, back)
            best = found if found.evidence > best.evidence else best
    last = workspace.judge(effect, tuned_shape(workspace, effect, best.shape, back), back)
    return last if last.evidence > best.evidence else best


def tuned_shape(workspace: Workspace, effect: Effect, shape: Shape, back: Background) -> Shape:
    """Return the shape with each continuous parameter at its best, within its bounds."""
    for tunable in effect.tunables(workspace.conditions, shape):

        def lack(value: float, shape: Shape = shape, name: str = tunable.name) -> float:
            return -workspace.judge(effect, replace(shape, **{name: value}), back).gain

        found = minimize_scalar(
            lack,
            bounds=(tunable.low, tunable.high),
            method="bounded",
            options={"xatol": 1e-3 * (tunable.high - tunable.low), "maxiter": 25},
        )
        if found.fun < lack(getattr(shape, tunable.name)):
            shape = replace(shape, **{tunable.name: float(found.x)})
    return shape


def allowed(workspace: Workspace, choices: Sequence[Choice], effect: Effect) -> bool:
    """Return whether a model may take an effect in (once more)."""
    held = sum(own.name == effect.name for own, _ in choices)
    if effect.name == "lost_counts":
        return held < MOST_STEPS_IN_TIME
    return held < (MOST_OF_A_KIND if effect.repeatable else 1)


def candidates(workspace: Workspace, choices: Sequence[Choice], effects: Sequence[Effect]) -> list[Candidacy]:
    """Return the candidates beside a model, best first, the best of them in their best form."""
    found = []
    for effect in effects:
        if allowed(workspace, choices, effect):
            best = workspace.best_of_scan(effect, workspace.beside(choices, effect))
            if best is not None and fits_places(workspace, [*choices, (effect, best.shape)]):
                found.append(best)
    found.sort(key=lambda c: -c.evidence)
    back = workspace.background(choices)
    found = [refined(workspace, c, choices, back) if k < REFINED else c for k, c in enumerate(found)]
    return sorted(found, key=lambda c: -c.evidence)


def forward(
    workspace: Workspace,
    choices: Sequence[Choice],
    effects: Sequence[Effect],
    *,
    limit: int = MOST_EFFECTS,
    watch: Callable[[Sequence[Choice], Candidacy], None] | None = None,
) -> list[Choice]:
    """Add the best candidate while there is evidence for one; after each, refit the shapes and take out the useless."""
    model = list(choices)
    for _ in range(limit):
        ranked = candidates(workspace, model, effects)
        if not ranked or ranked[0].evidence <= 0.0:
            break
        before = model
        model = [*model, (ranked[0].effect, ranked[0].shape)]
        if watch is not None:
            watch(model, ranked[0])
        model = reshaped(workspace, backward(workspace, model, keep=model[-1]))
        if [e.name for e, _ in model] == [e.name for e, _ in before]:
            break
    return model


def backward(workspace: Workspace, choices: Sequence[Choice], keep: Choice | None = None) -> list[Choice]:
    """Take out effects, the least needed first, as long as there is evidence against one."""
    model = list(choices)
    while len(model) > 1:
        judged = [(without(workspace, model, k).evidence, k) for k in range(len(model)) if model[k] is not keep]
        if not judged or min(judged)[0] >= 0.0:
            break
        del model[min(judged)[1]]
    return model


def without(workspace: Workspace, choices: Sequence[Choice], k: int) -> Candidacy:
    """Return what effect ``k`` explains beside the others."""
    effect, shape = choices[k]
    rest = [*choices[:k], *choices[k + 1 :]]
    return workspace.judge(effect, shape, workspace.beside(rest, effect))


def reshaped(workspace: Workspace, choices: Sequence[Choice]) -> list[Choice]:
    """Return the model with the form of each effect chosen again beside the others."""
    model = list(choices)
    if len(model) < 2:
        return model
    for k, (effect, shape) in enumerate(model):
        if not (is_map(effect) or effect.tunables(workspace.conditions, shape)):
            continue
        rest = [*model[:k], *model[k + 1 :]]
        back = workspace.background(rest)
        best = workspace.judge(effect, shape, back)
        scanned = workspace.best_of_scan(effect, back) if is_map(effect) else None
        for start in (best, scanned):
            if start is not None and fits_places(workspace, [*rest, (effect, start.shape)]):
                found = refined(workspace, start, rest, back)
                best = found if found.evidence > best.evidence else best
        model[k] = effect, best.shape
    return model


def exchanged(workspace: Workspace, choices: Sequence[Choice], effects: Sequence[Effect]) -> list[Choice]:
    """Return a model with one effect replaced by others that do better, or the same model where none do."""
    best, value = list(choices), workspace.total(choices)
    for k, (own, _) in enumerate(choices):
        rest = [*choices[:k], *choices[k + 1 :]]
        trial = forward(workspace, rest, [e for e in effects if e.name != own.name], limit=3)
        found = workspace.total(trial)
        if found > value + 1.0:
            best, value = trial, found
    return best


def search(
    workspace: Workspace, choices: Sequence[Choice], watch: Callable[[Sequence[Choice], Candidacy], None] | None = None
) -> list[Choice]:
    """Return the model for which there is most evidence.

    Two ways are gone: with the whole library, and with maps only once nothing simpler helps - for a map early explains
    a bit of everything. The better end counts; then each effect is tried against others in its place.
    """
    everything = workspace.library
    simple = [effect for effect in everything if not is_map(effect)]
    ends = [forward(workspace, choices, everything, watch=watch)]
    if len(simple) < len(everything):
        ends.append(forward(workspace, forward(workspace, choices, simple, watch=watch), everything, watch=watch))
    best = max(ends, key=workspace.total)
    for _ in range(EXCHANGES):
        better = exchanged(workspace, best, everything)
        if [e.name for e, _ in better] == [e.name for e, _ in best]:
            break
        best = better
    return best


def stated_period(workspace: Workspace, choice: Choice, others: Sequence[Choice]) -> Choice:
    """Return the choice with a period that the file states, where that does as well as the one found."""
    effect, shape = choice
    stated = workspace.conditions.screw_pitch
    period = getattr(shape, "period", None)
    if period is None or stated is None:
        return choice
    back = workspace.background(others)
    here = workspace.judge(effect, shape, back)
    ratio = np.round(stated / period)
    if ratio >= 1 and abs(stated / period / ratio - 1.0) < 0.02:
        there = workspace.judge(effect, replace(shape, period=stated / ratio), back)
        if workspace.worth(here.gain - there.gain, here.before) < STATED:
            return effect, there.shape
    return choice
