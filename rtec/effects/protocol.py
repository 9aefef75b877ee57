"""What a physical effect is to the rest of the program: columns, a scan grid, needs, confounded effects, a card."""

from __future__ import annotations

import abc
import enum
from collections.abc import Callable, Mapping, Sequence
from dataclasses import Field, dataclass, fields
from types import MappingProxyType
from typing import Any, ClassVar, TypeAlias, TypeVar

import numpy as np

from rtec.effects.conditions import Conditions, Floats
from rtec.effects.experiments import Rival, rivals
from rtec.errors import ArgumentError

Parameter: TypeAlias = Field[Any]
"""A field of a shape, with what it is as its metadata."""
LABELS: Mapping[str, str] = {
    "In the plot": "plot",
    "Cause": "cause",
    "Consequence": "consequence",
    "Action": "action",
    "Invariant to": "invariant_to",
    "Source": "source",
}
"""What stands in front of each part of a card, on its page and in a terminal."""
_SHOWN = {"mm": ("um", 1e3), "deg": ("arcsec", 3600.0), "nm": ("N*m", 1.0), "count": ("count", 1.0), "s": ("s", 1.0)}


@dataclass(frozen=True, slots=True, kw_only=True)
class Card:
    """What a user reads about an effect, as on the cards of a ballbar's help."""

    title: str
    formula: str
    """What it adds, in Markdown; docs/effects.md explains the symbols."""
    needs: str
    """What it needs from the data."""
    plot: str
    """How it looks, and in which plot."""
    cause: str
    consequence: str
    action: str
    invariant_to: str
    """What does not change it."""
    source: str
    """Paper, section, equation or table; docs/references.md has them in full."""


class Observable(enum.Enum):
    """What kind of measured quantity an effect contributes to."""

    DEVIATION = "deviation"
    """Actual less commanded position."""
    DRIVE = "drive"
    """Force, torque, current or voltage of a drive."""


class Over(enum.Enum):
    """What an effect depends on in the first place, over which a picture shows it."""

    POSITION = "position"
    VELOCITY = "velocity"
    ACCELERATION = "acceleration"
    REVERSAL = "reversal"
    """The way since the last reversal: a loop over position."""
    TIME = "time"
    TEMPERATURE = "temperature"
    RUN = "run"


class Quantity(enum.Enum):
    """What a shape parameter is, which decides its unit and how it is written."""

    POSITION = "position"
    SPEED = "speed"
    CLOCK = "clock"
    COUNT = "count"
    CHOICE = "choice"
    TEXT = "text"
    NUMBER = "number"
    """In a unit of its own, or none, within bounds: a parameter of an effect that somebody wrote."""


@dataclass(frozen=True, slots=True)
class Shape:
    """What an effect's columns depend on beyond the conditions; an effect without such parameters has no field."""

    @property
    def said_of_it(self) -> str:
        """What is said behind the effect's name, such as its sensor; empty as a rule."""
        return ""


def parameter(quantity: Quantity, meaning: str, **more: object) -> Mapping[str, object]:
    """Return the metadata of a shape's field: what it is and what it means; of a number ``unit``, ``low``, ``high``.

    Examples
    --------
    >>> parameter(Quantity.POSITION, "period")["quantity"].value
    'position'
    """
    return MappingProxyType({"quantity": quantity, "meaning": meaning, **more})


@dataclass(frozen=True, slots=True)
class Tunable:
    """A continuous shape parameter that a refit may move, within bounds."""

    name: str
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class Amplitude:
    """One linear parameter: its name, the unit in which people read it, and the factor from the internal unit."""

    name: str
    unit: str
    factor: float


class Per(enum.Enum):
    """What an amplitude goes with, so that its unit is that of what is observed per unit of it."""

    NOTHING = enum.auto()
    LENGTH = enum.auto()
    SPEED = enum.auto()
    ACCELERATION = enum.auto()
    KELVIN = enum.auto()
    DELAY = enum.auto()
    """Of what goes with a speed: a time where positions are explained."""
    DELAY_SQUARED = enum.auto()
    """Of what goes with an acceleration."""
    CLOCK = enum.auto()
    LOAD = enum.auto()


_OF_LINEAR_AXES = {("mm", Per.LENGTH): ("um/m", 1e6), ("n", Per.ACCELERATION): ("kg", 1e3)}
_OF_POSITIONS = {Per.DELAY: ("ms", 1e3), Per.DELAY_SQUARED: ("ms^2", 1e6)}


