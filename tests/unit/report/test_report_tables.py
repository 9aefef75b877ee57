"""Tables of the page, of files and of the terminal."""

from __future__ import annotations

import csv
import io
import re

import numpy as np
import pytest
from rich.console import Console

from rtec.machine import Ending
from rtec.report.appearance import scale_of
from rtec.report.tables import LENGTH_COLUMNS, Mark, audit_text, limit_rows, rows_csv, table_rows
from rtec.report.terminal import terminal_table
from rtec.study.results import Limit

# readings of the fixture: means ±e, wave of 0.1 e, scatter of 0.01 e * (-2..2); by hand for e = 50 µm:
# E: largest less smallest mean = 2 * 50 + spread of the wave over the targets; B = 100 in every target
HALF_WAVE = np.ptp(np.sin(2 * np.pi * np.arange(12) * 3.2 / 5.0))


def _by_key(row, scale):
    return {column.key: cell.text for column, cell in zip(LENGTH_COLUMNS, table_rows_cells(row, scale), strict=False)}


def table_rows_cells(result, scale):
    return table_rows(result, scale)[0].cells


def test_numbers_of_the_table_are_those_computed_by_hand(make_result):
    cells = _by_key(make_result(), scale_of("um"))
    assert cells["B"] == cells["max_reversal_error"] == "100.0"
    assert cells["E"] == cells["max_average_error"] == f"{100 + 5 * HALF_WAVE:.1f}"
    # sample standard deviation of -2..2 times 0.5 µm is sqrt(2.5) / 2; R = 4 s + B
    assert cells["R"] == f"{100 + 4 * np.sqrt(2.5) * 0.5:.1f}"
    assert cells["max_repeat"] == "102.0"


def test_csv_holds_every_digit_in_the_studys_unit(make_result):
    result = make_result(unit="inch")
    rows = list(csv.DictReader(io.StringIO(rows_csv(result, scale_of("inch")))))
    assert [row["name"] for row in rows] == ["uncompensated", "original", "c"]
    for row, given in zip(rows, result.rows, strict=True):
        assert float(row["pp_inch"]) == pytest.approx(np.ptp(given.readings.deviation_mm) / 25.4, rel=1e-14)
        assert float(row["max_reversal_error_inch"]) * 25.4 == pytest.approx(given.figures.iso["B"], rel=1e-14)
        assert int(row["corrections_inserted"]) == 12345 and row["audit"] == "true"


def test_figures_that_are_not_defined_are_dashes_and_empty_fields(make_result, make_row):
    result = make_result(rows=(make_row("uncompensated", 0.05, runs=1, directions=(1,)),))
    scale = scale_of("um")
    cells = _by_key(result, scale)
    assert [cells[key] for key in ("A", "R", "M", "B", "max_reversal_error", "max_repeat")] == ["–"] * 6
    row = next(csv.DictReader(io.StringIO(rows_csv(result, scale))))
    assert row["A_um"] == row["B_um"] == "" and float(row["rms_um"]) > 0


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"audit_counts": 4}, "off by +4 counts"),
        ({"audit_counts": -1}, "off by −1 count"),
        ({"illegal_transitions": 2}, "illegal transitions"),
        ({"ending": Ending.HELD}, "held by the PC"),
        ({"ending": Ending.FAULTED}, "servo fault"),
        ({}, "OK"),
    ],
)
def test_the_audit_in_words(make_result, make_row, changes, words):
    row = make_row("b", 0.001, **changes)
    assert audit_text(row) == words
    table = table_rows(make_result(rows=(row,)), scale_of("um"))
    assert table[0].cells[-1].mark is (Mark.GOOD if words == "OK" else Mark.ALARM)


def test_limits_say_what_holds_a_design_back(make_result):
    original, c = limit_rows(make_result(), scale_of("um"))
    assert original.verdict == "nothing at this feed"
    assert "window and the update rate" in c.verdict and "word" in c.verdict and "gate" not in c.verdict
    assert (c.follows.mark, c.gate.mark, c.word.mark) == (Mark.MIND, Mark.NONE, Mark.MIND)
    assert c.gate.text == "any feed" and c.word.text == "54 µm"


def test_a_gate_below_the_programs_feed_is_named(make_result):
    limit = Limit(
        name="a", follows_up_to_mm_s=50.0, gate_refuses_above_mm_s=20.0, word_holds_mm=1.0, largest_error_mm=0.1
    )
    assert limit_rows(make_result(limits=(limit,)), scale_of("um"))[0].verdict.startswith("the speed gate")


@pytest.mark.parametrize("unit", ["um", "mm", "inch"])
def test_the_terminals_table_fits_a_hundred_columns(make_result, make_row, unit):
    names = ("uncompensated", "table", "original", "a", "b", "c")
    rows = tuple(make_row(name, 0.05, audit_counts=-1234) for name in names)
    console = Console(width=200, record=True, file=io.StringIO())
    console.print(terminal_table(make_result(rows=rows, unit=unit)))
    lines = console.export_text().splitlines()
    assert max(len(line.rstrip()) for line in lines) <= 100
    assert any(re.search(r"max reversal error \(B\)", line) for line in lines)


def test_the_terminal_shows_a_failing_audit_in_red(make_result, make_row):
    rows = (make_row("uncompensated", 0.05), make_row("c", 0.002, audit_counts=4))
    console = Console(width=100, force_terminal=True, color_system="standard", file=io.StringIO())
    console.print(terminal_table(make_result(rows=rows, title="[bold]not markup[/] \x1b[2J")))
    text = console.file.getvalue()
    assert re.search("\x1b\\[1;31m *off by", text) and "OK" in text
    assert "[bold]not markup[/] \ufffd[2J" in text
