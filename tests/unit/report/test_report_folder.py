"""The report's folder and page."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

from rtec.errors import OutputError
from rtec.machine import Ending
from rtec.metrology import AxisFacts, read_measurement
from rtec.report import folder as folder_module
from rtec.report.drawn import Illustration
from rtec.report.folder import write_report
from tests.pages import XHTML, files_in, needs_nothing_else, page_of, text_of


@pytest.fixture
def quick(monkeypatch):
    """Draw one figure that costs nothing."""
    drawn = Illustration(name="dot", title="Dot", caption="A dot.", svg=b"<svg/>", png=b"")
    monkeypatch.setattr(folder_module, "illustrations", lambda *_: [drawn])


def test_all_files_are_there_and_the_page_needs_nothing_else(make_result, out):
    page = write_report(make_result(), out)
    assert page == out / "report.html"
    figures = ("summary", "positioning", "cyclic", "residual", "feed", "waveform", "hold")
    rows = ("uncompensated", "original", "c")
    assert files_in(out) == {
        "report.html",
        "result.json",
        "rows.csv",
        "feed.csv",
        "waveforms/c_8051.vcd",
        *(f"figures/{name}.{ending}" for name in figures for ending in ("png", "svg")),
        *(f"readings/{name}.{ending}" for name in rows for ending in ("csv", "dat")),
    }
    assert len(list(out.iterdir())) == 7  # no hidden folder is left
    assert page.stat().st_size < 6_000_000
    needs_nothing_else(page, 7)


@pytest.mark.usefixtures("quick")
def test_the_table_on_the_page_holds_the_rows_numbers(make_result, out):
    tree = page_of(write_report(make_result(), out))
    body = tree.find(f".//*[@id='table']//{XHTML}tbody")
    cells = [[text_of(cell) for cell in row] for row in body]
    assert [row[0] for row in cells] == ["Uncompensated", "Original", "C"]
    assert [row[3] for row in cells] == ["100.0", "8.0", "4.0"]  # twice the mean error of each
    assert all(row[1] == "OK" for row in cells)
    heads = tree.find(f".//*[@id='table']//{XHTML}thead")
    assert len(heads[1]) + 2 == len(cells[0])


@pytest.mark.usefixtures("quick")
def test_the_verdict_names_the_best_design_and_what_it_leaves(make_result, out):
    verdict = page_of(write_report(make_result(), out)).find(".//*[@id='verdict']")
    assert re.fullmatch(
        r"Design C leaves 4\.\d µm of 109\.9 µm maximum average error; every count is accounted for\.",
        text_of(verdict),
    )
    assert verdict.get("class") == "good"


@pytest.mark.usefixtures("quick")
def test_a_failing_audit_is_seen_at_once(make_result, make_row, out):
    rows = (
        make_row("uncompensated", 0.05),
        make_row("a", 0.001, audit_counts=-4),
        make_row("b", 0.001, ending=Ending.HELD),
    )
    tree = page_of(write_report(make_result(rows=rows), out))
    verdict = tree.find(".//*[@id='verdict']")
    assert verdict.get("class") == "bad"
    assert (
        text_of(verdict)
        == "Not every count is accounted for: Design A is off by −4 counts; Design B was held by the PC."
    )
    body = tree.find(f".//*[@id='table']//{XHTML}tbody")
    assert [row.get("class") for row in body] == [None, "bad", "bad"]
    assert text_of(body[1][1]) == "off by −4 counts" and "alarm" in body[1][1].get("class")


@pytest.mark.usefixtures("quick")
def test_readings_come_back_from_both_files(make_result, out):
    result = make_result()
    write_report(result, out)
    for row in result.rows:
        csv_file = out / "readings" / f"{row.name}.csv"
        measured = read_measurement(csv_file)
        assert np.array_equal(measured.columns["deviation"].values, row.readings.deviation_mm)
        assert np.array_equal(measured.columns["target"].values, row.readings.target_mm)
        assert np.array_equal(measured.columns["run"].values, row.readings.run)
        assert AxisFacts(source="", said=read_measurement(csv_file).facts).period("screw_pitch", "mm") == 5.0
        laser = read_measurement(out / "readings" / f"{row.name}.dat").to_readings()
        assert np.allclose(laser.deviation_mm, row.readings.deviation_mm, atol=25.4e-6 / 2 * 1.001)
        assert np.array_equal(laser.direction, row.readings.direction)


@pytest.mark.usefixtures("quick")
def test_json_is_strict_and_has_the_promised_keys(make_result, make_row, out):
    rows = (make_row("uncompensated", 0.05), make_row("c", 0.002, audit_counts=np.int64(0)))
    write_report(make_result(rows=rows, repeatability_mm=float("nan")), out)

    def refuse(word: str) -> None:
        raise AssertionError(word)

    document = json.loads((out / "result.json").read_text(), parse_constant=refuse)
    assert document["repeatability_um"] is None
    row = document["rows"][1]
    assert row["audit"] is True and row["max_reversal_error_um"] == pytest.approx(4.0)
    assert set(row["iso230"]) == set("AREMB")


@pytest.mark.parametrize("error", [OSError(5, "Input/output error"), KeyboardInterrupt()])
@pytest.mark.parametrize("failing_move", [1, 4, 9])
@pytest.mark.usefixtures("quick")
def test_an_interruption_while_moving_puts_everything_back(make_result, out, monkeypatch, error, failing_move):
    (out / "report.html").write_text("older")
    (out / "figures").mkdir()
    (out / "figures" / "mine.png").write_text("older")
    moves = 0
    rename = Path.rename

    def counted(self: Path, target: Path) -> Path:
        nonlocal moves
        moves += 1
        if moves == failing_move:
            raise error
        return rename(self, target)

    monkeypatch.setattr(Path, "rename", counted)
    with pytest.raises((OutputError, KeyboardInterrupt)):
        write_report(make_result(), out)
    assert moves > failing_move or failing_move == 1
    assert files_in(out) == {"report.html", "figures/mine.png"}
    assert (out / "report.html").read_text() == "older"


@pytest.mark.usefixtures("quick")
def test_a_folder_that_is_not_there_is_named(make_result, tmp_path):
    with pytest.raises(OutputError, match="nowhere: the report cannot be written"):
        write_report(make_result(), tmp_path / "nowhere")


def test_a_study_with_almost_nothing_in_it(make_result, make_row, out):
    rows = (make_row("uncompensated", 0.05, runs=1, directions=(1,)),)
    result = make_result(
        rows=rows, feed_curves=(), hold_curves=(), waveforms=(), limits=(), facts=(), period_mm=None, warnings=()
    )
    tree = page_of(write_report(result, out))
    assert text_of(tree.find(".//*[@id='verdict']")) == "Every count is accounted for."
    assert not (out / "waveforms").exists()
    assert tree.find(".//*[@id='limits']") is None and tree.find(".//*[@id='warnings']") is None
