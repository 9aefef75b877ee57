"""What the signature of somebody's function says: its quantities, and where its parameters may lie."""

from __future__ import annotations

import inspect
import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from rtec.effects.quantities import MEANT
from rtec.errors import ArgumentError, unknown
from rtec.units import UNITS

_GEOMETRIC = 10.0
"""Ratio of the bounds from which on steps are equal ratios, not equal differences."""
_NAME = re.compile(r"[a-z][a-z0-9_]{0,39}", re.ASCII)


@dataclass(frozen=True)
class Within:
    """Where a parameter of an effect may lie: from ``low`` to ``high``, in ``unit`` (none: a number).

    The function gets it in the unit that its dimension has inside: lengths in mm, angles in deg, speeds in mm/s or
    deg/s, times in s.

    Raises
    ------
    ArgumentError
        Bounds that are no numbers or not in order, or a unit that is not known.

    Examples
    --------
    >>> Within(1, 50, "um").inside
    (0.001, 0.05, 'mm')
    """

    low: float
    high: float
    unit: str = ""

    def __post_init__(self) -> None:
        """Check bounds and unit."""
        ends = (self.low, self.high)
        if not all(isinstance(end, int | float) and math.isfinite(end) for end in ends) or not self.low < self.high:
            raise ArgumentError("Within", f"{self.low!r}, {self.high!r}", "two finite numbers, the lower one first")
        if self.unit and self.unit not in UNITS:
            raise unknown("Within", str(self.unit)[:60], UNITS, noun="unit")

    def at(self, share: float) -> float:
        """Return the value at a share of the way between the bounds, by ratios where they span a decade."""
        low, high, _ = self.inside
        if low > 0.0 and high / low >= _GEOMETRIC:
            return min(max(float(low * (high / low) ** share), low), high)
        return low + (high - low) * share

    @property
    def inside(self) -> tuple[float, float, str]:
        """Both bounds and the unit as the function gets them."""
        unit = UNITS.get(self.unit)
        if unit is None:
            return float(self.low), float(self.high), self.unit
        target = next(u.name for u in UNITS.values() if u.dimension == unit.dimension and u.factor == 1.0)
        low, high = ((end + unit.offset) * unit.factor for end in (self.low, self.high))
        return low, high, target


def checked_name(name: str) -> str:
    """Return a name that a model file can have, or refuse it."""
    if not _NAME.fullmatch(name):
        allowed = "a name of small letters, digits and _, 40 at most, such as dent; name=... states one"
        raise ArgumentError("effect", repr(name)[:60], allowed)
    return name


def signature_of(function: Callable[..., Any], name: str) -> tuple[tuple[str, ...], dict[str, Within]]:
    """Return the quantities that a function takes, and the bounds of its parameters."""
    try:
        signature = inspect.signature(function, eval_str=True)
    except (NameError, TypeError, ValueError, SyntaxError, AttributeError) as error:
        raise ArgumentError(f"effect {name}", f"{error}", "a function whose annotations can be read") from error
    quantities, bounds = [], {}
    for one in signature.parameters.values():
        if one.kind in (one.VAR_POSITIONAL, one.VAR_KEYWORD):
            raise ArgumentError(f"effect {name}", f"*{one.name}", "named quantities, and parameters behind a *")
        if one.kind is not one.KEYWORD_ONLY:
            quantities.append(one.name)
        elif isinstance(one.annotation, Within):
            bounds[one.name] = one.annotation
        else:
            allowed = f'bounds, as in {one.name}: rtec.Within(0, 500, "mm")'
            raise ArgumentError(f"effect {name}", one.name, allowed, problem=f"{one.name} has no bounds")
    if taken := {"name", "amplitudes", "errors", name} & set(bounds):
        allowed = "other names of parameters: these stand for something else in a model file"
        raise ArgumentError(f"effect {name}", ", ".join(sorted(taken)), allowed)
    if not quantities:
        allowed = f"a quantity that it depends on: {', '.join(MEANT)}, or the name of a column"
        raise ArgumentError(f"effect {name}", "no quantity", allowed)
    return tuple(quantities), bounds
