"""A laser's wavelength that follows the air: an error in proportion to the distance measured."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rtec.effects._heat import SensorShape
from rtec.effects.conditions import Conditions, Floats, one_place
from rtec.effects.protocol import Amplitude, Card, Effect, Over, Shape, Units, own_shape

STANDARD_HPA, STANDARD_DEGC, STANDARD_PERCENT = 1013.25, 20.0, 50.0
"""The air for which a laser without compensation assumes its wavelength."""
LEAST_PPM = 0.1
"""By which the refractive index has to change: a tenth of a micrometre a metre."""
_WAVELENGTH_UM = 0.6329908  # of a helium-neon laser in vacuum


def refractivity(pressure_hpa: Floats, air_degc: Floats, humidity_percent: Floats) -> Floats:
    """Return the refractive index of air less 1, for the light of a helium-neon laser; all of shape (rows,).

    Notes
    -----
    Modified Edlen equation: ``n - 1`` of dry air in proportion to its density, less what vapour displaces.

    References
    ----------
    K. P. Birch and M. J. Downs, An updated Edlen equation for the refractive index of air, Metrologia 30 (1993) 155,
    and 31 (1994) 315; J. A. Stone and J. H. Zimmerman, Index of refraction of air, NIST Engineering Metrology
    Toolbox, appendix A. Pressure of saturated vapour: Magnus's formula (WMO-No. 8, annex 4.B).

    Examples
    --------
    >>> one = np.ones(1)
    >>> round(float(refractivity(1013.25 * one, 20.0 * one, 50.0 * one)[0]) * 1e6, 1)
    271.4
    """
    wave = 1.0 / _WAVELENGTH_UM**2
    standard = 1e-8 * (8342.54 + 2406147.0 / (130.0 - wave) + 15998.0 / (38.9 - wave))
    pascal = 100.0 * pressure_hpa
    density = (1.0 + 1e-8 * (0.601 - 0.00972 * air_degc) * pascal) / (1.0 + 0.0036610 * air_degc)
    vapour = humidity_percent / 100.0 * 611.2 * np.exp(17.62 * air_degc / (243.12 + air_degc))
    displaced = 1e-10 * 292.75 / (air_degc + 273.15) * (3.7345 - 0.0401 * wave) * vapour
    return standard * pascal / 96095.43 * density - displaced


def change_of_index(conditions: Conditions, shape: SensorShape) -> Floats:
    """Return by how much the refractive index differs from that of standard air, shape (rows,)."""
    rows = conditions.rows
    pressure = np.full(rows, STANDARD_HPA) if conditions.pressure_hpa is None else conditions.pressure_hpa
    air = conditions.temperatures.get(shape.sensor)
    humidity = conditions.humidity_percent
    here = refractivity(
        pressure,
        np.full(rows, STANDARD_DEGC) if air is None else air,
        np.full(rows, STANDARD_PERCENT) if humidity is None else humidity,
    )
    standard = (np.full(1, value) for value in (STANDARD_HPA, STANDARD_DEGC, STANDARD_PERCENT))
    return here - refractivity(*standard)


def air_sensors(conditions: Conditions) -> Sequence[SensorShape]:
    """Return the temperatures that may be the air's: those whose names say so, else all; without any the standard."""
    names = list(conditions.temperatures)
    return [SensorShape(name) for name in [name for name in names if "air" in name] or names] or [SensorShape()]


def no_weather(conditions: Conditions) -> str | None:
    """Return why the data cannot show what the air does to a wavelength, or None."""
    if conditions.pressure_hpa is None:
        return "no pressure column"
    if conditions.position_unit != "mm":
        return "no lengths"
    ppm = 1e6 * max(float(np.ptp(change_of_index(conditions, shape))) for shape in air_sensors(conditions))
    return None if ppm >= LEAST_PPM else f"the index of the air changes by {ppm:.2g} ppm only: {LEAST_PPM:g} needed"


class Refraction(Effect):
    """The distance from the laser's zero times the change of the air's refractive index.

    Notes
    -----
    ``deviation = refraction * position * (n - n_standard)``, with n by pressure, temperature and humidity of the air
    (the standard's where a column lacks). A laser without compensation has a refraction of 1: it counts n half
    waves where it assumes n_standard of them. With another laser's own zero the constant part is an offset or a
    ``dead_path``.

    Examples
    --------
    >>> x, air = np.array([0.0, 1000.0]), np.full(2, 983.25)
    >>> c = Conditions(position=x, position_unit="mm", run=np.ones(2, dtype=np.int64), pressure_hpa=air)
    >>> (1e3 * Refraction().contribution(c, SensorShape(), [1.0])).round(1).tolist()
    [0.0, -8.1]
    """

    name = "refraction"
    over = Over.TEMPERATURE
    shape_type = SensorShape
    in_time = True
    data_checks = (no_weather, one_place)
    card = Card(
        title="Refraction of the air",
        formula="`refraction · x · (n − n_standard)`",
        needs="a pressure column, with air temperature and humidity where there are any, and positions in a length",
        plot="The slope against position follows the air pressure from run to run.",
        cause=(
            "The laser's wavelength compensation is off or wrong: 1 um/m for 3.7 hPa, for 1 K of air, or for the "
            "whole range of humidity."
        ),
        consequence="Lengths, and tables made from them, are wrong by the weather.",
        action="Switch the wavelength compensation on, or correct the readings by pressure and air temperature.",
        invariant_to="direction, feed and all that the machine does.",
        source="Birch and Downs (1993); thesis, section 2.3: sensors of the air.",
    )

    def shapes(self, conditions: Conditions) -> Sequence[Shape]:
        return air_sensors(conditions)

    def columns(self, conditions: Conditions, shape: Shape) -> Floats:
        self._needed(conditions.pressure_hpa, "a pressure column")
        return (conditions.position * change_of_index(conditions, own_shape(shape, SensorShape)))[:, None]

    def amplitudes(self, shape: Shape, units: Units) -> tuple[Amplitude, ...]:
        """Return which share of the air's effect is there: 1 without any compensation."""
        return (Amplitude("refraction", "", 1.0),)
