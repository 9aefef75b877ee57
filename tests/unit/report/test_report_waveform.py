"""The drawing of both sides of a box: every number in its place, insertions where they are."""

import numpy as np
import pytest
from matplotlib.colors import to_hex

from rtec.errors import ArgumentError
from rtec.injector import Totals
from rtec.report.palette import ALARM
from rtec.report.waveform import insertions, waveform
from rtec.signal import EdgeStream

US = 1_000_000
# NISTIR 4832, Design C: "invert A, then invert B" in state 1 adds two counts; then states 2 and 3 come inverted
ENCODER = EdgeStream([10 * US, 20 * US, 30 * US], [0, 1, 3], initial=2)
CONTROLLER = EdgeStream([10 * US, 12 * US, 13 * US, 20 * US, 30 * US], [0, 1, 3, 2, 0], initial=2)


def drawn(**changes):
    given = {
        "requested": Totals([5 * US], [1]),
        "completed": Totals([13 * US], [1]),
        "window_ps": (0, 40 * US),
        "title": "",
    }
    return waveform(ENCODER, CONTROLLER, **(given | changes)).axes[0]


def rows(axes):
    """The numbers that stand in each band, from the top down, and the names at the left."""
    found = {}
    for text in axes.texts:
        if hasattr(text, "xy"):
            continue
        found.setdefault(round(text.get_position()[1], 3), []).append((text.get_position()[0], text.get_text()))
    return [[number for _, number in sorted(found[y])] for y in sorted(found, reverse=True)]


def test_states_counts_and_totals():
    assert rows(drawn()) == [
        ["4", "1", "2", "3"],
        ["0", "1", "2", "3"],
        ["4", "1", "2", "3", "4", "1"],
        ["0", "1", "2", "3", "4", "5"],
        ["0", "1"],
        ["0", "1"],
    ]


def test_levels_are_drawn_at_their_times():
    axes = drawn()
    a, b, a_out, b_out = axes.lines

    def steps(line):
        x, y = line.get_data()
        y = np.round((np.asarray(y) - min(y)) / 0.62).astype(int)
        return [(float(x[0]), int(y[0]))] + [(float(x[k]), int(y[k])) for k in range(1, len(x)) if y[k] != y[k - 1]]

    assert steps(a) == [(0, 0), (20, 1)]
    assert steps(b) == [(0, 1), (10, 0), (30, 1)]
    assert steps(a_out) == [(0, 0), (12, 1), (20, 0)]
    assert steps(b_out) == [(0, 1), (10, 0), (13, 1), (30, 0)]
    assert axes.get_xlim() == (0, 40) and axes.get_xlabel() == "time (µs)"


def test_an_insertion_is_shaded_from_its_first_change_on_and_not_in_the_colour_of_faults():
    axes = waveform(
        EdgeStream([], [], initial=0),
        EdgeStream([10 * US, 10 * US + 100_000], [1, 3], initial=0),
        requested=Totals([10 * US], [1]),
        completed=Totals([10 * US + 100_000], [1]),
        window_ps=(10 * US - 15_000, 10 * US + 115_000),
        title="",
    ).axes[0]
    (shade,) = [each for each in axes.collections if each.get_alpha() == pytest.approx(0.11)]
    x = shade.get_paths()[0].vertices[:, 0]
    assert x.min() < 10_000
    assert x.max() > 10_100
    assert to_hex(shade.get_facecolor()[0]) != ALARM


def test_a_late_moment_keeps_its_digits():
    late = 3_600 * 10**12 + 123_456_789_012
    axes = waveform(
        EdgeStream([late + 2_000], [1], initial=0),
        EdgeStream([late + 2_000], [1], initial=0),
        requested=Totals(),
        completed=Totals(),
        window_ps=(late, late + 5_000),
        title="",
    ).axes[0]
    assert axes.get_xlabel() == "time from 3600.123456789 s on (ns)"
    assert axes.get_xlim() == pytest.approx((0.012, 5.012))


@pytest.mark.parametrize(
    ("encoder", "controller", "booked", "expected"),
    [
        (ENCODER, CONTROLLER, [13 * US], [(12 * US, 13 * US)]),
        # a real edge within the insertion, merged by the gates: both go on
        (
            EdgeStream([10, 115], [1, 3], initial=0),
            EdgeStream([10, 100, 110, 115, 120, 130], [1, 3, 2, 0, 1, 3], initial=0),
            [130],
            [(100, 130)],
        ),
        # Design B takes a count away: passed 100 late, and 100 later one back
        (
            EdgeStream([1_000, 2_000], [1, 3], 0),
            EdgeStream([1_100, 2_100, 2_200], [1, 3, 1], 0),
            [2_200],
            [(2_200, 2_200)],
        ),
        # two insertions, one after the other
        (
            EdgeStream([], [], 0),
            EdgeStream([10, 20, 500, 510], [1, 3, 2, 0], 0),
            [25, 515],
            [(10, 20), (500, 510)],
        ),
        # booked and nothing done
        (EdgeStream([10], [1], 0), EdgeStream([], [], 0), [50], []),
    ],
)  # fmt: skip
def test_insertions_are_told_from_real_edges(encoder, controller, booked, expected):
    assert insertions(encoder, controller, Totals(booked, np.arange(1, len(booked) + 1))) == expected


def test_marks_have_their_words():
    axes = drawn(marks=[(12 * US, "requested"), (30 * US, "wrong"), (90 * US, "outside")])
    words = [(text.get_text(), text.xy[0]) for text in axes.texts if hasattr(text, "xy")]
    assert words[-2:] == [("requested", 12.0), ("wrong", 30.0)]
    heights = [text.xy[1] for text in axes.texts if hasattr(text, "xy")][-2:]
    assert heights[0] > heights[1]


def test_a_window_without_width_is_refused():
    with pytest.raises(ArgumentError, match="window_ps: 5 to 5 ps"):
        drawn(window_ps=(5, 5))
