import io
import os
import resource
from pathlib import Path

import numpy as np
import pytest
from signal_oracle import read_vcd

from rtec.errors import ArgumentError, OutputError
from rtec.signal import TIMESCALES_PS, VcdSignal, VcdWriter
from rtec.signal.vcd import Phase, VcdPhaseError

A = VcdSignal(scope="encoder", name="A")
STATE = VcdSignal(scope="encoder", name="state", width=3, initial=4)


def written(signals, changes, *, end_ps, **options):
    file = io.BytesIO()
    with VcdWriter(file, signals=signals, **options) as writer:
        for times, which, values in changes:
            writer.write(times, which, values)
        writer.finish(end_ps)
    return file.getvalue()


def test_file_word_by_word():
    data = written([A, STATE], [([5, 5], [0, 1], [1, 2]), ([17], [0], [0])], end_ps=20)
    assert data.decode().splitlines() == [
        "$version rtec $end",
        "$timescale 1 ps $end",
        "$scope module encoder $end",
        "$var wire 1 a A $end",
        "$var wire 1 d state[2] $end",
        "$var wire 1 c state[1] $end",
        "$var wire 1 b state[0] $end",
        "$upscope $end",
        "$enddefinitions $end",
        "#0",
        "$dumpvars",
        "0a",
        "1d",
        "0c",
        "0b",
        "$end",
        "#5",
        "1a",
        "1c",
        "0d",
        "#17",
        "0a",
        "#20",
    ]


def test_second_name_is_that_of_the_same_bit():
    named = VcdSignal(scope="encoder", name="enc_A", also="A")
    data = written([named], [([5], [0], [1])], end_ps=9)
    assert b"$var wire 1 a enc_A $end\n$var integer 1 a A $end\n" in data
    assert read_vcd(data).also == {"encoder.A": "encoder.enc_A"}
    with pytest.raises(ArgumentError, match=r"signals\[1\]: encoder.A is not valid"):
        VcdWriter(io.BytesIO(), signals=[named, A])


def test_value_that_stays_changes_no_bit():
    data = written([STATE], [([5, 6, 7], [0, 0, 0], [4, 6, 6])], end_ps=9)
    assert data.decode().split("$end\n")[-1].split() == ["#5", "#6", "1b", "#7", "#9"]


def test_scope_is_opened_again_where_the_order_wants_it():
    signals = [VcdSignal(scope=scope, name=name) for scope, name in (("x", "p"), ("y", "q"), ("x", "r"))]
    waves = read_vcd(written(signals, [], end_ps=9))
    assert list(waves.changes) == ["x.p", "y.q", "x.r"]


def test_time_line_is_written_once_over_several_calls():
    data = written([A, STATE], [([5], [0], [1]), ([5], [1], [1]), ([], [], [])], end_ps=5)
    assert read_vcd(data).times == [0, 5]


def test_change_at_the_start_follows_the_initial_values():
    waves = read_vcd(written([A], [([7_000], [0], [1])], end_ps=9_000, start_ps=7_000, timescale="1 ns"))
    assert (waves.start, waves.initial, waves.changes, waves.end) == (7, {"encoder.A": 0}, {"encoder.A": [(7, 1)]}, 9)


def test_widest_value_and_latest_time():
    wide = VcdSignal(scope="s", name="w", width=62)
    latest = 2**62
    waves = read_vcd(written([wide], [([latest - 1], [0], [2**62 - 1])], end_ps=latest))
    assert waves.changes["s.w"] == [(4611686018427387903, 4611686018427387903)]
    assert waves.end == 4611686018427387904


def test_more_signals_than_letters_keep_their_names_apart():
    signals = [VcdSignal(scope=f"s{k % 3}", name=f"n{k}") for k in range(60)]
    waves = read_vcd(written(signals, [(np.arange(1, 61), np.arange(60), np.ones(60, int))], end_ps=100))
    assert waves.changes == {f"s{k % 3}.n{k}": [(k + 1, 1)] for k in range(60)}


