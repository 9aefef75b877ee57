"""The records of a campaign, counted once for everything that its report shows: cells of the map, threats, ids."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field

from rtec.rates import clopper_pearson, never_seen
from rtec.verify.campaign.job import EXEMPT, FAILED, NOT_ACTIVATED, PASSED, Choice, Parameters, Value
from rtec.verify.campaign.plan import Plan
from rtec.verify.campaign.run import Counts
from rtec.verify.campaign.store import Done, Store
from rtec.verify.safety.threats import Threat

ALL: tuple[Value, ...] = (None,)
"""Values of an axis that a map does not have."""
_FAULT, _SECOND, _NONE = "fault", "second", "none"
_MOST_PICTURES = 8
"""A second each."""
_MOST_ACROSS = 40
"""Columns of all panels together; more panels are counted as one."""


@dataclass(slots=True)
class Cell:
    """The jobs with equal values on all axes of a map."""

    addresses: list[str] = field(default_factory=list)
    counts: Counts = field(default_factory=Counts)


@dataclass(frozen=True, slots=True, kw_only=True)
class Axis:
    """Of a map: a parameter of the plan that has several values."""

    name: str
    """Empty where the map has no such axis."""
    values: tuple[Value, ...]


@dataclass(slots=True)
class Group:
    """Faults that threaten messages in one way, or that happen to something else."""

    title: str
    defence: str
    faults: list[str] = field(default_factory=list)
    counts: Counts = field(default_factory=Counts)
    told_by: Counter[str] = field(default_factory=Counter)
    """Who said why the machine was held."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Tally:
    """What a report counts beside the rows of `rtec.verify.campaign.run.Campaign`."""

    rows: Axis
    columns: Axis
    panels: Axis
    cells: dict[tuple[Value, Value, Value], Cell]
    """By row, column and panel."""
    threats: list[Group]
    """Of a plan that injects faults, else empty."""
    requirements: dict[str, Counts]
    """By id, those of the plan."""
    shown: list[Done]
    """Jobs that are worth a picture: those that failed, those that are exempt, and one of each other outcome."""


def tallied(plan: Plan, store: Store, addresses: Sequence[str]) -> Tally:
    """Count the records of a plan.

    Parameters
    ----------
    plan, store
        What was tried, and its records.
    addresses
        Of the plan's jobs, in their order.
    """
    rows, columns, panels = axes_of(plan)
    cells: dict[tuple[Value, Value, Value], Cell] = {}
    groups = _groups(plan)
    of_fault = {fault: group for group in groups for fault in group.faults}
    requirements = {one.id: Counts() for one in plan.requirements}
    shown: dict[str, list[Done]] = {FAILED: [], EXEMPT: []}
    for address, job in zip(addresses, plan.jobs(), strict=True):
        cells.setdefault(_place(job.parameters, rows, columns, panels), Cell()).addresses.append(address)
    for done in store.records(addresses):
        parameters = done.job.parameters
        _show(shown, done)
        cells[_place(parameters, rows, columns, panels)].counts.take(done)
        for name in plan.requirement_ids(parameters):
            requirements[name].take(done)
        group = of_fault.get(str(parameters.get(_FAULT)))
        if group is not None and parameters.get(_SECOND, _NONE) == _NONE:  # of two, who knows which one it was
            group.counts.take(done)
            reason = done.record.get("reason")
            if reason and done.record["result"] != NOT_ACTIVATED:
                group.told_by[str(reason)] += 1
    return Tally(
        rows=rows, columns=columns, panels=panels, cells=cells, requirements=requirements,
        shown=[done for some in shown.values() for done in some][:_MOST_PICTURES],
        threats=[group for group in groups if group.counts.tried + group.counts.not_activated],
    )  # fmt: skip


def _show(shown: dict[str, list[Done]], done: Done) -> None:
    """Keep a job that is worth a picture, by its result; of those that passed one of each outcome."""
    result = str(done.record["result"])
    if result in shown and len(shown[result]) < _MOST_PICTURES:
        shown[result].append(done)
    elif result == PASSED:
        shown.setdefault(str(done.record.get("outcome", result)), [done])


def axes_of(plan: Plan) -> tuple[Axis, Axis, Axis]:
    """Return rows, columns and panels of the map of a plan: what it has to prove, what it counts by, and the rest.

    Examples
    --------
    >>> from rtec.verify.campaign.plan import read_plan
    >>> [axis.name for axis in axes_of(read_plan("safety"))], [axis.name for axis in axes_of(read_plan("soak"))]
    (['fault', 'phase', 'design'], ['design', '', ''])
    """
    by = [one.name for key in plan.by if (one := plan.kind.parameter(key)) is not None]
    names = dict.fromkeys([*plan.kind.proves, *by, *plan.grid])
    several = [Axis(name=name, values=plan.grid[name]) for name in names if len(plan.grid.get(name, ())) > 1]
    none = Axis(name="", values=ALL)
    rows, columns, panels = [*several, none, none, none][:3]
    if len(columns.values) > len(rows.values):
        rows, columns = columns, rows
    if len(columns.values) * len(panels.values) > _MOST_ACROSS:
        panels = none
    return rows, columns, panels


def _place(parameters: Parameters, *axes: Axis) -> tuple[Value, Value, Value]:
    row, column, panel = (parameters[axis.name] if axis.name else None for axis in axes)
    return row, column, panel


def _groups(plan: Plan) -> list[Group]:
    """Return the threats of EN 50159, then what else faults of a plan happen to."""
    parameter = plan.kind.parameter(_FAULT)
    if not isinstance(parameter, Choice) or "threat" not in parameter.classes:
        return []
    groups = {one.value: Group(one.value, one.defence) for one in Threat}
    for fault in plan.grid[_FAULT]:
        threat = parameter.classes["threat"].get(str(fault))
        title = threat or parameter.classes["category"][str(fault)].replace("-", " ")
        groups.setdefault(title, Group(title, "no threat to messages")).faults.append(str(fault))
    return list(groups.values())


def residual(counts: Counts) -> str:
    """Return the rate of harm, exempt or not, with its bounds of 95 % as text.

    Examples
    --------
    >>> residual(Counts(passed=300)), residual(Counts(passed=96, failed=3, exempt=1)), residual(Counts())
    ('0 of 300: below 0.0099', '4 of 100: 0.011 to 0.099', 'not tried')
    """
    tried, harm = counts.tried, counts.failed + counts.exempt
    if not tried:
        return "not tried"
    if not harm:
        return f"0 of {tried}: below {never_seen(tried):.2g}"
    low, high = clopper_pearson(harm, tried)
    return f"{harm} of {tried}: {low:.2g} to {high:.2g}"
