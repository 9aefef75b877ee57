"""What speaks against a positioning test, each planted into good readings."""

from __future__ import annotations

import re

import numpy as np
import pytest

from rtec.dataset.load import positioning_warnings
from rtec.metrology import read_measurement

PLACES = (0.0, 8.0, 17.0, 30.0, 41.0, 55.0)
"""Targets on no grid that anybody would miss."""
LINE = {
    (run, way, place): 3 + 12 * run - 12 + (index if way > 0 else 11 - index)
    for run in range(1, 6)
    for index, place in enumerate(PLACES)
    for way in (1, -1)
}
"""Line of the file of each reading: two lines above, six forward and six backward in each run."""


def good_rows():
    """Return five bidirectional runs: run, direction, time in s, target in mm, deviation in um."""
    rng = np.random.default_rng(5)
    rows = []
    for run in range(1, 6):
        for way, places in ((1, PLACES), (-1, PLACES[::-1])):
            for place in places:
                deviation = 20.0 + 0.2 * place - 3.0 * way + rng.normal(0.0, 0.3)
                rows.append([run, way, 100.0 * len(rows), place, round(deviation, 4)])
    return rows


def found(tmp_path, rows, header="run,direction,time_s,target_mm,deviation_um", facts=None):
    file = tmp_path / "x.csv"
    text = "\n".join(",".join(f"{value:.10g}" for value in row) for row in rows)
    file.write_text(f"# axis: x\n{header}\n{text}\n")
    return positioning_warnings(read_measurement(file), facts)


def changed(run, way, place, column, value):
    rows = good_rows()
    row = rows[LINE[run, way, place] - 3]
    assert row[:2] == [run, way]
    assert row[3] == place
    row[column] = value(row[column]) if callable(value) else value
    return rows


def test_good_readings_are_plausible(tmp_path):
    assert found(tmp_path, good_rows()) == ()


@pytest.mark.parametrize(
    "order",
    [
        pytest.param(lambda row: (row[3], -row[1], row[0]), id="by target"),
        pytest.param(lambda row: (row[0], -row[1], row[3]), id="both ways ascending"),
        pytest.param(lambda row: (row[0], row[3], -row[1]), id="both ways at each target"),
    ],
)
def test_rows_may_stand_in_another_order_than_they_were_read_in(tmp_path, order):
    rows = [[*row[:2], *row[3:]] for row in sorted(good_rows(), key=order)]  # without its time
    assert found(tmp_path, rows, "run,direction,target_mm,deviation_um") == ()
    lacking = [row for row in rows if row[:3] != [2, -1, 30.0]]
    (text,) = found(tmp_path, lacking, "run,direction,target_mm,deviation_um")
    assert "column target: run 2 backward lacks 1 of 6 targets of the other runs" in text


def test_directions_that_are_exchanged(tmp_path):
    rows = [[run, -way, time, place, deviation] for run, way, time, place, deviation in good_rows()]
    (text,) = found(tmp_path, rows)
    assert text.startswith("column direction: targets fall from row to row where it says forward")
    assert text.endswith("are the directions exchanged? If so, exchange them in that column")
    one_way = [row for row in good_rows() if row[1] > 0]
    assert found(tmp_path, [[run, -1, *rest] for run, _, *rest in one_way]) == (text,)


def test_outlier_is_named_with_line_and_column(tmp_path):
    (text,) = found(tmp_path, changed(3, -1, 17.0, 4, 70.0))
    assert text.startswith(f"line {LINE[3, -1, 17.0]}, column deviation: 70 µm")
    assert "17 mm backward: an outlier?" in text


def test_deviation_from_actual_positions_names_their_column(tmp_path):
    rows = [[*row[:4], row[3] + row[4] / 1000] for row in changed(2, 1, 30.0, 4, 70.0)]
    (text,) = found(tmp_path, rows, "run,direction,time_s,target_mm,actual_mm")
    assert text.startswith(f"line {LINE[2, 1, 30.0]}, column actual: 70 µm")


def test_run_in_another_unit_is_told_from_outliers(tmp_path):
    rows = good_rows()
    for row in rows:
        if row[0] == 4 and row[1] == 1:
            row[4] /= 1000.0
    (text,) = found(tmp_path, rows)
    first, last = LINE[4, 1, PLACES[0]], LINE[4, 1, PLACES[-1]]
    assert text.startswith(f"lines {first} to {last}, column deviation: multiplied by 1000 ")
    assert text.endswith("mm among um?")


@pytest.mark.parametrize(
    ("factor", "words"),
    [(1000.0, "multiplied by 0.001 .*um among mm"), (1 / 25.4, "multiplied by 25.4 .*inch among mm")],
)
def test_single_reading_in_another_unit(tmp_path, factor, words):
    (text,) = found(tmp_path, changed(1, 1, 41.0, 4, lambda value: value * factor))
    assert text.startswith(f"line {LINE[1, 1, 41.0]}, ")
    assert re.search(words, text)


