"""In which form an effect explains most: nodes, harmonics, directions, and the place between grid points."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.optimize import minimize_scalar

from rtec.effects import Effect, Observable, Shape
from rtec.effects.frequency_grid import stated_periods
from rtec.inference.score import Background
from rtec.inference.workspace import WORTH_ADDING, Candidacy, Choice, Workspace, is_map

SHARE_OF_PLACES = 0.55
"""Functions of position with more parameters than this share of the places fit anything: nothing is left to test."""
SAME_LINE = 0.005
"""Share by which the period of a line may differ from a fraction of a family's and still be its harmonic."""
NEXT_HARMONICS = 3
"""A line so few harmonics beyond a family belongs to it."""
REVERSAL = ("backlash", "backlash_map", "windup")
"""Effects that differ by direction."""
SLOW = ("drift", "warm_up")
"""Smooth courses in time."""
OTHER_LINES = 0.2
"""Share of the strongest line's gain that the other lines of a longer period have to bring."""
NEAR = 5e-3
"""Share of its room to which a parameter is tuned: near enough for the joint refit that follows."""
STATED = 6.0
"""Twice the log-likelihood that a stated period may lack against a period found by scanning."""


def fits_places(workspace: Workspace, choices: Sequence[Choice]) -> bool:
    """Return whether what a model says about position can still be tested by the places measured."""
    if workspace.dataset.observable is not Observable.DEVIATION:
        return True
    room = SHARE_OF_PLACES * workspace.conditions.places.size
    both = [choice for choice in choices if choice[0].name not in REVERSAL]
    turned = [c for c in choices if c[0].name in REVERSAL or getattr(c[1], "by_direction", False)]
    for group in (both, turned):
        spent = [_place_parameters(effect, shape) for effect, shape in group]
        alone = sum(count > 1 for count in spent) == 1 and any(is_map(effect) for effect, _ in group)
        # a map that is alone in this is limited by its own ladder of nodes
        if not alone and sum(spent) > room:
            return False
    return True


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
    best, line = candidate, getattr(candidate.shape, "period", None)
    tuned = tuned_shape(workspace, effect, candidate.shape, back)
    for shape in effect.variants(workspace.conditions, tuned):
        if fits_places(workspace, [*others, (effect, shape)]):
            found = workspace.judge(effect, shape, back)
            if _is_better(workspace, found, best) and (line is None or _is_family(found, candidate, line)):
                best = found
    for shape in _at_stated_pitch(workspace, effect, candidate.shape):
        if fits_places(workspace, [*others, (effect, shape)]):
            found = workspace.judge(effect, shape, back)
            best = found if _is_better(workspace, found, best) else best
    last = workspace.judge(effect, tuned_shape(workspace, effect, best.shape, back), back)
    return last if last.evidence > best.evidence else best


def _at_stated_pitch(workspace: Workspace, effect: Effect, shape: Shape) -> Sequence[Shape]:
    """Return the forms of a wave at the pitch that the file states: with harmonics it may beat any single line."""
    c = workspace.conditions
    if effect.name not in ("cyclic", "cogging") or not stated_periods(c, c.screw_pitch, 1).size:
        return ()
    return effect.variants(c, replace(shape, **{"period": c.screw_pitch}))


def _is_better(workspace: Workspace, found: Candidacy, best: Candidacy) -> bool:
    """Return whether a form has more evidence; without repeats, also whether each amplitude more explains enough."""
    if found.evidence <= best.evidence:
        return False
    more = 0.5 * (found.amplitudes - best.amplitudes)
    left = best.before - best.gain
    return not workspace.ordinary or more <= 0 or found.gain - best.gain > WORTH_ADDING * more * left


def _is_family(found: Candidacy, single: Candidacy, line: float) -> bool:
    """Return whether a family of which the line is a higher harmonic explains much more than the line itself.

    Else a few weak lines beside a strong one would pass its third for the first, and make the period three times
    as long.
    """
    part = round(getattr(found.shape, "period", line) / line)
    return part <= 1 or found.gain > (1.0 + OTHER_LINES) * single.gain


def tuned_shape(workspace: Workspace, effect: Effect, shape: Shape, back: Background) -> Shape:
    """Return the shape with each continuous parameter at its best, within its bounds."""
    for tunable in effect.tunables(workspace.conditions, shape):

        def lack(value: float, shape: Shape = shape, name: str = tunable.name) -> float:
            return -workspace.judge(effect, replace(shape, **{name: value}), back).gain

        found = minimize_scalar(
            lack,
            bounds=(tunable.low, tunable.high),
            method="bounded",
            options={"xatol": NEAR * (tunable.high - tunable.low), "maxiter": 25},
        )
        if found.fun < lack(getattr(shape, tunable.name)):
            shape = replace(shape, **{tunable.name: float(found.x)})
    return shape


def families_joined(choices: Sequence[Choice]) -> list[Choice]:
    """Return the model with lines put into the family of which they are the next harmonics: one family, not two."""
    model = list(choices)
    for k in range(len(model) - 1, -1, -1):
        effect, shape = model[k]
        line = getattr(shape, "period", None)
        for j, (other, family) in enumerate(model):
            base = getattr(family, "period", None)
            if j == k or line is None or base is None or other.name != effect.name:
                continue
            order, held = round(base / line), int(getattr(family, "harmonics", 1))
            alike = order >= 2 and abs(base / line / order - 1.0) < SAME_LINE
            top = order * int(getattr(shape, "harmonics", 1))
            if alike and top <= held + NEXT_HARMONICS:
                model[j] = other, replace(family, **{"harmonics": max(held, top)})
                del model[k]
                break
    return model


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
        there = workspace.judge(effect, replace(shape, **{"period": stated / ratio}), back)
        if workspace.worth(here.gain - there.gain, here.before) < STATED:
            return effect, there.shape
    return choice
