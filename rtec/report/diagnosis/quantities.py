"""How quantities of a diagnosis are written: in the unit that people read, with the digits that they deserve."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

import numpy as np

from rtec.dataset.dataset import Dataset
from rtec.effects import Units
from rtec.inference.results import Value
from rtec.readable import MISSING, common_size, quantity_text, rounded, suited_unit
from rtec.report.appearance import printable
from rtec.units import symbol

_PARTS_OF_UNITS = re.compile(r"[^A-Za-z0-9/]+")
_CERTAIN = 1e-3
"""Probabilities below it are given as a bound: the calibration resolves no finer."""


def unit_suffix(unit: str) -> str:
    """Return a unit as the end of a key: what stands below the first stroke follows ``per``.

    Examples
    --------
    >>> unit_suffix("um"), unit_suffix("um/m/K"), unit_suffix("N/(m/s)"), unit_suffix("ms^2"), unit_suffix("")
    ('_um', '_um_per_m_k', '_n_per_m_s', '_ms2', '')
    """
    top, stroke, bottom = unit.replace("^", "").partition("/")
    words = [top, "per", bottom] if stroke else [top]
    flat = "_".join(_PARTS_OF_UNITS.sub("_", word.replace("/", "_")).strip("_") for word in words)
    return f"_{re.sub('_+', '_', flat).lower()}" if flat else ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Shown:
    """Turns the observed quantity from its unit inside into the one that people read.

    Examples
    --------
    >>> shown = shown_of(Units("mm", "mm", "s"))
    >>> shown.unit, shown.text(0.0123456), shown.with_unit(15.0), shown.text(float("nan"))
    ('um', '12.3', '15.0 mm', '–')
    """

    unit: str
    """As in files."""
    symbol: str
    """As printed."""
    factor: float

    def number(self, value: float | None) -> float | None:
        """Return the value in the shown unit; None where there is none or it is not finite."""
        if value is None or not math.isfinite(value):
            return None
        return float(value) * self.factor

    def text(self, value: float | None) -> str:
        """Return the value with three digits, without the unit: for a column that has it in its head."""
        scaled = self.number(value)
        return MISSING if scaled is None else rounded(scaled, 3)

    def with_unit(self, value: float | None) -> str:
        """Return the value with three digits in the unit that suits its size."""
        scaled = self.number(value)
        if scaled is None:
            return MISSING
        unit, factor = suited_unit(scaled, self.unit)
        return f"{rounded(scaled * factor, 3)} {symbol(unit)}"


def shown_of(units: Units) -> Shown:
    """Return how the observed quantity is shown in documents for programs: in the unit of the contract."""
    unit, factor = units.shown
    return Shown(unit=unit, symbol=symbol(printable(unit)), factor=factor)


def shown_for(dataset: Dataset) -> Shown:
    """Return how the observed quantity is shown to people: all tables and figures in one unit, that of its spread."""
    return shown_in(dataset.units, float(np.std(dataset.observed)))


def shown_in(units: Units, size: float) -> Shown:
    """Return how the observed quantity is shown where it has a certain size, in its unit inside.

    Examples
    --------
    >>> shown_in(Units("deg", "deg", "s"), 2.5).symbol, shown_in(Units("deg", "deg", "s"), 0.001).symbol
    ('deg', 'arcsec')
    """
    shown = shown_of(units)
    unit, factor = suited_unit(size * shown.factor, shown.unit)
    return Shown(unit=unit, symbol=symbol(printable(unit)), factor=shown.factor * factor)


def probability(p: float) -> str:
    """Return a probability in two digits; a very small one as a bound.

    Examples
    --------
    >>> probability(0.2345), probability(1e-12), probability(1.0), probability(float("nan"))
    ('0.23', '< 0.001', '1', '–')
    """
    if not math.isfinite(p):
        return MISSING
    if p < _CERTAIN:
        return f"< {_CERTAIN:g}"
    return f"{p:.2g}"


def value_text(value: Value, size: float | None = None) -> str:
    """Return a parameter with its standard error and unit, rounded to two digits of the error.

    Parameters
    ----------
    value
        The parameter.
    size
        Of the largest with which it shares its unit; None: its own.

    Examples
    --------
    >>> value_text(Value("backlash", 12.3456, 0.234, "um")), value_text(Value("harmonics", 3.0, None, ""))
    ('12.35 ± 0.23 µm', '3')
    >>> value_text(Value("sensor", "temperature_nut", None, "")), value_text(Value("lag", 0.5, 40.0, "ms"))
    ('temperature_nut', '0 ± 40 ms')
    """
    if isinstance(value.value, str):
        return " ".join(words for words in (printable(value.value)[:60], symbol(printable(value.unit))) if words)
    return quantity_text(value.value, printable(value.unit), value.error, size=size)


def named_texts(values: tuple[Value, ...]) -> list[tuple[str, str]]:
    """Return name and text of each parameter of an effect; what has one unit keeps one unit.

    Examples
    --------
    >>> named_texts((Value("mean", 90.0, 9.0, "arcsec"), Value("largest", 7200.0, 36.0, "arcsec")))
    [('mean', '0.0250 ± 0.0025 deg'), ('largest', '2.000 ± 0.010 deg')]
    """
    numbers: dict[str, list[tuple[float, float | None]]] = {}
    for v in values:
        if not isinstance(v.value, str):
            numbers.setdefault(v.unit, []).append((v.value, v.error))
    sizes = {unit: common_size(pairs) for unit, pairs in numbers.items()}
    return [(printable(v.name).replace("_", " "), value_text(v, sizes.get(v.unit))) for v in values]


def parameter_texts(values: tuple[Value, ...], most: int) -> list[str]:
    """Return ``name value ± error unit`` of each parameter, the last of more than ``most`` counted only.

    Examples
    --------
    >>> parameter_texts((Value("lag", 1.5, None, "ms"),), 3), parameter_texts((Value("a", 1.0, None, "um"),) * 3, 2)
    (['lag 1.5 ms'], ['a 1 µm', 'and 2 more'])
    >>> parameter_texts((Value("amplitude_1", 6.22, 0.11, "um"),), 1)  # a number beside a number
    ['amplitude 1: 6.22 ± 0.11 µm']
    """
    texts = [f"{name}{':' if name[-1:].isdigit() else ''} {text}" for name, text in named_texts(values)]
    return texts if len(texts) <= most else [*texts[: most - 1], f"and {len(texts) - most + 1} more"]
