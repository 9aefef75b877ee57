"""rtec replay: a log to a box in a thread, and what is refused."""

import json
import os

import pytest

from rtec.cli import main
from rtec.link.frame import Frame
from rtec.link.logs import Direction, Log
from rtec.link.messages import MessageSet

MS = 10**9
CYCLE_PS = 200 * MS
"""So slow that a machine which is busy for a second does no harm: the watchdog timeout is six cycles."""


def parts():
    from rtec.machine.station import Station, StationSettings
    from rtec.requester.supervision import SupervisionLimits

    supervision = SupervisionLimits(cycle_ps=CYCLE_PS, watchdog_ps=6 * CYCLE_PS)
    return Station(StationSettings(supervision=supervision), session=5), supervision


@pytest.fixture
def log(tmp_path):
    """A log of box and PC in simulated time: 2 s, three steps asked for and inserted."""
    from rtec.predictors import UnidirectionalTable
    from rtec.requester.pc_node import PcNode
    from rtec.requester.settings import HandshakeSettings

    station, supervision = parts()
    table = UnidirectionalTable(positions_mm=[-50.0, 50.0], errors_mm=[0.012, 0.012], backlash_mm=0.0)
    handshake = HandshakeSettings(pc_period_ps=CYCLE_PS)
    pc = PcNode(
        handshake, supervision, axis=1, predictor=table, count_mm=0.001, step_counts=4, word_limit=127,
        setup=station.settings.setup,
    )  # fmt: skip
    file = tmp_path / "run.log"
    with Log(file) as written:
        for t_ps in range(MS, 2000 * MS, MS):
            for at_ps, frame in station.advance(until_ps=t_ps):
                written.record(frame, at_ps, Direction.RECEIVED)
                pc.receive(frame, at_ps=at_ps)
            if pc.due_ps <= t_ps:
                for frame in pc.turn(at_ps=t_ps):
                    written.record(frame, t_ps, Direction.SENT)
                    station.receive(frame)
    assert station.view.completed == 3
    return file


@pytest.fixture
def box(on_a_bus):
    """A box that has just been switched on, on a virtual bus, in a thread: its channel."""
    station, _ = parts()
    return on_a_bus(station), station


def run_replay(capsys, *words):
    code = main(["replay", *words])
    out, err = capsys.readouterr()
    return code, out, err


def test_a_box_is_held_to_a_log(capsys, box, log):
    channel, station = box
    code, out, err = run_replay(capsys, str(log), "--interface", "virtual", "--channel", channel, "--json")
    report = json.loads(out)
    assert (code, report["passed"], report["differences"]) == (0, True, [])
    assert (report["as"], report["tolerance_ms"]) == ("pc", 1000.0)  # five cycles
    assert report["played"] == pytest.approx(11, abs=2)
    assert station.view.completed == 3
    assert "waiting up to 60 s for the box" in err


def test_a_box_that_answers_otherwise_fails(capsys, box, log, tmp_path):
    """The log's box completed five steps where this one is asked for three."""
    messages = MessageSet.load()
    lines = []
    for line in log.read_text().splitlines():
        at, channel, frame, way = line.split()
        identifier, data = frame.split("#")
        message = messages.decode(int(identifier, 16), bytes.fromhex(data))
        if message.name == "Corrections" and message.values["Completed"] == 3:
            values = {name: value for name, value in message.values.items() if name != "Crc"}
            changed = messages.encode("Corrections", 1, values | {"Completed": 5})
            frame = f"{identifier}#{changed.data.hex().upper()}"
        lines.append(f"{at} {channel} {frame} {way}\n")
    other = tmp_path / "other.log"
    other.write_text("".join(lines))
    code, out, _ = run_replay(capsys, str(other), "--interface", "virtual", "--channel", box[0])
    assert code == 1
    (row,) = [line.split() for line in out.splitlines() if "Corrections" in line]
    assert row[2:6] == ["1", "Corrections", "Completed", "5"]
    assert row[6] in ("0", "3")  # it may still insert when it is first looked at
    assert "1 difference beyond 1000 ms" in out


def test_nobody_is_heard(capsys, log):
    words = [str(log), "--interface", "virtual", "--channel", f"none-{os.getpid()}", "--start-up", "100ms"]
    code, out, err = run_replay(capsys, *words)
    assert code == 1
    assert "nothing was played: no box answered" in out
    assert "rtec: the box of axis 1 was not heard" in err


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["none.log"], "none.log: there is no such file"),
        (["none.txt"], ".log (candump), .asc or .blf"),
        (["one.log"], "one.log: it holds no frame of a box; use a log with the frames of box and PC"),
        (["one.log", "--as", "bx"], "--as: 'bx' is not valid; use pc or box"),
        (["one.log", "--speed", "0"], "--speed: '0'"),
        (["one.log", "--start-up", "5"], "--start-up: '5'"),
    ],
)
def test_bad_words_are_refused_in_one_line(capsys, monkeypatch, tmp_path, words, said):
    monkeypatch.chdir(tmp_path)
    with Log("one.log") as log:
        log.record(Frame(identifier=0x201, data=bytes(8)), 0, Direction.SENT)
    code, _, err = run_replay(capsys, *words)
    assert code == 2
    (line,) = err.splitlines()
    assert said in line
