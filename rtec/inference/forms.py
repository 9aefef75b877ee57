"""What speaks against a name by the form that was fitted, and which forms may be one cause: one mapping, by effect.

An effect is its physics: its columns, its shapes, what it needs. That a wave of three cycles may as well be a bend,
or that a spike beside a wind-up is a backlash, is knowledge about names, and stands here.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, fields, replace
from functools import partial
from types import MappingProxyType
from typing import Any

import numpy as np

from rtec.effects import Conditions, CyclicShape, Effect, Floats, HeatShape, MapShape, Shape, WavesShape, effect_named
from rtec.effects._build_up import BuildsUp
from rtec.effects._smooth import TABLE_TARGETS, smooth_columns
from rtec.effects.backlash_map import ReversalMapShape
from rtec.effects.cyclic import closer_steps
from rtec.effects.lost_counts import StepShape
from rtec.effects.protocol import own_shape
from rtec.effects.reversal_spike import SpikeShape
from rtec.effects.stribeck import Stribeck
from rtec.effects.thermal_growth import GrowthShape
from rtec.effects.warm_up import WarmShape
from rtec.effects.warm_up_growth import WarmGrowthShape
from rtec.effects.windup import WindupShape, too_sparse, unseen_distances
from rtec.inference.wave_forms import (
    bends,
    crowded_waves,
    family_of_turn,
    no_cogging,
    no_eccentricity,
    no_family,
    parts_of_family,
    wave_doubt,
)

MOST_SWINGS, SWINGS_PLACES = 4.0, 400
"""Of a smooth curve, in cycles over the span, and places looked at: what the lead of screws and the straightness of
ways leave has one or two, and a wave of five cycles whose amplitude changes along the axis is none."""
UNBENT = 1e-20
"""Share of a curve's mean square that may be left of a straight line."""
FAR = 2.0
"""Spans beyond the axis from which on a fixed point is none: what moves alike everywhere is a shift."""
MOST_LAGS, LAGS_APART = 2, 3.0
"""Terms that may follow one sensor, as a housing and the spindle within do, and the ratio of their lags at least."""
TRANSIENT = 1 / 20
"""Of a log in motion: what dies out in less is the transient of its start, no heat."""
GRADUAL = 0.02
"""Of a log, over which a step is spread that a sudden one has to outdo; of a time halves and quarters of it, too."""
FEWEST_SPREAD = 4
"""Readings over which a step in time is spread at least: over fewer it is a step."""

_LEFT_OUT: ContextVar[frozenset[str]] = ContextVar("left_out", default=frozenset())


def is_asked(rule: str) -> bool:
    """Return whether a rule of the table in `rtec.inference.rules` is asked: all are, but those left out."""
    return rule not in _LEFT_OUT.get()


@contextmanager
def left_out(*rules: str) -> Iterator[None]:
    """Leave rules out, to measure what they are worth.

    Examples
    --------
    >>> with left_out("crowded"):
    ...     is_asked("crowded"), is_asked("misnamed")
    (False, True)
    """
    token = _LEFT_OUT.set(_LEFT_OUT.get() | set(rules))
    try:
        yield
    finally:
        _LEFT_OUT.reset(token)


def _nothing(*_: object) -> None:
    return None


