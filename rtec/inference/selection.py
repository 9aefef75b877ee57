"""Which effects belong in a model: the best is added, what became useless is taken out."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import replace

from rtec.effects import Effect, Shape
from rtec.inference.forms import SAME_LINE, fits_places, refined
from rtec.inference.workspace import Candidacy, Choice, Workspace, is_map, scan_cost

MOST_EFFECTS = 12
MOST_OF_A_KIND = 6
"""Families of periods that a model may hold."""
MOST_STEPS_IN_TIME = 2
"""Lost counts more often than that explain anything; then something else is wrong."""
REFINED = 5
"""So many of the best candidates of a scan are looked at in all their forms."""
SHARE_OF_ROWS = 0.25
"""Parameters for each reading, at most, where no repeats say what noise is."""


def allowed(workspace: Workspace, choices: Sequence[Choice], effect: Effect) -> bool:
    """Return whether a model may take an effect in (once more)."""
    held = sum(own.name == effect.name for own, _ in choices)
    if not effect.builds_on <= {own.name for own, _ in choices}:
        return False
    usual = 1 if not effect.repeatable else MOST_STEPS_IN_TIME if effect.name == "lost_counts" else MOST_OF_A_KIND
    return held < min(usual, workspace.most.get(effect.name, usual))


def candidates(
    workspace: Workspace, choices: Sequence[Choice], effects: Sequence[Effect], *, plain: bool = False
) -> list[Candidacy]:
    """Return the candidates beside a model, best first; the best of them in their best form, unless plain."""
    found, back = [], workspace.background(choices)
    for effect in effects:
        if allowed(workspace, choices, effect):
            own = workspace.beside(choices, effect) if effect.name == "offset" else back
            best = workspace.best_of_scan(effect, own, fitting(workspace, choices, effect))
            if best is not None and fits_places(workspace, [*choices, (effect, best.shape)]):
                found.append(best)
    room = workspace.dataset.rows * SHARE_OF_ROWS - back.basis.shape[1]
    if workspace.ordinary:
        found = [c for c in found if c.amplitudes + scan_cost(c.effect, c.shape) <= room]
    found.sort(key=lambda c: _rank(workspace, c))
    if plain:
        return found
    found = [refined(workspace, c, choices, back) if k < REFINED else c for k, c in enumerate(found)]
    return sorted(found, key=lambda c: _rank(workspace, c))


def _rank(workspace: Workspace, candidacy: Candidacy) -> tuple[float, bool]:
    """Return the order of candidates: by evidence; where time stands for position, a drift before a scale error."""
    behind = candidacy.effect.name == "scale" and workspace.conditions.time_is_coordinate
    return -round(candidacy.evidence, 6), behind


def fitting(workspace: Workspace, choices: Sequence[Choice], effect: Effect) -> Callable[[Shape], bool]:
    """Return the test whether a form of an effect leaves something of the places to test the model by."""
    return lambda shape: fits_places(workspace, [*choices, (effect, shape)])


def forward(
    workspace: Workspace,
    choices: Sequence[Choice],
    effects: Sequence[Effect],
    *,
    given: Collection[str] = (),
    limit: int = MOST_EFFECTS,
    plain: bool = False,
    watch: Callable[[Sequence[Choice], Candidacy], None] | None = None,
) -> list[Choice]:
    """Add the best candidate while there is evidence for one; after each, refit and take out the useless.

    ``plain``: effects come as the scan finds them (single waves), which leaves room for others beside them.
    """
    model = list(choices)
    for _ in range(limit):
        ranked = candidates(workspace, model, effects, plain=plain)
        if not ranked or ranked[0].evidence <= 0.0:
            break
        before = model
        longer = _as_harmonic(workspace, model, ranked[0])
        model = [*model, (ranked[0].effect, ranked[0].shape)] if longer is None else longer
        if watch is not None:
            watch(model, ranked[0])
        keep = model[-1] if longer is None else None
        model = backward(workspace, model, given=given, keep=keep)
        model = model if plain else reshaped(workspace, model)
        if longer is None and [e.name for e, _ in model] == [e.name for e, _ in before]:
            break
    return model


def _as_harmonic(workspace: Workspace, choices: Sequence[Choice], found: Candidacy) -> list[Choice] | None:
    """Return the model with the family lengthened of which a line found is a harmonic, where that has evidence."""
    line = getattr(found.shape, "period", None)
    if line is None:
        return None
    for k, (effect, shape) in enumerate(choices):
        base = getattr(shape, "period", None)
        if effect.name != found.effect.name or base is None:
            continue
        order = round(base / line)
        if order < 2 or abs(base / line / order - 1.0) > SAME_LINE:
            continue
        longer = replace(shape, **{"harmonics": max(order, int(getattr(shape, "harmonics", 1)))})
        model = [*choices[:k], (effect, longer), *choices[k + 1 :]]
        if longer != shape and workspace.total(model) > workspace.total(choices):
            return model
    return None


def backward(
    workspace: Workspace, choices: Sequence[Choice], *, given: Collection[str] = (), keep: Choice | None = None
) -> list[Choice]:
    """Take out effects, the least needed first, as long as there is evidence against one."""
    model = list(choices)
    while len(model) > 1:
        judged = [
            (without(workspace, model, k).evidence, k)
            for k in range(len(model))
            if model[k] is not keep and model[k][0].name not in given and coherent([*model[:k], *model[k + 1 :]])
        ]
        if not judged or min(judged)[0] >= 0.0:
            break
        del model[min(judged)[1]]
    return model


def coherent(choices: Sequence[Choice]) -> bool:
    """Return whether every effect that is an addition to others has these beside it."""
    names = {effect.name for effect, _ in choices}
    return all(effect.builds_on <= names for effect, _ in choices)


def without(workspace: Workspace, choices: Sequence[Choice], k: int) -> Candidacy:
    """Return what effect ``k`` explains beside the others."""
    effect, shape = choices[k]
    rest = [*choices[:k], *choices[k + 1 :]]
    return workspace.judge(effect, shape, workspace.beside(rest, effect))


def reshaped(workspace: Workspace, choices: Sequence[Choice], *, alone: bool = False) -> list[Choice]:
    """Return the model with the form of each effect chosen again beside the others.

    An effect that is alone is left as it is unless ``alone``: it was chosen beside nothing.
    """
    model = list(choices)
    if len(model) < 2 and not alone:
        return model
    for k, (effect, shape) in enumerate(model):
        if not (is_map(effect) or effect.tunables(workspace.conditions, shape)):
            continue
        rest = [*model[:k], *model[k + 1 :]]
        back = workspace.background(rest)
        best = workspace.judge(effect, shape, back)
        scanned = workspace.best_of_scan(effect, back, fitting(workspace, rest, effect)) if is_map(effect) else None
        for start in (best, scanned):
            if start is not None and fits_places(workspace, [*rest, (effect, start.shape)]):
                found = refined(workspace, start, rest, back)
                best = found if found.evidence > best.evidence else best
        model[k] = effect, best.shape
    return model