def test_long_array_is_formatted_in_parts():
    n = (1 << 18) + 1000
    times = np.arange(1, n + 1, dtype=np.int64) * 7
    waves = read_vcd(written([A], [(times, np.zeros(n, int), times % 2)], end_ps=7 * n))
    assert waves.changes["encoder.A"] == [(7 * k, k % 2) for k in range(1, n + 1)]


@pytest.mark.parametrize(("timescale", "unit"), [("1 ps", 1), ("100 ns", 10**5), ("10 us", 10**7), ("1 s", 10**12)])
def test_timescale_divides_the_times(timescale, unit):
    waves = read_vcd(written([A], [([3 * unit], [0], [1])], end_ps=4 * unit, timescale=timescale))
    assert (waves.timescale, waves.changes["encoder.A"], waves.end) == (timescale, [(3, 1)], 4)


def test_timescales_are_those_of_the_standard():
    assert list(TIMESCALES_PS.values()) == [10**k for k in range(13)]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"timescale": "3 ns"}, "timescale: '3 ns' is not a timescale; use one of 1 ps, 10 ps"),
        ({"timescale": ""}, "timescale: ''"),
        ({"signals": []}, "signals: an empty sequence"),
        ({"signals": [A, STATE, A]}, r"signals\[2\]: encoder.A"),
        ({"start_ps": -1}, "start_ps: -1 ps"),
        ({"start_ps": 1500, "timescale": "1 ns"}, "start_ps: 1500 is not valid; .*multiples of the timescale 1 ns"),
        ({"start_ps": 2**63}, "start_ps: 9223372036854775808"),
        ({"start_ps": 0.5}, "start_ps: 0.5"),
    ],
)
def test_wrong_argument_of_the_writer(options, message):
    with pytest.raises(ArgumentError, match=message):
        VcdWriter(io.BytesIO(), **{"signals": [A], **options})


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"scope": "1x"}, "scope: '1x'"),
        ({"name": "A B"}, "name: 'A B'"),
        ({"name": ""}, "name: ''"),
        ({"name": "A" * 300}, "name: 'AAAA"),
        ({"name": None}, "name: None"),
        ({"also": "A B"}, "also: 'A B'"),
        ({"width": 0}, "width: 0"),
        ({"width": 63}, "width: 63"),
        ({"width": 1.0}, "width: 1.0"),
        ({"initial": 2}, "initial: 2"),
        ({"initial": 8, "width": 3}, "initial: 8"),
    ],
)
def test_wrong_signal(fields, message):
    with pytest.raises(ArgumentError, match=message):
        VcdSignal(**{"scope": "s", "name": "A", **fields})


@pytest.mark.parametrize(
    ("times", "which", "values", "message"),
    [
        (
            [1000, 2500],
            [0, 0],
            [1, 0],
            r"times_ps\[1\]: 2500 is not valid; use multiples of the timescale 1 ns",
        ),
        ([2000, 1000], [0, 0], [1, 0], r"times_ps\[1\]: 1000 .*do not decrease"),
        ([-1000], [0], [1], "times_ps: -1000"),
        ([2**63], [0], [1], "times_ps: 9223372036854775808"),
        ([1e400], [0], [1], r"times_ps\[0\]: inf"),
        ([1000], [2], [1], "signals: 2 is not valid; use 0..1"),
        ([1000], [0], [2], "values: 2 is not valid; use values within the signal's width"),
        ([1000], [1], [8], "values: 8"),
        ([1000], [1], [-1], "values: -1"),
        ([1000], [1], [2**63], "values: 9223372036854775808"),
        ([1000], [0, 0], [1], "values: 1, 2 and 1 items"),
    ],
)
def test_wrong_changes(times, which, values, message):
    with VcdWriter(io.BytesIO(), signals=[A, STATE], timescale="1 ns") as writer:
        with pytest.raises(ArgumentError, match=message):
            writer.write(times, which, values)


