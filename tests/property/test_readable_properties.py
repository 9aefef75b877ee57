"""Numbers as people read them say what was measured, whatever their size."""

from __future__ import annotations

import math

from hypothesis import example, given, strategies as st

from rtec.readable import quantity_text, suited_unit

SIZES = st.floats(min_value=1e-30, max_value=1e30)
SIGNED = st.one_of(SIZES, SIZES.map(lambda x: -x), st.just(0.0))
UNITS = st.sampled_from(["", "um", "mm", "deg", "arcsec", "s", "N", "mN*m", "A/(deg/s)", "count"])


def read(text: str) -> tuple[float, float]:
    """Return value and error of what was written, without its unit."""
    text, _, power = (
        text.replace("−", "-").partition("e") if text.startswith("(") else (text.replace("−", "-"), "", "")
    )
    value, error = text.strip("()").split(" ± ")
    scale = 10.0 ** int(power.split()[0]) if power else 1.0
    return float(value) * scale, float(error.split()[0]) * scale


@given(SIGNED, SIZES)
@example(1.0, 0.0995)
@example(9.995, 9.995)
@example(0.0, 1e-30)
def test_value_and_error_are_within_half_of_the_last_of_two_digits(value, error):
    found, spread = read(quantity_text(value, "", error))
    step = 10.0 ** (math.floor(math.log10(error)) - 1)
    assert abs(spread - error) <= 0.5001 * step
    # an error that rounds up has its last digit one place further to the left
    assert abs(found - value) <= 5.001 * step + 1e-15 * abs(value)


@given(SIGNED, UNITS)
def test_a_suited_unit_reads_well_and_stays_the_same_quantity(value, unit):
    new, factor = suited_unit(value, unit)
    assert factor > 0.0 and suited_unit(value * factor, new)[0] == new
    assert (new == unit) == (factor == 1.0)