def _no_shapes(*_: object) -> tuple[Shape, ...]:
    return ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Forms:
    """What is asked of the shapes of an effect and of their fits; what speaks against one says why, else None."""

    doubtful: Callable[[Conditions, Shape], str | None] = _nothing
    """Why data cannot bear out a shape, however well it fits."""
    suspects: Callable[[Conditions], Sequence[Shape]] = _no_shapes
    """Doubtful shapes that compete all the same: where one fits, no other effect is sure."""
    crowded: Callable[[Conditions, Shape, Sequence[Shape], float], str | None] = _nothing
    """Why a shape cannot stand beside others of the same effect, and a map that draws waves from a length on."""
    implausible: Callable[[Conditions, Shape, Floats], str | None] = _nothing
    """Why a fit is no such effect, whatever it explains, by its amplitudes."""
    misnamed: Callable[[Floats, Mapping[str, Floats]], str | None] = _nothing
    """Why a fit has another name beside others: by its amplitudes, and theirs by the names of effects."""
    softer: Callable[[Conditions, Shape], Sequence[Shape]] = _no_shapes
    """The same change spread over a while, which a sudden one has to outdo."""
    regrouped: Callable[[Conditions, Shape], Sequence[Shape]] = _no_shapes
    """Shapes that hold a part of one, in other company: single harmonics of a family, and theirs."""
    closer: Callable[[Conditions, Shape], Sequence[Shape]] = _no_shapes
    """Shapes beside one of those variants that stand for many."""
    joined: Callable[[Conditions, Shape, Shape], Sequence[Shape]] = _no_shapes
    """Shapes that hold both of two, which one cause may have: of this effect, or of that named in ``joins``."""
    joins: str = ""
    ranked: Callable[[Conditions], bool] = lambda conditions: True
    """Whether a search ranks it; else it is not identifiable from another effect, or found by other means."""
    contains: Collection[str] = ()
    """Simpler effects that are special cases of this one: where they explain the data, they win."""
    at_most: int = 1
    """How many of it a model may hold (several families of periods, steps at several moments)."""


def forms_of(effect: Effect) -> Forms:
    """Return what is known of the forms of an effect, without the rules that are left out.

    Examples
    --------
    >>> forms_of(effect_named("cyclic")).at_most, forms_of(effect_named("gravity")).at_most
    (3, 1)
    """
    found, without = FORMS.get(effect.name, _PLAIN), _LEFT_OUT.get()
    if not without:
        return found
    idle: dict[str, Any] = {f.name: f.default for f in fields(Forms) if f.name in without}
    return replace(found, **idle)


def finest_drawn(shape: Shape) -> float:
    """Return the shortest wave that the nodes of a map draw, of two of their steps; infinite for no map."""
    nodes = shape.nodes if isinstance(shape, MapShape) else ()
    return 2.0 * (nodes[-1] - nodes[0]) / (len(nodes) - 1) if nodes else np.inf


def _periodic(name: str, form: type[WavesShape], at_most: int) -> Forms:
    effect = effect_named(name)
    return Forms(
        doubtful=wave_doubt,
        suspects=partial(bends, form),
        crowded=crowded_waves,
        implausible=no_family,
        regrouped=partial(parts_of_family, effect),
        joined=partial(family_of_turn, effect),
        at_most=at_most,
    )


# maps


def swings(nodes: Sequence[float], values: Sequence[float] | Floats) -> float:
    """Return how often a curve swings over its span, in cycles: the RMS frequency of what a straight line leaves.

    Examples
    --------
    >>> round(swings(np.linspace(0.0, 1.0, 24), np.cos(np.linspace(0.0, 6.0 * np.pi, 24))), 1)
    3.0
    """
    share = np.linspace(0.0, 1.0, SWINGS_PLACES)
    at = nodes[0] + (nodes[-1] - nodes[0]) * share
    curve = smooth_columns(at, nodes) @ np.asarray(values, dtype=np.float64)
    rounding = UNBENT * float(np.mean(curve**2))
    ends = np.column_stack([np.ones_like(share), share])
    curve = curve - ends @ np.linalg.lstsq(ends, curve, rcond=None)[0]
    size = float(np.mean(curve**2))
    return float(np.sqrt(np.mean(np.gradient(curve, share) ** 2) / size) / (2.0 * np.pi)) if size > rounding else 0.0


def _no_map(conditions: Conditions, shape: Shape, amplitudes: Floats) -> str | None:
    """Return why a fit is no map: many nodes follow a wave whose amplitude changes along the axis."""
    nodes = own_shape(shape, MapShape).nodes
    cycles = swings(nodes, amplitudes)
    if cycles <= MOST_SWINGS or len(nodes) <= TABLE_TARGETS:  # so few nodes are a table
        return None
    return f"it changes as fast as a wave of {cycles:.0f} cycles along the axis, whose amplitude changes"