@dataclass(frozen=True, slots=True)
class Units:
    """Units inside of what is observed (``mm``, ``deg``, ``n``, ``a``, ``nm``, ``v``), of position, time and load.

    Examples
    --------
    >>> Units("mm", "mm", "s").shown, Units("n", "mm", "s").shown
    (('um', 1000.0), ('N', 1.0))
    >>> Units("mm", "mm", "s").per(Per.LENGTH), Units("deg", "deg", "s").per(Per.LENGTH)
    (('um/m', 1000000.0), ('arcsec/deg', 3600.0))
    >>> Units("n", "mm", "s").per(Per.SPEED), Units("a", "deg", "s").per(Per.SPEED)
    (('N/(m/s)', 1000.0), ('A/(deg/s)', 1.0))
    >>> Units("n", "mm", "s").per(Per.ACCELERATION), Units("a", "deg", "s").per(Per.ACCELERATION)
    (('kg', 1000.0), ('A/(deg/s^2)', 1.0))
    """

    observed: str
    position: str
    clock: str
    load: str = ""

    @property
    def shown(self) -> tuple[str, float]:
        """Unit in which what is observed is shown, and the factor to it."""
        return _SHOWN.get(self.observed, (self.observed.upper(), 1.0))

    def per(self, quantity: Per) -> tuple[str, float]:
        """Return the unit in which what is observed per quantity is shown, and the factor to it."""
        linear = self.position == "mm"
        if linear and (self.observed, quantity) in _OF_LINEAR_AXES:
            return _OF_LINEAR_AXES[self.observed, quantity]
        if self.observed == self.position and quantity in _OF_POSITIONS:
            return _OF_POSITIONS[quantity]
        below, scale = {
            Per.NOTHING: ("", 1.0),
            Per.LENGTH: (f"/{self.position}", 1.0),
            Per.SPEED: ("/(m/s)", 1e3) if linear else (f"/({self.speed})", 1.0),
            Per.ACCELERATION: ("/(m/s^2)", 1e3) if linear else (f"/({self.position}/s^2)", 1.0),
            Per.KELVIN: ("/K", 1.0),
            Per.DELAY: (f"/({self.speed})", 1.0),
            Per.DELAY_SQUARED: (f"/({self.speed}^2)", 1.0),
            Per.CLOCK: ("/h", 3600.0) if self.clock == "s" else (f"/{self.clock}", 1.0),
            Per.LOAD: (f"/{self.load or 'load'}", 1.0),
        }[quantity]
        unit, factor = self.shown
        return unit + below, scale * factor

    @property
    def speed(self) -> str:
        """Unit of speeds inside: position units a second."""
        return f"{self.position}/s"

    def of(self, item: Parameter) -> str:
        """Return the unit inside of a shape parameter; empty for what has none."""
        kinds = {Quantity.POSITION: self.position, Quantity.SPEED: self.speed, Quantity.CLOCK: self.clock}
        found: str = item.metadata.get("unit") or kinds.get(item.metadata["quantity"], "")
        return found


_S = TypeVar("_S", bound=Shape)


def own_shape(shape: Shape, kind: type[_S]) -> _S:
    """Return ``shape``, known to be of the effect's own kind.

    Raises
    ------
    ArgumentError
        The shape belongs to another effect.

    Examples
    --------
    >>> own_shape(Shape(), Shape)
    Shape()
    """
    if not isinstance(shape, kind):
        raise ArgumentError("shape", shape, f"a {kind.__name__}")
    return shape


