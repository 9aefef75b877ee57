"""How the rows look everywhere: one name, colour and marker each, and lengths in the study's unit."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from rtec import readable
from rtec.errors import unknown
from rtec.report import palette
from rtec.units import MM_PER_INCH, UNITS, symbol

MISSING = readable.MISSING
"""Stands where a figure is not defined."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Look:
    """Name, colour and marker of one way of correcting, the same in every figure and table."""

    label: str
    colour: str
    ink: str
    """A darker shade of the colour, for words on white."""
    marker: str


_LABELS = {
    "uncompensated": "Uncompensated",
    "table": "Controller's own table",
    "original": "Original",
    "a": "Design A",
    "b": "Design B",
    "c": "Design C",
}


def look_of(name: str) -> Look:
    """Return the look of a row; one that is not known is grey and carries its own name.

    Examples
    --------
    >>> look_of("b").label, look_of("mine").label
    ('Design B', 'mine')
    """
    # figures know one font: what it cannot show would be boxes and warnings
    known = "".join(sign if sign.isascii() and sign.isalnum() else "_" for sign in name[:20])
    colour, ink, marker = palette.WAYS_OF_CORRECTING.get(name, palette.OTHER_WAY)
    return Look(label=_LABELS.get(name) or known or "_", colour=colour, ink=ink, marker=marker)


def is_design(name: str) -> bool:
    """Return whether a row is one of the box's designs.

    Examples
    --------
    >>> is_design("original"), is_design("table")
    (True, False)
    """
    return name not in ("uncompensated", "table")


@dataclass(frozen=True, slots=True, kw_only=True)
class Scale:
    """Turns lengths, positions and feeds in internal units into the study's unit.

    Examples
    --------
    >>> scale_of("um").text(0.12992), scale_of("inch").text(0.1293), scale_of("mm").text(None)
    ('129.9', '0.005091', '–')
    >>> scale_of("inch").with_unit(0.0254), scale_of("um").feed(25.4)
    ('0.001000 inch', '1524 mm/min (60 inch/min)')
    """

    unit: str
    """``um``, ``mm`` or ``inch``, as in headings of files."""
    symbol: str
    """The same for readers."""
    per_mm: float
    """Units in one millimetre."""
    decimals: int
    """Digits behind the point that a reading deserves: a tenth of a micrometre."""
    position_unit: str
    position_per_mm: float
    """Of positions along the axis."""
    feed_unit: str
    feed_per_mm_s: float
    """Of feeds."""

    def text(self, value_mm: float | None) -> str:
        """Return a length as a number, or a dash where there is none."""
        if value_mm is None or not math.isfinite(value_mm):
            return MISSING
        return f"{round(value_mm * self.per_mm, self.decimals) + 0.0:.{self.decimals}f}"

    def with_unit(self, value_mm: float | None) -> str:
        """Return a length with its unit."""
        text = self.text(value_mm)
        return text if text == MISSING else f"{text} {self.symbol}"

    def feed(self, feed_mm_s: float) -> str:
        """Return a feed with its unit; a metric one in inches, too, which are the units of the papers."""
        if math.isnan(feed_mm_s):
            return MISSING
        if math.isinf(feed_mm_s):
            return "any feed"
        text = f"{feed_mm_s * self.feed_per_mm_s:.4g} {self.feed_unit}"
        if self.unit == "inch":
            return text
        return f"{text} ({feed_mm_s * 60.0 / MM_PER_INCH:.3g} inch/min)"


_SCALES = {
    name: Scale(
        unit=name,
        symbol=symbol(name),
        per_mm=1.0 / UNITS[name].factor,
        decimals=decimals,
        position_unit=along,
        position_per_mm=1.0 / UNITS[along].factor,
        feed_unit=f"{along}/min",
        feed_per_mm_s=60.0 / UNITS[along].factor,
    )
    for name, decimals, along in (("um", 1, "mm"), ("mm", 4, "mm"), ("inch", 6, "inch"))
}


def scale_of(unit: str) -> Scale:
    """Return the scale of a study's unit.

    Raises
    ------
    ArgumentError
        A unit other than ``um``, ``mm`` and ``inch``.
    """
    if unit not in _SCALES:
        raise unknown("unit", unit, _SCALES, noun="unit of results")
    return _SCALES[unit]


def number(value: float, digits: int = 4) -> str:
    r"""Return a whole number with thin gaps between thousands, or any other with so many digits.

    Examples
    --------
    >>> number(131186).replace("\u202f", " "), number(0.25), number(float("nan"))
    ('131 186', '0.25', '–')
    """
    if not math.isfinite(value):
        return MISSING
    if float(value).is_integer() and abs(value) < 1e15:
        return f"{int(value):,}".replace(",", "\u202f")
    return f"{value:.{digits}g}"


def joined(words: Iterable[str]) -> str:
    """Return words as a list in a sentence.

    Examples
    --------
    >>> joined(["A", "B", "C"]), joined(["A"])
    ('A, B and C', 'A')
    """
    parts = list(words)
    return parts[0] if len(parts) == 1 else ", ".join(parts[:-1]) + " and " + parts[-1] if parts else ""


printable = readable.printable
