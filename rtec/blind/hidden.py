"""What is hidden: its name, its numbers and how strong it is; and who decides how strong a unit of it is."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from rtec.blind.plan import Floats
from rtec.metrology import Column


@dataclass(frozen=True, slots=True)
class Parameter:
    """A number of a hidden effect, as people read it."""

    name: str
    value: float
    unit: str
    scales: bool = False
    """Proportional to the strength of the effect; given for unit strength until that is known."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Hidden:
    """An effect that was hidden."""

    name: str
    """As in the library of effects, or a name of its own for what lies outside."""
    description: str
    """What it does physically."""
    parameters: tuple[Parameter, ...]
    """Its numbers."""
    rms_sigma: float
    """RMS of its contribution over the readings, mean removed, in units of the repeat noise."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Secret:
    """What the game hid in a measurement."""

    effects: tuple[Hidden, ...]
    """What was hidden, with its strength as it came out."""
    noise: str
    """``white`` or ``correlated``."""
    sigma_um: float
    """Standard deviation of the noise of one reading."""
    seed: int
    """That decided everything drawn."""
    plan: str
    """Name of the plan."""
    outside: tuple[str, ...]
    """Names of those effects that lie outside the library."""

    @property
    def names(self) -> tuple[str, ...]:
        """Names of what was hidden."""
        return tuple(hidden.name for hidden in self.effects)


class Recorded(NamedTuple):
    """What a measurement of the axis holds, and what was hidden in it."""

    columns: list[Column]
    """Everything that was read, in order of the readings."""
    unknown: dict[str, Floats]
    """Columns that no known quantity names."""
    hidden: dict[str, Hidden]
    """By name."""


def rms(values: Floats) -> float:
    """Return the RMS of ``values`` about their mean.

    Examples
    --------
    >>> rms(np.array([1.0, 3.0]))
    1.0
    """
    return float(np.std(values))


def hidden_of(
    name: str, description: str, parameters: tuple[Parameter, ...], factor: float, rms_mm: float, sigma_mm: float
) -> Hidden:
    """Return what was hidden: an effect ``factor`` times as strong as the one that adds ``rms_mm``.

    Examples
    --------
    >>> play = Parameter("play", 2.0, "um", scales=True)
    >>> hidden = hidden_of("backlash", "play", (play, Parameter("period", 5.0, "mm")), 3.0, 0.001, 0.002)
    >>> [parameter.value for parameter in hidden.parameters], hidden.rms_sigma
    ([6.0, 5.0], 1.5)
    """
    scaled = tuple(replace(one, value=one.value * factor) if one.scales else one for one in parameters)
    return Hidden(name=name, description=description, parameters=scaled, rms_sigma=factor * rms_mm / sigma_mm)
