"""From a model of effects to a predictor: what of it depends on position and direction, as a table on a fine grid.

What follows the heat of the machine is in it as it is on a machine of a stated warmth, and never left out unasked.

A file holds either of the two: a trained predictor, or a model of effects.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rtec.dataset.dataset import Dataset
from rtec.effects import LIBRARY, Conditions, Floats, Library, Units
from rtec.effects.own import FunctionEffect
from rtec.errors import ArgumentError
from rtec.inference.model import Model
from rtec.inference.model_file import read_model
from rtec.inference.warmth import Warmth, check_warmth, heat_terms, mean_warmth
from rtec.io import read_toml
from rtec.predictors import (
    FORWARD,
    REVERSE,
    BidirectionalTable,
    Cautious,
    Predictor,
    is_predictor_file,
    read_predictor,
)

POINTS_A_WAVE = 50
"""Of the table's grid: joined by straight lines, the shortest wave is followed within 0.2 % of its amplitude."""
FEWEST_POINTS, MOST_POINTS = 5_000, 100_000
UNSEEN = 1e-3
"""Of the size of somebody's function: what a table may be off between its places without a word."""
FEWEST_POINTS_A_WAVE = 10
"""Below, a wave is left out: it would be followed by no better than 5 % of its amplitude."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LeftOut:
    """An effect of a model that a predictor of position and direction cannot hold."""

    effect: str
    why: str


def static_part(
    model: Model, position_mm: Floats, direction: int, warmth: Warmth | None = None
) -> tuple[Floats, tuple[LeftOut, ...]]:
    """Return the part of a model that depends on position and direction, its datum included.

    Parameters
    ----------
    model
        Of a deviation in mm over positions in mm, every effect fitted.
    position_mm
        Shape (n,), in mm.
    direction
        +1 forward or -1 reverse: every position counts as approached from far, so that a windup is built up.
    warmth
        Of the machine; a model with effects of heat needs it.

    Returns
    -------
    error_mm, left out
        At each position, shape (n,), in mm; and the effects that have no part in it.

    Raises
    ------
    ArgumentError
        A model of something else, an effect without numbers, or one of heat where the warmth is not known.

    Examples
    --------
    >>> from rtec.effects import Shape, Units, effect_named
    >>> from rtec.inference.model import Term
    >>> names = ("backlash", "drift")
    >>> terms = tuple(Term(effect=effect_named(name), shape=Shape(), amplitudes=(0.002,)) for name in names)
    >>> model = Model(observe="deviation", units=Units("mm", "mm", "s"), terms=terms, datum=0.01)
    >>> error_mm, left_out = static_part(model, np.array([0.0, 5.0]), -1)
    >>> error_mm.round(9).tolist(), left_out[0].effect
    ([0.009, 0.009], 'drift')
    """
    check_of_positions(model)
    check_warmth(model, warmth)
    conditions = Conditions(
        position=position_mm,
        position_unit="mm",
        run=np.ones(position_mm.size, dtype=np.int64),
        direction=np.full(position_mm.size, float(direction)),
        since_reversal=np.full(position_mm.size, np.inf),
    )
    total = np.full(position_mm.size, model.datum)
    left_out = []
    of_heat = heat_terms(model)
    for term in model.terms:
        if term in of_heat and warmth is not None:
            total += warmth.contribution(term, conditions)
            continue
        if term.effect.in_time:
            left_out.append(LeftOut(effect=term.name, why="it changes with time or temperature"))
            continue
        try:
            total += term.contribution(conditions)
        except ArgumentError:  # the effect misses a column: that of a velocity, say
            left_out.append(LeftOut(effect=term.name, why=f"it needs {term.effect.needs}"))
    return total, tuple(left_out)


def check_of_positions(model: Model) -> None:
    """Refuse a model of which no table of positions can be made.

    Raises
    ------
    ArgumentError
        It is none of a deviation in mm over positions in mm, or has an effect without numbers.

    Examples
    --------
    >>> from rtec.effects import Units
    >>> over_time = Model(observe="deviation", units=Units("mm", "s", "s"), terms=())
    >>> check_of_positions(over_time)  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    rtec.errors.ArgumentError: model: deviation in mm over time; use a deviation in mm over ...
    """
    units = model.units
    if (model.observe, units.observed, units.position) != ("deviation", "mm", "mm"):
        over = "time" if units.position == "s" else f"positions in {units.position}"
        found = f"{model.observe} in {units.observed} over {over}"
        raise ArgumentError("model", found, "a deviation in mm over positions in mm")
    for term in model.terms:
        if not term.fitted:
            hint = "rtec diagnose DATA --save MODEL.toml fits it"
            raise ArgumentError("model", f"{term.name} without numbers", "a fitted model", hint)


def predictor_of_model(
    model: Model, low_mm: float, high_mm: float, warmth: Warmth | None = None
) -> tuple[BidirectionalTable, tuple[LeftOut, ...]]:
    """Return the table of what a model predicts in both directions, and what had to be left out of it.

    Parameters
    ----------
    model, warmth
        As for ``static_part``.
    low_mm, high_mm
        Range of the table; beyond it, the error of its nearest end is held.

    Returns
    -------
    table, left out
        The predictor, and the effects that are not in it: those that change with time or speed, and waves so short
        that the grid could not follow them.

    Raises
    ------
    ArgumentError
        As for ``static_part``.

    Examples
    --------
    >>> from rtec.effects import Shape, Units, effect_named
    >>> from rtec.inference.model import Term
    >>> backlash = Term(effect=effect_named("backlash"), shape=Shape(), amplitudes=(0.08,))
    >>> model = Model(observe="deviation", units=Units("mm", "mm", "s"), terms=(backlash,))
    >>> table, left_out = predictor_of_model(model, 0.0, 100.0)
    >>> table.error_mm([50.0, 50.0], [1, -1]).tolist(), left_out
    ([0.04, -0.04], ())
    """
    span = high_mm - low_mm
    waves = {term: np.inf if term.period is None else term.period / term.harmonics for term in model.terms}
    fine = [term for term, wave in waves.items() if wave * MOST_POINTS < FEWEST_POINTS_A_WAVE * span]
    shortest = min((wave for term, wave in waves.items() if term not in fine), default=span)
    points = min(max(round(span / shortest * POINTS_A_WAVE), FEWEST_POINTS), MOST_POINTS)
    kept = model.with_terms(term for term in model.terms if term not in fine)
    own = kept.with_terms(term for term in kept.terms if isinstance(term.effect, FunctionEffect))
    while (off_mm := _off_between(own, low_mm, high_mm, points, warmth)) > 0.0 and 2 * points <= MOST_POINTS:
        points *= 2
    grid = np.linspace(low_mm, high_mm, points + 1)
    (forward_mm, left_out), (reverse_mm, _) = (static_part(kept, grid, way, warmth) for way in (FORWARD, REVERSE))
    table = BidirectionalTable.on_grid(grid, forward_mm, reverse_mm)
    if off_mm > 0.0:
        why = f"it changes faster than a table can follow, which is off by {1e3 * off_mm:.3g} µm at most"
        left_out = (*left_out, *(LeftOut(effect=name, why=why) for name in own.names))
    too_fine = [LeftOut(effect=term.name, why=f"its waves of {waves[term]:.3g} mm are too short") for term in fine]
    return table, (*left_out, *too_fine)


def _off_between(own: Model, low_mm: float, high_mm: float, points: int, warmth: Warmth | None) -> float:
    """Return how far straight lines between places are from somebody's functions; 0 where that is not seen."""
    worst = 0.0
    for way in (FORWARD, REVERSE) if own.terms else ():
        fine = static_part(own, np.linspace(low_mm, high_mm, 2 * points + 1), way, warmth)[0]
        off = float(np.abs(fine[1::2] - (fine[:-1:2] + fine[2::2]) / 2.0).max())
        worst = max(worst, off if off > UNSEEN * float(np.ptp(fine)) else 0.0)
    return worst


