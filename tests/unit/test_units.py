import math
from fractions import Fraction

import pint
import pytest
from hypothesis import given, strategies as st

from rtec import units
from rtec.errors import ArgumentError


@pytest.mark.parametrize(
    ("target", "unit"), [(target, unit) for target, known in units._COMMON.items() for unit in known]
)
def test_common_units_are_those_of_the_library(target, unit):
    by_library = pint.UnitRegistry().Quantity(1.0, unit).to(target).magnitude
    assert units._COMMON[target][unit] == pytest.approx(by_library, rel=1e-15)


@pytest.mark.parametrize(
    ("text", "kind", "value"),
    [
        ("500kHz", units.FREQUENCY, 500e3),
        ("2 us", units.TIME, 2e-6),
        ("0.25 inch", units.LENGTH, 6.35),
        ("1 in", units.LENGTH, 25.4),
        ("3 µm", units.LENGTH, 0.003),
        ("0.5 rad", units.ANGLE, 28.64788975654116),
        ("60 1/min", units.RATE, 1.0),
        ("2 %", units.SHARE, 2.0),
    ],
)
def test_quantities_are_read(text, kind, value):
    assert units.parse_quantity(text, kind, name="x") == pytest.approx(value, rel=1e-14)


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("0.25 inch", "mm", 6.35),
        ("12.3 um", "mm", 0.0123),
        ("12.3µm", "um", 12.3),
        ("20 arcsec", "deg", 20 / 3600),
        ("1 rev", "deg", 360.0),
        ("0.5 turn", "deg", 180.0),
        ("30 min", "s", 1800.0),
        ("2 h", "s", 7200.0),
        ("12 reading", "reading", 12.0),
        ("3 counts", "count", 3.0),
        ("1.5 s", "ms", 1500.0),
        ("20 ppm", "um/m", 20.0),
        ("0.02 mm/m", "um/m", 20.0),
        ("3.6 arcsec/deg", "um/m", 1000.0),  # both are pure numbers
        ("10 um/m/K", "um/m/K", 10.0),
        ("10 um/m/degC", "um/m/K", 10.0),
        ("9 um/m/degF", "um/m/K", 16.2),
        ("0.01 mm/min", "um/h", 600.0),
        ("2 um/reading", "um/reading", 2.0),
        ("95 N/(mm/s^2)", "kg", 95e3),
        ("200 N*s/m", "N/(m/s)", 200.0),
        ("3 N m", "N*m", 3.0),
        ("3 A/(deg/s^2)", "A/(deg/s^2)", 3.0),
        ("2 mA", "A", 0.002),
        ("1 ms²", "ms^2", 1.0),
        ("1e-3 m/s", "mm/s", 1.0),
    ],
)
def test_quantities_are_read_in_any_unit_of_the_dimension(text, unit, value):
    assert units.parse_in(text, unit, name="x") == pytest.approx(value, rel=1e-14)


@pytest.mark.parametrize(
    ("text", "unit"),
    [
        ("5", "mm"),
        ("5 deg", "mm"),
        ("5 mm", "deg"),
        ("5 count", "deg"),
        ("5 %", "deg"),
        ("5 deg", "count"),
        ("5 deg", "um/m"),
        ("5 s", "reading"),
        ("5 reading", "s"),
        ("5 reading", "count/s"),
        ("nan mm", "mm"),
        ("inf mm", "mm"),
        ("1e9999 mm", "mm"),
        ("1" * 5000 + " mm", "mm"),
        ("1 " + "m" * 5000, "mm"),
        ("9**9**9 mm", "mm"),
        ("1 m^9^9^9", "mm"),
        ("1 m**9**9**9", "mm"),
        ("1 ((((m", "mm"),
        ("1 m)", "mm"),
        ("1 m//s", "mm"),
        ("1 mm/", "mm"),
        ("1 __import__", "mm"),
        ("", "mm"),
        (5.0, "mm"),
        (None, "mm"),
        (["1 mm"], "mm"),
    ],
)
def test_what_is_no_quantity_of_the_dimension_is_refused(text, unit):
    with pytest.raises(ArgumentError, match=f"such as '1.5 {unit}'") as caught:
        units.parse_in(text, unit, name="period")
    assert str(caught.value).startswith("period: ")
    assert len(str(caught.value)) < 300


def test_a_tower_of_powers_is_refused_at_once():
    with pytest.raises(ArgumentError):
        units.parse_quantity("1 m^9^9^9", units.LENGTH, name="x")


@pytest.mark.parametrize(
    ("text", "kind"), [("2 %", units.ANGLE), ("5 count", units.ANGLE), ("60 rpm", units.FREQUENCY)]
)
def test_pure_numbers_are_no_angles(text, kind):
    with pytest.raises(ArgumentError):
        units.parse_quantity(text, kind, name="x")


@given(
    st.floats(allow_nan=False, allow_infinity=False),
    st.sampled_from([1.0, 1e3, 3600.0, 1e6, 3.6e9, 1 / 3600, math.pi]),
)
def test_what_is_written_is_read_back_bit_for_bit(value, inside):
    text = units.written(value, "um/h", inside=inside)
    assert units.parse_in(text, "um/h", name="x", inside=inside) == value


@given(st.integers(1, 10**9), st.integers(-6, 3))
def test_a_short_decimal_is_written_short(digits, power):
    # what people typed comes back as they typed it, whatever the unit inside
    value = units.parse_in(f"{digits}e{power} um", "um", name="x", inside=1e3)
    number = units.written(value, "um", inside=1e3).removesuffix(" um")
    assert Fraction(number) == Fraction(digits) * Fraction(10) ** power


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_what_is_not_finite_is_not_written(value):
    with pytest.raises(ArgumentError, match="finite"):
        units.written(value, "mm")
