"""rtec simulate and check with --capture: a captured stream in place of a made one."""

import json

import numpy as np
import pytest

from rtec.cli import main
from rtec.signal.captures import read_capture

# up over four lines at 100 kHz, back over two, from a trigger 10 us after the first sample
EDGES_US, LEVELS = [0.0, 2.5, 5.0, 7.5, 20.125, 22.625], ["10", "11", "01", "00", "01", "11"]


@pytest.fixture
def scope(tmp_path):
    rows = [f"{t / 1e6:.9f},{level[0]},{level[1]}" for t, level in zip(EDGES_US, LEVELS, strict=True)]
    file = tmp_path / "scope.csv"
    file.write_text("\n".join(["Time [s],A,B", "-0.00001,0,0", *rows, "0.001,1,1"]) + "\n")
    return file


@pytest.fixture
def simulate(capsys):
    """Carry out rtec simulate; returns exit code, document or None, and stderr."""

    def carry_out(*words):
        capsys.readouterr()
        code = main(["simulate", *map(str, words)])
        out, err = capsys.readouterr()
        return code, json.loads(out) if out.startswith("{") else None, err

    return carry_out


@pytest.mark.parametrize(("design", "timing", "step"), [("c", "fast", 2), ("a", "8051", 4)])
def test_the_box_sees_captured_edges_and_counts_are_audited(simulate, scope, design, timing, step):
    words = "--design", design, "--capture", scope, "--corrections", 3, "--timing", timing
    code, result, err = simulate(*words, "--sign", "-", "--json")
    assert (code, err, result["audit"], result["motion"]) == (0, "", True, "capture")
    # four up and two down; three steps take counts away
    assert (result["edges"], result["encoder_counts"], result["controller_counts"]) == (6, 2, 2 - 3 * step)
    assert result["corrections_inserted"] == -3
    # 2.5 us from line to line
    assert result["top_frequency_hz"] == pytest.approx(100e3, rel=1e-5)


def test_edges_reach_the_box_to_the_picosecond(simulate, scope, tmp_path):
    # a whole motion with turns within 100 ns, written as waveforms and played again
    first, again = tmp_path / "first.vcd", tmp_path / "again.vcd"
    motion = "--frequency", "500kHz", "--cycles", 500, "--motion", "adversary", "--seed", 5
    assert simulate("--design", "c", *motion, "--corrections", 50, "--vcd", first)[0] == 0
    lines = "--a", "enc_A", "--b", "enc_B"
    words = "--design", "original", "--capture", first, *lines, "--corrections", 2
    assert simulate(*words, "--vcd", again)[0] == 0
    one, two = read_capture(first, "enc_A", "enc_B").edges, read_capture(again, "enc_A", "enc_B").edges
    assert len(one) > 500
    assert one == two
    assert np.diff(one.times_ps).min() < 200_000


@pytest.mark.parametrize(
    "option",
    [
        "--frequency=10kHz", "--cycles=10", "--jitter=5ns", "--phase-error=1deg", "--direction=-", "--motion=dither",
        "--seed=1", "--home-state=2",
    ],
)  # fmt: skip
def test_options_of_a_made_stream_are_refused_beside_a_captured_one(simulate, scope, option):
    code, _, err = simulate("--design", "c", "--capture", scope, "--corrections", 3, option)
    name = option.partition("=")[0]
    assert (code, err.count("\n")) == (2, 1)
    assert err.startswith(f"rtec: {name} does not go with --capture")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--frequency", "1kHz", "--cycles", "9", "--a", "CH0"), "--a needs --capture"),
        ((), "--frequency is missing"),
        (("--capture", "no.csv"), "no.csv: there is no such file"),
        (("--capture", "scope.csv", "--b", "CH1"), "--b: 'CH1' is not a channel of the capture"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(simulate, scope, monkeypatch, words, said):
    monkeypatch.chdir(scope.parent)
    code, _, err = simulate("--design", "c", "--corrections", 3, *words)
    assert (code, err.count("\n")) == (2, 1)
    assert said in err


@pytest.fixture
def check(capsys, monkeypatch):
    """Carry out rtec check with one run of each kind of endurance; returns exit code, document and stderr."""
    monkeypatch.setattr("rtec.verify.contract.suite.KINDS", ())
    monkeypatch.setattr("rtec.verify.contract.suite.measure_speeds", lambda *_: None)

    def carry_out(*words):
        capsys.readouterr()
        code = main(["check", *map(str, words), "--tries", "16", "--json"])
        out, err = capsys.readouterr()
        return code, json.loads(out) if out else None, err

    return carry_out


def test_a_captured_stream_is_a_check_of_the_suite(check, scope):
    code, verdict, err = check("c", "--capture", scope)
    (row,) = (row for row in verdict["checks"] if row["name"] == "capture")
    assert (code, row["passed"], row["reason"]) == (0, True, "49 runs, every count right")
    # 100 kHz from power-up within 2.5 us is more than 100 MHz/s
    assert "the capture goes beyond the contract" in err
    assert "gain or lose more than 100 MHz/s" in verdict["capture_beyond_contract"]
    code, verdict, err = check("c", "--capture", scope, "--acceleration", "200 GHz/s")
    assert (code, err, verdict["capture_beyond_contract"]) == (0, "", None)


def test_edges_that_no_axis_sends_are_said_and_judged(check, tmp_path):
    file = tmp_path / "burst.csv"
    file.write_text("Time [s],A,B\n0,0,0\n0.001,1,0\n0.00100003,1,1\n0.002,1,1\n")
    code, verdict, err = check("c", "--capture", file)
    (row,) = (row for row in verdict["checks"] if row["name"] == "capture")
    assert (code, row["passed"], row["stream"].split()[:3]) == (1, False, "00 1ms:+ 1.00003ms:+".split())
    assert "the capture, nothing asked for" in row["reason"]
    assert "A and B change within 30 ns" in row["reason"]
    assert "1.00003ms comes 30ns after the one before" in err
    assert verdict["worst_case"] == f"rtec check c --capture {file}"


def test_a_stream_and_a_capture_do_not_go_together(check, scope):
    assert check("c", "--capture", scope, "--stream", "00 1us:+ 9us:end")[0] == 2
    assert check("c", "--capture", scope, "--exhaustive")[0] == 2
