"""What is seen of an open path: a waveform file of all of it, and what is around one insertion."""

from itertools import pairwise

import numpy as np
import pytest
from signal_oracle import FORWARD, joined, read_vcd

from rtec.axis import Encoder, Imperfections
from rtec.board import Microcontroller
from rtec.injector import Design, InjectorSettings, Processor, RealEdges, Timing
from rtec.injector.insertion_capture import InsertionCapture
from rtec.machine import OpenPath, simulate
from rtec.machine.tape import _ROOM, estimated_bytes
from rtec.signal import EdgeStream

TWELVE_MHZ = Microcontroller.named("8051-12mhz")
TIMINGS = ("fast", "8051", "firmware")
STATE = {levels: number for number, levels in enumerate(FORWARD, start=1)}


def path_of(design, timing="fast", *, hold=False, **changes):
    profile = Timing.of(design, Processor.FAST if timing == "fast" else Processor.MCS51)
    box = InjectorSettings(design=design, timing=profile, real_edges=RealEdges.HOLD if hold else RealEdges.MERGE)
    values = {"frequency_hz": 500e3 if timing == "fast" else 3e3, "cycles": 200, "corrections": 20} | changes
    if timing == "firmware":
        values["microcontroller"] = TWELVE_MHZ
    return OpenPath(injector=box, **values)


def unit_ps(waves):
    number, unit = waves.timescale.split()
    return int(number) * {"ps": 1, "ns": 10**3, "us": 10**6}[unit]


def lines_of(waves, scope, short):
    times = {line: [t for t, _ in waves.changes[f"{scope}.{short}_{line}"]] for line in "AB"}
    return EdgeStream(*joined(*((times[line], waves.initial[f"{scope}.{short}_{line}"]) for line in "AB")))


def signed(waves, name):
    width = waves.widths[name]
    return [(t, v - (1 << width) if v >> width - 1 else v) for t, v in waves.changes[name]]


@pytest.mark.one_in(5)
@pytest.mark.parametrize("timing", TIMINGS)
@pytest.mark.parametrize("hold", [False, True])
@pytest.mark.parametrize("design", list(Design))
def test_a_file_tells_the_run(tmp_path, design, hold, timing):
    path = path_of(design, timing, hold=hold, corrections=-20, direction=-1)
    file = tmp_path / "run.vcd"
    result = simulate(path, vcd=file)
    assert result.good
    waves = read_vcd(file.read_bytes())
    step = design.step_counts
    for scope, short, counts in (("encoder", "enc", -800), ("controller", "ctl", -800 - 20 * step)):
        lines = lines_of(waves, scope, short)
        assert lines.counts() == (counts, 0)
        assert signed(waves, f"{scope}.{short}_count")[-1][1] == counts
        states = [
            (t, STATE[f"{ab & 1}{ab >> 1}"])
            for t, ab in zip(lines.times_ps.tolist(), lines.levels.tolist(), strict=True)
        ]
        assert waves.changes[f"{scope}.{short}_state"] == states
    for total in ("requested", "completed"):
        assert [v for _, v in signed(waves, f"box.{total}")][-1] == -20
    asked = [v for _, v in signed(waves, "box.requested")]
    assert asked == list(range(-1, -21, -1))
    assert waves.changes["box.illegal"] == []
    busy = waves.changes["box.inserting"]
    assert [v for _, v in busy] == [1, 0] * (len(busy) // 2)
    assert sum(v for _, v in busy) == 20


@pytest.mark.parametrize("design", [Design.ORIGINAL, Design.A, Design.C])
def test_an_insertion_shows_from_the_look_to_its_last_change(tmp_path, design):
    path = path_of(design, "8051")
    file = tmp_path / "run.vcd"
    simulate(path, vcd=file)
    waves = read_vcd(file.read_bytes())
    busy = [t for t, _ in waves.changes["box.inserting"]]
    done = [t for t, _ in waves.changes["box.completed"]]
    timing = path.injector.timing
    assert busy[1::2] == done
    assert {end - begin for begin, end in zip(busy[::2], busy[1::2], strict=True)} == {
        (timing.decide_ps + (design.step_counts - 1) * timing.step_ps) // unit_ps(waves)
    }


def test_illegal_transitions_are_marked(tmp_path):
    # no gate and edges 50 ns apart: the pulses meet real edges at the same instant
    timing = Timing(gate_margin=None)
    path = OpenPath(
        injector=InjectorSettings(design=Design.C, timing=timing), frequency_hz=5e6, cycles=400, corrections=90
    )
    file = tmp_path / "run.vcd"
    result = simulate(path, vcd=file)
    waves = read_vcd(file.read_bytes())
    levels = lines_of(waves, "controller", "ctl")
    wrong = [
        t for (before, after), t in zip(pairwise([0, *levels.levels.tolist()]), levels.times_ps.tolist(), strict=True)
        if before ^ after == 3
    ]  # fmt: skip
    assert len(wrong) == result.insertions.illegal > 3
    raised = [t for t, value in waves.changes["box.illegal"] if value]
    assert set(raised) <= set(wrong)
    cleared = [t for t, value in waves.changes["box.illegal"] if not value]
    times = levels.times_ps.tolist()
    assert all(t not in wrong and times[times.index(t) - 1] in wrong for t in cleared)


def test_more_than_the_tape_holds_comes_in_parts(tmp_path):
    path = path_of(Design.C, cycles=_ROOM // 3, corrections=500, encoder=Encoder(
        imperfections=Imperfections(jitter_ps=9_000, glitch_probability=0.01), seed=3))  # fmt: skip
    file = tmp_path / "run.vcd"
    traced, plain = simulate(path, vcd=file), simulate(path)
    assert (traced.received, traced.insertions) == (plain.received, plain.insertions)
    text = file.read_text()
    code = next(line.split()[3] for line in text.splitlines() if line.endswith(" enc_A $end"))
    assert text.count(f"\n1{code}\n") >= path.cycles


