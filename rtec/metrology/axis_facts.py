"""Facts of the axis, from the ``# key: value`` lines of a file or from options, in the units of its position."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from rtec.errors import ArgumentError, FileFormatError, RtecError, unknown
from rtec.metrology.plain_numbers import shown
from rtec.units import ANGLE, LENGTH, NUMBER, TIME, Kind, parse_quantity

_FACTS = ("counts_per_rev", "screw_pitch", "scale_signal_period", "reference_temperature", "blocks")
_COUNTS = re.compile(rf"\s*({NUMBER})\s*(?:counts?(?:\s*/\s*rev|\s+per\s+rev\w*)?)?\s*", re.IGNORECASE)
_COUNTS_IN_WORDS = re.compile(rf"(?<![\w.])({NUMBER})\s*counts?\s*(?:/|per)\s*rev", re.IGNORECASE)
_COUNT_PERIOD = re.compile(rf"\s*({NUMBER})\s*counts?\s*", re.IGNORECASE)
_TEMPERATURE = re.compile(rf"\s*({NUMBER})\s*°?\s*(degc|degf|c|f|k|kelvin|celsius|fahrenheit)\s*", re.IGNORECASE)
_KINDS: dict[str, Kind] = {"mm": LENGTH, "deg": ANGLE}
_COLDEST_DEGC, _ROOM_DEGC = -273.15, 20.0


@dataclass(frozen=True, slots=True, kw_only=True)
class AxisFacts:
    """What a file says of the axis, and the options ``given``, which go before it and are refused under another name.

    Examples
    --------
    >>> said = {"screw_pitch": "0.25 inch", "axis": "motor, 8192 counts/rev"}
    >>> facts = AxisFacts(source="x.csv", said=said, given={"reference_temperature": "68 degF"})
    >>> facts.period("screw_pitch", "mm"), facts.counts_per_rev(), facts.reference_temperature_degc()
    (6.35, (8192.0, 'axis'), 20.0)
    """

    source: str
    said: Mapping[str, str]
    given: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))

    def __post_init__(self) -> None:
        for key in self.given:
            if key not in _FACTS:
                raise unknown("facts", key, _FACTS, noun="fact of an axis")

    def text(self, key: str) -> str | None:
        """Return what is said of one fact, or None."""
        return self.given.get(key, self.said.get(key))

    def wrong(self, key: str, allowed: str) -> RtecError:
        """Return the error for a fact that does not say what it should, naming who said it."""
        text = self.text(key) or ""
        if key in self.given:
            return ArgumentError(key, shown(text), allowed)
        return FileFormatError(self.source, None, f"{key}: {shown(text)} is not valid", allowed)

    def counts_per_rev(self) -> tuple[float, str] | None:
        """Return the counts of a turn and the fact that states them, or None.

        Words such as ``8192 counts/rev`` in any other fact will do, unless two of them contradict each other.
        """
        key = "counts_per_rev"
        if (text := self.text(key)) is not None:
            match = _COUNTS.fullmatch(text)
            if match is None or not 0.0 < float(match[1]) < 1e12:
                raise self.wrong(key, "a number above 0, such as 8192")
            return float(match[1]), key
        said = [(float(m[1]), k) for k, v in self.said.items() for m in _COUNTS_IN_WORDS.finditer(v)]
        different = {counts for counts, _ in said}
        return said[0] if len(different) == 1 and 0.0 < said[0][0] < 1e12 else None

    def period(self, key: str, position_unit: str) -> float | None:
        """Return a stated period in the unit of the position (``mm``, ``deg``, ``count``, ``s``), or None.

        A length or an angle cannot be turned into counts or into time: then None. What is no quantity above zero, or
        of another dimension than the position, is refused.
        """
        text = self.text(key)
        if text is None:
            return None
        if position_unit == "count" and (match := _COUNT_PERIOD.fullmatch(text)) and float(match[1]) > 0.0:
            return float(match[1])
        if position_unit in _KINDS:
            return self._above_zero(key, text, _KINDS[position_unit])
        for kind in (TIME, LENGTH, ANGLE):
            try:
                value = parse_quantity(text, kind, name=key)
            except ArgumentError:
                continue
            if value > 0.0:
                return value if kind.unit == position_unit else None
        raise self.wrong(key, "a period above zero with its unit, such as 6.35 mm, 4 deg")

    def _above_zero(self, key: str, text: str, kind: Kind) -> float:
        try:
            value = parse_quantity(text, kind, name=key)
        except ArgumentError as error:
            if key in self.given:
                raise
            problem = f"{key}: {error.value} {error.problem or 'is not valid'}"
            raise FileFormatError(self.source, None, problem, error.allowed) from None
        if value <= 0.0:
            raise self.wrong(key, f"{'an' if kind is ANGLE else 'a'} {kind.name} above zero")
        return value

    def reference_temperature_degc(self) -> float:
        """Return the reference temperature in degC, 20 where it is not stated."""
        key = "reference_temperature"
        text = self.text(key)
        match = _TEMPERATURE.fullmatch(f"{_ROOM_DEGC} degC" if text is None else text)
        value, scale = (float(match[1]), match[2].lower().removeprefix("deg")[0]) if match else (-1e9, "c")
        degc = {"c": value, "f": (value - 32.0) / 1.8, "k": value + _COLDEST_DEGC}[scale]
        if not _COLDEST_DEGC <= degc < 1e4:
            raise self.wrong(key, "a temperature with its unit, such as 20 degC, 68 degF, 293.15 K")
        return degc
