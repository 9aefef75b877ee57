"""``rtec simulate --timing firmware``: the design's program between encoder and controller."""

import json
import re

import pytest
import typer
from typer.testing import CliRunner

from rtec.cli._groups import taken_apart
from rtec.cli.simulate import simulate
from rtec.errors import ArgumentError

SIMULATE = ["--design", "c", "--frequency", "5kHz", "--cycles", "400", "--corrections", "9", "--timing", "firmware"]


def run(verb, *words):
    app = typer.Typer()
    app.command()(taken_apart(verb))
    return CliRunner().invoke(app, list(words))


@pytest.mark.parametrize("design", ["original", "a", "b", "c"])
def test_simulate_with_the_firmware_timing(design):
    done = run(simulate, *SIMULATE[2:], "--design", design, "--json")
    found = json.loads(done.stdout)
    assert done.exit_code == 0
    assert found["audit"] is True
    assert found["corrections_inserted"] == 9
    assert found["longest_insertion_ps"] is found["real_edges_inside_insertions"] is None  # its looks are its own


def test_the_table_says_what_runs():
    done = run(simulate, *SIMULATE)
    assert done.exit_code == 0
    assert "firmware on 8051-12mhz" in done.stdout
    assert re.search(r"real edges inside insertions *│ *held back │", done.stdout)  # how many, only its program knows


def test_what_the_word_does_not_hold_is_refused():
    error = run(simulate, *SIMULATE[:6], "--corrections", "128", *SIMULATE[8:]).exception
    assert isinstance(error, ArgumentError)
    assert str(error).startswith("corrections: 128 is too large; use -127 to 127 ")


@pytest.mark.parametrize("words", [["--poll", "2us"], ["--decide", "4us"], ["--gate-margin", "10%"], ["--no-gate"]])
def test_simulate_refuses_times_that_are_the_programs(words):
    error = run(simulate, *SIMULATE, *words).exception
    assert isinstance(error, ArgumentError)
    assert words[0].strip("-").replace("-", "_").removeprefix("no_") in str(error)
    assert "--timing firmware" in str(error)