def _one_sided(conditions: Conditions, shape: Shape, other: Shape) -> Sequence[Shape]:
    """Return the one-sided maps: where one approach is right, a map of the axis had half of the other's error."""
    own = own_shape(shape, ReversalMapShape)
    return [replace(own, forward_right=right, backward_right=not right) for right in (True, False)]


# reversals


def _too_sparse(conditions: Conditions, shape: Shape) -> str | None:
    return None if conditions.moving else too_sparse(conditions)


def _opposed(amplitudes: Floats, others: Mapping[str, Floats]) -> bool:
    """Return whether a reversal error has the other sign than the constant one beside it."""
    beside = [values.mean() for name, values in others.items() if name in ("backlash", "backlash_map")]
    return bool(beside) and float(amplitudes.mean()) * float(np.sum(beside)) < 0.0


def _no_windup(amplitudes: Floats, others: Mapping[str, Floats]) -> str | None:
    """Return that beside a reversal error of the other sign the curve falls, and is a spike."""
    if "hysteresis" in others:
        return "it is what the hysteresis beside it is, with less memory"
    if "reversal_spike" in others:
        return "beside a reversal spike it is a backlash"
    return "beside this backlash it is a reversal spike" if _opposed(amplitudes, others) else None


def _no_spike(amplitudes: Floats, others: Mapping[str, Floats]) -> str | None:
    """Return that beside a reversal error of the other sign the curve grows, and is a wind-up."""
    if "windup" in others:
        return "beside a wind-up it is a backlash"
    return "beside this backlash it is a wind-up" if _opposed(amplitudes, others) else None


def _no_hysteresis(amplitudes: Floats, others: Mapping[str, Floats]) -> str | None:
    """Return that beside a wind-up it is one of two names for the same springs."""
    return "it is what the wind-up beside it is, with more memory" if "windup" in others else None


def _unseen_windups(conditions: Conditions) -> Sequence[Shape]:
    return [WindupShape(way, carried) for way in unseen_distances(conditions) for carried in (False, True)]


def _beside_its_rival(other: str, amplitudes: Floats, others: Mapping[str, Floats]) -> str | None:
    """Return that two causes of one turn are one: the second takes what the form of the first lacks."""
    return f"beside the {other.replace('_', ' ')} it is what the form of that lacks" if other in others else None


# heat and time


def _sensor_taken(conditions: Conditions, shape: Shape, others: Sequence[Shape], finest: float) -> str | None:
    own = own_shape(shape, HeatShape)
    lags = [theirs.lag for other in others if (theirs := own_shape(other, HeatShape)).sensor == own.sensor]
    if len(lags) >= MOST_LAGS or any(max(lag, own.lag) <= LAGS_APART * min(lag, own.lag) for lag in lags):
        return f"{own.sensor} is followed already"
    return None


def _no_growth(conditions: Conditions, shape: Shape, amplitudes: Floats) -> str | None:
    """Return why a growth and its shift at position zero are no growth about a fixed point.

    Examples
    --------
    >>> x = np.array([0.0, 1000.0])
    >>> c = Conditions(position=x, position_unit="mm", run=np.ones(2, dtype=np.int64))
    >>> free = GrowthShape(elsewhere=True)
    >>> _no_growth(c, free, np.array([1e-5, -2e-3])), _no_growth(c, free, np.array([1e-5, -0.05]))
    (None, 'its fixed point would lie beyond the axis')
    """
    if not (isinstance(shape, GrowthShape | WarmGrowthShape) and shape.elsewhere):
        return None
    growth, at_zero = amplitudes.tolist()
    middle = (float(conditions.position.max()) + float(conditions.position.min())) / 2.0
    off = abs(growth * middle + at_zero) / max(abs(growth), 1e-300)
    return None if off <= (FAR + 0.5) * conditions.span else "its fixed point would lie beyond the axis"


