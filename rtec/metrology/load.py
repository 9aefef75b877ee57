"""A positioning test: the readings of a measurement file, with what else it says of the axis."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from rtec.errors import ArgumentError, FileFormatError
from rtec.metrology.measurement import Measurement
from rtec.metrology.readings import Readings, RotaryReadings
from rtec.units import ANGLE, LENGTH, parse_quantity


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PositioningTest:
    """Readings of a file and what else it says.

    Parameters
    ----------
    source
        The file.
    readings
        Of a linear or a rotary axis.
    facts
        ``# key: value`` lines of the file.
    unknown
        Headings of columns that were not used because they name no known quantity.
    """

    source: str
    readings: Readings | RotaryReadings
    facts: Mapping[str, str]
    unknown: tuple[str, ...]

    def period(self, given: str | None) -> float | None:
        """Return the period of the cyclic error: as given, else the fact ``screw_pitch``, else None.

        Parameters
        ----------
        given
            With its unit: a length, or an angle for a rotary axis.

        Returns
        -------
        float or None
            In mm or degrees.

        Raises
        ------
        ArgumentError
            What is given is no length (angle) above zero.
        FileFormatError
            The fact ``screw_pitch`` of the file is none.
        """
        linear = isinstance(self.readings, Readings)
        kind = LENGTH if linear else ANGLE
        text = given if given is not None else self.facts.get("screw_pitch") if linear else None
        if text is None:
            return None
        try:
            period = parse_quantity(text, kind, name="--period")
            if period <= 0:
                raise ArgumentError("--period", text, f"a {kind.name} above zero")
        except ArgumentError as error:
            if given is not None:
                raise
            problem = f"screw_pitch: {error.value} {error.problem or 'is not valid'}"
            raise FileFormatError(self.source, None, problem, error.allowed) from None
        return period


def positioning_test(measurement: Measurement) -> PositioningTest:
    """Return the positioning test that a measurement holds.

    Raises
    ------
    FileFormatError
        It holds none.
    """
    return PositioningTest(
        source=measurement.source,
        readings=measurement.to_readings(),
        facts=measurement.facts,
        unknown=tuple(measurement.unknown),
    )
