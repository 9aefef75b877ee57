"""The picture of a comparison of predictors: it shows the numbers of its rows, and nothing covers another."""

import itertools
import math

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_hex

from rtec.dataset.load import load_dataset
from rtec.errors import ArgumentError
from rtec.predictors.fitting.training import Effort
from rtec.report.figures_predicted import COLOURS
from rtec.report.figures_style import figure_style
from rtec.report.figures_training import training_figure
from rtec.training import all_methods, compare_predictors
from rtec.training.results import Kind

EFFORT = Effort(starts=1, epochs=5)


def dataset(folder, *, pitch="10 mm", ways=(1, -1), step=0.5):
    """A bow with a backlash of 4 µm and a wave of the screw: 200 mm, two runs."""
    rng = np.random.default_rng(0)
    lines = [f"# screw_pitch: {pitch}"] * (pitch is not None) + ["run,direction,target_mm,deviation_um"]
    for run, way in itertools.product((1, 2), ways):
        for x in np.arange(0.0, 200.1, step):
            error = 1e-3 * x * (200.0 - x) + 4.0 * (way < 0) + 3.0 * math.sin(0.2 * math.pi * x)
            lines.append(f"{run},{way},{x:g},{error + rng.normal(0.0, 0.3):.4f}")
    file = folder / "axis.csv"
    file.write_text("\n".join([*lines, ""]))
    return load_dataset(file, facts={})


def compared(data, *starts):
    methods = [method for method in all_methods() if method.name.startswith(starts)]
    return compare_predictors(data, effort=EFFORT, budget_s=None, methods=methods)


def drawn(result):
    with figure_style():
        figure = training_figure(result)
    return {axes.get_title(loc="left"): axes for axes in figure.axes}


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    """Tables and one network with figures, one that has none (30 + 8: too few means for its weights)."""
    names = ("none", "table", "network 40 lm", "network 40 scg", "network 30 + 8 lm")
    return compared(dataset(tmp_path_factory.mktemp("a")), *names)


@pytest.fixture(scope="module")
def panels(result):
    return drawn(result)


def marks(axes, marker):
    return [
        (x, y)
        for line in axes.lines
        if line.get_marker() == marker
        for x, y in zip(*line.get_data(), strict=True)
        if np.isfinite([x, y]).all()
    ]


def test_each_row_has_its_name_and_its_errors_or_says_that_it_has_no_figure(result, panels):
    axes = panels["Error on the readings at places held out"]
    names = [label.get_text() for label in axes.get_yticklabels()]
    assert names == ["none (no correction)" if row.kind is Kind.NONE else row.name for row in result.ranked]
    found = dict(zip(axes.get_yticks(), result.ranked, strict=True))
    dots = {y: x for x, y in marks(axes, "o")}
    assert dots == {y: pytest.approx(1e3 * row.rms_heldout_mm) for y, row in found.items() if row.rms_heldout_mm}
    bars = {y: x for x, y in marks(axes, "|")}
    assert bars == {y: pytest.approx(1e3 * row.worst_heldout_mm) for y, row in found.items() if row.worst_heldout_mm}
    without = [text.get_position()[1] for text in axes.texts if text.get_text() == "no figure"]
    assert without == [y for y, row in found.items() if row.reason] == [0]


def test_lines_of_the_best_of_each_kind_go_through_the_readings_in_both_directions(result, panels):
    axes = panels["In the middle, 2 turns of the screw: the best of each kind"]
    best = next(row for row in result.ranked if row.kind is Kind.TABLE)
    colour = COLOURS[Kind.TABLE]
    lines = [line for line in axes.lines if to_hex(line.get_color()) == colour and line.get_data()[0].size]
    assert len(lines) == 2
    for line, way in zip(lines, (1, -1), strict=True):
        x, y = line.get_data()
        assert x[-1] - x[0] == pytest.approx(20.0)
        assert y[100] == pytest.approx(1e3 * best.predictor.error_mm(float(x[100]), way))
    assert len(marks(axes, "o")) >= 2  # readings that judge, one of them in the middle


def labels_overlap(axis, renderer):
    low, high = axis.get_view_interval()
    ticks = [tick for tick in axis.get_major_ticks() if low <= tick.get_loc() <= high]
    boxes = [tick.label1.get_window_extent(renderer) for tick in ticks if tick.label1.get_text()]
    assert len(boxes) > 1
    return any(one.overlaps(other) for one, other in itertools.combinations(boxes, 2))


def test_no_words_cover_each_other(panels):
    figure = next(iter(panels.values())).figure
    renderer = FigureCanvasAgg(figure).get_renderer()
    assert not any(labels_overlap(axis, renderer) for axes in figure.axes for axis in (axes.xaxis, axes.yaxis))
    titles = [axes._left_title.get_window_extent(renderer) for axes in figure.axes]
    assert not any(one.overlaps(other) for one, other in itertools.combinations(titles, 2))
    assert max(box.x1 for box in titles) <= figure.bbox.x1


def test_without_a_pitch_the_axis_is_drawn_alone_and_the_middle_is_some_targets(tmp_path):
    data = dataset(tmp_path, pitch=None)
    titles = drawn(compared(data, "none", "table bi"))
    assert not any("turn" in title for title in titles)
    assert any(title.startswith("In the middle, between the targets") for title in titles)
    assert not any(title.startswith("network") for title in titles)


def test_one_direction_alone_is_drawn_with_what_has_a_figure(tmp_path):
    result = compared(dataset(tmp_path, ways=(1,), step=0.25), "none", "table", "network 40 lm")
    titles = drawn(result)
    axes = titles["Tables: tried (dots), chosen (ring), judged (×)"]
    assert [text.get_text() for text in axes.texts] == ["no table has a figure"]
    along = next(axes for title, axes in titles.items() if title.startswith("Readings along"))
    assert [text.get_text() for text in along.get_legend().get_texts()] == ["forward"]


def test_without_any_figure_there_is_no_picture(tmp_path):
    with pytest.raises(ArgumentError, match="no predictor has a figure"):
        training_figure(compared(dataset(tmp_path, ways=(1,)), "none", "table"))
