"""What pictures show of many readings."""

from __future__ import annotations

import numpy as np
import pytest

from rtec.report.diagnosis.readings import figure_text, some_rows
from rtec.report.figures_style import outline


def test_an_outline_keeps_every_peak_and_the_order():
    rng = np.random.default_rng(2)
    x = np.arange(100_000.0)
    y = rng.normal(0, 1, x.size)
    y[77_777] = 99.0
    at, line = outline(x, y, 500)
    assert at.size <= 1000 and line.max() == 99.0 and line.min() == y.min()
    assert (np.diff(at) >= 0).all()
    assert abs(at[int(np.argmax(line))] - 77_777) <= 200


def test_some_rows_are_the_same_every_time_and_belong():
    mask = np.arange(100_000) % 3 == 0
    rows = some_rows(mask, 500)
    assert rows.size == 500 and mask[rows].all() and (np.diff(rows) > 0).all()
    assert np.array_equal(rows, some_rows(mask, 500))
    assert some_rows(mask[:30], 500).tolist() == list(range(0, 30, 3))


@pytest.mark.parametrize("text", ["$\\frac{", "温度\x00\n", "a" * 500, "", "_^{}%#&~"])
def test_any_text_can_be_drawn(text):
    shown = figure_text(text)
    assert len(shown) <= 40 and "$" not in shown and "\\" not in shown and shown.isprintable()
