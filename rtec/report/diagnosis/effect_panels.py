"""What is drawn of each effect: which readings, over what, and the part of the model that they are drawn with."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from rtec.dataset.dataset import Dataset
from rtec.effects import Conditions, Floats, Over
from rtec.inference.model import Model, Term
from rtec.report.diagnosis.readings import (
    Abscissa,
    Mask,
    Way,
    abscissas,
    clock,
    phase,
    position_label,
    ways,
)
from rtec.report.palette import FORWARD, GREEN, PURPLE
from rtec.units import symbol

MOST_PANELS = 6
"""Of one figure, each with what is left below it."""
_SUMS = frozenset({Over.VELOCITY, Over.REVERSAL})
"""Curves of speed and loops of reversals are seen as a whole: friction is one curve, whatever it is made of."""
_FEW_TURNS = 4
"""Periods over the travel above which one period is drawn, not the travel."""
_DISTANCES, _SHORT = 8.0, {True: 0.1, False: 0.5}
"""How many distances of decay are drawn after a reversal, where they are a smaller share of the way than this: of a
log, whose loops can be seen, and of readings at rest."""
_COLOURS = (FORWARD, GREEN, PURPLE)
"""Of the thirds of an axis."""
_GROW = frozenset({"refraction", "thermal_growth", "warm_up_growth"})
"""In proportion to position, too: the near and the far end are drawn apart."""
_SLOW = frozenset({Over.TIME, Over.TEMPERATURE, Over.RUN})
_INSTEAD = ("position", "velocity", "time")
"""What an effect is drawn over where what it depends on is not in the data or never changes."""
_REVERSALS = 12
"""Of a path: more of them would cover each other."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Panel:
    """Effects that one picture shows together."""

    terms: tuple[Term, ...]
    """The effects."""
    over: Abscissa
    """What they are drawn over, one value for each reading."""
    part: Floats
    """What they contribute together, shape (rows,), in the observed unit inside; of what grows with position, in the
    middle of each section."""
    rows: Mask
    """Readings that the picture shows, shape (rows,)."""
    groups: tuple[Way, ...]
    """Readings that are drawn alike: of one direction, or of one part of the axis."""
    by_group: bool = True
    """Whether the model has a curve for each group; what time and heat do is one curve."""
    is_path: bool = False
    """Whether readings are joined in their order, as loops are."""
    period: float | None = None
    """Of a wave that is drawn over one period, in position units; None for anything else."""


def effect_panels(dataset: Dataset, model: Model) -> list[Panel]:
    """Return how the effects of a model are looked at, those that contribute most, in the order of the model.

    Terms that are not fitted are left out.

    Returns
    -------
    list
        At most ``MOST_PANELS``.
    """
    groups: dict[object, list[Term]] = {}
    for term in model.terms:
        if term.fitted:
            groups.setdefault(term.effect.over if term.effect.over in _SUMS else id(term), []).append(term)
    found = [_panel(dataset, tuple(terms)) for terms in groups.values()]
    most = sorted(range(len(found)), key=lambda k: -float(np.std(found[k].part)))[:MOST_PANELS]
    return [found[k] for k in sorted(most)]


def _panel(dataset: Dataset, terms: tuple[Term, ...]) -> Panel:
    c = dataset.coordinates
    part = np.sum([term.component(dataset) for term in terms], axis=0)
    everything = np.ones(c.rows, dtype=np.bool_)
    period = terms[0].period
    if period is not None and _FEW_TURNS * period < c.span:
        return Panel(
            terms=terms, over=phase(c, period), part=part, rows=everything, groups=tuple(ways(c)), period=period
        )
    over = terms[0].effect.over
    if over is Over.REVERSAL:
        return _loop(c, terms, part, everything)
    groups = tuple(ways(c))
    if grows := terms[0].name in _GROW and dataset.resample is None:
        groups = _sections(c)
        part = terms[0].contribution(_in_the_middle(c, groups))
    return Panel(
        terms=terms,
        over=_abscissa(c, terms[0]),
        part=part,
        rows=everything,
        groups=groups,
        by_group=grows or over not in _SLOW,
    )


def _sections(c: Conditions) -> tuple[Way, ...]:
    edges = c.position.min() + c.span * np.arange(4) / 3.0
    unit = symbol(c.position_unit)
    section = np.clip(np.searchsorted(edges, c.position, side="right") - 1, 0, 2)
    looks = zip(range(3), _COLOURS, "sod", ("-", "--", ":"), strict=True)
    found = [
        Way(label=f"{edges[k]:.4g} to {edges[k + 1]:.4g} {unit}", colour=colour, marker=marker, dash=dash,
            rows=section == k)
        for k, colour, marker, dash in looks
    ]  # fmt: skip
    return tuple(way for way in found if way.rows.any())


def _in_the_middle(c: Conditions, groups: tuple[Way, ...]) -> Conditions:
    """Return the conditions with each reading in the middle of its section: what is left there is a curve."""
    place = c.position.copy()
    for group in groups:
        place[group.rows] = float(c.position[group.rows].mean())
    return replace(c, position=place)


def _abscissa(c: Conditions, term: Term) -> Abscissa:
    """Return what the effect depends on, or the first of all else that changes where there is no column of it."""
    known, over = {one.name: one for one in reversed(abscissas(c))}, term.effect.over
    order = Abscissa(name="order", label="readings in their order", values=c.order)
    if over is Over.TEMPERATURE and getattr(term.shape, "lag", 0.0) > 0.0:
        over = Over.TIME  # what lags behind makes a loop over its own temperature
    if over is Over.TIME or (over is Over.POSITION and c.time_is_coordinate):
        return clock(c)
    if over is Over.RUN:
        return order
    sensor = getattr(term.shape, "sensor", "temperature") if over is Over.TEMPERATURE else over.value
    return next((known[name] for name in (sensor, *_INSTEAD) if name in known), order)


def _loop(c: Conditions, terms: tuple[Term, ...], part: Floats, everything: Mask) -> Panel:
    """Return what happens after a reversal: close to it where it is over soon, else the loop over position."""
    gone = {one.name: one for one in abscissas(c)}.get("since_reversal")
    reach = _DISTANCES * max((getattr(term.shape, "distance", 0.0) for term in terms), default=0.0)
    if gone is not None and 0.0 < reach < _SHORT[c.moving] * float(gone.values.max()):
        return Panel(terms=terms, over=gone, part=part, rows=gone.values <= reach, groups=tuple(ways(c)))
    if not c.moving or c.direction is None:
        return Panel(terms=terms, over=_abscissa(c, terms[0]), part=part, rows=everything, groups=tuple(ways(c)))
    place = Abscissa(name="position", label=position_label(c), values=c.position)
    return Panel(terms=terms, over=place, part=part, rows=_few_loops(c, part), groups=tuple(ways(c)), is_path=True)


def _few_loops(c: Conditions, part: Floats) -> Mask:
    """Return a stretch of the log with a few reversals: that in which the loops are widest."""
    way = np.zeros(c.rows) if c.direction is None else c.direction
    moving = np.flatnonzero(way)
    turns = moving[1:][way[moving[1:]] != way[moving[:-1]]]
    shown = np.zeros(c.rows, dtype=np.bool_)
    if turns.size <= _REVERSALS:
        return ~shown
    ends = np.concatenate([[0], turns, [c.rows]])
    stretches = [slice(ends[k], ends[k + _REVERSALS + 1]) for k in range(0, turns.size - _REVERSALS + 1, _REVERSALS)]
    shown[max(stretches, key=lambda rows: float(np.std(part[rows])))] = True
    return shown