def test_all_that_is_owed_may_come_before_one_edge(tmp_path, monkeypatch):
    # one cycle a minute: at rest in state 1 all steps that have come due follow each other before the next edge
    monkeypatch.setitem(simulate.__globals__["TraceRecorder"].__init__.__globals__, "_ROOM", 64)
    path = path_of(Design.ORIGINAL, frequency_hz=1 / 60, cycles=50, corrections=800)
    file = tmp_path / "run.vcd"
    traced, plain = simulate(path, vcd=file), simulate(path)
    assert (traced.received, traced.insertions) == (plain.received, plain.insertions)
    waves = read_vcd(file.read_bytes())
    assert signed(waves, "controller.ctl_count")[-1][1] == 200 + 4 * plain.insertions.completed
    assert len(waves.changes["box.completed"]) == plain.insertions.completed > 700


@pytest.mark.one_in(5)
@pytest.mark.parametrize("design", list(Design))
@pytest.mark.parametrize(
    "changes",
    [
        {"cycles": 300, "corrections": 0},
        {"cycles": 5_000, "corrections": 5_000, "frequency_hz": 100.0},
        {"cycles": 20_000, "corrections": -900, "direction": -1},
        {"timing": "8051", "cycles": 3_000, "corrections": 300},
        {"timing": "firmware", "cycles": 300, "corrections": 30, "frequency_hz": 1e3},
        {"cycles": 3_000, "encoder": Encoder(imperfections=Imperfections(glitch_probability=0.2, jitter_ps=5_000))},
    ],
    ids=str,
)
def test_size_is_known_before_the_run(tmp_path, design, changes):
    path = path_of(design, **changes)
    file = tmp_path / "run.vcd"
    simulate(path, vcd=file)
    assert estimated_bytes(path) == pytest.approx(file.stat().st_size, rel=0.2)


@pytest.mark.one_in(7)
@pytest.mark.parametrize("timing", TIMINGS)
@pytest.mark.parametrize("hold", [False, True])
@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("design", list(Design))
def test_the_first_insertion_is_found(design, sign, hold, timing):
    path = path_of(design, timing, hold=hold, corrections=20 * sign)
    capture = InsertionCapture()
    result, plain = simulate(path, seen=capture), simulate(path)
    assert (result.received, result.insertions) == (plain.received, plain.insertions)
    seen = capture.found
    inside = seen.controller.window(seen.begin_ps, seen.end_ps + 1)
    assert inside.counts() == (sign * design.step_counts, 0)
    assert STATE[f"{inside.initial & 1}{inside.initial >> 1}"] == seen.state
    assert seen.requested.at(seen.begin_ps) == sign
    assert seen.completed.at(seen.begin_ps - 1) == 0
    assert (seen.steps, seen.completed.totals[0]) == (sign, sign)
    # before and after: the encoder goes on
    assert seen.encoder.times_ps[0] < seen.begin_ps
    assert (seen.encoder.times_ps > seen.end_ps).sum() >= 4


@pytest.mark.parametrize("state", [1, 2, 3, 4])
def test_an_insertion_from_each_state_is_found(state):
    # 37 and 4 * 200 have no common divisor: the insertions go through all states
    capture = InsertionCapture(state)
    simulate(path_of(Design.C, corrections=37), seen=capture)
    assert capture.found.state == state
    level = capture.found.encoder.level_at(capture.found.begin_ps - 1)
    assert f"{level & 1}{level >> 1}" == FORWARD[state - 1]


def test_what_is_not_there_is_looked_for_to_the_end():
    capture = InsertionCapture(2)
    simulate(path_of(Design.ORIGINAL), seen=capture)
    assert capture.found is None
    assert capture.seen_in == {1: 20, 2: 0, 3: 0, 4: 0}


def test_it_is_not_looked_for_for_ever(monkeypatch):
    monkeypatch.setitem(InsertionCapture.__init__.__globals__, "MOST_INSERTIONS", 7)
    capture = InsertionCapture(2)
    simulate(path_of(Design.ORIGINAL), seen=capture)
    assert (capture.found, capture.done) == (None, True)
    assert capture.seen_in[1] == 7


def test_the_last_edges_of_a_run_end_the_capture():
    capture = InsertionCapture()
    result = simulate(path_of(Design.C, cycles=3, corrections=1), seen=capture)
    assert result.good
    seen = capture.found
    assert np.all(seen.controller.times_ps <= result.simulated_s * 1e12)
    assert seen.controller.window(seen.begin_ps, seen.end_ps + 1).counts().net == 2