@pytest.mark.parametrize(
    ("header", "words"),
    [
        ("run,direction,time_s,target_mm,deviation_mm", "span 17.* mm on a travel of 55 mm: .*um taken for mm"),
        ("run,direction,time_s,target_m,deviation_nm", "span 17.* nm on a travel of 55000 mm: .*mm taken for um"),
        ("run,direction,time_s,target_mm,deviation_um", None),
    ],
)
def test_unit_of_all_deviations(tmp_path, header, words):
    texts = found(tmp_path, good_rows(), header)
    if words is None:
        assert texts == ()
    else:
        assert re.search(words, texts[0])
        assert texts[0].startswith("column deviation: ")


def test_copied_run_is_named(tmp_path):
    rows = good_rows()
    for row, source in zip(rows[36:42], rows[12:18], strict=True):
        row[4] = source[4]
    (text,) = found(tmp_path, rows)
    where = f"lines {LINE[4, 1, PLACES[0]]} to {LINE[4, 1, PLACES[-1]]}, column deviation: "
    assert text == f"{where}run 4 forward has the same 6 deviations as run 2 forward: a copy?"


def test_equal_readings_of_a_coarse_device_are_no_copies(tmp_path):
    rng = np.random.default_rng(2)
    rows = [[*row[:4], 20 - 3 * row[1] + rng.integers(0, 2)] for row in good_rows() if row[3] < 20]
    forward = [tuple(row[4] for row in rows if row[:2] == [run, 1]) for run in range(1, 6)]
    assert len(set(forward)) < 5  # some passes are equal
    assert not any("copy" in text for text in found(tmp_path, rows))


def test_clock_that_runs_back(tmp_path):
    (text,) = found(tmp_path, changed(2, 1, 17.0, 2, 5.0))
    assert text == f"line {LINE[2, 1, 17.0]}, column time: 5 s after 1300 s: the clock runs back"


def test_clock_of_each_run_may_start_anew(tmp_path):
    rows = good_rows()
    for row in rows:
        row[2] -= 1200.0 * (row[0] - 1)
    assert found(tmp_path, rows) == ()


def test_runs_with_different_targets(tmp_path):
    (text,) = found(tmp_path, changed(3, 1, 17.0, 3, 18.0))
    what = "run 3 forward lacks 1 of 6 targets of the other runs and has 1 that they have not, the first 18 mm"
    assert text == f"line {LINE[3, 1, 17.0]}, column target: {what}"


def test_run_that_was_cut_off(tmp_path):
    (text,) = found(tmp_path, good_rows()[:-2])
    first, last = LINE[5, -1, PLACES[-1]], LINE[5, -1, PLACES[2]]
    assert text == f"lines {first} to {last}, column target: run 5 backward lacks 2 of 6 targets of the other runs"


def test_runs_that_no_column_numbers(tmp_path):
    rows = [row[1:] for row in good_rows()]
    assert found(tmp_path, rows, "direction,time_s,target_mm,deviation_um") == ()
    rows[36:42] = [[*row[:3], source[3]] for row, source in zip(rows[36:42], rows[12:18], strict=True)]
    (text,) = found(tmp_path, rows, "direction,time_s,target_mm,deviation_um")
    assert "pass 7 forward has the same 6 deviations as pass 3 forward" in text


def test_rows_that_are_sorted_by_target(tmp_path):
    rows = sorted((row[3:] for row in good_rows()), key=lambda row: row[0])
    texts = found(tmp_path, rows, "target_mm,deviation_um")
    assert any("column target: the same target stands in rows one after the other" in text for text in texts)


def test_periods_that_even_targets_hide(tmp_path):
    rows = [[*row[:3], 10.0 * PLACES.index(row[3]), row[4]] for row in good_rows()]
    (text,) = found(tmp_path, rows)
    assert text.startswith("column target: these targets cannot show periods of 10 mm / k; ISO 230-2 asks for uneven")


def test_stated_pitch_counts_among_the_hidden_periods(tmp_path):
    rows = [[*row[:3], 10.0 * PLACES.index(row[3]), row[4]] for row in good_rows()]
    (text,) = found(tmp_path, rows, facts={"screw_pitch": "20 mm"})
    assert "periods of 10 mm / k, 20 mm" in text


def test_log_of_a_moving_axis_is_no_positioning_test(tmp_path):
    rows = [[0.01 * index, 0.1 * index, 2.0] for index in range(200)]
    (text,) = found(tmp_path, rows, "time_s,target_mm,deviation_um")
    assert "the axis moves while it is read" in text


def test_nobody_has_to_read_endless_lists(tmp_path):
    rows = good_rows()
    for index in range(1, 60, 2):
        rows[index][2] = 0.0
    texts = found(tmp_path, rows)
    assert len(texts) == 8
    assert texts[-1].endswith("and 21 more of this kind")  # the first of the 30 follows a 0


def test_two_readings_say_nothing(tmp_path):
    assert found(tmp_path, good_rows()[:2]) == ()
