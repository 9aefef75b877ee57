"""Parameters of the command line: whole numbers."""

import pytest

from rtec.cli._parameters import whole_number
from rtec.errors import ArgumentError


@pytest.mark.parametrize(
    ("text", "value"), [("4000", 4000), ("100_000", 100_000), ("1e5", 100_000), ("-2.5e1", -25), (" 7 ", 7)]
)
def test_whole_numbers(text, value):
    assert whole_number(text, name="x") == value


@pytest.mark.parametrize("text", ["", "1.5", "1e-1", "1e9999", "9" * 90, "12 mm", "0x10", "1,000", "nan"])
def test_what_is_no_whole_number(text):
    with pytest.raises(ArgumentError, match="not a whole number") as caught:
        whole_number(text, name="--cycles")
    assert len(str(caught.value)) < 200


def test_a_whole_number_has_its_range():
    assert whole_number("1e3", name="x", low=1000, high=1000) == 1000
    with pytest.raises(ArgumentError, match="x: 1001 is too large; use 1 to 1000"):
        whole_number("1001", name="x", low=1, high=1000)
    with pytest.raises(ArgumentError, match="x: -1 is too small; use 0 or more"):
        whole_number("-1", name="x", low=0)
