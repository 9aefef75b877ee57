"""What the axis did at each reading: everything that a physical effect can depend on."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from rtec.errors import ArgumentError

Floats = NDArray[np.float64]
SAME = 1e-6
"""Positions nearer than this share of the span are one position: a file's rounding would decide otherwise."""
GAP = 10.0
"""Times the usual interval between readings, after which nothing is known of the motion between two runs."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Conditions:
    """The conditions of each reading, as columns of equal length.

    Parameters
    ----------
    position
        Commanded position (actual where there is no command; time where there is neither), shape (rows,), in
        ``position_unit``.
    position_unit
        ``mm``, ``deg``, ``count``, or ``s`` where time is the coordinate.
    run
        Repeat number, shape (rows,).
    direction
        +1 or −1, of approach or of motion; 0 at rest in a moving log; None where the data do not tell.
    time_s
        Seconds since the first reading; None where the file has no time: then row order counts as time.
    velocity, acceleration
        In position units a second (a second squared); None for readings at rest without a feed.
    since_reversal
        Distance travelled since the last reversal, in position units; None without directions.
    temperatures
        In degC, by the name of the column.
    spindle_rpm
        Speed of the spindle in rev/min, held from reading to reading; None where it was not recorded.
    pressure_hpa, humidity_percent
        Of the air; None where they were not recorded.
    load
        On the axis, in whatever unit the file has; None where it was not recorded.
    others
        Columns of no known quantity, by `heading_name`.
    reference_temperature_degc
        At which the axis has its nominal length (ISO 1: 20 degC).
    screw_pitch, signal_period, revolution
        Periods that the file states, in position units: of the screw, of the scale's signal, of a turn of the
        encoder.
    moving
        True for a log of a moving axis, false for readings at rest.

    Raises
    ------
    ArgumentError
        Columns of unequal length or without rows.

    Examples
    --------
    >>> c = Conditions(position=np.array([0.0, 5.0, 10.0]), position_unit="mm", run=np.ones(3, dtype=np.int64))
    >>> c.rows, c.span, c.clock_unit
    (3, 10.0, 'reading')
    """

    position: Floats
    position_unit: str
    run: NDArray[np.int64]
    direction: Floats | None = None
    time_s: Floats | None = None
    velocity: Floats | None = None
    acceleration: Floats | None = None
    since_reversal: Floats | None = None
    temperatures: Mapping[str, Floats] = field(default_factory=lambda: MappingProxyType({}))
    spindle_rpm: Floats | None = None
    pressure_hpa: Floats | None = None
    humidity_percent: Floats | None = None
    load: Floats | None = None
    others: Mapping[str, Floats] = field(default_factory=lambda: MappingProxyType({}))
    reference_temperature_degc: float = 20.0
    screw_pitch: float | None = None
    signal_period: float | None = None
    revolution: float | None = None
    moving: bool = False
    first_row: int = 0
    """Row order of the first reading, where these conditions are a part of more."""
    whole: Conditions | None = None
    """The conditions of which these are a drawn part, where its places say what the part resolves."""
    order_of_rows: Floats | None = None
    """Row order of each reading, where these conditions are a selection."""

    def __post_init__(self) -> None:
        sizes = {name: np.shape(value) for name, value in self._columns()}
        if len(set(sizes.values())) != 1 or self.position.ndim != 1 or self.position.size == 0:
            raise ArgumentError("conditions", sizes, "columns of one shape (rows,), with rows")

    def _columns(self) -> list[tuple[str, NDArray[np.float64] | NDArray[np.int64]]]:
        found = [(f.name, getattr(self, f.name)) for f in fields(self)]
        named = [(name, value) for name, value in found if isinstance(value, np.ndarray)]
        return [*named, *self.temperatures.items(), *self.others.items()]

    @property
    def rows(self) -> int:
        """Number of readings."""
        return int(self.position.size)

    @property
    def order(self) -> Floats:
        """Row order of each reading, shape (rows,)."""
        if self.order_of_rows is not None:
            return self.order_of_rows
        return np.arange(self.first_row, self.first_row + self.rows, dtype=np.float64)

    @cached_property
    def path(self) -> tuple[Conditions, NDArray[np.int64]]:
        """The conditions along the whole way, and which rows of them these are: what remembers needs all of it."""
        if self.whole is None:
            return self, np.arange(self.rows)
        return self.whole, np.searchsorted(self.whole.order, self.order)

    @property
    def clock(self) -> Floats:
        """Time of each reading: seconds, or row order where there is no time; shape (rows,)."""
        return self.order if self.time_s is None else self.time_s

    @property
    def clock_unit(self) -> str:
        """Unit of ``clock``: ``s`` or ``reading``."""
        return "reading" if self.time_s is None else "s"

    @property
    def time_is_coordinate(self) -> bool:
        """Whether the file has no position, so that time stands for it."""
        return self.position_unit == "s"

    @property
    def on_schedule(self) -> bool:
        """Whether nothing but time goes on while a spindle changes its speed."""
        return self.time_is_coordinate and self.spindle_rpm is not None and float(np.ptp(self.spindle_rpm)) > 0.0

    @cached_property
    def span(self) -> float:
        """Length over which positions spread; those of the whole, where these are a drawn part of it."""
        return float(np.ptp(self.position)) if self.whole is None else self.whole.span

    @cached_property
    def places(self) -> Floats:
        """Distinct positions, ascending, the middle of those that are alike; of the whole, where this is a part."""
        if self.whole is not None:
            return self.whole.places
        ordered = np.unique(self.position)
        if ordered.size < 2 or self.span == 0.0:
            return ordered[:1]
        apart = np.diff(ordered) > SAME * self.span
        middle: Floats = (ordered[np.append(True, apart)] + ordered[np.append(apart, True)]) / 2.0
        return middle

    @cached_property
    def both_directions(self) -> bool:
        """Whether positions were approached from both sides."""
        return self.direction is not None and bool((self.direction > 0).any() and (self.direction < 0).any())

    @cached_property
    def motion_begins(self) -> NDArray[np.bool_]:
        """Where nothing is known of the way to a reading: at a run that does not go on where the last one ended.

        Examples
        --------
        >>> run, time_s = np.array([1, 1, 2, 2, 3, 3]), np.array([0.0, 1.0, 2.0, 3.0, 60.0, 61.0])
        >>> Conditions(position=np.zeros(6), position_unit="mm", run=run, time_s=time_s).motion_begins.tolist()
        [True, False, False, False, True, False]
        """
        new = np.concatenate([[True], np.diff(self.run) != 0])
        if self.time_s is None:
            return new
        passed = np.concatenate([[np.inf], np.diff(self.time_s)])
        usual = float(np.median(passed[~new])) if (~new).any() else 0.0
        return new & ((passed > GAP * usual) | (passed < 0.0))

    def take(self, rows: NDArray[np.int64] | NDArray[np.bool_]) -> Conditions:
        """Return the conditions of some of the readings, which keep their time and row order.

        Examples
        --------
        >>> c = Conditions(position=np.arange(4.0), position_unit="mm", run=np.ones(4, dtype=np.int64))
        >>> c.take(np.array([2, 3])).order.tolist()
        [2.0, 3.0]
        """
        picked = {
            f.name: getattr(self, f.name)[rows] for f in fields(self) if isinstance(getattr(self, f.name), np.ndarray)
        }
        picked["order_of_rows"] = self.order[rows]
        for name in ("temperatures", "others"):
            picked[name] = MappingProxyType({key: values[rows] for key, values in getattr(self, name).items()})
        return replace(self, **picked)


def heading_name(heading: str) -> str:
    """Return a heading as the name of a function's parameter: small letters, digits and _.

    Examples
    --------
    >>> heading_name("Oil level [%]")
    'oil_level'
    """
    return re.sub(r"[^a-z0-9]+", "_", heading.lower()).strip("_")


def one_place(conditions: Conditions) -> str | None:
    """Return why the data cannot show a slope, or None."""
    return None if conditions.places.size >= 2 else "one position only"


def one_way(conditions: Conditions) -> str | None:
    """Return why the data cannot show what depends on the direction, or None."""
    return None if conditions.both_directions else "one direction only"


def no_speed(conditions: Conditions) -> str | None:
    """Return why the data cannot show what depends on speed, or None."""
    if conditions.velocity is None:
        return "no velocity or feed column"
    return None if np.any(conditions.velocity) else "the velocity is zero throughout"


def no_acceleration(conditions: Conditions) -> str | None:
    """Return why the data cannot show what depends on acceleration, or None."""
    if conditions.acceleration is None:
        return "no moving data"
    return None if np.any(conditions.acceleration) else "the acceleration is zero throughout"


def no_spread(conditions: Conditions) -> str | None:
    """Return why the data cannot show what grows with the position, or None."""
    if conditions.time_is_coordinate:
        return "no positions: what grows with them cannot be seen"
    return one_place(conditions)


def scheduled(conditions: Conditions) -> str | None:
    """Return why the data cannot show what comes in time alone, or None.

    A spindle that changes its speed moves its end at once and by its heat: a step, a period or the way to one end may
    be the schedule's.
    """
    return "the spindle changes its speed: what comes in time may come of that" if conditions.on_schedule else None


def too_few_moments(conditions: Conditions, fewest: int) -> str | None:
    """Return why the data cannot show a course in time, or None."""
    if conditions.time_s is None:
        return "no time column"
    moments = np.unique(conditions.time_s).size
    return None if moments >= fewest else f"{moments} moments only: at least {fewest} needed"


def distance_since_reversal(
    position: Floats, direction: Floats, run: NDArray[np.int64], *, moving: bool = False
) -> Floats:
    """Return how far the axis has gone since it last turned round, from columns of readings in order.

    Arguments and result are of shape (rows,), the result in the unit of the positions.

    The axis turns where it was read last, or a little beyond; while it is ``moving``, at the first sample in the
    other direction. The first reading of a run counts as one just after a reversal, and so does one that does not lie
    in its direction from the last: the program overshoots and comes back.

    Examples
    --------
    >>> x, way = np.array([0.0, 5.0, 10.0, 10.0, 5.0]), np.array([1.0, 1.0, 1.0, -1.0, -1.0])
    >>> distance_since_reversal(x, way, np.ones(5, dtype=np.int64)).tolist()
    [0.0, 5.0, 10.0, 0.0, 5.0]
    >>> distance_since_reversal(np.array([3.0, 9.0, 4.0, 2.0]), np.array([1.0, 1.0, -1.0, -1.0]), np.ones(4)).tolist()
    [0.0, 6.0, 5.0, 7.0]
    """
    turned = np.ones(position.size, dtype=np.bool_)
    turned[1:] = (direction[1:] != direction[:-1]) | (run[1:] != run[:-1])
    starts = np.flatnonzero(turned)
    before = np.maximum(starts - 1, 0)
    onward = (run[before] == run[starts]) & (direction[starts] * (position[starts] - position[before]) > 0.0)
    begin = np.where(onward & (not moving), before, starts)[np.cumsum(turned) - 1]
    gone: Floats = np.abs(position - position[begin])
    return gone
