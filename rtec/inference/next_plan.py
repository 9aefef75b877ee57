"""The best use of the next hour at the machine: a whole plan, and what it will be able to tell.

Of all plans that fit into the time, the one that tells apart what is tied, and then the one that makes the standard
errors of what was named smallest, beside repeating the plan that was measured by for the same time.
"""

from __future__ import annotations

import contextlib
import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from rtec.dataset.dataset import Dataset
from rtec.effects import Conditions, Effect, Floats, Observable, Shape
from rtec.errors import ArgumentError
from rtec.inference.candidates import minimum_detectable
from rtec.inference.model import Model, Term
from rtec.inference.planned import planned_conditions
from rtec.inference.results import Diagnosis, Verdict
from rtec.inference.scored import Judge
from rtec.inference.space import Space
from rtec.inference.suggested_plan import SPEED_SHARES, changed, measured_plan
from rtec.metrology import ExperimentPlan, Passes, Spacing, Strokes

ENOUGH = 15.0
"""Nats by which a plan has to prefer one of two rivals: the chance of the other is then below 3 in a million."""
_TARGETS = (5, 7, 9, 11, 15, 21, 31, 41, 61, 81, 121, 161, 201)
_FEWEST_RUNS, _MOST_RUNS = 2, 99
_SHORT_REST_S = (2.0, 2.0)
"""Before a reversal: nothing that was named asks for more."""
_STEP = 1e-3
"""Share of a shape parameter by which its derivative is taken."""
_MOST_SHAPES = 80
_CONDITION = 1e10
_SHORTEST_REST_S = 2.0
"""At a target: half of what was taken before may do where it is longer than this, which the reader has to see to."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Sharper:
    """A parameter of what was named: its standard error after the next hour."""

    effect: str
    parameter: str
    unit: str
    planned: float
    repeated: float
    """By the plan, and by repeating the one that was measured by for the same time."""


@dataclass(frozen=True, slots=True, kw_only=True)
class NextPlan:
    """What to do with the next hour at the machine, and what that will show."""

    plan: ExperimentPlan
    repeated: ExperimentPlan
    """What was measured by, as often as fits into the same time."""
    apart: tuple[tuple[str, str, float], ...]
    """Effects that are tied now, and the nats by which the plan would prefer the right one."""
    sharper: tuple[Sharper, ...]
    detectable: tuple[tuple[str, float], ...]
    """RMS contribution of each effect that would be found, in the observed unit inside."""


def next_plan(diagnosis: Diagnosis, time_s: float) -> NextPlan | str:
    """Return the best plan for a time at the machine, in s, or why there is none.

    Examples
    --------
    >>> from rtec.dataset.load import load_dataset
    >>> from rtec.inference.diagnose import diagnose
    >>> from rtec.metrology import measurement_of_columns
    >>> x = [float(v) for v in [*range(0, 110, 10), *range(100, -10, -10)] * 3]
    >>> noise = np.random.default_rng(1).normal(0.0, 0.3, 66)
    >>> data = {"target_mm": x, "deviation_um": np.multiply(x, 0.2) + noise, "run": np.repeat([1, 2, 3], 22),
    ...         "direction": np.tile(np.repeat([1, -1], 11), 3)}
    >>> found = next_plan(diagnose(load_dataset(measurement_of_columns(data))), 3600.0)
    >>> found.plan.duration_s <= 3600.0, [one.planned < one.repeated for one in found.sharper]
    (True, [True])
    """
    dataset = diagnosis.dataset
    try:
        measured = measured_plan(dataset)
    except ArgumentError as error:
        return f"what was measured does not fit into a plan: {error}"
    if measured is None:
        return "the measurement has no targets in mm or degrees, or way in motion, for a plan"
    repeated = _filled(measured, time_s)
    if repeated is None:
        return f"one run of what was measured takes {measured.duration_s / measured.runs:.0f} s"
    ties = _ties(diagnosis)
    before = _Expected(diagnosis, repeated, ties)
    best, key = before, before.key(before)
    for plan in _plans(measured, diagnosis, time_s):
        one = _Expected(diagnosis, plan, ties)
        if one.complete(before) and one.key(before) < key:
            best, key = one, one.key(before)
    return NextPlan(
        plan=best.plan,
        repeated=repeated,
        apart=tuple((a, b, nats) for (a, b), nats in zip(ties, best.nats, strict=True)),
        sharper=best.sharper(before),
        detectable=best.detectable(),
    )


def _ties(diagnosis: Diagnosis) -> list[tuple[str, str]]:
    """Return the accepted effects, each with one that would do in its place."""
    found = []
    for candidate in diagnosis.candidates:
        if candidate.accepted and diagnosis.verdict is Verdict.TIED:
            found += [(candidate.effect, other) for other in candidate.tied_with if other not in candidate.for_ever]
    return list(dict.fromkeys(found))


def _filled(plan: ExperimentPlan, time_s: float) -> ExperimentPlan | None:
    """Return a plan with as many runs as fit into a time; None where not even one does."""
    if plan.in_motion and plan.passes is Passes.FORWARD:
        return plan if plan.duration_s <= time_s else None
    most = int(time_s / (plan.duration_s / plan.runs))
    for runs in range(min(most, _MOST_RUNS), 0, -1):
        try:
            return replace(plan, runs=runs)
        except ArgumentError:  # too many readings
            continue
    return None


def _plans(measured: ExperimentPlan, diagnosis: Diagnosis, time_s: float) -> Iterator[ExperimentPlan]:
    """Yield plans that fit into a time: of the one measured by, and of what separates what is tied."""
    dataset = diagnosis.dataset
    bases = [measured]
    if diagnosis.experiment.asks:
        try:
            bases.append(changed(measured, diagnosis.experiment.asks, dataset))
        except ArgumentError:
            pass
    for base in bases:
        for feeds in _feeds(base):
            for plan in _shapes_of(base, feeds):
                filled = _filled(plan, time_s)
                if filled is not None and (filled.runs >= max(_FEWEST_RUNS, _in_turn(plan)) or filled.in_motion):
                    yield filled


def _tried(plan: ExperimentPlan, **changes: object) -> Iterator[ExperimentPlan]:
    """Yield a plan with changes, or nothing where it would be too long or too large."""
    with contextlib.suppress(ArgumentError):
        yield replace(plan, runs=1, **changes)  # type: ignore[arg-type]  # checked by the plan itself


def _in_turn(plan: ExperimentPlan) -> int:
    return max(len(plan.feeds_mm_s), len(plan.shifts_mm), len(plan.loads_kg), 1)


def _feeds(plan: ExperimentPlan) -> list[tuple[float, ...]]:
    top = max(plan.feeds_mm_s)
    spread = tuple(float(f"{share * top:.2g}") for share in SPEED_SHARES)
    slow = (top, *(float(f"{top * share:.2g}") for share in (0.3, 0.1, 0.03)))
    return list(dict.fromkeys([plan.feeds_mm_s, spread, slow] if plan.in_motion else [plan.feeds_mm_s, spread]))


def _shapes_of(plan: ExperimentPlan, feeds: tuple[float, ...]) -> Iterator[ExperimentPlan]:
    if plan.in_motion:
        kinds = (Strokes.FULL,) if plan.rotary else tuple(Strokes)  # whole turns show an arm in every pose
        for strokes, moves in itertools.product(kinds, sorted({20, 60, max(plan.targets, 20)})):
            yield from _tried(plan, feeds_mm_s=feeds, strokes=strokes, targets=moves, passes=Passes.BOTH)
        return
    spacings = dict.fromkeys((plan.spacing, Spacing.EVEN, Spacing.DENSE_AT_ENDS))
    rests = dict.fromkeys((plan.turn_dwells_s, _SHORT_REST_S))
    ways = dict.fromkeys((plan.passes, Passes.BOTH))
    dwells = dict.fromkeys((plan.dwell_s, min(plan.dwell_s, max(plan.dwell_s / 2.0, _SHORTEST_REST_S))))
    every = itertools.product(sorted({*_TARGETS, plan.targets}), spacings, rests, ways, dwells)
    for targets, spacing, rest, passes, dwell in every:
        columns = plan.columns if passes is Passes.FORWARD else tuple(dict.fromkeys((*plan.columns, "direction")))
        lie = {"targets": targets, "spacing": spacing, "passes": passes, "columns": columns}
        yield from _tried(plan, feeds_mm_s=feeds, turn_dwells_s=rest, dwell_s=dwell, **lie)


class _Expected:
    """What a plan is expected to show of the model that was found."""

    def __init__(self, diagnosis: Diagnosis, plan: ExperimentPlan, ties: Sequence[tuple[str, str]]) -> None:
        self.plan, self.dataset = plan, diagnosis.dataset
        self.model: Model = diagnosis.model
        self.sigma = max(diagnosis.noise.sigma, 1e-300)
        self.c = planned_conditions(plan, diagnosis.dataset)
        self.weight = self._samples() / self.c.rows
        # a force has no zero of the instrument, and a map of positions holds it
        holds_constant = self.dataset.observable is Observable.DRIVE or any(t.effect.is_map for t in self.model.terms)
        self.names: list[tuple[str, str]] = []
        table = [np.zeros(self.c.rows) if holds_constant else np.ones(self.c.rows)]
        for term in self.model.terms:
            for name, column in _derivatives(term, self.c, self.model):
                self.names.append((term.name, name))
                table.append(column)
        self.table = np.array(table)
        self.errors = self._errors()
        self.nats = [self._apart(one, other) for one, other in ties]

    def _samples(self) -> float:
        """Return how many independent readings the plan gives: of a log as many in a second as were measured."""
        if not self.plan.in_motion:
            return float(self.c.rows)
        c = self.dataset.coordinates
        lasted = float(np.ptp(c.clock)) if c.time_s is not None else float(c.rows)
        return self.plan.duration_s * c.rows / max(lasted, 1e-9)

    def _errors(self) -> Floats:
        """Return the standard error of each parameter, infinite where the plan does not show it."""
        errors = np.full(self.table.shape[0], np.inf)
        size = np.sqrt((self.table**2).sum(axis=1))
        seen = np.flatnonzero(size > 0.0)
        scaled = self.table[seen] / size[seen, None]
        gram = scaled @ scaled.T
        if seen.size and np.linalg.cond(gram) < _CONDITION:
            errors[seen] = self.sigma * np.sqrt(np.diag(np.linalg.inv(gram)) / self.weight) / size[seen]
        return errors[1:]

    def complete(self, before: _Expected) -> bool:
        """Return whether the plan shows everything that repeating shows; and where nothing is tied, as sharply."""
        enough = np.inf if self.nats else before.errors
        return bool(((np.isfinite(self.errors) & (self.errors <= enough)) | ~np.isfinite(before.errors)).all())

    def key(self, before: _Expected) -> tuple[float, float]:
        """Return how good the plan is, the less the better: what it leaves tied, then how sharp it is."""
        tied = sum(max(ENOUGH - nats, 0.0) for nats in self.nats)
        both = np.isfinite(self.errors) & np.isfinite(before.errors)
        ratio = self.errors[both] / before.errors[both]
        more = int((np.isfinite(self.errors) & ~np.isfinite(before.errors)).sum())
        return round(tied, 1) - more, float(np.mean(np.log(ratio))) if ratio.size else -math.log(self.c.rows)

    def _apart(self, name: str, other: str) -> float:
        """Return the nats by which the plan would prefer the first of two effects, if that is the right one."""
        rival = self.dataset.library.named(other)
        own = [term for term in self.model.terms if term.name == name]
        if any(effect.untestable(self.c) is not None for effect in (rival, *(term.effect for term in own))):
            return 0.0  # it would be told by nothing
        try:
            added = sum((term.contribution(self.c) for term in own), np.zeros(self.c.rows))
        except ArgumentError:
            return 0.0
        keep = [0, *(k + 1 for k, (effect, _) in enumerate(self.names) if effect != name)]
        return float(min(self._left(added, keep, columns) for columns in _columns_of(rival, self.c)))

    def _left(self, added: Floats, keep: Sequence[int], columns: Floats) -> float:
        table = np.vstack([self.table[list(keep)], columns]).T
        size = np.maximum(np.sqrt((table**2).sum(axis=0)), 1e-300)
        left = added - (table / size) @ np.linalg.lstsq(table / size, added, rcond=1e-9)[0]
        return self.weight * float(left @ left) / (2.0 * self.sigma**2)

    def sharper(self, before: _Expected) -> tuple[Sharper, ...]:
        """Return the standard error of each parameter by this plan and by repeating, in the units of people."""
        found = []
        for k, (effect, name) in enumerate(self.names):
            unit, factor = self._unit(effect, name)
            errors = [float(one.errors[k]) * factor for one in (self, before)]
            found.append(Sharper(effect=effect, parameter=name, unit=unit, planned=errors[0], repeated=errors[1]))
        return tuple(found)

    def _unit(self, effect: str, name: str) -> tuple[str, float]:
        term = next(t for t in self.model.terms if t.name == effect)
        for amplitude in term.effect.amplitudes(term.shape or Shape(), self.model.units):
            if amplitude.name == name:
                return amplitude.unit, amplitude.factor
        item = next(field for field in fields(term.effect.shape_type) if field.name == name)
        return self.model.units.of(item), 1.0

    def detectable(self) -> tuple[tuple[str, float], ...]:
        """Return the smallest RMS contribution of each effect that the plan would show."""
        noise = np.random.default_rng(0).normal(0.0, self.sigma, self.c.rows)
        cell = np.full(self.c.rows, -1, dtype=np.int64)
        made = Dataset(
            source="plan",
            observe=self.dataset.observe,
            observable=self.dataset.observable,
            units=self.dataset.units,
            observed=noise,
            conditions=self.c,
            cell=cell,
            library=self.dataset.library,
        )
        judge = Judge(Space(made))
        found = minimum_detectable(judge, judge.score(()))
        return tuple((name, value / math.sqrt(self.weight)) for name, value in found.items())


def _derivatives(term: Term, c: Conditions, model: Model) -> Iterator[tuple[str, Floats]]:
    """Yield how what is observed changes with each parameter of a term, shape (rows,)."""
    if term.shape is None or term.amplitudes is None:
        return
    try:
        columns = term.effect.columns(c, term.shape)
        tunables = term.effect.tunables(c, term.shape)
    except (ArgumentError, IndexError, ValueError):
        return
    for amplitude, column in zip(term.effect.amplitudes(term.shape, model.units), columns.T, strict=True):
        yield amplitude.name, column
    for tunable in tunables:
        value = float(getattr(term.shape, tunable.name))
        step = _STEP * max(abs(value), abs(tunable.high - tunable.low))
        try:
            moved = term.effect.columns(c, replace(term.shape, **{tunable.name: value + step}))
        except ArgumentError:
            continue
        yield tunable.name, (moved - columns) @ np.asarray(term.amplitudes) / step


def _columns_of(effect: Effect, c: Conditions) -> Iterator[Floats]:
    """Yield what an effect could add, in some of its shapes; shape (columns, rows)."""
    shapes = effect.shapes(c)
    for k in np.unique(np.linspace(0, len(shapes) - 1, min(len(shapes), _MOST_SHAPES)).astype(int)) if shapes else ():
        yield effect.columns(c, shapes[k]).T
