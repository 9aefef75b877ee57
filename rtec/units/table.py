"""The one table of units: of each its dimension, its size, how it is printed, and how people write it in headings.

Whatever reads or shows a unit asks here. A unit has one name in options, TOML files and JSON (``um``, ``N*m``,
``mm/s``); in the headings of a measurement file it stands in small letters (``deviation_um``, ``torque_nm``,
``feed_mm_s``).
"""

from __future__ import annotations

import enum
import math
import re
from dataclasses import dataclass

from rtec.units._time_kernels import PS_PER_MS, PS_PER_NS, PS_PER_S, PS_PER_US

MM_PER_INCH = 25.4
"""Millimetres in one inch, exact."""
PS_PER = {"s": PS_PER_S, "ms": PS_PER_MS, "us": PS_PER_US, "ns": PS_PER_NS, "ps": 1}
"""Picoseconds in a unit of time, the largest first."""


class Heading(enum.Enum):
    """In the headings of which files a unit is known."""

    OURS = "files as rtec writes them, and other people's"
    OTHERS = "other people's files"
    NONE = "none"


@dataclass(frozen=True, slots=True)
class Unit:
    """A unit."""

    name: str
    """As in options, TOML files and JSON."""
    dimension: str
    """Units of one dimension can be turned into each other."""
    factor: float
    """From the unit to the one that the dimension has inside: inside = (value + offset) * factor."""
    words: tuple[str, ...] = ()
    """What else it is called in other people's headings, in small letters, with a plain u for µ."""
    heading: Heading = Heading.OURS
    """Whether headings have it at all."""
    offset: float = 0.0

    @property
    def symbol(self) -> str:
        """As it is printed for people.

        Examples
        --------
        >>> [UNITS[name].symbol for name in ("um", "urad", "N*m", "deg")]
        ['µm', 'µrad', 'N·m', 'deg']
        """
        name = self.name.replace("*", "·")
        return f"µ{name[1:]}" if name[0] == "u" else name

    @property
    def column(self) -> str:
        """As it ends a heading of a measurement file.

        Examples
        --------
        >>> [UNITS[name].column for name in ("degC", "mm/s", "N*m")]
        ['degc', 'mm_s', 'nm']
        """
        return self.name.replace("/", "_").replace("*", "").lower()


_OTHERS, _NONE = Heading.OTHERS, Heading.NONE

