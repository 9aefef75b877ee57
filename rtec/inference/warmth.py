"""How warm a machine is that a table is made for, and which effects of a model ask for it."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np

from rtec.dataset.dataset import Dataset
from rtec.effects import Conditions, Floats
from rtec.effects.quantities import quantity_of
from rtec.effects.warm_up import WarmUp
from rtec.errors import ArgumentError, nearest
from rtec.inference.model import Model, Term

TEMPERATURE, SPINDLE, TIME = "temperature", "spindle", "time"
"""What an effect of heat follows; a temperature has its own name behind."""
REFERENCE_DEGC = 20.0
"""Where a model does not say at which temperature its axis has its nominal length (ISO 1)."""
_AHEAD = 2
"""Rows before the others: a spindle at rest, and one that begins to turn."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Warmth:
    """How warm a machine is.

    Parameters
    ----------
    since_on_s
        Time since it was switched on, and since its spindle runs; None: unknown, and long ago for the spindle.
    temperatures_degc
        What thermometers say, and have said for long, by the name of the column: ``temperature_NAME``, or
        ``temperature`` where there is one alone.
    spindle_rpm
        Speed of its spindle; None: unknown.
    reference_degc
        Temperature at which the axis has its nominal length.

    Raises
    ------
    ArgumentError
        A time below 0, or a number that is not finite.

    Examples
    --------
    >>> print(Warmth(since_on_s=3600.0, temperatures_degc={"temperature_screw": 22.0}))
    screw at 22 degC, 60 min after it was switched on
    """

    since_on_s: float | None = None
    temperatures_degc: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))
    spindle_rpm: float | None = None
    reference_degc: float = REFERENCE_DEGC

    def __post_init__(self) -> None:
        if self.since_on_s is not None and not 0.0 <= self.since_on_s < math.inf:
            raise ArgumentError("since_on_s", self.since_on_s, "a time from 0")
        for name, value in self.temperatures_degc.items():
            if not -273.15 <= value < 1e4:
                raise ArgumentError(name, f"{value:g} degC", "a temperature")

    def __str__(self) -> str:
        """Return it in words; nothing where nothing is known."""
        said = [f"{short(name)} at {value:.6g} degC" for name, value in self.temperatures_degc.items()]
        if self.spindle_rpm is not None:
            said.append(f"spindle at {self.spindle_rpm:.6g} rpm")
        if self.since_on_s is not None:
            said.append(f"{self.since_on_s / 60.0:.6g} min after it was switched on")
        return ", ".join(said)

    def contribution(self, term: Term, conditions: Conditions) -> Floats:
        """Return what a term of heat adds on such a machine, shape (rows,), at positions in mm and their directions.

        Notes
        -----
        Two rows are put before: the spindle at rest, and the moment at which it begins to turn.
        """
        rows = conditions.rows + _AHEAD
        time_s, speed = np.full(rows, self.since_on_s or 0.0), None
        time_s[:_AHEAD] = 0.0
        if self.spindle_rpm is not None:
            speed = np.full(rows, self.spindle_rpm)
            speed[0] = self.spindle_rpm if self.since_on_s is None else 0.0
        ahead = conditions.take(np.zeros(_AHEAD, dtype=np.int64))
        standing = Conditions(
            position=np.concatenate([ahead.position, conditions.position]),
            position_unit=conditions.position_unit,
            run=np.ones(rows, dtype=np.int64),
            direction=_joined(ahead.direction, conditions.direction),
            since_reversal=_joined(ahead.since_reversal, conditions.since_reversal),
            time_s=time_s,
            temperatures={name: np.full(rows, value) for name, value in self.temperatures_degc.items()},
            spindle_rpm=speed,
            reference_temperature_degc=self.reference_degc,
        )
        return term.contribution(standing)[_AHEAD:]


def _joined(ahead: Floats | None, behind: Floats | None) -> Floats | None:
    return None if ahead is None or behind is None else np.concatenate([ahead, behind])


def short(name: str) -> str:
    """Return how people name the column of a temperature.

    Examples
    --------
    >>> short("temperature_screw"), short("temperature")
    ('screw', 'temperature')
    """
    return name.removeprefix(f"{TEMPERATURE}_")


def wanted_of(term: Term) -> tuple[str, ...]:
    """Return what has to be known of a machine's warmth for a term: `TIME`, `SPINDLE`, names of temperatures.

    Nothing for effects that are not those of heat in the machine: a laser's air is none, nor a drift.
    """
    if isinstance(term.effect, WarmUp):
        return (TIME,)
    sensor = getattr(term.shape, "sensor", None)
    if sensor is not None and hasattr(term.shape, "lag"):  # the air of a laser lags behind nothing
        return (sensor,)
    own = tuple(getattr(term.effect, "quantities", ()))  # of a curve, and of an effect of the user's
    heats = [name for name in own if name == SPINDLE or _is_heat(name)]
    return (*heats, *(name for name in own if heats and name == TIME))


def _is_heat(name: str) -> bool:
    return name == TEMPERATURE or name.startswith(f"{TEMPERATURE}_")


def heat_terms(model: Model) -> tuple[Term, ...]:
    """Return the terms of a model that follow the heat of the machine."""
    return tuple(term for term in model.terms if wanted_of(term))


def check_warmth(model: Model, warmth: Warmth | None) -> None:
    """Refuse to make a table of a model of heat where it is not said how warm the machine is.

    Raises
    ------
    ArgumentError
        Something that an effect of heat follows is not known.
    """
    wanted = {name: term.name for term in heat_terms(model) for name in wanted_of(term)}
    known = set() if warmth is None else set(warmth.temperatures_degc)
    if warmth is not None and warmth.since_on_s is not None:
        known.add(TIME)
    if warmth is not None and warmth.spindle_rpm is not None:
        known.add(SPINDLE)
    for name, effect in wanted.items():
        if name not in known:
            raise ArgumentError(_asked(name), None, f"{_said(name)}: {effect} of the model follows it")


def check_followed(warmth: Warmth, followed: Iterable[str]) -> None:
    """Refuse a temperature that a model does not follow.

    Raises
    ------
    ArgumentError
        The nearest name that it follows is suggested.
    """
    heats = [short(name) for name in followed if _is_heat(name)]
    for name in map(short, warmth.temperatures_degc):
        if name not in heats:
            allowed = f"what the model follows: {', '.join(heats) or 'no temperature'}"
            raise ArgumentError("--temperature", name, allowed, nearest(name, heats) if heats else "")


def _asked(name: str) -> str:
    return {TIME: "--at", SPINDLE: "--spindle"}.get(name, "--temperature")


def _said(name: str) -> str:
    says = {TIME: "the time since the machine was switched on, as in --at '60 min'", SPINDLE: "--spindle 3000rpm"}
    return says.get(name, f"{short(name)}=22degC")


def mean_warmth(model: Model, dataset: Dataset) -> Warmth:
    """Return how warm a machine was on average over the readings of a data set, as far as a model asks for it."""
    have = dataset.conditions
    wanted = [name for term in heat_terms(model) for name in wanted_of(term) if _is_heat(name)]
    columns = {name: quantity_of(have, name) for name in wanted}
    return Warmth(
        since_on_s=None if have.time_s is None else max(float(have.time_s.mean()), 0.0),
        temperatures_degc={name: float(values.mean()) for name, values in columns.items() if values is not None},
        spindle_rpm=None if have.spindle_rpm is None else float(have.spindle_rpm.mean()),
        reference_degc=have.reference_temperature_degc,
    )
