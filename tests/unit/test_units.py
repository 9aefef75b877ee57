import math
from fractions import Fraction

import pint
import pytest
from hypothesis import given, strategies as st

from rtec import units
from rtec.errors import ArgumentError
from rtec.units.factors import COMMON

LIBRARY = pint.UnitRegistry()


@pytest.mark.parametrize(("target", "unit"), [(target, unit) for target, known in COMMON.items() for unit in known])
def test_common_units_are_those_of_the_library(target, unit):
    by_library = LIBRARY.Quantity(1.0, unit).to(target).magnitude
    assert COMMON[target][unit] == pytest.approx(by_library, rel=1e-15)


@pytest.mark.parametrize(
    ("text", "kind", "value"),
    [
        ("500kHz", units.FREQUENCY, 500e3),
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
        ("20 arcsec", "deg", 20 / 3600),
        ("0.5 turn", "deg", 180.0),
        ("12 reading", "reading", 12.0),
        ("3 counts", "count", 3.0),
        ("0.02 mm/m", "um/m", 20.0),
        ("3.6 arcsec/deg", "um/m", 1000.0),  # both are pure numbers
        ("10 um/m/degC", "um/m/K", 10.0),
        ("9 um/m/degF", "um/m/K", 16.2),
        ("0.01 mm/min", "um/h", 600.0),
        ("95 N/(mm/s^2)", "kg", 95e3),
        ("3 N m", "N*m", 3.0),
        ("3 A/(deg/s^2)", "A/(deg/s^2)", 3.0),
        ("1 ms²", "ms^2", 1.0),
    ],
)
def test_quantities_are_read_in_any_unit_of_the_dimension(text, unit, value):
    assert units.parse_in(text, unit, name="x") == pytest.approx(value, rel=1e-14)


@pytest.mark.parametrize(
    ("text", "unit"),
    [
        ("5", "mm"),
        ("5 mm", "deg"),
        ("5 count", "deg"),
        ("5 deg", "um/m"),
        ("5 reading", "s"),
        ("nan mm", "mm"),
        ("1e9999 mm", "mm"),
        ("1" * 5000 + " mm", "mm"),
        ("1 " + "m" * 5000, "mm"),
        ("9**9**9 mm", "mm"),
        ("1 m**9**9**9", "mm"),
        ("1 ((((m", "mm"),
        ("1 m//s", "mm"),
        ("1 __import__", "mm"),
        ("", "mm"),
        (None, "mm"),
    ],
)
def test_what_is_no_quantity_of_the_dimension_is_refused(text, unit):
    with pytest.raises(ArgumentError, match=f"such as '1.5 {unit}'") as caught:
        units.parse_in(text, unit, name="period")
    assert str(caught.value).startswith("period: ")
    assert len(str(caught.value)) < 300


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


@pytest.mark.parametrize(
    ("text", "kind", "meant"),
    [
        ("500khz", units.FREQUENCY, "500kHz"),
        ("12mHz", units.FREQUENCY, "12MHz"),
        ("5 kherz", units.FREQUENCY, "5 kHz"),
        ("2 US", units.TIME, "2 us"),
        ("2 Ms", units.TIME, "2 ms"),
        ("1 Mm", units.LENGTH, "1 mm"),
        ("50 inch/MIN", units.SPEED, "50 inch/min"),
        ("10 DEG", units.ANGLE, "10 deg"),
    ],
)
def test_a_unit_that_is_nearly_right_is_suggested_and_not_taken(text, kind, meant):
    with pytest.raises(ArgumentError) as caught:
        units.parse_quantity(text, kind, name="--x")
    assert f"did you mean '{meant}'?" in str(caught.value)


def test_a_unit_that_exists_in_another_case_says_what_it_would_be():
    with pytest.raises(ArgumentError, match=r"12mHz would be 0\.012 Hz"):
        units.parse_quantity("12mHz", units.FREQUENCY, name="--clock")


@pytest.mark.parametrize(("text", "kind"), [("5 mm", units.TIME), ("5 m", units.TIME), ("5 V", units.LENGTH)])
def test_a_unit_of_another_dimension_is_no_slip_of_the_pen(text, kind):
    with pytest.raises(ArgumentError) as caught:
        units.parse_quantity(text, kind, name="x")
    assert "did you mean" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "value"), [("1e5 Hz", 1e5), ("100_000 Hz", 1e5), ("1_0.5_0e3Hz", 10.5e3), (".5 kHz", 500.0)]
)
def test_numbers_with_exponents_and_underscores(text, value):
    assert units.parse_quantity(text, units.FREQUENCY, name="x") == value
    assert units.parse_in(text, "Hz", name="x") == value


@pytest.mark.parametrize("text", ["1__0 Hz", "_1 Hz", "1_ Hz", "1e Hz", "1_.5 Hz"])
def test_underscores_stand_between_digits(text):
    with pytest.raises(ArgumentError):
        units.parse_quantity(text, units.FREQUENCY, name="x")


def test_a_bare_number_is_told_the_units():
    with pytest.raises(ArgumentError, match="write the unit behind the number: Hz, kHz, MHz"):
        units.parse_quantity("1e5", units.FREQUENCY, name="x")
    with pytest.raises(ArgumentError, match="write the unit behind the number: um/h"):
        units.parse_in("3", "um/h", name="x")


def test_a_comma_is_no_decimal_point():
    with pytest.raises(ArgumentError, match="decimal point"):
        units.parse_quantity("1,5 mm", units.LENGTH, name="x")
