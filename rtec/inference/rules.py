"""The rules about names: what every effect of a model has to show, and what speaks against a model as a whole.

One table. What a rule is worth is measured by leaving it out (`rtec.inference.forms.left_out`): docs/rules.md has the
figures, and a rule without which nothing gets worse goes.
"""

from __future__ import annotations

import enum
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from rtec.effects import CyclicShape, Observable, Over
from rtec.effects._loop import LoopShape
from rtec.effects.inertia import share_with_position
from rtec.inference.completeness import (
    Sign,
    beats,
    coloured,
    floor_missed,
    leaves_a_hair,
    nearly_right,
    trends,
)
from rtec.inference.forms import finest_drawn, forms_of, is_asked
from rtec.inference.probes import Probe
from rtec.inference.proposals import by_chance
from rtec.inference.results import NoiseFloor
from rtec.inference.scored import Scored, replaced

if TYPE_CHECKING:
    from rtec.inference.gate import Gate
    from rtec.inference.search import Search

WORTH = 5.0
"""Nats by which an effect has to raise the score before it enters."""
SHARPER = 3.0
"""Nats by which a sudden change has to be likelier than a gradual one."""
NEARLY_ONE_FREQUENCY, MISSING = 0.9, 0.5
"""Share of the acceleration with the position, and of the residual that wanders: a model that lacks something."""
LONGER = (2, 3)
"""Times the period of a wave in time, of which it may be a harmonic alone."""
MATTERS, MATTERS_IN_TIME = 0.15, 2.0
"""Of what is left, that the contribution of an effect has to have beside the others; of a course without a name."""


class Against(enum.Enum):
    """What a rule speaks against."""

    DOUBT = enum.auto()
    """That an effect may be accepted: the model competes all the same."""
    SIGN = enum.auto()
    FORM = enum.auto()
    """The form of a fit, however much it explains: where it predicts much better, it may be told as approximate."""
    EVIDENCE = enum.auto()
    RESIDUAL = enum.auto()
    """A model as a whole, unless what it leaves is a hair: the verdict is UNKNOWN."""
    NAMES = enum.auto()
    """A model as a whole, whatever it leaves."""


@dataclass(frozen=True, slots=True)
class Rule:
    """A rule: its name, what it speaks against, what applies it, what it asks, and what earned it its place.

    Of an effect ``applies(gate, model, k)`` returns why it has not earned its place, else None. Of a model as a whole
    ``applies(search, model, floor, approximate)`` returns the signs that it is not complete.
    """

    name: str
    against: Against
    applies: Callable[..., Any]
    asks: str
    earned: str


def objections(gate: Gate, model: Scored, k: int, *against: Against) -> Iterator[str]:
    """Yield what speaks against an effect of a model, what is cheap to find out first."""
    for rule in RULES:
        if rule.against in against and is_asked(rule.name) and (why := rule.applies(gate, model, k)) is not None:
            yield why


def signs_of(search: Search, model: Scored, floor: NoiseFloor, approximate: Sequence[str] = ()) -> tuple[Sign, ...]:
    """Return what speaks against the completeness of a model in which effects were found."""
    against = {Against.NAMES} if leaves_a_hair(search, model) else {Against.NAMES, Against.RESIDUAL}
    asked = [rule for rule in RULES if rule.against in against and is_asked(rule.name)]
    return tuple(sign for rule in asked for sign in rule.applies(search, model, floor, approximate))


def _slow_course(gate: Gate, model: Scored, k: int) -> str | None:
    effect, _ = model.choices[k]
    if isinstance(effect, Probe) and effect.in_time and gate.size(model, k) < MATTERS_IN_TIME:
        return f"its contribution is below {MATTERS_IN_TIME:g} times the residual, as that of slow noise is"
    return None


def _doubtful(gate: Gate, model: Scored, k: int) -> str | None:
    (effect, shape), c = model.choices[k], gate.space.dataset.conditions
    doubt = forms_of(effect).doubtful
    if (why := doubt(c, shape)) is not None or not (c.time_is_coordinate and isinstance(shape, CyclicShape)):
        return why
    for times in LONGER:  # a schedule that comes back a few times, without its first waves
        longer = replace(shape, period=times * shape.period, harmonics=times * shape.harmonics)
        if (why := doubt(c, longer)) is not None:
            if gate.judge.score(replaced(model, k, (effect, longer)), model).score > model.score + WORTH:
                return why
    return None


