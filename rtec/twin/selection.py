"""Which effects belong in a model: forward with every form of each effect, backward, and by exchange."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.optimize import minimize_scalar

from rtec.effects import Effect, Observable, Shape
from rtec.effects.frequency_grid import stated_periods
from rtec.twin.score import Background
from rtec.twin.workspace import WORTH_ADDING, Candidacy, Choice, Workspace, is_map, scan_cost

MOST_EFFECTS = 12
MOST_OF_A_KIND = 6
"""Families of periods that a model may hold."""
MOST_STEPS_IN_TIME = 2
"""Lost counts more often than that explain anything; then something else is wrong."""
REFINED = 5
"""So many of the best candidates of a scan are looked at in all their forms."""
SHARE_OF_PLACES = 0.55
"""Functions of position with more parameters than this share of the places fit anything: nothing is left to test."""
SAME_LINE = 0.005
"""Share by which the period of a line may differ from a fraction of a family's and still be its harmonic."""
NEXT_HARMONICS = 3
"""A line so few harmonics beyond a family belongs to it."""
SHARE_OF_ROWS = 0.25
"""Parameters for each reading, at most, where no repeats say what noise is."""
MANY_ROWS = 2000
MOST_PLAIN = 4
SIMPLER = 6.0
"""Evidence that a model may lack against one that is less simple."""
REVERSAL = ("backlash", "backlash_map", "windup")
"""Effects that differ by direction."""
EXCHANGES = 4
MOST_EXCHANGED = 4
"""Without repeats a larger model is not tried by exchange: what is left of it is decided by held-out error."""
OTHER_LINES = 0.2
"""Share of the strongest line's gain that the other lines of a longer period have to bring."""
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
            options={"xatol": 1e-3 * (tunable.high - tunable.low), "maxiter": 25},
        )
        if found.fun < lack(getattr(shape, tunable.name)):
            shape = replace(shape, **{tunable.name: float(found.x)})
    return shape


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
            best = workspace.best_of_scan(effect, own, _fitting(workspace, choices, effect))
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


def _fitting(workspace: Workspace, choices: Sequence[Choice], effect: Effect) -> Callable[[Shape], bool]:
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
        scanned = workspace.best_of_scan(effect, back, _fitting(workspace, rest, effect)) if is_map(effect) else None
        for start in (best, scanned):
            if start is not None and fits_places(workspace, [*rest, (effect, start.shape)]):
                found = refined(workspace, start, rest, back)
                best = found if found.evidence > best.evidence else best
        model[k] = effect, best.shape
    return model


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


def simplified(
    workspace: Workspace, choices: Sequence[Choice], effects: Sequence[Effect], *, given: Collection[str] = ()
) -> list[Choice]:
    """Return the model with simpler effects where they do nearly as well: the simplest that explains the data wins.

    Each effect is tried against its special cases, and each map alone against the map with a special case beside it.
    """
    model = list(choices)
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
            if trials:
                model, changed = max(trials, key=workspace.total), True
                break
    return model


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
        return forward(workspace, found, library, given=given, watch=watch)
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
