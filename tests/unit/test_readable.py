"""Numbers as people read them."""

from __future__ import annotations

import math

import pytest

from rtec.readable import MISSING, quantity_text, rounded, suited_unit
from rtec.units import symbol


@pytest.mark.parametrize(
    ("value", "error", "text"),
    [
        (12.3456, 0.234, "12.35 ± 0.23 µm"),
        (1.0, 0.09949, "1.000 ± 0.099 µm"),
        (1.0, 0.0995, "1.00 ± 0.10 µm"),  # rounded up, the error has a digit less behind the point
        (1.0, 9.995, "1 ± 10 µm"),
        (-0.004, 0.3, "0.00 ± 0.30 µm"),  # no minus before a zero
        (-7.98, 0.23, "−7.98 ± 0.23 µm"),
        (5.0, 2345.0, "0 ± 2300 µm"),
        (0.0, 0.02, "0 ± 20 nm"),
        (15_000.0, 20.0, "15.000 ± 0.020 mm"),
    ],
)
def test_a_value_ends_where_two_digits_of_its_error_end(value, error, text):
    assert quantity_text(value, "um", error) == text


@pytest.mark.parametrize("error", [None, 0.0, -1.0, math.nan, math.inf])
def test_without_an_error_there_are_four_digits(error):
    assert quantity_text(1.234567, "um", error) == "1.235 µm"
    assert quantity_text(9.9996, "um", error) == "10 µm"
    assert quantity_text(24.0, "", error) == "24"
    assert quantity_text(123456.0, "count", error) == "123456 count"


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_what_is_no_number_is_a_dash(value):
    assert quantity_text(value, "um", 1.0) == MISSING == rounded(value, 3)


def test_huge_and_tiny_numbers_have_a_power_of_ten():
    assert quantity_text(1.23456e20, "", 1e15) == "(1.234560 ± 0.000010)e+20"
    assert quantity_text(-2.5e-13, "", 1e-14) == "(−2.50 ± 0.10)e-13"
    assert quantity_text(3.2e-15) == "3.2e-15" and quantity_text(-3.2e15) == "−3.2e+15"
    assert rounded(-2.5e-12, 2) == "−2.5e-12"


@pytest.mark.parametrize(
    ("size", "unit", "expected", "number"),
    [
        (9_999.0, "um", "um", 9_999.0),
        (10_000.0, "um", "mm", 10.0),
        (0.099, "um", "nm", 99.0),
        (0.1, "um", "um", 0.1),
        (-2e7, "um", "m", -20.0),
        (599.0, "arcsec", "arcsec", 599.0),
        (900.0, "arcsec", "arcmin", 15.0),
        (3_600.0, "arcsec", "deg", 1.0),
        (0.05, "deg", "arcmin", 3.0),
        (599.0, "s", "s", 599.0),
        (1_200.0, "s", "min", 20.0),
        (36_000.0, "s", "h", 10.0),
        (0.00002, "s", "us", 20.0),
        (12_000.0, "N", "kN", 12.0),
        (0.02, "N*m", "mN*m", 20.0),
        (0.02, "A", "mA", 20.0),
        (0.05, "deg/s", "deg/s", 0.05),
        (20_000.0, "um/m", "mm/m", 20.0),
        (0.002, "N/(mm/s)", "mN/(mm/s)", 2.0),
        (1e9, "count", "count", 1e9),
        (1e9, "", "", 1e9),
    ],
)
def test_the_unit_suits_the_size(size, unit, expected, number):
    found, factor = suited_unit(size, unit)
    assert found == expected and size * factor == pytest.approx(number)


@pytest.mark.parametrize("size", [0.0, math.nan, math.inf])
def test_without_a_size_the_unit_stays(size):
    assert suited_unit(size, "mm") == ("mm", 1.0)


def test_a_unit_is_printed_with_its_own_signs():
    assert [symbol(unit) for unit in ("um/m/K", "us", "uA", "N*m", "mm/s^2", "cup")] == [
        "µm/m/K", "µs", "µA", "N·m", "mm/s²", "cup"]  # fmt: skip
