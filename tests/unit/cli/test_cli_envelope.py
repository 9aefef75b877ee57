"""rtec envelope: the table, the JSON document, the figure, and what it refuses."""

import json

import pytest

VERB = "envelope"

KEYS = {"design", "processor", "clock_hz", "max_safe_hz", "limited_by", "reaches_500khz", "gate_hz", "failing"}
MECHANISMS = {
    "insertion window",
    "polling",
    "pass-through latency",
    "decoder filter",
    "speed gate",
    "no answer",
}


def test_json_is_one_document_with_the_keys_relied_on(said, tmp_path, answer):
    figure = tmp_path / "envelope.png"
    words = ["--design", "original", "--processor", "8051-12mhz", "--figure", str(figure)]
    [row] = answer(*words)["rows"]
    assert set(row) >= KEYS | {"max_acceleration_counts_s2", "jitter_ps", "hold_latch", "sweep"}
    assert (row["design"], row["processor"], row["clock_hz"]) == ("original", "8051-12mhz", 12_000_000)
    assert 20_000 < row["max_safe_hz"] < 30_000
    assert row["limited_by"] in MECHANISMS
    assert (row["reaches_500khz"], row["jitter_ps"], row["hold_latch"], row["sweep"]) == (False, 0, False, "short")
    assert row["failing"]["what"]
    assert (row["at_500khz"], row["motion"], row["max_acceleration_hz_s"]) == ("passes", None, 0.0)
    assert 18_500 < row["max_inserting_hz"] < row["max_safe_hz"] < row["max_passing_hz"]
    assert 0 < row["max_jitter_ps"] < 500_000
    assert row["data_sheet"]["frequency"] == row["summary"]
    assert {tried["does"] for tried in row["frequencies"]} == {"inserts", "passes"}
    assert figure.read_bytes().startswith(b"\x89PNG")
    # a second run does not write over it
    code, _, err = said(*words)
    assert code == 2
    assert "--force" in err


def test_a_processor_of_ones_own_and_a_table(said, tmp_path):
    figure = tmp_path / "envelope.svg"
    words = ["--design", "a", "--processor", "12-clock 24MHz", "--jitter", "50ns", "--figure", str(figure)]
    code, out, err = said(*words)
    assert (code, err) == (0, "")
    assert "8051-24mhz" in out
    assert "insertion window" in out
    assert "<svg" in figure.read_text()


def test_plain_gates_merge_an_edge_where_the_axis_turns_within_insertions(said):
    words = ["--design", "c", "--processor", "8051-12mhz", "--motion", "reversal", "--acceleration", "100 MHz/s"]
    code, out, err = said(*words, "--json")
    assert (code, err) == (0, "")
    [row] = json.loads(out)["rows"]
    # a turn before the first change is refused, one behind it merges with the pulses: at some speed the turns meet it
    assert (row["motion"], row["gate_hz"]) == ("reversal", None)
    assert 1_000 < row["max_safe_hz"] < 5_000
    assert row["limited_by"] in ("insertion window", "polling")
    # the failing stream can be played again
    assert row["failing"]["stream"].endswith("end")
    assert "right" in row["failing"]["what"] or "at once" in row["failing"]["what"]


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (["--processor", "12-clock 5Hz"], "--processor: 5 Hz is too small"),
        (["--jitter", "2ms", "--design", "c"], "--jitter"),
        (["--image", "mine.hex"], "--image"),
        (["--image", "mine.hex", "--design", "a", "--design", "b"], "--image"),
        (["--image", "no-such.hex", "--design", "a"], "no-such.hex"),
        (["--nothing-owed"], "--nothing-owed"),
        (["--figure", "envelope.gif"], "--figure"),
        (["--motion", "revresal"], "did you mean 'reversal'"),
        (["--motion", "ramp", "--jitter", "5ns"], "--jitter"),
        (["--motion", "ramp", "--exhaustive"], "--exhaustive"),
        (["--motion", "ramp", "--seed", "3"], "--seed"),
        (["--motion", "ramp", "--acceleration", "1e15 Hz/s"], "--acceleration"),
        (["--acceleration", "5 MHz/s"], "--acceleration"),
        (["--seed", "3"], "--seed"),
    ],
)
def test_bad_arguments_are_one_line(refused, words, named):
    err = refused(*words)
    assert named in err
    assert "Traceback" not in err
