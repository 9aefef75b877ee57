"""Air and a laser: the refractive index against a formula for the shop floor, and what needs which columns."""

import numpy as np
import pytest

from rtec.effects import Conditions
from rtec.effects.dead_path import DeadPath
from rtec.effects.refraction import Refraction, air_sensors, refractivity
from rtec.errors import ArgumentError

SensorShape = Refraction().shape_type


def shop_floor(hpa, degc, percent):
    """J. A. Stone and J. H. Zimmerman, Index of refraction of air, appendix B: good to 1.5e-7 on a shop floor."""
    return 7.86e-4 * hpa / 10.0 / (273.0 + degc) - 1.5e-11 * percent * (degc**2 + 160.0)


def weather(rows=60, seed=0):
    rng = np.random.default_rng(seed)
    return rng.uniform(900.0, 1050.0, rows), rng.uniform(15.0, 28.0, rows), rng.uniform(10.0, 80.0, rows)


def at(position, pressure, heat=None, percent=None, **more):
    return Conditions(
        position=position,
        position_unit="mm",
        run=np.ones(position.size, dtype=np.int64),
        pressure_hpa=pressure,
        temperatures={} if heat is None else {"temperature_air": heat},
        humidity_percent=percent,
        **more,
    )


def test_the_index_is_that_of_the_shop_floor_formula():
    hpa, degc, percent = weather()
    assert refractivity(hpa, degc, percent) == pytest.approx(shop_floor(hpa, degc, percent), abs=1.5e-7)


def test_a_laser_without_compensation_counts_its_waves_in_another_air():
    """Half waves on the way, counted in the air there is, and taken for those of the standard."""
    hpa, degc, percent = weather()
    x = np.linspace(100.0, 900.0, hpa.size)
    vacuum_mm = 632.9908e-6
    standard = 1.0 + shop_floor(1013.25, 20.0, 50.0)
    waves = x * 2.0 * (1.0 + shop_floor(hpa, degc, percent)) / vacuum_mm
    shown = waves * vacuum_mm / (2.0 * standard)
    c = at(x, hpa, degc, percent)
    found = Refraction().contribution(c, SensorShape("temperature_air"), [1.0])
    assert found == pytest.approx(shown - x, abs=1.5e-7 * 900.0)
    dead = DeadPath().contribution(c, SensorShape("temperature_air"), [400.0])
    assert dead == pytest.approx(400.0 * (shown / x - 1.0), abs=1.5e-7 * 400.0)


def test_a_sensor_whose_name_says_air_goes_before_others():
    x = np.zeros(3)
    heats = {"temperature_screw": x + 25.0, "temperature_air": x + 20.0}
    c = Conditions(position=x, position_unit="mm", run=np.ones(3, dtype=np.int64), temperatures=heats)
    assert air_sensors(c) == [SensorShape("temperature_air")]


@pytest.mark.parametrize("effect", [Refraction(), DeadPath()], ids=lambda e: e.name)
def test_without_pressure_or_with_a_steady_one_nothing_can_be_seen(effect):
    x = np.linspace(0.0, 300.0, 8)
    assert effect.untestable(at(x, None)) == "no pressure column"
    assert "ppm only" in effect.untestable(at(x, np.linspace(1013.0, 1013.2, 8)))
    assert effect.untestable(at(x, np.linspace(1000.0, 1013.2, 8))) is None
    with pytest.raises(ArgumentError, match="a pressure column"):
        effect.columns(at(x, None), SensorShape())


def test_at_one_place_a_dead_path_shows_and_refraction_does_not():
    c = at(np.full(8, 200.0), np.linspace(1000.0, 1013.2, 8))
    assert Refraction().untestable(c) == "one position only"
    assert DeadPath().untestable(c) is None
