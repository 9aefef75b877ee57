"""Orders, programs, waveforms, pictures, the wish to stop."""

import io
import os
import signal
from unittest.mock import Mock, call

import pytest

from rtec.errors import ArgumentError, FileFormatError
from rtec.live.figures import spread_ms
from rtec.live.incoming import Incoming
from rtec.live.orders import FAULTS, Word, carry_out, parse_order
from rtec.live.picture import picture
from rtec.live.programs import read_moves
from rtec.live.stopping import StopWish
from rtec.live.waveform_text import HIGH, LOW, caption_of, waveform_text
from rtec.live.words import ALARM_WORDS
from rtec.machine.faults import FaultKind
from rtec.machine.station import Alarm, Station, StationSettings
from rtec.metrology import MeasuringPlan, measuring_program
from rtec.requester.status import Status

US = 10**6


@pytest.mark.parametrize(
    ("text", "word", "axis", "done"),
    [
        ("go 1 inch", Word.GO, None, [call.go(25.4, 10.0)]),
        ("go -3 mm at 6 m/min", Word.GO, None, [call.go(-3.0, 100.0)]),
        ("  axis 2:   go 1 mm at 60 mm/min ", Word.GO, 2, [call.go(1.0, 1.0)]),
        ("HOME", Word.HOME, None, [call.go_home()]),
        ("clear torn-position", Word.CLEAR, None, [call.end(FaultKind.TORN_POSITION)]),
        ("status", Word.STATUS, None, []),
    ],
)
def test_orders(text, word, axis, done):
    order, station = parse_order(text), Mock()
    order.act(station)
    assert (order.word, order.axis, station.mock_calls) == (word, axis, done)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("go 12", "12 mm|unit"),
        ("go", "go: ''"),
        ("go 3 mm at", "go: "),
        ("go 3 mm at 5", "go ... at"),
        ("switch", "on or off"),
        ("fault cable", "did you mean 'cable-open'"),
        ("fault frame-lost", "cable-open"),
        ("quit now", "use the word alone"),
        ("wait 3", "unit"),
        ("wait -1 s", "wait: -1"),
        ("wait 1e99 s", "wait: "),
        ("", "go, home"),
        ("axis 2", "go, home"),
    ],
)
def test_orders_that_are_none(text, said):
    with pytest.raises(ArgumentError, match=said):
        parse_order(text)


def test_faults_of_an_axis_can_all_be_ordered():
    station = Station(StationSettings())
    for name, kind in FAULTS.items():
        asked = Mock()
        parse_order(f"fault {name} while inserting").act(asked)
        asked.begin.assert_called_once_with(kind, while_inserting=True)
        carry_out(parse_order(f"fault {name}"), [station])
    assert not station.view.powered and not station.view.switch_on
    assert {FaultKind.CABLE_OPEN, FaultKind.GLITCHES, FaultKind.TORN_POSITION} <= set(FAULTS.values())


def test_mend_makes_the_cable_whole():
    station = Station(StationSettings())
    carry_out(parse_order("fault lines-swapped"), [station])
    carry_out(parse_order("clear"), [station])
    carry_out(parse_order("power off"), [station])
    assert not station.view.powered
    carry_out(parse_order("power on"), [station])
    assert station.view.powered
    station.advance(until_ps=10**10)
    assert station.view.lines == 0


def test_orders_for_one_axis_leave_the_others():
    stations = [Station(StationSettings(axis=axis)) for axis in (1, 2)]
    carry_out(parse_order("axis 2 switch off"), stations)
    assert [station.view.switch_on for station in stations] == [True, False]


