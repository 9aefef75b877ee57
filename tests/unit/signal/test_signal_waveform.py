import io

import pytest
from signal_oracle import read_vcd

from rtec.errors import ArgumentError
from rtec.signal import EdgeStream, coarsest_timescale, write_vcd

CYCLE = EdgeStream([10, 20, 30, 40], [1, 3, 2, 0], initial=0)


def written(waveforms, **options):
    file = io.BytesIO()
    write_vcd(file, waveforms, **{"end_ps": 100, **options})
    return read_vcd(file.getvalue())


def test_streams_become_scoped_wires():
    waves = written({"encoder": CYCLE, "controller": CYCLE.shift(5)})
    assert waves.changes == {
        "encoder.A": [(10, 1), (30, 0)],
        "encoder.B": [(20, 1), (40, 0)],
        "controller.A": [(15, 1), (35, 0)],
        "controller.B": [(25, 1), (45, 0)],
    }
    assert waves.initial == {"encoder.A": 0, "encoder.B": 0, "controller.A": 0, "controller.B": 0}
    assert (waves.timescale, waves.start, waves.end) == ("1 ps", 0, 100)
    assert waves.times == sorted(set(waves.times))


def test_window_of_a_stream_starts_where_it_starts():
    waves = written({"e": CYCLE.window(20, 40)}, start_ps=20, end_ps=40)
    assert (waves.start, waves.end, waves.initial) == (20, 40, {"e.A": 1, "e.B": 0})
    assert waves.changes == {"e.A": [(30, 0)], "e.B": [(20, 1)]}


def test_times_that_the_timescale_cannot_hold_leave_no_file(tmp_path):
    with pytest.raises(ArgumentError, match="multiples of the timescale 1 ns; choose a finer timescale"):
        write_vcd(tmp_path / "f.vcd", {"e": CYCLE}, end_ps=1000, timescale="1 ns")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("times", "end", "expected"),
    [
        ([1], 10**12, "1 ps"),
        ([10**12], 2 * 10**12, "1 s"),
        ([30], 10, "10 ps"),
        ([], 0, "1 s"),
        ([5000], 15_000, "1 ns"),
    ],
)
def test_coarsest_timescale(times, end, expected):
    assert coarsest_timescale([*times, end]) == expected


@pytest.mark.parametrize(
    ("waveforms", "options", "message"),
    [
        ({}, {}, "signals: an empty sequence"),
        ({"e f": CYCLE}, {}, "scope: 'e f'"),
        ({"e": CYCLE}, {"end_ps": 39}, "end_ps: 39 ps"),
        ({"e": CYCLE}, {"start_ps": 11}, r"times_ps\[0\]: 10 .*not before 11 ps"),
        ({"e": CYCLE.shift(-30)}, {}, r"times_ps\[0\]: -20"),
    ],
)
def test_wrong_input_is_one_clear_error(waveforms, options, message):
    with pytest.raises(ArgumentError, match=message):
        written(waveforms, **options)
