"""Figures: drawn for every study, the same bytes each time, and nothing global touched."""

from __future__ import annotations

import io

import matplotlib as mpl
import numpy as np
import pytest
from PIL import Image

from rtec.report.appearance import scale_of
from rtec.report.figures_feed import feed_figure
from rtec.report.figures_style import figure_style
from rtec.report.figures_waveform import waveform_figure
from rtec.report.illustrations import illustrations
from rtec.study.results import FeedCurve, HoldCurve

ALL = ["summary", "positioning", "cyclic", "residual", "feed", "waveform", "hold"]
UM = scale_of("um")


def _texts(axes):
    return [text.get_text() for text in axes.texts]


@pytest.fixture(scope="module")
def drawn(make_result):
    return illustrations(make_result(), UM)


def test_all_figures_in_their_order_as_svg_and_png(drawn):
    assert [figure.name for figure in drawn] == ALL
    for figure in drawn:
        assert figure.svg.startswith(b"<?xml") and figure.caption.endswith(".")
        image = Image.open(io.BytesIO(figure.png))
        assert image.size[0] == 1500  # ten inches of 150 dots


def test_the_same_result_gives_the_same_bytes_whatever_the_users_settings(make_result, drawn):
    with mpl.rc_context(
        {"axes.facecolor": "black", "xtick.direction": "in", "svg.hashsalt": "other", "font.size": 30.0}
    ):
        second = illustrations(make_result(), UM)
        assert mpl.rcParams["font.size"] == 30.0
    assert [(figure.svg, figure.png) for figure in drawn] == [(figure.svg, figure.png) for figure in second]


def test_figures_without_data_are_left_out(make_result):
    bare = make_result(feed_curves=(), hold_curves=(), waveforms=(), period_mm=None)
    assert [figure.name for figure in illustrations(bare, UM)] == ["summary", "positioning", "residual"]


def test_a_perfect_study_and_curves_with_gaps_are_drawn(make_result, make_row):
    rows = (make_row("uncompensated", 0.0), make_row("b", 0.0))
    nothing = np.full(3, np.nan)
    feed = FeedCurve(
        name="b",
        feed_mm_s=np.array([1.0, 2.0, 3.0]),
        forward_pp_mm=nothing,
        reverse_pp_mm=np.array([0.001, np.nan, 0.002]),
        forward_rms_mm=nothing,
        reverse_rms_mm=nothing,
        follows_up_to_mm_s=float("inf"),
    )
    hold = HoldCurve(name="b", state=0, time_s=np.arange(3.0), deviation_mm=nothing, inserted=0, pending_steps=0)
    result = make_result(rows=rows, feed_curves=(feed,), hold_curves=(hold,))
    assert [figure.name for figure in illustrations(result, UM)] == ALL


def test_feeds_limit_and_programs_feed_are_marked(make_result):
    with figure_style():
        figure = feed_figure(make_result(), UM)
    assert {"limit of Original, C", "feed of the program"} <= set(_texts(figure.axes[0]))
    verticals = [line.get_xdata() for line in figure.axes[0].lines if len(line.get_xdata()) == 2]
    assert sorted(x[0] for x in verticals if x[0] == x[1]) == pytest.approx([12.0 * 60, 21.0 * 60])


def test_waveforms_carry_state_numbers_and_the_counts(make_result):
    with figure_style():
        figure = waveform_figure(make_result(), UM)
    texts = _texts(figure.axes[0])
    # the view begins half a gap before the second real edge and ends half a gap before the sixth
    encoder, controller = "23412", "2341234"
    assert "".join(text for text in texts if text in "1234") == encoder + controller
    assert "+2 counts inserted" in texts
    assert figure.axes[0].get_xlabel().endswith("(µs)")