def test_a_measuring_program_becomes_moves(tmp_path):
    plan = MeasuringPlan(
        start_mm=25.4, end_mm=50.8, increment_mm=25.4, dwell_s=2, runs=1, feed_mm_s=50 * 25.4 / 60, overshoot_mm=2.54
    )
    file = tmp_path / "z.nc"
    file.write_text("\n".join(measuring_program(plan)))
    moves = read_moves(file, home_mm=25.4)
    # Appendix B: start, below it, 2 s, start, stop; then target, overshoot and the way back with 2 s at each
    inches = [(move.target_mm + 25.4) / 25.4 for move in moves]
    assert inches == pytest.approx([1.0, 0.9, 1.0, 2.0, 2.1, 2.0, 1.0])
    assert [move.rest_s for move in moves] == [0.0, 2.0, 0.0, 2.0, 2.0, 2.0, 2.0]
    assert moves[0].speed_mm_s == pytest.approx(50 * 25.4 / 60)


def test_a_file_that_is_no_program(tmp_path):
    with pytest.raises(FileFormatError, match="no such file"):
        read_moves(tmp_path / "none.nc", home_mm=0.0)
    (tmp_path / "x.nc").write_text("G00 X1")
    with pytest.raises(FileFormatError, match="line 1"):
        read_moves(tmp_path / "x.nc", home_mm=0.0)


def test_waveform_shows_the_box_changing_its_lines():
    # an edge of the encoder, then an insertion of Design C: B then A inverted within 1 µs
    changes = [(0, 0, 0), (100 * US, 1, 1), (108 * US, 1, 3), (109 * US, 1, 2), (300 * US, 3, 0)]
    a, b, a_out, b_out = waveform_text(changes).values()
    runs = [len(set(zip(a, a_out, strict=True))), len(set(zip(b, b_out, strict=True)))]
    assert {len(row) for row in (a, b, a_out, b_out)} == {len(a)}
    assert caption_of(changes) == "the box changed its lines 2 times in 1.0 µs"
    assert "no change" in caption_of(changes[:2])
    assert runs == [4, 3] or all(run > 2 for run in runs)
    assert a[0] == LOW and a[-1] == HIGH and a_out[-1] == LOW
    # where the box has not touched them, both sides are the same
    first = a.index(HIGH)
    assert a[: first + 1] == a_out[: first + 1]


def test_picture_holds_every_axis_and_what_is_typed():
    from rich.console import Console

    axes = [
        {
            "axis": k,
            "held": k == 2,
            "words": f"words of {k}",
            "cells": {"position": f"{k}.5 mm"},
            "insertion": [[0, 0, 0], [9 * US, 0, 1]],
        }
        for k in (1, 2)
    ]
    document = {"title": "rtec box", "axes": axes, "events": [f"event {k}" for k in range(12)]}
    out = io.StringIO()
    Console(file=out, width=100).print(picture(document, width=100))
    shown = out.getvalue()
    for piece in ("1.5 mm", "2.5 mm", "words of 2", "event 11", "the box changed its lines once"):
        assert piece in shown
    assert "event 3\n" not in shown


def test_documents_cut_anywhere():
    read, write = os.pipe()
    incoming = Incoming(read)
    os.write(write, b'{"a": 1}\n{"a"')
    assert incoming.take() == ([], {"a": 1}, False)
    os.write(write, b": 2}\n")
    assert incoming.take() == ([], {"a": 2}, False)
    os.close(write)
    assert incoming.take() == ([], None, True)
    os.close(read)


def test_a_second_interrupt_is_not_swallowed():
    before = signal.getsignal(signal.SIGINT)
    with StopWish() as stop:
        signal.raise_signal(signal.SIGINT)
        assert stop.why == "Ctrl-C"
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
    assert signal.getsignal(signal.SIGINT) is before


def test_every_status_and_alarm_has_words():
    assert all(status.meaning for status in Status)
    assert set(ALARM_WORDS) == set(Alarm) - {Alarm.NONE}


def test_spread():
    assert spread_ms([], per_ms=1.0)["median_ms"] is None
    values = spread_ms(list(range(1, 102)), per_ms=10.0)
    assert (values["median_ms"], values["p99_ms"], values["max_ms"]) == (5.1, 10.0, 10.1)
