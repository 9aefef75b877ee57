"""The waveform file of a check holds what the trace holds, read back by hand."""

import numpy as np

from rtec.injector import Totals
from rtec.signal import EdgeStream
from rtec.verify.firmware.results import Trace


def changes_of(text):
    """Changes of each signal of a file whose unit is 1 ns: (time in ps, value)."""
    names, now, found = {}, 0, {}
    for line in text.splitlines():
        words = line.split()
        if line.startswith("$scope"):
            scope = words[2]
        elif line.startswith("$var"):
            names[words[3]] = f"{scope}.{words[4]}"
        elif line.startswith("#"):
            now = 1_000 * int(line[1:])
        elif line[:1] in "01" and line[1:] in names:
            found.setdefault(names[line[1:]], []).append((now, int(line[0])))
    return found


def test_lines_and_pins_are_written(tmp_path):
    trace = Trace(
        title="",
        encoder=EdgeStream([3_000], [1], initial=0),
        controller=EdgeStream([3_000, 5_000, 6_000], [1, 3, 2], initial=0),
        requested=Totals([2_000], [1]),
        completed=Totals([8_000], [1]),
        insertions_ps=((5_000, 6_000),),
        pin_times_ps=np.array([5_000, 6_000]),
        pin_levels=np.array([0xFD, 0xFC]),
        initial_pins=0xFF,
        from_ps=1_000,
        to_ps=9_000,
        zero_ps=3_000,
        mark_ps=6_000,
        cycle_ps=1_000.0,
    )
    file = tmp_path / "a.vcd"
    trace.write(file)
    text = file.read_text()
    assert "$timescale 1 ns $end" in text
    found = changes_of(text)
    assert found["encoder.A"] == [(0, 0), (3_000, 1)]
    assert found["encoder.B"] == [(0, 0)]
    assert found["controller.A"] == [(0, 0), (3_000, 1), (6_000, 0)]  # 10 00 01: A falls with the third
    assert found["controller.B"] == [(0, 0), (5_000, 1)]
    assert found["P1.P1_1"] == [(0, 1), (5_000, 0)]
    assert found["P1.P1_0"] == [(0, 1), (6_000, 0)]
    assert found["P1.P1_7"] == [(0, 1)]
    assert found["box.requested[0]"] == [(0, 0), (2_000, 1)]
    assert found["box.completed[0]"] == [(0, 0), (8_000, 1)]
    assert found["box.inserting"] == [(0, 0), (5_000, 1), (6_000, 0)]
    assert found["box.illegal"] == [(0, 0)]
    assert found["check.failed"] == [(0, 0), (6_000, 1)]