def _about_a_point(conditions: Conditions, shape: Shape, other: Shape) -> Sequence[Shape]:
    """Return a growth about a fixed point for one about zero and a shift beside it that follow one cause.

    Examples
    --------
    >>> c = Conditions(position=np.zeros(1), position_unit="mm", run=np.ones(1, dtype=np.int64))
    >>> [len(_about_a_point(c, GrowthShape("air"), HeatShape(sensor))) for sensor in ("air", "oil")]
    [1, 0]
    """
    own = own_shape(shape, GrowthShape)
    return (replace(own, elsewhere=True),) if other == HeatShape(own.sensor, own.lag) else ()


def _brief(conditions: Conditions, shape: Shape) -> str | None:
    """Return why a course is too short for heat."""
    brief = TRANSIENT * float(np.ptp(conditions.clock)) if conditions.moving else 0.0
    short = own_shape(shape, WarmShape).time_constant < brief
    return f"it dies out within {TRANSIENT:.0%} of the log, as a transient of its start does" if short else None


def _takes_time(conditions: Conditions, shape: Shape) -> str | None:
    return None if own_shape(shape, StepShape).over == 0.0 else "counts are lost at a moment, not over a while"


def _spread_out(conditions: Conditions, shape: Shape) -> Sequence[Shape]:
    """Return a step spread over a fiftieth of a log or of the time: what wanders there passes for a step, too."""
    if not (conditions.moving or conditions.time_is_coordinate):
        return ()
    moment, lasted = own_shape(shape, StepShape).moment, float(np.ptp(conditions.clock))
    least = FEWEST_SPREAD * lasted / conditions.rows
    overs = [GRADUAL * lasted / parts for parts in ((1,) if conditions.moving else (1, 2, 4))]
    return [StepShape(moment - over / 2.0, over) for over in overs if conditions.moving or over > least]


def _unseen_spikes(conditions: Conditions) -> Sequence[Shape]:
    return [SpikeShape(way) for way in unseen_distances(conditions)]


_PLAIN = Forms()
_NEVER_RANKED = Forms(ranked=lambda conditions: False)
_MAP = Forms(implausible=_no_map)
_HEAT = Forms(crowded=_sensor_taken, at_most=3)
FORMS: Mapping[str, Forms] = MappingProxyType(
    {
        "offset": _NEVER_RANKED,
        "curve": Forms(at_most=4),
        "quantisation": _NEVER_RANKED,
        "cosine": _NEVER_RANKED,
        "gravity": Forms(ranked=lambda conditions: conditions.position_unit != "mm"),
        "cyclic": replace(
            _periodic("cyclic", CyclicShape, 3), closer=closer_steps, contains=("eccentricity", "interpolation")
        ),
        "cogging": replace(_periodic("cogging", WavesShape, 4), implausible=no_cogging),
        "eccentricity": Forms(implausible=no_eccentricity),
        "pitch_map": replace(_MAP, contains=("offset", "scale", "cosine", "cyclic", "interpolation")),
        "force_map": replace(_MAP, contains=("force_offset", "gravity", "cogging")),
        "backlash_map": replace(_MAP, joined=_one_sided, joins="pitch_map", contains=("backlash", "windup")),
        "windup": Forms(doubtful=_too_sparse, suspects=_unseen_windups, misnamed=_no_windup),
        "reversal_spike": Forms(doubtful=_too_sparse, suspects=_unseen_spikes, misnamed=_no_spike),
        "hysteresis": Forms(misnamed=_no_hysteresis),
        "thermal_shift": _HEAT,
        "thermal_growth": replace(_HEAT, implausible=_no_growth, joined=_about_a_point, joins="thermal_shift"),
        "warm_up": Forms(doubtful=_brief, contains=("drift",)),
        "warm_up_growth": Forms(doubtful=_brief, implausible=_no_growth, contains=("scale",)),
        "lost_counts": Forms(doubtful=_takes_time, softer=_spread_out, at_most=3),
        "screw_runout": Forms(misnamed=partial(_beside_its_rival, "torque_ripple")),
        "torque_ripple": Forms(misnamed=partial(_beside_its_rival, "screw_runout")),
        "stribeck": Forms(closer=partial(BuildsUp.variants, Stribeck())),
    }
)
