"""Units of a sheet: of deviations as asked for, of positions as suits them."""

from __future__ import annotations

from dataclasses import dataclass

from rtec.metrology import UNITS, JudgedTest
from rtec.units import symbol


@dataclass(frozen=True, slots=True, kw_only=True)
class SheetUnits:
    """Units of a sheet.

    Parameters
    ----------
    name, symbol
        Of deviations, as in files and for people.
    factor
        From the unit inside to it.
    position_symbol, position_factor
        The same for targets.
    """

    name: str
    symbol: str
    factor: float
    position_symbol: str
    position_factor: float


def units_of(test: JudgedTest, unit: str | None) -> SheetUnits:
    """Return the units of a test's sheet.

    Raises
    ------
    ArgumentError
        A unit that the axis does not have.
    """
    name, factor = test.figures.unit_of(unit)
    coordinate = test.figures.coordinate
    position = "inch" if name == "inch" else coordinate.value
    return SheetUnits(
        name=name,
        symbol=symbol(name),
        factor=factor,
        position_symbol=symbol(position),
        position_factor=UNITS[coordinate][position],
    )