class Effect(abc.ABC):
    """One physical effect.

    The same object explains data (the columns of a fit) and produces them (``contribution``). A subclass states the
    class attributes and ``columns``, with several amplitudes ``amplitudes``; one with shape parameters states
    ``shapes`` and ``tunables``, too.
    """

    name: str
    card: Card
    """What a user reads about it; `tools/effects_page.py` writes it on docs/effects.md."""
    observable: Observable | None = Observable.DEVIATION
    """None: whatever is measured."""
    shape_type: type[Shape] = Shape
    amplitude: str = ""
    """Name of its only amplitude; empty: that of the effect."""
    amplitude_per: Per = Per.NOTHING
    """What its only amplitude goes with."""
    over: Over = Over.POSITION
    """What a picture shows it over."""
    data_checks: tuple[Callable[[Conditions], str | None], ...] = ()
    """Asked of the data in turn: each returns why they cannot show the effect, or None; an `untestable` of its own
    asks instead."""
    not_negative: bool = False
    """Amplitudes cannot be below zero (friction, inertia)."""
    in_time: bool = False
    """Changes from repeat to repeat, so that repeats are no pure noise where it is present."""
    is_map: ClassVar[bool] = False
    """A smooth function of position; how many nodes it has is chosen by what they explain."""
    is_wave: ClassVar[bool] = False
    """Periodic in position: a decimated log shows it at its rows as well as at every sample."""
    other_columns: frozenset[str] = frozenset()
    """Columns of no known quantity that it depends on, by `heading_name`."""
    builds_on: frozenset[str] = frozenset()
    """Effects to which this one is an addition: it is looked for beside them only."""

    @property
    def needs(self) -> str:
        """What it needs from the data, in words."""
        return self.card.needs

    @property
    def rivals(self) -> tuple[Rival, ...]:
        """Effects that it may be confounded with, and what to measure to separate the two."""
        return rivals().get(self.name, ())

    def explains(self, observable: Observable) -> bool:
        """Return whether it can be part of what is measured."""
        return self.observable is None or self.observable is observable

    def untestable(self, conditions: Conditions) -> str | None:
        """Return why the data cannot show this effect, or None where they can."""
        return next((why for check in self.data_checks if (why := check(conditions)) is not None), None)

    def shapes(self, conditions: Conditions) -> Sequence[Shape]:
        """Return the scan grid: shapes close enough together that none between them is missed."""
        return (self.shape_type(),)

    def tried(self, conditions: Conditions, shape: Shape) -> float:
        """Return from how many shapes one like ``shape`` is chosen, which is what its choice costs a model."""
        return float(len(self.shapes(conditions)))

    def variants(self, conditions: Conditions, shape: Shape) -> Sequence[Shape]:
        """Return simpler and richer forms around the best of the scan (harmonics, nodes, directions)."""
        return (shape,)

    def tunables(self, conditions: Conditions, shape: Shape) -> Sequence[Tunable]:
        """Return the continuous parameters that a refit may move, near ``shape``."""
        return ()

    @abc.abstractmethod
    def columns(self, conditions: Conditions, shape: Shape) -> Floats:
        """Return the contribution of unit amplitudes, shape (rows, amplitudes)."""

    def scan(self, conditions: Conditions, shapes: Sequence[Shape]) -> Floats:
        """Return the columns of shapes with the same number of amplitudes, shape (shapes, amplitudes, rows)."""
        return np.stack([self.columns(conditions, shape).T for shape in shapes])

    def amplitudes(self, shape: Shape, units: Units) -> tuple[Amplitude, ...]:
        """Return name and unit of each amplitude."""
        return (Amplitude(self.amplitude or self.name, *units.per(self.amplitude_per)),)

    def contribution(self, conditions: Conditions, shape: Shape, amplitudes: Sequence[float]) -> Floats:
        """Return what the effect adds to the observed quantity, shape (rows,), in its unit inside."""
        return self.columns(conditions, shape) @ np.asarray(amplitudes, dtype=np.float64)

    def summary(self, shape: Shape, amplitudes: Sequence[float], units: Units) -> tuple[tuple[str, float, str], ...]:
        """Return what people read of a fitted effect: (name, value, unit) of each number.

        The continuous shape parameters in units inside, as they are given, then the amplitudes in the units in which
        they are shown. A parameter that is 0 where it is not given (a lag, an overshoot) is left out where it is 0.
        """
        chosen = tuple(
            (f.name, float(getattr(shape, f.name)), unit)
            for f in fields(shape)
            if ((unit := units.of(f)) or f.metadata["quantity"] is Quantity.NUMBER)
            and (f.default != 0.0 or getattr(shape, f.name) != 0.0)
        )
        linear = zip(self.amplitudes(shape, units), amplitudes, strict=True)
        return chosen + tuple((a.name, float(value) * a.factor, a.unit) for a, value in linear)

    def _needed(self, values: Floats | None, what: str) -> Floats:
        """Return a column of the conditions that the effect cannot do without, or raise an error that names it."""
        if values is None:
            raise ArgumentError(
                f"effect {self.name}", f"data without {what}", f"data with {what}", f"needs {self.needs}"
            )
        return values


class ScannedEffect(Effect):
    """An effect with one amplitude that makes the columns of many shapes at once."""

    def columns(self, conditions: Conditions, shape: Shape) -> Floats:
        """Return the contribution of a unit amplitude, shape (rows, 1)."""
        column: Floats = self.scan(conditions, [shape])[0].T
        return column

    @abc.abstractmethod
    def scan(self, conditions: Conditions, shapes: Sequence[Shape]) -> Floats:
        """Return the columns of shapes, shape (shapes, 1, rows)."""
