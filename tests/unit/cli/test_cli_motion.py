"""--motion of rtec simulate and rtec check: what its words reach, and what is refused."""

import json

import pytest

from rtec.cli import main

PART = "G70\nG01G59G90G94\nG53Z0.02F50.\nG04F1\nG53Z0.01\nM00 (stop)\nG53Z0.0F10.\n"


VERB = "simulate"
BASE = ("--design", "c", "--frequency", "20kHz", "--corrections", "20")


@pytest.fixture
def part(tmp_path):
    file = tmp_path / "part.nc"
    file.write_text(PART)
    return str(file)


@pytest.mark.parametrize("kind", ["ramp", "adversary"])
def test_a_motion_is_carried_out_and_said(answer, kind):
    found = answer(*BASE, "--cycles", "100", "--motion", kind)
    assert (found["motion"], found["real_edges"], found["corrections_inserted"]) == (kind, "hold", 20)
    assert 0 < found["top_frequency_hz"] <= 20e3


def test_a_programme_goes_where_its_words_say(answer, part):
    found = answer(*BASE, "--motion", part)
    # 50 inch/min are 80 000 counts/s, so an inch is 96 000 counts: 0.02 inch there, and all the way back
    assert (found["motion"], found["edges"], found["encoder_counts"]) == ("programme", 2 * 1920, 0)
    assert found["top_frequency_hz"] == pytest.approx(20e3)
    assert found["simulated_s"] > 2.0  # the dwell and the stop


def test_acceleration_is_reached(answer):
    slow = answer(*BASE, "--cycles", "100", "--motion", "ramp", "--acceleration", "1 MHz/s")
    # v^2 = a s, in counts: sqrt(4e6 * 400) / 4
    assert slow["top_frequency_hz"] == pytest.approx(10e3)


@pytest.mark.parametrize(("gates", "code", "says"), [("hold", 0, "held back"), ("merge", 1, "merged")])
def test_the_table_says_what_became_of_real_edges(said, gates, code, says):
    found, out, _ = said(*BASE, "--cycles", "200", "--motion", "reversal", "--real-edges", gates)
    assert (found, says in out) == (code, True)


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["--motion", "revresal", "--cycles", "9"], "--motion: 'revresal' is not a motion; use steady, ramp"),
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
    ],
)
def test_what_is_refused(refused, words, says):
    assert says in refused(*BASE, *words)


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
def test_a_programme_that_cannot_be_run_is_refused(refused, tmp_path, text, says):
    (tmp_path / "bad.nc").write_text(text)
    assert says in refused(*BASE, "--motion", tmp_path / "bad.nc")


def test_a_programme_has_its_own_length(refused, part):
    err = refused(*BASE, "--motion", part, "--cycles", "9")
    assert "--cycles does not go with a G-code file; use one of the two" in err


@pytest.mark.usefixtures("no_speeds")
@pytest.mark.parametrize(("latch", "passed"), [("hold", True), ("merge", False)])
def test_check_has_the_motion_as_a_check(capsys, latch, passed):
    main(["check", "c", "--motion", "reversal", "--real-edges", latch, "--tries", "16", "--json"])
    checks = {check["name"]: check for check in json.loads(capsys.readouterr().out)["checks"]}
    assert checks["motion"]["passed"] is passed
    assert ("reversal up to" in checks["motion"]["reason"]) is not passed


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
