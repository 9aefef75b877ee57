"""What differs between diagnoses of several measurements: before and after, or axis by axis."""

from __future__ import annotations

import enum
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr

from rtec.inference.compare import Comparison
from rtec.inference.fit import fit_model, values_of
from rtec.inference.forms import forms_of
from rtec.inference.model import Term
from rtec.inference.results import Diagnosis, Value

_LEVEL = 0.01
"""Adjusted p below which a difference is one: that of the search for effects."""
_SAME_PERIOD = 0.05
"""How far the periods of two waves may differ, as a share, that are the same wave."""
_TURN_DEG = 360.0


class Outcome(enum.Enum):
    """What became of an effect or of one of its parameters from the first measurement to another."""

    SAME = "same"
    DIFFERS = "differs"
    NEW = "new"
    """Not in the first, where it would have been seen."""
    GONE = "gone"
    """Not in the other, where it would have been seen."""
    OPEN = "cannot be told"
    """Found in one of the two only, and too small to be seen in the other, or not testable there."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Change:
    """One parameter of an effect in two measurements, or an effect that only one of them shows."""

    effect: str
    """Its name."""
    parameter: str
    """Name of the parameter; nothing for an effect that only one of the two shows."""
    first: Value | None
    other: Value | None
    """The parameter in each, with its standard error; None where the effect was not found."""
    outcome: Outcome
    """What that comes to."""
    difference: float | None = None
    error: float | None = None
    """Other less first, and its standard error, in the unit of the values; None where there is no such thing."""
    p_adjusted: float | None = None
    """Probability of so large a difference by the errors alone, adjusted (Holm) for all that are compared."""
    reason: str = ""
    """In words, where the outcome needs one."""


def changes_from_first(results: Mapping[str, Diagnosis | Comparison]) -> dict[str, tuple[Change, ...]]:
    """Return what differs between the first of several results and each of the others, by the name of the latter."""
    first, *others = results
    return {name: changes(results[first], results[name]) for name in others}


def changes(first: Diagnosis | Comparison, other: Diagnosis | Comparison) -> tuple[Change, ...]:
    """Return what differs between two diagnoses, parameter by parameter, in the order of the effects found.

    Returns
    -------
    tuple
        Each parameter with a standard error in both; each effect found in one of them only; and each that a model
        states with its numbers, which two comparisons share whatever was measured.

    Notes
    -----
    Differences are judged by the standard errors of the two fits, as independent normal deviates; Holm's procedure
    (Holm 1979) holds the chance of one false difference among all below 0.01. What changes from one mounting of the
    instrument to the next is a difference like any other: the readings cannot tell it from one of the axis.
    """
    pairs = list(_paired(_fitted(first), _fitted(other)))
    compared = []
    for one, two in pairs:
        if one is None or two is None:
            continue
        here, there = ({v.name: v for v in values_of(term, d.model)} for term, d in ((one, first), (two, other)))
        for name, value in here.items():
            if name in there and (found := _difference(value, there[name])) is not None:
                compared.append((one.name, name, value, there[name], *found))
    both = _judged(compared)
    gone = [_alone(one, first, other, Outcome.GONE) for one, two in pairs if one is not None and two is None]
    new = [_alone(two, other, first, Outcome.NEW) for one, two in pairs if two is not None and one is None]
    return (*both, *gone, *new, *_stated(first))


def changes_since(comparison: Comparison) -> tuple[Change, ...]:
    """Return what differs between the numbers that a model states and those that a measurement gives, fitted anew.

    Only parameters that the model states with a standard error are told of, as a file of an earlier diagnosis has
    them: what has worn, been adjusted or lost since. Judged as by `changes`.
    """
    c = comparison.dataset.conditions
    given = zip(comparison.model.terms, comparison.stated, strict=True)
    shown = [(term, is_given) for term, is_given in given if term.effect.untestable(c) is None]
    stated = [term for term, is_given in shown if is_given and term.errors is not None]
    if not stated:
        return ()
    model = comparison.model.with_terms(term for term, _ in shown)
    now = fit_model(comparison.dataset, model, all_open=True)
    compared = []
    for before, after in zip(model.terms, now.terms, strict=True):
        if before in stated:
            there = {value.name: value for value in values_of(after, now)}
            for value in values_of(before, model):
                if value.name in there and (found := _difference(value, there[value.name])) is not None:
                    compared.append((before.name, value.name, value, there[value.name], *found))
    return tuple(_judged(compared))


def _judged(compared: Sequence[tuple[str, str, Value, Value, float, float]]) -> list[Change]:
    """Return the outcome of each comparison: effect, parameter, both values, their difference and its error."""
    adjusted = _holm([2.0 * float(ndtr(-abs(d) / e)) for *_, d, e in compared])
    return [
        Change(
            effect=effect,
            parameter=name,
            first=here,
            other=there,
            difference=d,
            error=e,
            p_adjusted=p,
            outcome=Outcome.DIFFERS if p < _LEVEL else Outcome.SAME,
        )
        for (effect, name, here, there, d, e), p in zip(compared, adjusted, strict=True)
    ]


def _fitted(result: Diagnosis | Comparison) -> list[Term]:
    """Return the terms whose numbers come from the measurement."""
    if isinstance(result, Diagnosis):
        return list(result.model.terms)
    return [term for term, stated in zip(result.model.terms, result.stated, strict=True) if not stated]


def _stated(result: Diagnosis | Comparison) -> list[Change]:
    """Return an open change for each term that the model states: its numbers say nothing of either measurement."""
    fitted = _fitted(result)
    values = [(term, next(iter(values_of(term, result.model)))) for term in result.model.terms if term not in fitted]
    return [
        Change(
            effect=term.name,
            parameter=value.name,
            first=value,
            other=value,
            outcome=Outcome.OPEN,
            reason="the model states it",
        )
        for term, value in values
    ]


def _paired(first: Sequence[Term], other: Sequence[Term]) -> Iterator[tuple[Term | None, Term | None]]:
    """Yield the effects that belong together, and those of one measurement alone; waves by their periods."""
    left = list(other)
    for term in first:
        rivals = [two for two in left if two.name == term.name and _period_distance(term, two) <= _SAME_PERIOD]
        if not rivals:
            yield term, None
            continue
        nearest = min(rivals, key=lambda two: _period_distance(term, two))
        left.remove(nearest)
        yield term, nearest
    yield from ((None, two) for two in left)


def _period_distance(one: Term, two: Term) -> float:
    """Return how far the periods of two effects differ, as a share; 0 where they have none."""
    return 0.0 if one.period is None or two.period is None else abs(math.log(two.period / one.period))


def _difference(first: Value, other: Value) -> tuple[float, float] | None:
    """Return the difference of two numbers and its standard error; None where they have no errors or other units."""
    numbers = isinstance(first.value, float) and isinstance(other.value, float) and first.unit == other.unit
    if not numbers or first.error is None or other.error is None:
        return None
    error = math.hypot(first.error, other.error)
    difference = float(other.value) - float(first.value)
    if "phase" in first.name and first.unit == "deg":
        difference = (difference + _TURN_DEG / 2) % _TURN_DEG - _TURN_DEG / 2
    return (difference, error) if error > 0.0 and math.isfinite(error) else None


def _holm(p: Sequence[float]) -> list[float]:
    """Return p values adjusted for their number by Holm's step-down procedure.

    >>> _holm([0.01, 0.04, 0.03])
    [0.03, 0.06, 0.06]
    """
    order = np.argsort(p)
    stepped = np.maximum.accumulate(np.asarray(p)[order] * np.arange(len(p), 0, -1))
    adjusted: list[float] = np.minimum(1.0, stepped)[np.argsort(order)].tolist()
    return adjusted


def _alone(term: Term, having: Diagnosis | Comparison, lacking: Diagnosis | Comparison, outcome: Outcome) -> Change:
    """Return the change for an effect that one measurement shows alone: gone, new, or why that cannot be told."""
    value = next((value for value in values_of(term, having.model) if value.error is not None), None)
    size = float(np.std(term.component(having.dataset)))
    smallest, why = None, ""
    if isinstance(lacking, Diagnosis):
        smallest = dict(lacking.minimum_detectable).get(term.name)
        why = dict(lacking.not_testable).get(term.name, "")
    kin = [
        two.name
        for two in lacking.model.terms
        if two.name in forms_of(term.effect).contains or term.name in forms_of(two.effect).contains
    ]
    if kin:
        why = f"{kin[0].replace('_', ' ')} stands in its place"
    elif not why and (smallest is None or smallest > size):
        why = "too small to be seen there"
    return Change(
        effect=term.name,
        parameter="" if value is None else value.name,
        first=value if outcome is Outcome.GONE else None,
        other=value if outcome is Outcome.NEW else None,
        outcome=Outcome.OPEN if why else outcome,
        reason=why,
    )
