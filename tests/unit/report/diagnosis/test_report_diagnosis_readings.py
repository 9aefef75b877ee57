"""What pictures show of many readings."""

from __future__ import annotations

import numpy as np
import pytest

from rtec.effects import Conditions
from rtec.inference.model import Model, Term
from rtec.report.diagnosis.readings import (
    abscissas,
    clock,
    figure_text,
    periods_of,
    phase,
    residual,
    some_rows,
    ways,
)
from rtec.report.figures_style import outline


def _conditions(**changes: object) -> Conditions:
    n = 30
    fields = {"position": np.linspace(0.0, 29.0, n), "position_unit": "mm", "run": np.ones(n, dtype=np.int64)}
    return Conditions(**{**fields, **changes})


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


def test_readings_split_by_direction_only_where_both_occur():
    assert [way.label for way in ways(_conditions())] == ["readings"]
    assert [way.label for way in ways(_conditions(direction=np.ones(30)))] == ["readings"]
    found = ways(_conditions(direction=np.tile([1.0, -1.0, 0.0], 10)))
    assert [(way.label, int(way.rows.sum())) for way in found] == [("forward", 10), ("backward", 10), ("at rest", 10)]


def test_there_is_an_axis_for_each_column_that_varies():
    c = _conditions(
        time_s=np.arange(30) * 60.0,
        velocity=np.full(30, 3.0),
        temperatures={"temperature_nut": np.linspace(20, 25, 30), "temperature": np.full(30, 20.0)},
    )
    labels = [one.label for one in abscissas(c, (7.0,))]
    assert labels == ["position (mm)", "time (min)", "temperature nut (°C)",
                      "phase within the period of 7 mm (turns)"]  # fmt: skip
    assert [one.label for one in abscissas(_conditions(position_unit="s"))] == ["time (s)"]
    assert clock(_conditions()).label == "row order (no time in the file)"


def test_a_phase_lies_within_one_turn_whatever_a_file_rounds():
    c = _conditions(position=np.array([0.0, 6.35 - 1e-9, 6.35, 3.175, -3.175, 12.7 + 1e-9]),
                    run=np.ones(6, dtype=np.int64))  # fmt: skip
    assert phase(c, 6.35).values == pytest.approx([0.0, 0.0, 0.0, 0.5, 0.5, 0.0], abs=1e-6)


def test_found_periods_come_before_stated_ones_and_unknown_ones_first(make_diagnosis):
    c = _conditions(screw_pitch=5.0)
    model = make_diagnosis().model
    assert periods_of(model, c, None) == (6.35,)
    assert periods_of(model, c, 2.0) == (2.0, 6.35)
    assert periods_of(Model(observe="deviation", units=model.units), c, None) == (5.0,)
    assert periods_of(model, c, float("inf")) == (6.35,)


def test_what_is_left_by_no_model_is_taken_about_the_mean(make_dataset, make_diagnosis):
    dataset, model = make_dataset(), make_diagnosis().model
    empty = Model(observe="deviation", units=model.units)
    assert residual(dataset, empty) == pytest.approx(dataset.observed - dataset.observed.mean())
    open_model = empty.with_terms([Term(effect=model.terms[0].effect)])
    assert residual(dataset, open_model) == pytest.approx(dataset.observed - dataset.observed.mean())
    assert residual(dataset, empty.with_terms([], datum=0.001)) == pytest.approx(dataset.observed - 0.001)
    assert np.std(residual(dataset, model)) == pytest.approx(0.001, rel=0.15)


@pytest.mark.parametrize("text", ["$\\frac{", "温度\x00\n", "a" * 500, "", "_^{}%#&~"])
def test_any_text_can_be_drawn(text):
    shown = figure_text(text)
    assert len(shown) <= 40 and "$" not in shown and "\\" not in shown and shown.isprintable()