def _negative(gate: Gate, model: Scored, k: int) -> str | None:
    return "its amplitude would have to be negative" if model.choices[k][0].name in model.wrong_sign else None


def _crowded(gate: Gate, model: Scored, k: int) -> str | None:
    effect, shape = model.choices[k]
    others = [s for i, (e, s) in enumerate(model.choices) if i != k and e.name == effect.name]
    if effect.is_wave:  # what a loop leaves of a turn is a wave of that period
        others += [CyclicShape(s.period) for _, s in model.choices if isinstance(s, LoopShape)]
    finest = min((finest_drawn(s) for e, s in model.choices if effect.name in forms_of(e).contains), default=np.inf)
    return forms_of(effect).crowded(gate.space.dataset.conditions, shape, others, finest)


def implausible(gate: Gate, model: Scored, k: int) -> str | None:
    """Return why the fit of an effect of a model is no such effect, whatever it explains, or None."""
    (effect, shape), fit = model.choices[k], gate.judge.fit(model)
    return forms_of(effect).implausible(gate.space.dataset.conditions, shape, fit.mean[fit.rows(k)])


def misnamed(gate: Gate, model: Scored, k: int) -> str | None:
    """Return why an effect of a model has another name beside the others, or None."""
    fit = gate.judge.fit(model)
    sizes = {e.name: fit.mean[fit.rows(i)] * fit.parts[i].unit for i, (e, _) in enumerate(model.choices) if i != k}
    return forms_of(model.choices[k][0]).misnamed(fit.mean[fit.rows(k)] * fit.parts[k].unit, sizes)


def _chance(gate: Gate, model: Scored, k: int) -> str | None:
    chance = by_chance(gate.judge, model, k)
    return "one of so many periods explains as much at so few targets" if chance else None


def _worth(gate: Gate, model: Scored, k: int) -> str | None:
    worth = gate.worth(model, k, gate.neighbours.without(model, k))
    if worth >= WORTH:
        return None
    return f"it raises the log marginal likelihood by {worth:.1f} nats, less than the {WORTH:g} required"


def _slow_noise(gate: Gate, model: Scored, k: int) -> str | None:
    if not model.choices[k][0].in_time or gate.free is gate.judge:
        return None
    rest = gate.neighbours.without(model, k)
    alone = gate.free.score(model.choices).score - gate.free.score(rest.choices).score
    return "slow noise explains as much" if alone < WORTH else None


def _spring(gate: Gate, model: Scored, k: int) -> str | None:
    wanders, effect = model.colour.rho * (1.0 - model.colour.white) > MISSING, model.choices[k][0]
    if not wanders or effect.over is not Over.ACCELERATION or effect.observable is not Observable.DRIVE:
        return None
    alike = share_with_position(gate.space.dataset.conditions) > NEARLY_ONE_FREQUENCY
    return "beside what is missing it looks like a spring at nearly one frequency" if alike else None


def _small(gate: Gate, model: Scored, k: int) -> str | None:
    return f"its contribution is below {MATTERS:g} of the residual" if gate.size(model, k) < MATTERS else None


def _gradual(gate: Gate, model: Scored, k: int) -> str | None:
    effect, shape = model.choices[k]
    for softer in forms_of(effect).softer(gate.space.dataset.conditions, shape):
        if gate.judge.score(replaced(model, k, (effect, softer)), model).score > model.score - SHARPER:
            return "a gradual change explains as much"
    return None


def _held_out(gate: Gate, model: Scored, k: int) -> str | None:
    gain = gate.gain(gate.neighbours.without(model, k), model)
    return None if gain.passes else "the held-out error does not fall"


