"""The predictors that compete: tables, the effects that a diagnosis finds, the thesis's networks."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial

from rtec.dataset.dataset import Dataset
from rtec.inference.diagnose import diagnose
from rtec.inference.model import Model
from rtec.inference.static_predictor import predictor_at_mean
from rtec.predictors import BidirectionalTable, NoError, Predictor, UnidirectionalTable
from rtec.predictors.fitting.algorithms import Algorithm
from rtec.predictors.fitting.samples import FEWEST_POINTS_A_TURN, points_a_turn, together
from rtec.predictors.fitting.several_axes import Geometry, fit_across
from rtec.predictors.fitting.spaced_tables import Table, spaced_table, table_of
from rtec.predictors.fitting.training import Course, Design, Effort, Limit, train
from rtec.predictors.tables import Between
from rtec.training.parts import Parts
from rtec.training.results import Kind

DESIGNS = (Design(hidden=(40,)), Design(hidden=(30, 10)), Design(hidden=(30,), within_turn=8))
"""Of the thesis, section 5.4."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Task:
    """What every method gets."""

    dataset: Dataset
    parts: Parts
    """The measurement, and what its readings are for."""
    pitch_mm: float | None
    """Travel of a turn of the screw, None where it is not stated."""
    effort: Effort
    """What a network is worth."""
    limit: Limit = field(default_factory=Limit)
    """What ends a training from outside."""
    tell: Callable[[float], None] = lambda loss_mm: None
    """Told the lowest root mean square error of the choosing readings so far, in mm."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Fitted:
    """What a method gives."""

    predictor: Predictor
    """What goes to work."""
    parameters: int
    """Numbers that were fitted."""
    unsure: Predictor | None = None
    """The same predictor fitted without the places that tell how sure it is; None where ``predictor`` is."""
    notes: tuple[str, ...] = ()
    courses: tuple[Course, ...] = ()
    tried: tuple[tuple[float, float], ...] = ()
    model: Model | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Method:
    """One way to a predictor."""

    name: str
    kind: Kind
    fit: Callable[[Task], Fitted]


def all_methods(*, several_axes: bool = False) -> tuple[Method, ...]:
    """Return every method: what is quick first.

    Parameters
    ----------
    several_axes
        Whether the measurement tells where other axes stood: then their geometry competes, too.
    """
    tables = (
        Method(name=f"table {side} {between.value}", kind=Kind.TABLE, fit=partial(_fit_table, kind, between))
        for side, kind in (("uni-directional", UnidirectionalTable), ("bi-directional", BidirectionalTable))
        for between in Between
    )
    networks = (
        Method(
            name=f"network {design.name} {algorithm.value}",
            kind=Kind.NETWORK,
            fit=partial(_fit_network, design, algorithm),
        )
        for design in DESIGNS
        for algorithm in Algorithm
    )
    geometries = (
        Method(name=geometry.value, kind=Kind.GEOMETRY, fit=partial(_fit_geometry, geometry))
        for geometry in Geometry
        if several_axes
    )
    none = Method(name="none", kind=Kind.NONE, fit=lambda task: Fitted(predictor=NoError(), parameters=0))
    return (none, *tables, *geometries, Method(name="effects", kind=Kind.MODEL, fit=_fit_effects), *networks)


def _fit_table(kind: type[Table], between: Between, task: Task) -> Fitted:
    parts = task.parts
    chosen = spaced_table(parts.seen, kind, between, seed=task.effort.seed)
    # the place without readings would be a gap that no control's table has
    table = table_of(together([parts.seen, parts.sure]), chosen)
    notes = [f"a point every {chosen.spacing_mm:.4g} mm"]
    if task.pitch_mm is not None:
        turn = task.pitch_mm / chosen.spacing_mm
        notes.append(f"{turn:.3g} points a turn of the screw")
        if turn < FEWEST_POINTS_A_TURN:
            notes.append("errors that repeat every turn are not in it")
    return Fitted(
        predictor=table,
        parameters=_numbers_in(table),
        unsure=chosen.table,
        notes=tuple(notes),
        tried=chosen.tried,
    )


def _numbers_in(table: Table) -> int:
    """Return how many numbers of a table were fitted: its errors, and the backlash where it has one."""
    if isinstance(table, UnidirectionalTable):
        return table.errors_mm.size + 1
    return sum(errors.size for _, errors in table.ways)


def _fit_geometry(geometry: Geometry, task: Task) -> Fitted:
    parts = task.parts
    found = fit_across(together([parts.seen, parts.sure]), geometry)
    return Fitted(
        predictor=found.predictor,
        parameters=found.parameters,
        unsure=fit_across(parts.seen, geometry).predictor,
        notes=tuple(map(str, found.across)),
    )


def _fit_effects(task: Task) -> Fitted:
    """Find effects, and make a table of what depends on position and direction; of heat, as it was on average."""
    data = task.dataset.alone(task.parts.rows)
    found = diagnose(data)
    predictor, left_out = predictor_at_mean(found.model, *task.parts.train.span_mm, data)
    names = ", ".join(found.effects) or "none"
    notes = [f"{found.verdict.value}: {names}"]
    notes += [f"{one.effect} is left out: {one.why}" for one in left_out]
    numbers = sum(len(term.amplitudes or ()) for term in found.model.terms) + 1
    return Fitted(predictor=predictor, parameters=numbers, notes=tuple(notes), model=found.model)


def _fit_network(design: Design, algorithm: Algorithm, task: Task) -> Fitted:
    trained = train(
        design,
        task.parts.train,
        task.parts.choose,
        replace(task.effort, algorithm=algorithm),
        pitch_mm=task.pitch_mm,
        limit=task.limit,
        tell=task.tell,
    )
    epochs = " + ".join(str(course.epochs) for course in trained.courses)
    notes = [f"{epochs} epochs"]
    if task.pitch_mm is None:
        notes.append("without the place in the turn: no pitch of a screw is stated")
    return Fitted(
        predictor=trained.predictor, parameters=trained.weights, notes=tuple(notes), courses=trained.courses
    )


def turn_warning(task_parts: Parts, pitch_mm: float | None) -> str | None:
    """Return what has to be said of too few places in a turn of the screw; None where there are enough.

    References
    ----------
    Thesis 5.1: at intervals of an inch the measurement of a screw of a quarter of an inch was inconsistent.
    """
    if pitch_mm is None:
        return None
    points = points_a_turn(task_parts.train, pitch_mm)
    if points >= FEWEST_POINTS_A_TURN:
        return None
    return (
        f"{points:.2g} targets a turn of the screw are too few for errors that repeat every turn: "
        f"measure every {pitch_mm / FEWEST_POINTS_A_TURN:.3g} mm or closer"
    )
