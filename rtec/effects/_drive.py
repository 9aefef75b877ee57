"""What the effects of a drive's force, torque or current share: units of their amplitudes."""

from __future__ import annotations

from rtec.effects.protocol import Units


def per_speed(units: Units) -> tuple[str, float]:
    """Return the unit of a force per speed, and the factor to it: N/(m/s) on a linear axis.

    Examples
    --------
    >>> per_speed(Units("n", "mm", "s")), per_speed(Units("a", "deg", "s"))
    (('N/(m/s)', 1000.0), ('A/(deg/s)', 1.0))
    """
    unit, factor = units.shown
    return (f"{unit}/(m/s)", 1e3 * factor) if units.position == "mm" else (f"{unit}/({units.speed})", factor)


def per_acceleration(units: Units) -> tuple[str, float]:
    """Return the unit of a force per acceleration, and the factor to it: kg for forces on a linear axis.

    Examples
    --------
    >>> per_acceleration(Units("n", "mm", "s")), per_acceleration(Units("a", "deg", "s"))
    (('kg', 1000.0), ('A/(deg/s^2)', 1.0))
    """
    unit, factor = units.shown
    if units.position != "mm":
        return f"{unit}/({units.position}/s^2)", factor
    return ("kg", 1e3) if units.observed == "n" else (f"{unit}/(m/s^2)", 1e3 * factor)
