"""A curve over what is left, where nothing has a name for it: over which quantity, how sure, and what it is like.

A learned curve is no name. It competes by the same evidence as effects do, and has to lower the error held out.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rtec.dataset.dataset import Dataset
from rtec.effects import Floats, Shape
from rtec.effects.conditions import Conditions
from rtec.effects.curve import Curve, CurveShape, curve_columns
from rtec.effects.protocol import own_shape
from rtec.effects.quantities import quantity_of, unit_of
from rtec.inference.answer import EQUAL
from rtec.inference.chessboard import board_of, gain_between, held_out_residual
from rtec.inference.colour import Colour
from rtec.inference.described import descriptions
from rtec.inference.finding import Finding
from rtec.inference.model import Model, Term
from rtec.inference.probes import Probe, is_index
from rtec.inference.results import LearnedCurve
from rtec.inference.rules import WORTH
from rtec.inference.scored import Judge, Scored
from rtec.inference.space import Choice

_INSIDE = 1e-6
"""Share of an effect that a curve may miss where it can say all that the effect does."""
_PROMISING, _FEW = 5, 4
"""Curves of which all nodes are tried, and of how many nodes each is looked at first."""
_ROUNDS = 3
"""Times the nodes of a curve are looked at, each beside a noise that knows the curve better."""
_PAIRED = ("position", "time", "velocity", "load", "run")
_MOST_HEAT = 3
_SAME_PLACE = 0.02
"""Of the span, by which passes may begin at other places and still go from end to end."""
PLACES = 161
"""Of a curve, at which it is drawn and described."""


def learned_curve(found: Finding) -> LearnedCurve | None:
    """Return the curve that lowers what is left most, beside the effects found; None where no curve earns its place.

    Notes
    -----
    A curve takes the place of a map over the same quantity. It is worth five nats like an effect, its quantity and
    nodes paid for, and lowers the error held out by blocks.
    """
    judge, dataset = Judge(found.scout.space), found.scout.space.dataset
    begun = [c for c in found.scouted.choices if not isinstance(c[0], Probe) and c[0].name != Curve.name]
    before = judge.score(begun)
    given, board = found.search.given, board_of(dataset)
    few = {
        curve: max((_looked(judge, before, near, given, curve, coarse=True) for near in _noises(before)), key=_first)
        for curve in curves_for(dataset)
    }
    promising = sorted((curve for curve in few if few[curve]), key=lambda curve: -few[curve][0][0])[:_PROMISING]
    closer = [_closest(judge, before, few[curve][0][1], given, curve) for curve in promising]
    most = max(map(_score, closer), default=0.0)
    # of curves that do as well the one with fewer effects beside it
    for best in sorted(closer, key=lambda m: (m.score < most - EQUAL, len(m.choices), -m.score)):
        rest = judge.score([c for c in best.choices if c[0].name != Curve.name])
        if best.score < max(rest.score + WORTH, before.score - EQUAL):  # where it stands for a map it may do as well
            continue
        held = [held_out_residual(judge, one, board) for one in (rest, best)]
        if gain_between(judge, held[0], held[1], best, board).gain > 0.0:
            return _as_people_get_it(found, best)
    return None


def _closest(
    judge: Judge, before: Scored, choices: Sequence[Choice], given: Sequence[Choice], curve: Curve
) -> Scored:
    """Return the best model with a curve: each number of nodes is looked at under the noise of the best so far."""
    best = judge.score(choices, before)
    for _ in range(_ROUNDS):
        looked = [_looked(judge, before, near, given, curve)[0] for near in _noises(best)]
        better = max((judge.score(choices, best) for _, choices in looked), key=_score)
        if better.score <= best.score:
            break
        best = better
    return best


def _noises(model: Scored) -> tuple[Scored, Scored]:
    """Return a model with its noise, and with white noise: what a curve lacks passes for slow noise otherwise."""
    return model, replace(model, colour=Colour())


def _looked(
    judge: Judge, before: Scored, near: Scored, given: Sequence[Choice], curve: Curve, *, coarse: bool = False
) -> list[tuple[float, list[Choice]]]:
    """Return scores under the noise of a model, and the model before with a curve, best first; or a few of them."""
    kept = [[c for c in before.choices if c in given or not over(c, curve)] for over in (_same_map, _same_form)]
    shapes = curve.shapes(judge.space.dataset.conditions)
    found = []
    for beside in kept[: 1 if kept[0] == kept[1] else 2]:
        for shape in _few_of(shapes) if coarse else shapes:
            choices: list[Choice] = [*beside, (curve, shape)]
            found.append((judge.quickly(choices, near), choices))
    return sorted(found, key=lambda item: -item[0])


def _few_of(shapes: Sequence[CurveShape]) -> Sequence[CurveShape]:
    """Return some of the numbers of nodes; of two quantities every other one along each of them."""
    if not shapes or not shapes[0].across:
        return [*shapes[: -1 : max(1, len(shapes) // _FEW)], *shapes[-1:]]
    one, two = (
        {len(nodes) for nodes in sides} for sides in zip(*((s.nodes, s.nodes_across) for s in shapes), strict=True)
    )
    kept = [set(sorted(counts)[:: 2 if len(counts) > 2 else 1]) for counts in (one, two)]
    return [s for s in shapes if len(s.nodes) in kept[0] and len(s.nodes_across) in kept[1]]


def curves_for(dataset: Dataset) -> list[Curve]:
    """Return the curves that data could show: over each quantity, each by direction, and over two.

    Examples
    --------
    >>> from rtec.dataset.load import load_dataset
    >>> from rtec.metrology import measurement_of_columns
    >>> x = [0.0, 1, 2, 3, 4, 5, 6, 7, 8, 9] * 2
    >>> data = load_dataset(measurement_of_columns({"target_mm": x, "deviation_um": range(20)}))
    >>> [curve.text for curve in curves_for(data)]
    ['position']
    """
    c = dataset.conditions
    heat = list(c.temperatures)[:_MOST_HEAT]
    others = [name for name, values in c.others.items() if not is_index(values, c)]
    single = [name for name in ("position", "time", "velocity", "acceleration", "load", "pressure", "humidity")
              if quantity_of(c, name) is not None]  # fmt: skip
    single += [*heat, *others, *_phases(c)]
    gone = [] if _is_place(c) else ["since_reversal"]
    by_way = ("position", *gone, "time", "run", *_phases(c), *heat, *others)
    texts = [*single, *(f"{name}*direction" for name in by_way)]
    paired = [name for name in (*_PAIRED, *gone) if quantity_of(c, name) is not None] + heat + others[:_MOST_HEAT]
    for one, two in itertools.combinations(paired, 2):
        if "run" not in (one, two):
            texts += [f"{one}*{two}", f"{one}*{two}*direction"]
        elif "time" not in (one, two) and c.both_directions:  # another map in each pass is what noise is like, too
            texts.append(f"{one}*{two}")
    texts += [
        f"{phase}*{slow}" for phase in _phases(c) for slow in ("time", *heat) if quantity_of(c, slow) is not None
    ]
    curves = [Curve(text) for text in dict.fromkeys(texts)]
    return [curve for curve in curves if curve.untestable(c) is None]


def _phases(c: Conditions) -> list[str]:
    return [
        name for name in ("phase_of_pitch", "phase_of_signal", "phase_of_turn") if quantity_of(c, name) is not None
    ]


def _same_map(choice: Choice, curve: Curve) -> bool:
    """Return whether an effect is a smooth map over what a curve is over."""
    effect, _ = choice
    return effect.is_map and "position" in curve.quantities and (curve.by_direction or effect.name != "backlash_map")


def _same_form(choice: Choice, curve: Curve) -> bool:
    """Return whether an effect is a map or a wave over what a curve is over: a sum of such resembles anything."""
    return _same_map(choice, curve) or (choice[0].is_wave and "position" in curve.quantities)


def _is_place(c: Conditions) -> bool:
    """Return whether the way since a reversal says no more than place and direction, as of passes from end to end."""
    if c.since_reversal is None or c.direction is None or c.time_is_coordinate:
        return True
    return all(
        float(np.ptp(c.since_reversal[rows] - way * c.position[rows])) <= _SAME_PLACE * c.span
        for way in (1.0, -1.0)
        if (rows := c.direction == way).any()
    )


def _first(looked: Sequence[tuple[float, list[Choice]]]) -> float:
    return looked[0][0] if looked else -math.inf


def _score(model: Scored) -> float:
    return model.score


def _as_people_get_it(found: Finding, best: Scored) -> LearnedCurve:
    """Return a curve fitted to all rows, with what it says."""
    search = found.search
    judge = Judge(search.space)
    model = judge.score(best.choices, best)
    fitted = without_what_effects_hold(found.dataset, found.fitted(model))
    term = next(t for t in fitted.terms if t.name == Curve.name)
    shape = own_shape(term.shape or Shape(), CurveShape)
    at, across, values, errors = curve_values(term, judge.space.dataset.conditions)
    ways = (1, -1) if shape.by_direction else (0,)
    unit, factor = found.dataset.units.shown
    weights = _crowding(judge.space.dataset.conditions, shape, at)
    said: list[str] = []
    if not shape.across:
        for k, way in enumerate(ways):
            name = {1: "forward: ", -1: "backward: ", 0: ""}[way]
            place = unit_of(judge.space.dataset.conditions, shape.over)
            like = descriptions(at, values[k, 0] * factor, errors[k, 0] * factor, weights, (place, unit))
            said += [name + text for text in like]
    return LearnedCurve(
        shape=shape,
        model=fitted,
        rms=found.dataset.rms(judge.left(model)),
        rms_heldout=found.dataset.rms(held_out_residual(judge, model, board_of(found.dataset)))
        if found.heldout is None
        else found.rms_heldout(model),
        ways=ways,
        at=at,
        across=across,
        values=values,
        errors=errors,
        descriptions=tuple(said),
    )


def without_what_effects_hold(dataset: Dataset, model: Model) -> Model:
    """Return the same model with a curve that holds nothing of what an effect beside it can say.

    A curve over speed can say all that a viscous friction does: a fit splits the two at will. What can be the
    effect's is the effect's.
    """
    k = next(i for i, term in enumerate(model.terms) if term.name == Curve.name)
    curve = model.terms[k]
    table = dataset.columns(curve.effect, curve.shape or Shape())
    ones = np.ones((dataset.rows, 1))
    whole = np.hstack([table, ones])
    terms, held = list(model.terms), []
    for i, term in enumerate(model.terms):
        if i != k and term.shape is not None:
            columns = dataset.columns(term.effect, term.shape)
            inside = np.linalg.lstsq(whole, columns, rcond=1e-9)[0]
            left = columns - whole @ inside
            if float((left**2).sum()) < _INSIDE * float(((columns - columns.mean(axis=0)) ** 2).sum()):
                held.append((i, columns, inside[:-1]))
    if not held:
        return model
    columns = np.hstack([one for _, one, _ in held])
    inside = np.hstack([one for _, _, one in held])
    amplitudes = np.asarray(curve.amplitudes)
    share = np.linalg.lstsq(np.hstack([columns, ones]), table, rcond=1e-9)[0][:-1]
    kept = np.eye(table.shape[1]) - inside @ share
    covariance = None
    if curve.covariance is not None:
        covariance = tuple(map(tuple, (kept @ np.asarray(curve.covariance) @ kept.T).tolist()))
    errors = (
        None if covariance is None else tuple(math.sqrt(max(covariance[j][j], 0.0)) for j in range(len(covariance)))
    )
    terms[k] = replace(curve, amplitudes=tuple((kept @ amplitudes).tolist()), covariance=covariance, errors=errors)
    given, moved = 0, share @ amplitudes
    for i, one, _ in held:
        own = moved[given : given + one.shape[1]]
        given += one.shape[1]
        terms[i] = replace(terms[i], amplitudes=tuple((np.asarray(terms[i].amplitudes) + own).tolist()), errors=None,
                           covariance=None)  # fmt: skip
    changed = model.with_terms(terms)
    shift = float(np.mean(model.predict(dataset) - changed.predict(dataset)))
    return replace(changed, datum=changed.datum + shift) if abs(shift) > 0.0 else changed


def curve_values(term: Term, conditions: Conditions) -> tuple[Floats, Floats, Floats, Floats]:
    """Return places along both quantities of a fitted curve, its values there and their standard errors.

    Shapes (places,), (few,), (ways, few, places) twice; the mean over the places is taken out.
    """
    shape = own_shape(term.shape or Shape(), CurveShape)
    at = np.linspace(shape.nodes[0], shape.nodes[-1], PLACES)
    across = np.linspace(shape.nodes_across[0], shape.nodes_across[-1], 3) if shape.across else np.zeros(1)
    amplitudes = np.asarray(term.amplitudes or ())
    covariance = np.asarray(term.covariance) if term.covariance is not None else np.zeros((amplitudes.size,) * 2)
    ways = (1.0, -1.0) if shape.by_direction else (0.0,)
    values, errors = [], []
    for way in ways:
        for place in across:
            columns = curve_columns(shape, at, np.full(PLACES, place), np.full(PLACES, way))
            columns = columns - columns.mean(axis=0) if not shape.across else columns
            values.append(columns @ amplitudes)
            errors.append(np.sqrt(np.maximum(np.einsum("ik,kl,il->i", columns, covariance, columns), 0.0)))
    size = len(ways), across.size, PLACES
    return at, across, np.array(values).reshape(size), np.array(errors).reshape(size)


def _crowding(conditions: Conditions, shape: CurveShape, at: Floats) -> Floats:
    """Return the share of the readings near each place of a curve, shape (places,)."""
    values = quantity_of(conditions, shape.over)
    if values is None:
        return np.full(at.size, 1.0 / at.size)
    nearest = np.clip(np.searchsorted((at[1:] + at[:-1]) / 2.0, values), 0, at.size - 1)
    found = np.bincount(nearest, minlength=at.size).astype(np.float64)
    spread = np.convolve(found, np.ones(9) / 9.0, mode="same")
    weights: Floats = spread / spread.sum()
    return weights
