"""The tables of docs/state-tables.md, decoded by the oracle; and the code's table against the page's."""

import pytest
from signal_oracle import FORWARD, inverted, pulsed, running_counts
from state_table_page import insertion_rows, tables

from rtec.signal import STATES

STEP = {"Original": 4, "Design A": 4, "Design B": 1, "Design C": 2}


def design_c_tables():
    return [rows for heading, rows in tables() if heading.startswith("The report's tables")]


def test_gray_table_of_page_oracle_and_code_agree():
    rows = next(rows for heading, rows in tables() if heading == "The Gray code")
    page = [(int(row["State"]), row["A"] + row["B"]) for row in rows]
    assert page == list(enumerate(FORWARD, start=1))
    assert page == [(state.number, f"{state.a}{state.b}") for state in STATES]


@pytest.mark.parametrize(("design", "row"), insertion_rows())
def test_insertion_gives_its_counts_without_illegal_transition(design, row):
    output = row["Output, step by step"].split()
    assert row["Levels"] == FORWARD[int(row["Start"]) - 1]
    counts = running_counts([row["Levels"], *output])[1:]
    assert counts == [int(count) for count in row["Count after each"].split()]
    assert counts[-1] == (1 if row["Sign"] == "+" else -1) * STEP[design]


@pytest.mark.parametrize(("design", "row"), insertion_rows())
def test_what_is_done_to_the_lines_gives_the_output(design, row):
    output = row["Output, step by step"].split()
    if design in ("Original", "Design A"):
        first, second = (tuple(row[f"{which} pulse"].split()) for which in ("First", "Second"))
        assert pulsed(row["Levels"], first, second) == output
        assert output[-1] == row["Levels"]
    if design == "Design C":
        assert inverted(row["Levels"], [row["First inverted"], row["Second inverted"]]) == output


@pytest.mark.parametrize("rows", design_c_tables())
def test_reports_walk_of_design_c_decodes_to_its_counts(rows):
    levels = [row["A"] + row["B"] for row in rows]
    assert running_counts(levels) == [int(row["Count"]) for row in rows]


@pytest.mark.parametrize("rows", design_c_tables())
def test_reports_walk_of_design_c_follows_from_its_comments(rows):
    flips = ""
    state = 1
    for row in rows:
        if row["Comment"].startswith("Invert "):
            flips += row["Comment"].removeprefix("Invert ")
        else:
            state = int(row["State"].strip("()")[0])
        levels = FORWARD[(state - 1) % 4]
        assert row["A"] + row["B"] == ([levels, *inverted(levels, flips)][-1])
        if row["Comment"].endswith("inverted"):
            assert row["Comment"] == f"{state} inverted" and sorted(flips) == ["A", "B"]
