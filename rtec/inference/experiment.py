"""What to measure next: the experiment that separates rivals, or shows what this plan cannot."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from rtec.dataset.dataset import Dataset
from rtec.effects import Conditions, Effect, Observable, distance_since_reversal
from rtec.effects.experiments import (
    AFTER_REVERSAL,
    ASKS,
    COLD_AND_HOT,
    OTHER_WEATHER,
    SEVERAL_SPEEDS,
    SPEEDS_EACH_WAY,
    SPEEDS_OVER_ANGLES,
    Ask,
    rival,
)
from rtec.effects.gravity import LEAST_SPAN_DEG
from rtec.effects.viscous import one_speed_each_way
from rtec.inference.answer import Rivalry, alike, newly
from rtec.inference.fit import fitted_terms
from rtec.inference.results import Experiment, Unknown
from rtec.inference.scored import Judge, Scored
from rtec.inference.space import Space
from rtec.readable import quantity_text

_PLACES = 15
_FEED_SHARES = (1.0, 0.5, 0.05)
_AFTER_REVERSAL = (0.0, 0.01, 0.02, 0.04)
_PAUSE_S = 10.0
_OTHER_HPA = np.array([0.0, -15.0, 15.0])
"""Of the days on which the runs of the suggested plan are made."""
CHANGES_DEGC = 1.0
"""From which on a temperature counts as one that changed."""
_REPEAT = (
    "repeat the same targets from the same directions at least five times: without repeats there is no noise floor "
    "to judge the residual by"
)
_AFTER_REVERSALS = frozenset(("windup", "reversal_spike"))
_MOST_SENTENCES = 3
"""Of what separates an effect from all that are tied with it."""


_STATE_PITCH = (
    "state the travel of a turn of the screw, as in --screw-pitch '10 mm': fewer targets show an error of a period "
    "that is stated"
)
_OTHERWISE = "vary {} on purpose while everything else stays"
_WAYS: Mapping[str, tuple[str, frozenset[Ask]]] = MappingProxyType(
    {
        "position": (
            "measure twice as many targets, closer where the residual is largest",
            frozenset((Ask.MORE_TARGETS,)),
        ),
        "direction": (
            "approach some targets repeatedly from each side with different dwells before the reversal",
            frozenset((Ask.BOTH_DIRECTIONS, Ask.FIVE_RUNS)),
        ),
        "run": (
            "repeat the same run at once and after a pause, with the time and the dwell recorded",
            frozenset((Ask.FIVE_RUNS,)),
        ),
        "time": (
            "measure one target for an hour with time and temperatures recorded",
            frozenset((Ask.THREE_HOURS, Ask.TEMPERATURES)),
        ),
        "velocity": ("measure at several feeds", frozenset((Ask.SPEEDS,))),
    }
)
"""What tells more about structure by what it depends on."""


def experiment_for_rivals(
    judge: Judge, model: Scored, rivalry: Rivalry, others: Sequence[Rivalry] = ()
) -> Experiment:
    """Return the experiment that separates two effects, with what each of them predicts there.

    Where ``others`` are tied as well, the words of what separates them follow.
    """
    named = judge.space.dataset.library.named
    first = between(named(rivalry.effect), named(rivalry.rival))
    further = (known_between(one.effect, one.rival) for one in others if not one.permanent)
    hidden = (
        known_between(one.name, two.name)
        for one, two in alike(judge, model, {rivalry.effect, *(o.effect for o in others)})
    )
    found = experiment_of(
        [first, *(words for words in (*further, *hidden, *_of_weight(judge.space.dataset)) if words)]
    )
    found = replace(found, rivals=(rivalry.effect, rivalry.rival))
    plan = separating_plan(judge.space)
    if plan is None or rivalry.model is None:
        return found
    predictions = []
    for name, one, other in ((rivalry.effect, model, rivalry.model), (rivalry.rival, rivalry.model, model)):
        terms, _ = fitted_terms(judge, one)
        effect, shape = newly(one, other, name)
        term = next(term for term in terms if (term.effect, term.shape) == (effect, shape))
        predictions.append(term.contribution(plan))
    return replace(
        found,
        label="reading of the suggested plan",
        abscissa=np.arange(1.0, plan.rows + 1.0),
        predictions=tuple(predictions),
    )


def experiment_of(sentences: Sequence[str]) -> Experiment:
    """Return the experiment of several sentences: the first stand in its text, it asks what all of them ask."""
    told = list(dict.fromkeys(sentences))
    asks = frozenset[Ask]().union(*(ASKS.get(sentence, frozenset()) for sentence in told))
    return Experiment(text="; then ".join(told[:_MOST_SENTENCES]), asks=asks)


def experiment_for_likely(names: Sequence[str]) -> Experiment | None:
    """Return what separates effects that may well be there although none was accepted; None where none is known.

    Examples
    --------
    >>> experiment_for_likely(["drift", "refraction"]).text[:25]
    'measure again on a day of'
    """
    known = [words for pair in itertools.combinations(names, 2) if (words := known_between(*pair))]
    return experiment_of(known) if known else None


def known_between(first: str, second: str) -> str | None:
    """Return the words of the experiment that separates two effects, by name; None where they are not confounded."""
    known = rival(first, second)
    return None if known is None else known.experiment


def between(first: Effect, second: Effect) -> str:
    """Return the words of the experiment that separates two effects."""
    return known_between(first.name, second.name) or (
        f"vary what {first.name} depends on while what {second.name} depends on stays ({first.name} needs "
        f"{first.needs}; {second.name} needs {second.needs})"
    )


def separating_plan(space: Space) -> Conditions | None:
    """Return a plan on which what looks alike here differs: feeds, returns, dense points after reversals, heat.

    Three bidirectional runs over the places measured, each at another feed and on a day of another air pressure,
    continued in time, the temperature going from the coldest to the hottest measured. None for logs of a drive.
    """
    c = space.dataset.conditions
    if space.dataset.observable is not Observable.DEVIATION or c.time_is_coordinate or c.places.size < 2:
        return None
    shares = np.unique(np.concatenate([np.linspace(0.0, 1.0, _PLACES), _AFTER_REVERSAL]))
    way_up = c.places[0] + shares * c.span
    way_down = c.places[-1] - shares * c.span
    runs = len(_FEED_SHARES)
    position = np.tile(np.concatenate([way_up, way_down]), runs)
    direction = np.tile(np.repeat([1.0, -1.0], shares.size), runs)
    run = np.repeat(np.arange(1, runs + 1), 2 * shares.size)
    rows = position.size
    speed = 0.0 if c.velocity is None else float(np.abs(c.velocity).max())
    feeds = np.repeat(np.array(_FEED_SHARES) * speed, 2 * shares.size)
    pause = float(np.median(np.diff(c.time_s))) if c.time_s is not None and c.rows > 1 else _PAUSE_S
    course = np.linspace(0.0, 1.0, rows)
    return Conditions(
        position=position,
        position_unit=c.position_unit,
        run=run,
        direction=direction,
        time_s=None if c.time_s is None else np.arange(rows, dtype=np.float64) * max(pause, 1e-9),
        velocity=None if c.velocity is None else direction * feeds,
        acceleration=None if c.acceleration is None else np.zeros(rows),
        since_reversal=distance_since_reversal(position, direction, run, moving=c.moving),
        temperatures=MappingProxyType({
            name: float(heat.min()) + course * float(np.ptp(heat)) for name, heat in c.temperatures.items()
        }),
        spindle_rpm=None if c.spindle_rpm is None else course * float(c.spindle_rpm.max()),
        pressure_hpa=None if c.pressure_hpa is None else float(c.pressure_hpa.mean()) + _OTHER_HPA[run - 1],
        humidity_percent=None if c.humidity_percent is None else np.full(rows, float(c.humidity_percent.mean())),
        reference_temperature_degc=c.reference_temperature_degc,
        screw_pitch=c.screw_pitch,
        signal_period=c.signal_period,
        revolution=c.revolution,
    )  # fmt: skip


def experiment_for_unknown(unknown: Unknown, dataset: Dataset) -> Experiment:
    """Return what would tell more about structure that nothing in the library explains, or cannot at one speed."""
    asked = [(words, ASKS[words]) for words in _of_one_speed(dataset)]
    c = dataset.conditions
    if "position" in unknown.depends_on and c.position_unit == "mm" and c.screw_pitch is None:
        asked.append((_STATE_PITCH, frozenset[Ask]()))
    asked += [_WAYS.get(name, (_OTHERWISE.format(name), frozenset())) for name in unknown.depends_on]
    asks = frozenset[Ask]().union(*(asks for _, asks in asked))
    return Experiment(text="; ".join(words for words, _ in asked), asks=asks)


def _of_weight(dataset: Dataset) -> list[str]:
    """Return how a weight would show on an axis that turned so little that it looked constant."""
    c = dataset.conditions
    narrow = dataset.observable is Observable.DRIVE and c.position_unit == "deg" and c.span < LEAST_SPAN_DEG
    return [SPEEDS_OVER_ANGLES] if narrow else []


def _of_one_speed(dataset: Dataset) -> list[str]:
    """Return how friction that grows with speed would differ from friction that builds up, where one speed was seen.

    Both rise while the axis gets up to speed, and neither is looked for there.
    """
    of_drive = dataset.observable is Observable.DRIVE
    return [SEVERAL_SPEEDS] if of_drive and one_speed_each_way(dataset.conditions) else []


def _varied(dataset: Dataset, not_testable: Mapping[str, str]) -> list[str]:
    """Return how to vary what was recorded and did not come twice, or came in one way only."""
    c = dataset.coordinates
    if dataset.observable is Observable.DRIVE:
        return [*([] if c.both_directions else [SPEEDS_EACH_WAY]), *_of_one_speed(dataset), *_of_weight(dataset)]
    sparse = c.both_directions and not c.moving and not _AFTER_REVERSALS.isdisjoint(not_testable)
    heated = any(float(np.ptp(heat)) > CHANGES_DEGC for heat in c.temperatures.values())
    asked = ((heated, COLD_AND_HOT), (c.pressure_hpa is not None, OTHER_WEATHER), (sparse, AFTER_REVERSAL))
    return [words for wanted, words in asked if wanted]


def experiment_for_more(
    dataset: Dataset, not_testable: Mapping[str, str], minimum: Mapping[str, float], unseen: str | None
) -> Experiment:
    """Return what this plan would need to show more."""
    if not dataset.has_repeats:
        varied = experiment_of(_varied(dataset, not_testable))
        text = "; ".join(words for words in (_REPEAT, varied.text, unseen) if words)
        shifted = [Ask.SHIFTED_TARGETS] if unseen else []
        return Experiment(text=text, asks=varied.asks | {Ask.FIVE_RUNS, *shifted})
    if unseen:
        return Experiment(text=unseen, asks=frozenset((Ask.SHIFTED_TARGETS,)))
    if minimum:
        name = max(minimum, key=lambda key: minimum[key])
        unit, factor = dataset.units.shown
        need = f": {dataset.library.named(name).needs}" if name in not_testable else ""
        return Experiment(
            text="four times as many repeats halve the smallest detectable effects; the hardest to detect here is "
            f"{name} (from {quantity_text(minimum[name] * factor, unit, digits=3)} RMS on){need}",
            asks=frozenset((Ask.MORE_RUNS,)),
        )
    name = next(iter(not_testable), "")
    return Experiment(
        text=f"{name} needs {dataset.library.named(name).needs}" if name else "repeat with more targets",
        asks=frozenset() if name else frozenset((Ask.MORE_TARGETS,)),
    )
