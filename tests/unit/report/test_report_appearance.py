"""Names, colours and units."""

from __future__ import annotations

import pytest

from rtec.errors import ArgumentError
from rtec.report.appearance import look_of, scale_of

NAMES = ("uncompensated", "table", "original", "a", "b", "c")


def _luminance(colour: str) -> float:
    """Return the relative luminance of WCAG 2."""
    channels = [int(colour[at : at + 2], 16) / 255 for at in (1, 3, 5)]
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in channels]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


@pytest.mark.parametrize("name", [*NAMES, "unheard of"])
def test_words_in_a_rows_colour_can_be_read_on_white(name):
    assert 1.05 / (_luminance(look_of(name).ink) + 0.05) >= 4.5  # WCAG 2, level AA


def test_a_name_that_is_not_known_is_shown_in_plain_letters():
    label = look_of("$\\frac{雪}<b>" * 9).label
    assert label.isascii() and not set(label) & set("$\\{}<>")


@pytest.mark.parametrize(
    ("unit", "length", "feed"),
    [
        ("um", "129.9 µm", "1270 mm/min (50 inch/min)"),
        ("mm", "0.1299 mm", "1270 mm/min (50 inch/min)"),
        ("inch", "0.005115 inch", "50 inch/min"),
    ],
)
def test_lengths_and_feeds_in_each_unit(unit, length, feed):
    scale = scale_of(unit)
    assert scale.with_unit(0.12992) == length
    assert scale.feed(1270 / 60) == feed


def test_an_unknown_unit_is_refused_with_the_nearest():
    with pytest.raises(ArgumentError, match="did you mean 'inch'"):
        scale_of("inches")
