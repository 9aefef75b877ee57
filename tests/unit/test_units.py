import pint
import pytest

from rtec import units


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
