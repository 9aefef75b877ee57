"""The chapter on the search: its words, tables, figures and files, from a small search whose scores are made up."""

from __future__ import annotations

import json
import re
import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
import pytest
from rich.console import Console

from rtec.dataset.load import load_dataset
from rtec.inference.diagnose import diagnose
from rtec.inference.model_file import read_model
from rtec.inference.static_predictor import LeftOut
from rtec.metrology import MeasuringPlan, Readings, measurement_of_readings, read_measurement
from rtec.predictors import BidirectionalTable
from rtec.report.diagnosis import verdict_sentence
from rtec.report.document import study_document
from rtec.report.figures_rounds import rounds_figure
from rtec.report.folder import write_report
from rtec.report.search import alias_words, rounds_sentence, search_figures, search_of
from rtec.report.terminal import staircase_table
from rtec.study.results import Learned, Round, TruthScore

PLAN = MeasuringPlan(
    start_mm=25.4, end_mm=76.2, increment_mm=2.54, dwell_s=6, runs=3, feed_mm_s=50 * 25.4 / 60, overshoot_mm=2.54
)
BACKLASH_MM = 0.05


@pytest.fixture(scope="module")
def learned():
    """Return a search in 3 bidirectional runs of 21 targets, with a backlash of 50 um and 1 um of noise."""
    rng = np.random.default_rng(8)
    columns = []
    for run in (1, 2, 3):
        for way in (1, -1):
            target = PLAN.targets_mm[::way]
            deviation = way * BACKLASH_MM / 2 + rng.normal(0, 0.001, 21)
            columns.append((target, deviation, np.full(21, way), np.full(21, run)))
    target, deviation, direction, run = (np.concatenate(column) for column in zip(*columns, strict=True))
    readings = Readings(target_mm=target, deviation_mm=deviation, direction=direction, run=run)
    diagnosis = diagnose(load_dataset(measurement_of_readings(readings, {})))
    assert diagnosis.effects == ("backlash",)
    scores = (TruthScore(rms_mm=0.0251, worst_mm=0.0303), TruthScore(rms_mm=0.00042, worst_mm=0.00077))
    first = Round(
        plan=PLAN, readings=readings, machine_s=7200.0, missed_mm=deviation, left_mm=deviation - deviation.mean(),
        diagnosis=diagnosis, score=TruthScore(rms_mm=0.0012, worst_mm=0.0031),
    )  # fmt: skip
    places = np.linspace(0.0, 1.0, 5001)
    table = BidirectionalTable.on_grid(places, 0.0 * places, 0.0 * places)
    return Learned(rounds=(first,), predictor=table, left_out=(), scores=scores, wall_s=1.0)


@pytest.fixture(scope="module")
def again(learned):
    """Return the same search, measured again at other targets."""
    first = learned.rounds[0]
    plan = replace(PLAN, increment_mm=3.175, runs=1)
    target = np.concatenate([plan.targets_mm, plan.targets_mm[::-1]])
    readings = Readings(
        target_mm=target, deviation_mm=np.full(34, 0.002), direction=np.repeat([1, -1], 17), run=np.ones(34, int)
    )
    second = replace(
        first, plan=plan, readings=readings, machine_s=1800.0, missed_mm=np.full(34, 0.002),
        left_mm=np.full(34, -0.001), score=TruthScore(rms_mm=0.0004, worst_mm=0.0007),
    )  # fmt: skip
    return replace(learned, rounds=(first, second))


@pytest.fixture
def result(make_result, learned):
    return make_result(learned=learned, predictor="learned")


def test_the_chapter_says_what_was_measured_found_and_believed(result, learned):
    search = search_of(result)
    assert search.rounds == [] and rounds_figure(learned, None) is None
    assert search.found.sentence == verdict_sentence(learned.diagnosis)
    assert search.facts[0] == ("Program", "25.4 to 76.2 mm every 2.54 mm, 3 bidirectional runs, dwell 6 s")
    assert ("Readings", "126, at rest") in search.facts
    assert search.scores == ["25.1", "0.420"]
    assert "25.1 µm RMS before, 0.420 µm RMS after, 0.770 µm at worst" in search.score
    assert "noise-free curve" in search.score
    assert "5\u202f001 points in each direction from 25.4 to 76.2 mm" in search.belief
    assert "off the true error by 1.20 µm RMS, 3.10 µm at worst" in search.belief  # the conftest's score
    assert "nothing was left out" in search.belief


def test_what_the_predictor_cannot_hold_is_said(make_result, learned):
    left = (LeftOut(effect="thermal_growth", why="it changes with time or temperature"),)
    belief = search_of(make_result(learned=learned, left_out=left)).belief
    assert "Left out of it" in belief
    assert "thermal growth (it changes with time or temperature)" in belief