def predictor_at_mean(
    model: Model, low_mm: float, high_mm: float, dataset: Dataset
) -> tuple[BidirectionalTable, tuple[LeftOut, ...]]:
    """Return the table of a model at the mean warmth of the readings that it was found in, as `predictor_of_model`.

    Of an effect of heat, what is left out is how it differs from that: by how much is said.
    """
    warmth = mean_warmth(model, dataset)
    table, left_out = predictor_of_model(model, low_mm, high_mm, warmth)
    changes = []
    for term in heat_terms(model):
        changes_mm = term.contribution(dataset.conditions) - warmth.contribution(term, dataset.conditions)
        rms_mm = float(np.sqrt(np.mean(changes_mm**2)))
        why = f"only its mean is in the table; over the readings it changes by {1e3 * rms_mm:.3g} µm RMS"
        changes.append(LeftOut(effect=term.name, why=why))
    return table, (*left_out, *changes)


def axis_of_file(path: Path) -> int | None:
    """Return the number of the axis that a file says it is of; None where it says none.

    Raises
    ------
    RtecError
        As for `predictor_of_file`.
    """
    return read_predictor(path).axis if is_predictor_file(path) else None


def predictor_of_file(
    path: Path, low_mm: float, high_mm: float, *, cautious: bool = False, library: Library = LIBRARY
) -> tuple[Predictor, tuple[LeftOut, ...]]:
    """Return the predictor of a TOML file.

    Parameters
    ----------
    path
        Written by ``rtec train`` or ``rtec diagnose --save``; the latter states no interval.
    low_mm, high_mm
        A model of effects is tabled over the part of this range that it was fitted to, where it says so.
    cautious
        Whether corrections are reduced to what the predictor's interval supports.
    library
        With the effects of one's own that a model names.

    Returns
    -------
    predictor, left out
        And the effects of a model that it cannot hold.

    Raises
    ------
    RtecError
        A file that cannot be read, a model that predicts no deviation or follows the heat of the machine, or caution
        with a file that has no interval.
    """
    left_out: tuple[LeftOut, ...] = ()
    if is_predictor_file(path):
        known = read_predictor(path)
        predictor, interval_mm = known.of_position, known.interval_mm
    else:
        clock = read_toml(path).get("clock")
        model = read_model(path, Units("mm", "mm", clock if isinstance(clock, str) else "s"), library)
        if of_heat := heat_terms(model):
            found = f"a model with {of_heat[0].name}, which follows the heat of the machine"
            allowed = f"a table for one warmth: rtec export {path.name} --csv, with --temperature or --at"
            raise ArgumentError(str(path), found, allowed)
        predictor, left_out = predictor_of_model(model, *_known_mm(model, low_mm, high_mm))
        interval_mm = math.inf if model.interval is None else model.interval
    if not cautious:
        return predictor, left_out
    if not math.isfinite(interval_mm):
        allowed = "a file with an interval, as rtec train writes it where enough places tell"
        raise ArgumentError("cautious", f"{path} without an interval", allowed)
    return Cautious(predictor=predictor, unsure_mm=interval_mm), left_out


def _known_mm(model: Model, low_mm: float, high_mm: float) -> tuple[float, float]:
    """Return the part of a range in which a model was measured; beyond it a slope or a map would go on for ever."""
    if model.range is None:
        return low_mm, high_mm
    low, high = max(low_mm, model.range[0]), min(high_mm, model.range[1])
    return (low, high) if low < high else model.range