RULES: tuple[Rule, ...] = (
    Rule(
        *("slow course", Against.DOUBT, _slow_course),
        asks="Is a course in time without a name twice as large as the residual?",
        earned="In 50 games of noise alone such a course had up to 1.3 of the residual, for noise that wanders has a "
        "slow half and a quick one; weather that was hidden had 2.7 and more.",
    ),
    Rule(
        *("doubtful", Against.DOUBT, _doubtful),
        asks="Can these readings bear out the shape: five cycles of a wave, in time also of one whose "
        "harmonic it is, readings just after a reversal, a course longer than the start of a log?",
        earned="On real measurements of 17 makers every doubtful wave had four cycles or fewer, every confirmed one "
        "six or more. Warm machines that changed speed every two hours: without it the third harmonic of four cycles "
        "was listed in 5 of 60.",
    ),
    Rule(
        *("sign", Against.SIGN, _negative),
        asks="Is the amplitude of friction or inertia positive?",
        earned="Physics: friction takes energy out of a motion, and no mass is negative.",
    ),
    Rule(
        *("crowded", Against.FORM, _crowded),
        asks="Can it be told from others of its kind: 1.5 cycles from another wave, a sensor or lag of its own, no "
        "wave that a map beside it draws?",
        earned="Games with an error outside the library: without it waves were listed that are not there.",
    ),
    Rule(
        *("implausible", Against.FORM, implausible),
        asks="Are the amplitudes those of such an effect: a strong first wave, a map slower than any wave, a fixed "
        "point near the axis?",
        earned="An audit: growth was named about a point far beyond the axis; without it 14 of 159 answers have "
        "other names.",
    ),
    Rule(
        *("misnamed", Against.FORM, misnamed),
        asks="Has the curve no other name beside the others, as a spike has beside a wind-up?",
        earned="A spike is a backlash less a wind-up: games with one were answered by the other (decision 25).",
    ),
    Rule(
        *("by chance", Against.EVIDENCE, _chance),
        asks="Does a wave shorter than two uneven steps explain more than the best of so many periods by chance?",
        earned="Tables of random errors at uneven targets: without it a wave was listed in 3 of 24.",
    ),
    Rule(
        *("worth", Against.EVIDENCE, _worth),
        asks="Does it raise the score by 5 nats, alone or together with its look-alikes?",
        earned="At 3.5 nats the prototype gave false names on noise alone, at 5 on none of 324 measurements.",
    ),
    Rule(
        *("slow noise", Against.EVIDENCE, _slow_noise),
        asks="Is an effect in time of a log worth 5 nats beside noise of any colour, too?",
        earned="Logs that wander, drawn anew: without it drift or warm-up was listed in 6 of 8.",
    ),
    Rule(
        *("spring", Against.EVIDENCE, _spring),
        asks="Does the axis swing at several frequencies, where inertia stands beside a residual that wanders?",
        earned="A friction damper swung at nearly one frequency: what its friction left was told as a mass of a ton. "
        "Beside white noise a spring and a mass are told apart.",
    ),
    Rule(
        *("size", Against.EVIDENCE, _small),
        asks="Is it 0.15 of the residual beside the others, and without repeats 0.02 of the readings?",
        earned="After 8000 readings a tenth of the noise is certain, and of no interest.",
    ),
    Rule(
        *("gradual", Against.EVIDENCE, _gradual),
        asks="Is a step in a log, or in time, 3 nats likelier than the same change over a fiftieth of it?",
        earned="A log with a slow ramp, drawn anew: without it lost counts were NAMED. Warm machines whose sensors "
        "and speed were hidden: without it lost counts were listed in 12 of 60.",
    ),
    Rule(
        *("held-out gain", Against.EVIDENCE, _held_out),
        asks="Are held-out readings foretold better, and not in a single cell alone?",
        earned="Eliminating at the end only let junk push out what is real (prototype of the search).",
    ),
    Rule(
        *("floor missed", Against.RESIDUAL, floor_missed),
        asks="Is at most 1.3 times a well-known noise floor left?",
        earned="An audit: a model that left 280 noise floors was NAMED.",
    ),
    Rule(
        *("coloured", Against.RESIDUAL, coloured),
        asks="Is what is left of a log, or in time, uncorrelated over two to four readings?",
        earned="An audit: it was strongly correlated in 2 of 29 right answers and in 24 of 28 wrong ones.",
    ),
    Rule(
        *("trend", Against.RESIDUAL, trends),
        asks="Does what is left follow no smooth curve over position, direction, time or run?",
        earned="An audit: of physics outside the library 44 % was flagged at rest and 15 % in logs.",
    ),
    Rule(
        *("beat", Against.RESIDUAL, beats),
        asks="Do the waves found lie three cycles apart?",
        earned="An audit: a wave that changes along the axis was named as two.",
    ),
    Rule(
        *("approximate", Against.NAMES, nearly_right),
        asks="Has every effect exactly its form?",
        earned="On real data no form is exact, and what only resembles an effect was named as it.",
    ),
)