def test_times_before_those_written():
    with VcdWriter(io.BytesIO(), signals=[A], start_ps=50) as writer:
        with pytest.raises(ArgumentError, match="not before 50 ps"):
            writer.write([40], [0], [1])
        writer.write([60], [0], [1])
        with pytest.raises(ArgumentError, match="not before 60 ps"):
            writer.write([59], [0], [0])
        with pytest.raises(ArgumentError, match=r"end_ps: 59 ps is not valid; .*last change at 60 ps"):
            writer.finish(59)


def test_phases_follow_one_another():
    writer = VcdWriter(io.BytesIO(), signals=[A])
    assert writer.phase is Phase.NEW
    with pytest.raises(VcdPhaseError, match=r"write: not allowed while the VCD writer is not entered; write inside"):
        writer.write([1], [0], [1])
    with writer:
        with pytest.raises(VcdPhaseError, match="with: not allowed while the VCD writer is taking changes"), writer:
            pass
        writer.finish(3)
        with pytest.raises(VcdPhaseError, match="write: not allowed while the VCD writer is finished"):
            writer.write([1], [0], [1])
        with pytest.raises(VcdPhaseError, match="finish: not allowed while the VCD writer is finished"):
            writer.finish(5)
    assert writer.phase is Phase.CLOSED
    with pytest.raises(VcdPhaseError, match="finish: not allowed while the VCD writer is closed"):
        writer.finish(5)
    with pytest.raises(VcdPhaseError, match="with: not allowed while the VCD writer is closed"), writer:
        pass


def test_file_appears_when_complete_and_replaces_the_old_one(tmp_path):
    path = tmp_path / "f.vcd"
    path.write_text("old")
    with VcdWriter(path, signals=[A]) as writer:
        writer.write([1], [0], [1])
        assert path.read_text() == "old"
    assert read_vcd(path.read_bytes()).changes == {"encoder.A": [(1, 1)]}
    assert os.listdir(tmp_path) == ["f.vcd"]


@pytest.mark.parametrize("error", [KeyboardInterrupt, ZeroDivisionError, SystemExit])
def test_nothing_is_left_after_an_error(tmp_path, error):
    path = tmp_path / "f.vcd"
    with pytest.raises(error), VcdWriter(path, signals=[A]) as writer:
        writer.write([1], [0], [1])
        raise error
    assert os.listdir(tmp_path) == []


def test_no_space_left_is_one_clear_error_and_leaves_nothing(tmp_path):
    path = tmp_path / "f.vcd"
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    times = np.arange(1, 100_001)
    resource.setrlimit(resource.RLIMIT_FSIZE, (50_000, hard))
    try:
        with pytest.raises(OutputError, match=r"f\.vcd: cannot be written: File too large"):
            with VcdWriter(path, signals=[A]) as writer:
                writer.write(times, times * 0, times % 2)
                writer.finish(200_000)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert os.listdir(tmp_path) == []


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="the system has no /dev/full")
def test_full_device_stays_a_device():
    with pytest.raises(OutputError, match="/dev/full: cannot be written: No space left on device"):
        with VcdWriter("/dev/full", signals=[A]) as writer:
            writer.finish(5)
    assert Path("/dev/full").is_char_device()


@pytest.mark.parametrize("name", ["missing/f.vcd", "", "a\x00b", "x" * 300])
def test_path_that_cannot_be_written(tmp_path, name):
    with pytest.raises(OutputError, match="cannot be written"), VcdWriter(str(tmp_path / name), signals=[A]):
        pass
    assert os.listdir(tmp_path) == []


def test_permissions_are_those_of_any_new_file(tmp_path):
    (tmp_path / "plain").write_text("")
    with VcdWriter(tmp_path / "f.vcd", signals=[A]):
        pass
    assert (tmp_path / "f.vcd").stat().st_mode == (tmp_path / "plain").stat().st_mode
