"""--motion of rtec simulate and rtec check: what its words reach, and what is refused."""

import json

import pytest

from rtec.cli import main

PART = "G70\nG01G59G90G94\nG53Z0.02F50.\nG04F1\nG53Z0.01\nM00 (stop)\nG53Z0.0F10.\n"


def simulate(*words):
    return ["simulate", "--design", "c", "--frequency", "20kHz", "--corrections", "20", *words]


@pytest.fixture
def part(tmp_path):
    file = tmp_path / "part.nc"
    file.write_text(PART)
    return str(file)


def answer(capsys, argv):
    code = main([*argv, "--json"])
    return code, json.loads(capsys.readouterr().out)


@pytest.mark.parametrize("kind", ["ramp", "reversal", "dither", "adversary"])
def test_a_motion_is_carried_out_and_said(capsys, kind):
    code, found = answer(capsys, simulate("--cycles", "100", "--motion", kind))
    assert code == 0
    assert (found["motion"], found["real_edges"], found["corrections_inserted"]) == (kind, "hold", 20)
    assert 0 < found["top_frequency_hz"] <= 20e3


def test_a_programme_goes_where_its_words_say(capsys, part):
    code, found = answer(capsys, simulate("--motion", part))
    # 50 inch/min are 80 000 counts/s, so an inch is 96 000 counts: 0.02 inch there, and all the way back
    assert code == 0
    assert (found["motion"], found["edges"], found["encoder_counts"]) == ("programme", 2 * 1920, 0)
    assert found["top_frequency_hz"] == pytest.approx(20e3)
    assert found["simulated_s"] > 2.0  # the dwell and the stop


def test_the_seed_is_the_adversary_s(capsys):
    def counted(seed):
        _, found = answer(capsys, simulate("--cycles", "100", "--motion", "adversary", "--seed", seed))
        return {key: value for key, value in found.items() if key not in ("wall_s", "edges_per_s", "seed")}

    assert counted("1") == counted("1") != counted("2")


def test_acceleration_is_reached(capsys):
    _, slow = answer(capsys, simulate("--cycles", "100", "--motion", "ramp", "--acceleration", "1 MHz/s"))
    # v^2 = a s, in counts: sqrt(4e6 * 400) / 4
    assert slow["top_frequency_hz"] == pytest.approx(10e3)


def test_plain_gates_fail_where_held_edges_do_not(capsys):
    words = simulate("--cycles", "200", "--motion", "reversal")
    assert main(words) == 0
    assert "held back" in capsys.readouterr().out
    assert main([*words, "--real-edges", "merge"]) == 1
    assert "merged" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["--motion", "revresal", "--cycles", "9"], "--motion: 'revresal' is not a motion; use steady, ramp"),
        (["--motion", "revresal", "--cycles", "9"], "did you mean 'reversal'?"),
        (["--motion", "gone.nc"], "gone.nc: there is no such file"),
        (["--motion", "ramp"], "--cycles is missing"),
        (
            ["--cycles", "9", "--acceleration", "2 MHz/s"],
            "--acceleration does not go with --motion steady",
        ),
        (["--motion", "ramp", "--cycles", "9", "--acceleration", "100"], "--acceleration: '100' has no unit"),
        (["--motion", "ramp", "--cycles", "9", "--acceleration", "0 Hz/s"], "--acceleration: 0 Hz/s is too small"),
        (["--motion", "reversal", "--cycles", "9"], "--cycles: 9 is not valid; use at least 40"),
        (["--motion", "dither", "--cycles", "300000"], "--cycles: 300000 is not valid; use at most 250000"),
        (["--motion", "ramp", "--cycles", "0"], "--cycles: 0 is too small"),
    ],
)
def test_what_is_refused(capsys, words, says):
    assert main(simulate(*words)) == 2
    out, err = capsys.readouterr()
    assert out == ""
    lines = err.splitlines()
    assert len(lines) == 1 and says in lines[0]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("G70\nG01G59G90G94\nG53Z1.0F50.\nG02X1Y1\n", "line 4: 'G02X1Y1' is not understood"),
        ("G70\nG01G59G90G94\nG53Z999999.0F50.\n", "line 3: target_mm"),
        ("G70\nG01G59G90G94\nG53Z1.0F999999.\n", "line 3: feed_mm_s"),
        ("G70\nG01G59G90G94\nG53Z0.0F50.\n", "the axis stays at 0"),
        ("(nothing)\n", "the program moves no axis"),
        ("\n", "the file is empty"),
    ],
)
def test_a_programme_that_cannot_be_run_is_refused(capsys, tmp_path, text, says):
    file = tmp_path / "bad.nc"
    file.write_text(text)
    assert main(simulate("--motion", str(file))) == 2
    assert says in capsys.readouterr().err


def test_a_programme_has_its_own_length(capsys, part):
    assert main(simulate("--motion", part, "--cycles", "9")) == 2
    assert "--cycles does not go with a G-code file; use one of the two" in capsys.readouterr().err


@pytest.mark.usefixtures("no_speeds")
@pytest.mark.parametrize(("latch", "passed"), [("hold", True), ("merge", False)])
def test_check_has_the_motion_as_a_check(capsys, latch, passed):
    main(["check", "c", "--motion", "reversal", "--real-edges", latch, "--tries", "16", "--json"])
    checks = {check["name"]: check for check in json.loads(capsys.readouterr().out)["checks"]}
    assert checks["motion"]["passed"] is passed
    assert ("reversal up to" in checks["motion"]["reason"]) is not passed


@pytest.mark.usefixtures("no_speeds")
def test_check_runs_a_programme(capsys, part):
    main(["check", "a", "--motion", part, "--tries", "16", "--json"])
    checks = {check["name"]: check for check in json.loads(capsys.readouterr().out)["checks"]}
    assert checks["motion"]["passed"] is True
    assert "24 runs" in checks["motion"]["reason"]


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["--motion", "up"], "--motion: 'up' is not a motion; use steady"),
        (["--motion", "ramp", "--stream", "00 1us:+ 3us:end"], "does not go with --stream"),
        (["--motion", "gone.nc"], "gone.nc: there is no such file"),
    ],
)
def test_what_check_refuses(capsys, words, says):
    assert main(["check", "c", *words]) == 2
    assert says in capsys.readouterr().err
