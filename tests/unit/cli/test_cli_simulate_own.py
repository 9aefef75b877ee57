"""rtec simulate --algorithm: a user's algorithm in place of the design on the open path."""

import json
from pathlib import Path

import pytest

import rtec.examples
from rtec.cli import main
from rtec.signal.captures import read_capture

HERE = Path(rtec.examples.__file__).parent
MINE, BUG = f"{HERE}/design_c.py:DesignC", f"{HERE}/design_c_bug.py:DesignC"
STEADY = ("--frequency", "100kHz", "--cycles", "250")


@pytest.fixture
def simulate(capsys):
    """Carry out rtec simulate for design C; returns exit code, stdout and stderr."""

    def carry_out(*words):
        capsys.readouterr()
        code = main(["simulate", "--design", "c", "--corrections", "7", *map(str, words)])
        return code, *capsys.readouterr()

    return carry_out


@pytest.mark.parametrize(
    "words",
    [
        STEADY,
        (*STEADY, "--sign", "-", "--direction", "-", "--jitter", "5ns", "--phase-error", "10deg", "--seed", "3"),
        (*STEADY, "--motion", "reversal", "--counter-bits", "8"),
    ],
)
def test_an_algorithm_gives_the_counts_of_the_design_that_it_is(simulate, words):
    # the same design, built in: another implementation
    ours, theirs = (json.loads(simulate(*words, *more, "--json")[1]) for more in (("--algorithm", MINE), ()))
    assert (ours["algorithm"], ours["audit"], ours["corrections_pending"]) == ("design_c.py:DesignC", True, 0)
    keys = "encoder_counts", "corrections_inserted", "controller_counts", "step_counts", "illegal_transitions"
    if "--motion" not in words:  # there each is aimed at by turns of its own
        assert {key: ours[key] for key in keys} == {key: theirs[key] for key in keys}
        assert ours["edges"] == theirs["edges"]
    # two changes of the example are 200 ns apart
    assert ours["min_separation_ps"] <= 200_000


def test_what_is_wrong_is_found_and_told(simulate):
    words = "--frequency", "20kHz", "--cycles", "1000", "--motion", "adversary", "--algorithm", BUG
    code, out, _ = simulate(*words)
    assert (code, "fails: the controller's count is not the encoder's" in out) == (1, True)


def test_an_algorithm_that_ends_early_or_inserts_nothing_is_no_success(simulate, tmp_path):
    (tmp_path / "mine.py").write_text(
        "class Wires:\n    def step(self, t_ps, ab, requested):\n        return ab, 0, 0\n"
        "class Raises:\n    def step(self, t_ps, ab, requested):\n"
        "        if requested:\n            raise ValueError\n        return ab, 0, 0\n"
    )
    code, out, _ = simulate(*STEADY, "--algorithm", f"{tmp_path}/mine.py:Wires")
    assert (code, "7 corrections are left over" in out) == (1, True)
    code, out, _ = simulate(*STEADY, "--algorithm", f"{tmp_path}/mine.py:Raises", "--json")
    assert (code, "ValueError" in json.loads(out)["broken"]) == (1, True)


def test_it_takes_a_captured_stream_and_writes_both_sides(simulate, tmp_path):
    (tmp_path / "s.csv").write_text("Time [s],A,B\n0,0,0\n0.0001,1,0\n0.0002,1,1\n0.0009,1,1\n")
    files = "--vcd", tmp_path / "w.vcd", "--figure", tmp_path / "w.png"
    code, out, _ = simulate("--capture", tmp_path / "s.csv", "--algorithm", MINE, *files, "--json")
    result = json.loads(out)
    assert (code, result["motion"], result["encoder_counts"], result["controller_counts"]) == (0, "capture", 2, 16)
    assert (tmp_path / "w.png").stat().st_size > 1000
    assert read_capture(tmp_path / "w.vcd", "ctl_A", "ctl_B").edges.counts().net == 16


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--algorithm", MINE, "--timing", "8051"), "--timing does not go with --algorithm"),
        (("--algorithm", MINE, "--poll", "3us"), "--poll does not go with --algorithm"),
        (("--algorithm", MINE, "--glitch-probability", "1%"), "--glitch-probability does not go with --algorithm"),
        (("--algorithm", MINE, "--pins", "x.toml"), "--pins means nothing for Python"),
        (("--algorithm", "a"), "--algorithm a does not go with --design"),
        (("--algorithm", "no.py:Mine"), "no.py: no such file"),
        (("--clock", "50MHz"), "--clock needs --algorithm"),
    ],
)
def test_what_means_nothing_is_refused_in_one_line(simulate, words, said):
    code, out, err = simulate(*STEADY, *words)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert said in err
