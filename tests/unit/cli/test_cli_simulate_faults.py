"""rtec simulate --fault: faults of the open path and their moments, what is said of them, and what is refused."""

import json
import re

import pytest

import rtec.examples
from rtec.cli._words import OPEN_FAULTS as WORDS
from rtec.machine.open_fault_kinds import OPEN_FAULTS, word_of

VERB = "simulate"
MINE = f"{rtec.examples.__path__[0]}/design_c.py:DesignC"
BASE = "--design", "c", "--frequency", "100kHz", "--cycles", "1000", "--corrections", "40"


@pytest.fixture
def document(said):
    """Return the exit code and the document of a run."""

    def of(*words):
        code, out, err = said(*words, "--json")
        assert err == ""
        return code, json.loads(out)

    return of


def test_the_shell_completes_the_classes():
    assert WORDS == tuple(map(word_of, OPEN_FAULTS))


def test_the_document_has_the_keys_that_scripts_rely_on(document):
    code, found = document(*BASE, "--fault", "missed edge@2 ms", "--fault", "power-lost@0.005s..6ms")
    first, second = found["faults"]
    # the line that crosses next is 1.25 us late; A, and with it the next edge of A
    assert first == {
        "fault": "missed-edge", "place": "lines", "from_ps": 2 * 10**9, "until_ps": None, "activated": True,
        "activated_ps": 2_001_250_000, "changes": 2,
    }  # fmt: skip
    assert (second["fault"], second["place"], second["until_ps"]) == ("power-lost", "box", 6 * 10**9)
    assert 5 * 10**9 <= second["activated_ps"] < 6 * 10**9
    assert (code, found["outcome"], found["good_without_faults"], found["audit"]) == (1, "detected", True, False)
    assert found["noticed"] == ["audit: count mismatch"]
    # one cycle is lost before the box; with power back it follows the next request from zero on
    completed = found["corrections_inserted"]
    assert found["off_counts"] == found["controller_counts"] - 4000 - 2 * completed


def test_the_terminal_says_when_it_took_effect_and_what_it_is(said):
    code, out, _ = said(*BASE, "--fault", "missed edge@2 ms")
    assert re.search(r"missed-edge │ 2 ms +│ at 2.00125 ms │ 2", out)
    assert (code, out.splitlines()[-1]) == (
        1, "silent corruption: the controller is off by -4 counts, noticed by nobody"
    )  # fmt: skip
    code, out, _ = said(*BASE, "--fault", "phase error@2ms")
    assert (code, out.splitlines()[-1]) == (0, "masked: the controller is off by +0 counts, noticed by nobody")
    code, out, _ = said(*BASE, "--fault", "hold latch stuck open@2ms")
    assert (code, out.splitlines()[-1]) == (
        1, "not activated: the run proves nothing about a fault that took no effect"
    )  # fmt: skip


def test_what_fails_without_the_fault_is_said(said):
    out = said(
        "--design", "a", "--frequency", "3MHz", "--cycles", "500", "--corrections", "9", "--fault", "glitches"
    )[1]
    assert out.endswith("Without the faults the run fails, too.\n")


def test_a_moment_that_is_not_said_is_drawn_from_the_seed(document):
    drawn = [
        document(*BASE, "--fault", "missed edge", "--seed", seed)[1]["faults"][0]["from_ps"] for seed in (1, 1, 2)
    ]
    assert drawn[0] == drawn[1] != drawn[2]
    assert all(0 < moment < 10**10 for moment in drawn)


def test_waveforms_show_when_a_fault_is_there(said, tmp_path):
    file = tmp_path / "f.vcd"
    words = "--fault", "power lost@3ms..4ms", "--fault", "missed edge@2ms", "--vcd", file
    assert said(*BASE, *words)[0] == 1
    text = file.read_text()
    code = {name: re.search(rf"\$var wire 1 (\S+) {name} \$end", text)[1] for name in ("power_lost", "missed_edge")}
    changes, now = [], 0
    for line in text.split("$end")[-1].split():
        now = int(line[1:]) if line[0] == "#" else now
        changes += [(now, name, line[0]) for name, one in code.items() if line[1:] == one]
    assert changes == [
        (2 * 10**9, "missed_edge", "1"), (3 * 10**9, "power_lost", "1"), (4 * 10**9, "power_lost", "0"),
    ]  # fmt: skip


def test_an_algorithm_of_ones_own_meets_the_same_lines(document):
    # the same design, built in: another implementation
    faults = "--fault", "missed edge@2ms", "--fault", "request corrupted@4ms"
    ours, theirs = (document(*BASE, *more, *faults)[1] for more in (("--algorithm", MINE), ()))
    assert ours["faults"][0] == theirs["faults"][0]
    # requests come with the edges there, evenly in time here
    assert [found["faults"][1]["changes"] for found in (ours, theirs)] == [1, 1]
    assert (ours["outcome"], ours["off_counts"]) == (theirs["outcome"], theirs["off_counts"])
    assert (ours["off_counts"], ours["good_without_faults"]) == (-4, True)


def test_a_captured_stream_goes_through_faults(document, tmp_path):
    levels = ["00", "10", "11", "01"]
    rows = [f"{(10 + 5 * k) / 1e6:.9f},{levels[(k + 1) % 4][0]},{levels[(k + 1) % 4][1]}" for k in range(80)]
    file = tmp_path / "scope.csv"
    file.write_text("\n".join(["Time [s],A,B", "0,0,0", *rows, "0.001,0,0"]) + "\n")
    words = "--design", "c", "--capture", file, "--corrections", "3"
    code, found = document(*words, "--fault", "b stuck high@200us")
    assert (code, found["outcome"], found["edges"]) == (1, "silent corruption", 80)
    # 42 of 80 edges come after it
    assert found["off_counts"] == pytest.approx(-42, abs=1)


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (("missed-edgy",), "did you mean 'missed-edge'"),
        (("masquerade@1ms",), "is a fault of the bus; use rtec safety --fault masquerade"),
        (("missed edge@10ms",), "use a moment before the run ends, at 0.01 s"),
        (("missed edge@5",), "has no unit"),
        (("missed edge@1ms..2ms",), "is over at once"),
        (("power lost@2ms..1ms",), "a time after its begin"),
        (("glitches", "glitches@1ms"), "is given twice"),
        (("glitches", "missed edge", "phase error"), "one, or a combination of two"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(refused, words, reason):
    line = refused(*BASE, *(part for word in words for part in ("--fault", word)))
    assert line.startswith("rtec: --fault: ") and reason in line


def test_the_box_of_an_algorithm_is_ones_own(refused):
    line = refused(*BASE, "--algorithm", MINE, "--fault", "power lost@1ms")
    assert "power-lost is of the box of a design; use a fault of the lines or of a request with an algorithm" in line
    line = refused(*BASE, "--real-edges", "merge", "--fault", "hold latch stuck open@1ms")
    assert "real edges that merge pass no hold latch" in line
