"""A positioning test with everything that is said of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from rtec.metrology.figures import PositioningFigures
from rtec.metrology.uncertainty import PositioningUncertainty
from rtec.metrology.vdi3441 import VdiFigures


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JudgedTest:
    """A positioning test and what is said of it."""

    name: str
    """For people; of the file."""
    facts: Mapping[str, str]
    """What the file says of machine, axis, date."""
    figures: PositioningFigures
    vdi: VdiFigures | None
    uncertainty: PositioningUncertainty
    """``figures``, ``vdi``, ``uncertainty``: by ISO 230-2 and VDI/DGQ 3441, and how sure they are."""
    warnings: tuple[str, ...]
    """What speaks against the test or limits its figures."""
    unknown: tuple[str, ...]
    """Headings of columns that were not used."""
    notes: tuple[str, ...] = ()
    """What was guessed when the file was read."""

    def to_dict(self, unit: str | None = None) -> dict[str, Any]:
        """Return everything under the contract's names, in a unit as of `PositioningFigures.to_dict`, ready for JSON.

        Raises
        ------
        ArgumentError
            A unit that the axis does not have.
        """
        factor = self.figures.unit_of(unit)[1]
        return {
            **self.figures.to_dict(unit),
            "vdi3441": None if self.vdi is None else self.vdi.to_dict(factor),
            "uncertainty": self.uncertainty.to_dict(factor),
            "warnings": list(self.warnings),
            "unknown_columns": list(self.unknown),
            "notes": list(self.notes),
        }