UNITS = {
    unit.name: unit
    for unit in (
        Unit("mm", "length", 1.0, ("millimeter", "millimetre", "millimeters", "millimetres")),
        Unit("um", "length", 1e-3, ("micron", "microns", "mikron", "mikrometer", "micrometer", "micrometre", "mue",
                                    "mu", "my")),
        Unit("nm", "length", 1e-6, ("nanometer", "nanometre", "n m", "n*m", "n·m")),
        Unit("m", "length", 1e3, ("meter", "metre")),
        Unit("inch", "length", MM_PER_INCH, ("in", "inches", "zoll", "in.")),
        Unit("thou", "length", MM_PER_INCH / 1000.0, ("mil", "mils"), _OTHERS),
        Unit("uinch", "length", MM_PER_INCH / 1e6,
             ("uin", "uin.", "microinch", "microinches", "micro inch", "uinches"), _OTHERS),
        Unit("deg", "angle", 1.0, ("°", "degree", "degrees", "grad")),
        Unit("rad", "angle", 180.0 / math.pi, ("radian", "radians")),
        Unit("mrad", "angle", 0.18 / math.pi, (), _OTHERS),
        Unit("urad", "angle", 0.18e-3 / math.pi, (), _OTHERS),
        Unit("arcmin", "angle", 1.0 / 60.0, (), _OTHERS),
        Unit("arcsec", "angle", 1.0 / 3600.0, ("arc sec", "arc-sec", "arcseconds", "arc seconds", "winkelsekunden")),
        Unit("rev", "revolutions", 1.0, ("revs", "revolution", "revolutions", "turn", "turns", "umdr", "u")),
        Unit("count", "counts", 1.0, ("counts", "cts", "inc", "incs", "increments", "inkremente", "ticks", "lsb")),
        Unit("s", "time", 1.0, ("sec", "secs", "second", "seconds", "sek", "sekunden")),
        Unit("ms", "time", 1e-3, ("msec", "milliseconds")),
        Unit("us", "time", 1e-6, ("usec",)),
        Unit("ns", "time", 1e-9, (), _NONE),
        Unit("min", "time", 60.0, ("minutes", "minuten")),
        Unit("h", "time", 3600.0, ("hr", "hrs", "hours")),
        Unit("Hz", "frequency", 1.0, (), _NONE),
        Unit("kHz", "frequency", 1e3, (), _NONE),
        Unit("MHz", "frequency", 1e6, (), _NONE),
        Unit("GHz", "frequency", 1e9, (), _NONE),
        Unit("THz", "frequency", 1e12, (), _NONE),
        Unit("mm/s", "speed", 1.0, ("mm/s", "mm/sec")),
        Unit("mm/min", "speed", 1.0 / 60.0, ("mm/min",)),
        Unit("m/min", "speed", 1e3 / 60.0, ("m/min",)),
        Unit("m/s", "speed", 1e3, ("m/s",)),
        Unit("inch/min", "speed", MM_PER_INCH / 60.0, ("in/min", "inch/min", "ipm")),
        Unit("deg/s", "angular speed", 1.0, ("°/s", "deg/s")),
        Unit("rad/s", "angular speed", 180.0 / math.pi, ("rad/s",)),
        Unit("rpm", "angular speed", 6.0, ("1/min", "u/min", "rev/min", "min-1", "min^-1")),
        Unit("mm/s^2", "acceleration", 1.0, (), _NONE),
        Unit("m/s^2", "acceleration", 1e3, (), _NONE),
        Unit("mm/s^3", "jerk", 1.0, (), _NONE),
        Unit("m/s^3", "jerk", 1e3, (), _NONE),
        Unit("1/s", "rate", 1.0, (), _NONE),
        Unit("1/min", "rate", 1.0 / 60.0, (), _NONE),
        Unit("Hz/s", "sweep", 1.0, (), _NONE),
        Unit("kHz/s", "sweep", 1e3, (), _NONE),
        Unit("MHz/s", "sweep", 1e6, (), _NONE),
        Unit("GHz/s", "sweep", 1e9, (), _NONE),
        Unit("degC", "temperature", 1.0, ("°c", "c", "deg c", "celsius", "grad c", "oc")),
        Unit("degF", "temperature", 1.0 / 1.8, ("°f", "f", "deg f", "fahrenheit"), offset=-32.0),
        Unit("K", "temperature", 1.0, ("kelvin",), offset=-273.15),
        Unit("N", "force", 1.0, ("newton",)),
        Unit("mN", "force", 1e-3, (), _NONE),
        Unit("kN", "force", 1e3, (), _OTHERS),
        Unit("N*m", "torque", 1.0),
        Unit("mN*m", "torque", 1e-3, (), _NONE),
        Unit("kN*m", "torque", 1e3, (), _NONE),
        Unit("A", "current", 1.0, ("amp", "amps", "ampere")),
        Unit("uA", "current", 1e-6, (), _NONE),
        Unit("mA", "current", 1e-3, (), _OTHERS),
        Unit("kA", "current", 1e3, (), _NONE),
        Unit("V", "voltage", 1.0, ("volt", "volts")),
        Unit("uV", "voltage", 1e-6, (), _NONE),
        Unit("mV", "voltage", 1e-3, (), _OTHERS),
        Unit("kV", "voltage", 1e3, (), _NONE),
        Unit("hPa", "pressure", 1.0),
        Unit("mbar", "pressure", 1.0),
        Unit("Pa", "pressure", 1e-2),
        Unit("bar", "pressure", 1e3),
        Unit("kPa", "pressure", 10.0, (), _OTHERS),
        Unit("mmHg", "pressure", 1.33322387415, ("torr",), _OTHERS),
        Unit("inHg", "pressure", 33.86389, (), _OTHERS),
        Unit("percent", "share", 1.0, ("%", "% rh", "%rh", "% rf", "%rf", "rh")),
        Unit("%", "share", 1.0, (), _NONE),
    )
}  # fmt: skip
"""By name; of one dimension in the order in which messages list them."""


def symbol(unit: str) -> str:
    """Return a unit, or a product and quotient of several, as it is printed.

    Examples
    --------
    >>> symbol("um/m/K"), symbol("N*m"), symbol("ms^2"), symbol("arcsec"), symbol("us")
    ('µm/m/K', 'N·m', 'ms²', 'arcsec', 'µs')
    """
    printed = re.sub(r"[A-Za-z]+", lambda word: UNITS[word[0]].symbol if word[0] in UNITS else word[0], unit)
    return printed.replace("*", "·").replace("^2", "²").replace("^3", "³")