@pytest.mark.parametrize(
    ("period_mm", "said"),
    [
        (25.4, "10 targets to a turn of the screw (25.4 mm). They show harmonics of the cyclic error up to number 5"),
        (7.62, "3 targets to a turn of the screw (7.62 mm). They show harmonics of the cyclic error up to number 1"),
        (6.35, ""),  # two and a half: every other turn the targets stand elsewhere
        (None, ""),
    ],
)
def test_aliases_are_said_where_targets_stand_at_the_same_phases_of_each_turn(make_result, learned, period_mm, said):
    words = alias_words(make_result(learned=learned, period_mm=period_mm))
    assert said in words
    assert bool(words) == bool(said)


def test_both_rounds_stand_side_by_side_with_what_the_second_cost(make_result, again):
    result = make_result(learned=again, predictor="learned", period_mm=6.35)
    search = search_of(result)
    rows = dict(search.rounds)
    assert rows["targets every"] == ["2.54 mm", "3.175 mm"]
    assert rows["readings"] == ["126", "34"]
    assert rows["machine time"] == ["2.0 h", "0.5 h"]
    assert rows["its readings less the model before"][1] == "2.00 µm"
    assert rows["its readings less the model after"][1] == "1.00 µm"
    assert rows["true error less model, RMS all along the travel"] == ["1.20 µm", "0.400 µm"]
    assert "cost 0.5 h of machine time" in search.gained
    assert "2.54 mm / k" in search.gained, "what the first targets hide"
    assert "fell from 1.20 µm to 0.400 µm RMS" in rounds_sentence(again)
    document = study_document(result)
    assert [one["machine_s"] for one in document["rounds"]] == [7200.0, 1800.0]
    assert document["rounds"][1]["rms_less_model_before_um"] == pytest.approx(2.0)
    assert again.readings.size == 160
    assert np.unique(again.readings.run).tolist() == [1, 2, 3, 4]


def test_a_predictor_that_was_given_has_no_chapter(make_result):
    assert search_of(make_result()) is None
    assert alias_words(make_result()) == ""


def test_the_folder_holds_readings_model_and_figures(make_result, again, tmp_path, monkeypatch):
    figures = search_figures(again)
    names = [figure.name for figure in figures]
    assert names.index("axis-rounds") == names.index("axis-measured") + 1
    monkeypatch.setattr("rtec.report.folder.illustrations", lambda *_: [])
    page = write_report(make_result(learned=again, predictor="learned"), tmp_path, found=figures)
    text = page.read_text("utf-8")
    assert text.index('id="rounds"') < text.index('id="axis-rounds"') < text.index('id="search"')
    assert "Measured again" in text
    back = read_measurement(tmp_path / "readings" / "calibration.csv").to_readings()
    assert np.array_equal(back.deviation_mm, again.readings.deviation_mm)
    model = read_model(tmp_path / "model.toml")
    assert [term.amplitudes for term in model.terms] == [term.amplitudes for term in again.diagnosis.model.terms]
    assert (tmp_path / "figures" / "axis-staircase.svg").stat().st_size > 1000
    assert json.loads((tmp_path / "result.json").read_text())["diagnosis"]["effects"] == ["backlash"]

    tree = ET.fromstring(page.read_text("utf-8").removeprefix("<!DOCTYPE html>"))  # noqa: S314 - our own page
    ids = [element.get("id") for element in tree.iter() if element.get("id")]
    assert len(ids) == len(set(ids))
    order = ["finding", "verdict", "axis", "search", "effects", "left", "judged", "belief", "table", "facts"]
    assert [name for name in ids if name in order] == order
    text = " ".join("".join(tree.itertext()).split())
    for words in (verdict_sentence(again.diagnosis), "25.1 µm RMS before", "The PC's model from here on"):
        assert words in text
    shown = re.search(r"id=\"axis-staircase\".*?</figure>", page.read_text("utf-8"), re.DOTALL)
    assert shown is not None and "data:image/svg+xml;base64," in shown[0]


def test_the_terminals_staircase_fits_eighty_columns(learned):
    console = Console(width=80, force_terminal=False)
    with console.capture() as captured:
        console.print(staircase_table(learned))
    lines = captured.get().splitlines()
    assert all(len(line) <= 80 for line in lines)
    rows = [line.split() for line in lines]
    floor = learned.diagnosis.noise.floor * 1000
    assert any(row[:3] == ["perfect", "axis", f"{scale_free(learned.diagnosis.rms_before)}"] for row in rows)
    step = next(row for row in rows if row[:2] == ["+", "backlash"])
    assert step[-1] == "<" or step[-2:] == ["<", "0.001"]
    assert "0.420" in step
    assert f"{floor:.2f}" in captured.get()
    assert "true error less model" in " ".join(" ".join(lines).split())


def scale_free(value_mm):
    """Return micrometres in three digits."""
    return f"{value_mm * 1000:.1f}"
