"""``rtec firmware compare``, and ``rtec simulate --timing firmware``."""

import json

import pytest
import typer
from typer.testing import CliRunner

from rtec.cli.firmware_compare import compare
from rtec.cli.simulate import simulate
from rtec.errors import ArgumentError, OutputError

SIMULATE = ["--design", "c", "--frequency", "5kHz", "--cycles", "400", "--corrections", "9", "--timing", "firmware"]


def run(verb, *words):
    app = typer.Typer()
    app.command()(verb)
    return CliRunner().invoke(app, list(words))


def test_compare_writes_figure_and_json(tmp_path):
    figure = tmp_path / "staircase.png"
    words = ["--design", "c", "--phases", "2", "--edges", "2000", "--figure", str(figure), "--json"]
    done = run(compare, *words)
    assert done.exit_code == 0
    (row,) = json.loads(done.stdout)["rows"]
    assert row["good"]
    assert row["design"] == "c"
    assert [rung["name"] for rung in row["rungs"]][:3] == ["report", "S5P2", "decision"]
    assert row["rungs"][0]["steady"]["worst_clocks"] > 0.0
    assert row["rungs"][-1]["steady"]["worst_clocks"] == row["rungs"][-1]["long"]["worst_clocks"] == 0.0
    assert figure.read_bytes().startswith(b"\x89PNG")
    assert isinstance(run(compare, *words).exception, OutputError)  # it exists


def test_compare_prints_the_staircase():
    done = run(compare, "--design", "original", "--phases", "1", "--edges", "1000")
    assert done.exit_code == 0
    assert "interrupt" in done.stdout
    assert "the same to the picosecond" in done.stdout


@pytest.mark.parametrize(
    ("words", "said"),
    [(["--design", "d"], "original, a, b, c, all"), (["--design", "c", "--figure", "x.gif"], ".png")],
)
def test_compare_refuses(words, said):
    error = run(compare, *words).exception
    assert isinstance(error, ArgumentError)
    assert said in str(error)


@pytest.mark.parametrize("design", ["original", "a", "b", "c"])
def test_simulate_with_the_firmware_timing(design):
    done = run(simulate, *SIMULATE[2:], "--design", design, "--json")
    found = json.loads(done.stdout)
    assert done.exit_code == 0
    assert found["audit"] is True
    assert found["corrections_inserted"] == 9


@pytest.mark.parametrize("words", [["--poll", "2us"], ["--decide", "4us"], ["--gate-margin", "10%"], ["--no-gate"]])
def test_simulate_refuses_times_that_are_the_programs(words):
    error = run(simulate, *SIMULATE, *words).exception
    assert isinstance(error, ArgumentError)
    assert words[0] in str(error)
    assert "--timing firmware" in str(error)
