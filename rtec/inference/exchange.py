"""The search for the model with most evidence: several ways to it, then effects tried in the place of others."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence

from rtec.effects import Effect
from rtec.inference.forms import REVERSAL, SLOW, fits_places, refined
from rtec.inference.selection import backward, coherent, fitting, forward, reshaped
from rtec.inference.structure import lack_of_fit_of_means
from rtec.inference.workspace import Candidacy, Choice, Workspace, is_map

MANY_ROWS = 2000
MOST_PLAIN = 4
SIMPLER = 6.0
"""Evidence that a model may lack against one that is less simple."""
FITS = 0.01
"""Probability of the means over repeats above which a model explains all that repeats."""
EXCHANGES = 4
MOST_EXCHANGED = 4
"""Without repeats a larger model is not tried by exchange: what is left of it is decided by held-out error."""


def search(
    workspace: Workspace,
    choices: Sequence[Choice],
    *,
    banned: Collection[str] = (),
    most: Mapping[str, int] | None = None,
    watch: Callable[[Sequence[Choice], Candidacy], None] | None = None,
) -> list[Choice]:
    """Return the model for which there is most evidence; the effects that it begins with stay in it.

    Three ways are gone: with the whole library; with maps only once nothing simpler helps - for a map early explains
    a bit of everything; and with every effect in its plainest form first - for many harmonics do so, too. The best
    end counts; then each effect is tried against others in its place.
    """
    given = {effect.name for effect, _ in choices}
    mean = workspace.mean_run if workspace.dataset.rows > MANY_ROWS else None
    if mean is not None and not any(effect.in_time for effect, _ in choices):
        # what repeats is found in the mean run; only what changes in time needs all of them
        found = search(mean, choices, banned=banned, most=most)
        library = [effect for effect in workspace.library if effect.name not in banned]
        workspace.most = dict(most or {})
        return one_of_alike(workspace, forward(workspace, found, library, given=given, watch=watch), given=given)
    workspace.most = dict(most or {})
    everything = [effect for effect in workspace.library if effect.name not in banned]
    simple = [effect for effect in everything if not is_map(effect)]
    ends = [forward(workspace, choices, everything, given=given, watch=watch)]
    if len(simple) < len(everything):
        first = forward(workspace, choices, simple, given=given, watch=watch)
        ends.append(forward(workspace, first, everything, given=given, watch=watch))
    if not workspace.ordinary:
        bare = forward(workspace, choices, simple, given=given, limit=MOST_PLAIN, plain=True, watch=watch)
        ends.append(forward(workspace, reshaped(workspace, bare), everything, given=given, watch=watch))
    best = max(ends, key=workspace.total)
    for _ in range(EXCHANGES if workspace.noise.from_repeats or len(best) <= MOST_EXCHANGED else 0):
        better = exchanged(workspace, best, everything, given=given)
        if workspace.total(better) <= workspace.total(best) + 1.0:
            break
        best = better
    return simplified(workspace, best, everything, given=given)


def exchanged(
    workspace: Workspace, choices: Sequence[Choice], effects: Sequence[Effect], *, given: Collection[str] = ()
) -> list[Choice]:
    """Return a model with one effect replaced by others that do better, or the same model where none do."""
    best, value = list(choices), workspace.total(choices)
    for k, (own, _) in enumerate(choices):
        rest = [*choices[:k], *choices[k + 1 :]]
        if own.name in given or not coherent(rest):
            continue
        trial = forward(workspace, rest, [e for e in effects if e.name != own.name], given=given, limit=3)
        found = workspace.total(trial)
        if found > value + 1.0:
            best, value = trial, found
    for trial in _bolder(workspace, choices, effects, given):
        found = workspace.total(trial)
        if found > value + 1.0:
            best, value = trial, found
    return best


def _bolder(
    workspace: Workspace, choices: Sequence[Choice], effects: Sequence[Effect], given: Collection[str]
) -> Iterator[list[Choice]]:
    """Yield models that no single exchange reaches.

    A simple effect put in whatever the others say, periods looked for anew beside the others and beside other maps,
    two effects taken out.
    """
    held = {effect.name for effect, _ in choices}
    back = workspace.background(choices)
    for effect in effects:
        if effect.name in held or is_map(effect) or hasattr(effect.shape_type(), "period") or effect.name == "offset":
            continue
        if effect.builds_on <= held and (best := workspace.best_of_scan(effect, back)) is not None:
            model = [*choices, (effect, best.shape)]
            yield backward(workspace, reshaped(workspace, model), given=given)
    for k, (effect, shape) in enumerate(choices):
        if hasattr(shape, "period") and effect.name not in given:
            rest = [*choices[:k], *choices[k + 1 :]]
            again = workspace.best_of_scan(effect, workspace.background(rest))
            if again is not None and fits_places(workspace, [*rest, (effect, again.shape)]):
                yield reshaped(workspace, [*choices[:k], (effect, again.shape), *choices[k + 1 :]])
    if workspace.dataset.rows > MANY_ROWS or not 2 <= len(choices) <= MOST_EXCHANGED + 1:
        return
    yield from _other_maps(workspace, choices, given)
    for i in range(len(choices)):
        for j in range(i + 1, len(choices)):
            names = {choices[i][0].name, choices[j][0].name}
            rest = [c for k, c in enumerate(choices) if k not in (i, j)]
            if not names & set(given) and coherent(rest):
                yield forward(workspace, rest, [e for e in effects if e.name not in names], given=given, limit=3)


def _other_maps(workspace: Workspace, choices: Sequence[Choice], given: Collection[str]) -> Iterator[list[Choice]]:
    """Yield the model with each map in all its other sizes, periods looked for anew beside it."""
    for k, (effect, shape) in enumerate(choices):
        if is_map(effect) and effect.name not in given:
            for other in workspace.maps(effect):
                if other != shape:
                    model = [*choices[:k], (effect, other), *choices[k + 1 :]]
                    yield _periods_anew(workspace, model, given)


def _periods_anew(workspace: Workspace, choices: Sequence[Choice], given: Collection[str]) -> list[Choice]:
    """Return the model with every period looked for again, beside the other effects as they are."""
    model = list(choices)
    for j, (effect, shape) in enumerate(model):
        if hasattr(shape, "period") and effect.name not in given:
            rest = [*model[:j], *model[j + 1 :]]
            back = workspace.background(rest)
            best = workspace.best_of_scan(effect, back)
            if best is not None and fits_places(workspace, [*rest, (effect, best.shape)]):
                model[j] = effect, refined(workspace, best, rest, back).shape
    return model if fits_places(workspace, model) else list(choices)


def one_of_alike(workspace: Workspace, choices: Sequence[Choice], *, given: Collection[str] = ()) -> list[Choice]:
    """Return the model without those effects of the reversal, or in time, whose like does nearly as well alone.

    Two of them together draw any course after a reversal, or over the measurement.
    """
    model = list(choices)
    for alike in (REVERSAL, SLOW):
        while sum(effect.name in alike for effect, _ in model) > 1:
            least = workspace.total(model) - SIMPLER
            places = [k for k, (own, _) in enumerate(model) if own.name in alike and own.name not in given]
            rests = [[*model[:k], *model[k + 1 :]] for k in places]
            trials = [reshaped(workspace, rest, alone=True) for rest in rests if coherent(rest)]
            trials = [trial for trial in trials if workspace.total(trial) > least]
            if not trials:
                break
            model = max(trials, key=workspace.total)
    return model


def _maps_instead(
    workspace: Workspace, choices: Sequence[Choice], k: int, given: Collection[str]
) -> Iterator[list[Choice]]:
    """Yield the model with effect ``k``, a map, in any of its sizes, in the place of itself and one part of it."""
    own = choices[k][0]
    for j, (other, shape) in enumerate(choices if is_map(own) else ()):
        part = other.name in own.contains or (own.name == "backlash_map" and getattr(shape, "by_direction", False))
        if part and other.name not in given:
            rest = [c for i, c in enumerate(choices) if i not in (j, k)]
            if coherent(rest):
                fits = fitting(workspace, rest, own)
                yield from ([*rest, (own, size)] for size in workspace.maps(own) if fits(size))


def _fits(workspace: Workspace, choices: Sequence[Choice]) -> bool:
    """Return whether repeats of every reading say that a model lacks nothing; of some, they leave the others open."""
    if workspace.dataset.has_repeats and (workspace.dataset.cell < 0).any():
        return False
    p = lack_of_fit_of_means(workspace, choices)
    return p is not None and p > FITS


def simplified(
    workspace: Workspace, choices: Sequence[Choice], effects: Sequence[Effect], *, given: Collection[str] = ()
) -> list[Choice]:
    """Return the model with simpler effects where they do nearly as well: the simplest that explains the data wins.

    Each effect is tried against its special cases, and each map alone against the map with a special case beside it:
    the map alone wins where it lacks little evidence, or where repeats say that it lacks nothing. Of two effects of
    the reversal, or two slow ones, one goes where the other does nearly as well alone.
    """
    model = one_of_alike(workspace, backward(workspace, choices, given=given), given=given)
    changed = True
    while changed:
        changed, value = False, workspace.total(model)
        for k, (own, _) in enumerate(model):
            if own.name in given:
                continue
            rest = [*model[:k], *model[k + 1 :]]
            names = {effect.name for effect, _ in rest}
            inner = [e for e in effects if e.name in own.contains and e.name not in names and e.name != "offset"]
            trials = [forward(workspace, rest, [e], given=given, limit=1) for e in inner]
            if is_map(own):
                for j, (other, _) in enumerate(model):
                    if other.name in own.contains and other.name not in given:
                        less = [*(c for i, c in enumerate(model) if i not in (j, k))]
                        trials.append(forward(workspace, less, [own], given=given, limit=1))
            trials = [t for t in trials if coherent(t) and workspace.total(t) > value - SIMPLER]
            trials = trials or [t for t in _maps_instead(workspace, model, k, given) if _fits(workspace, t)]
            if trials:
                model, changed = max(trials, key=workspace.total), True
                break
    return model
