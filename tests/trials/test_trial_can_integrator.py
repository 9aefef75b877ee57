"""The CAN integrator: a PC of her own against the box, by the lines that it prints and the DBC that it names."""

import os
import re
import shlex
import signal
import sys
import time

import can
import cantools
import pytest
from crc_oracle import frame_checksum

from tests.terminals import PATIENCE_S

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="no pseudo-terminals")
CYCLE_S = 0.1
CYCLE = ("--cycle", "100ms")  # a busy machine lets a process wait


class HerPc:
    """What she has written by docs/messages.md: the DBC, a checksum, a frame each cycle."""

    def __init__(self, bus, dbc):
        self.bus, self.dbc, self.log, self.sequence, self.last = bus, dbc, None, 0, {}

    def request(self, total=0, **fields):
        message = self.dbc.get_message_by_name("Request_1")
        self.sequence += 1
        values = dict.fromkeys((signal.name for signal in message.signals), 0) | fields
        values |= {"Sequence": self.sequence % 256, "Total": total, "TotalInverted": ~total & 0xFFFF}
        data = bytearray(message.encode(values | {"Session": self.last["Status_1"]["Session"]}))
        data[0] = frame_checksum(message.frame_id, data)
        return can.Message(arbitration_id=message.frame_id, data=data, is_extended_id=False)

    def send(self, frame):
        self.bus.send(frame)
        if self.log is not None:
            frame.timestamp, frame.is_rx = time.time(), False
            self.log(frame)

    def listen(self, for_s=CYCLE_S):
        end_s = time.monotonic() + for_s
        while (frame := self.bus.recv(max(end_s - time.monotonic(), 0.0))) is not None:
            assert frame_checksum(frame.arbitration_id, frame.data) == frame.data[0]
            name = self.dbc.get_message_by_frame_id(frame.arbitration_id).name
            self.last[name] = self.dbc.decode_message(frame.arbitration_id, frame.data)
            if self.log is not None:
                frame.timestamp = time.time()
                self.log(frame)

    def until(self, message, value, total=0, **fields):
        """Send a request each cycle until a message of the box has these fields."""
        end_s = time.monotonic() + PATIENCE_S
        while not value.items() <= {name: _word(v) for name, v in self.last[message].items()}.items():
            assert time.monotonic() < end_s, f"never {value}: {self.last}"
            self.send(self.request(total, **fields))
            self.listen()


def _word(value):
    return str(value) if isinstance(value, cantools.database.namedsignalvalue.NamedSignalValue) else value


def joined(box):
    """Return her PC on the bus that the box has printed, copied to her program, once the box was heard."""
    line = re.search(r"^rtec: or in Python: (.*)$", box.said, re.MULTILINE)[1]
    dbc = cantools.database.load_file(re.search(r"^rtec: messages: (.*)$", box.said, re.MULTILINE)[1])
    pc = HerPc(eval(line, {"can": can}), dbc)  # noqa: S307 - as it was printed for her to copy
    end_s = time.monotonic() + PATIENCE_S
    while len(pc.last) < 4:
        assert time.monotonic() < end_s
        pc.listen(4 * CYCLE_S)  # also to what waited for her on the line
    return pc


def take_home_and_ask_for_steps(pc):
    pc.listen(4 * CYCLE_S)
    assert _word(pc.last["Setup_1"]["Design"]) == "C" and pc.last["Setup_1"]["Cycle"] == 100_000
    pc.until("Status_1", {"State": "RUNNING"}, GoHome=1)
    pc.until("Position_1", {"Position": 0, "DataValid": 1}, GoHome=1)
    for total in (3, 5, 2):
        pc.until("Corrections_1", {"Completed": total, "Accepted": total}, total, Enable=1)
        for _ in range(3):
            pc.send(pc.request(total, Enable=1))
            pc.listen()


def test_a_pc_of_her_own_is_answered_as_documented_and_its_log_is_played_again(terminal, rtec, tmp_path):
    line = ("--channel", f"integrator-{os.getpid()}")
    early = terminal("pc", *line, *CYCLE, "--design", "a", "--start-up", "90s")
    early.wait_for("waiting up to 90 s for a box")
    box = terminal("box", *line, *CYCLE, "--design", "c", "--stand")
    assert early.ended() == 1  # it has found the box that came later, and another design in it
    assert "the box has design c, step 2 µm" in early.said and "start both with the same --design" in early.said

    pc = joined(box)
    with can.CanutilsLogWriter(tmp_path / "run.log") as pc.log:
        take_home_and_ask_for_steps(pc)
    pc.log = None

    refused = pc.last["Status_1"]["FramesRefused"]
    wrong = pc.request(2, Enable=1)
    wrong.data[0] ^= 1
    pc.send(wrong)  # the only one of these that counts as refused
    for identifier, data, extended in ((0x201, 7, False), (0x555, 8, False), (0x201, 8, True)):
        pc.send(can.Message(arbitration_id=identifier, data=bytes(data), is_extended_id=extended))
    pc.until("Status_1", {"FramesRefused": refused + 1, "State": "RUNNING"}, 2, Enable=1)
    pc.until("Status_1", {"Code": "I_DONT_BELIEVE_YOU", "State": "RUNNING"}, 12, Enable=1)  # +10, the window is 3
    pc.until("Status_1", {"Code": "OK"}, 3, Enable=1)
    pc.until("Status_1", {"Code": "I_STILL_DONT_BELIEVE_YOU", "State": "FATAL", "HoldWanted": 1}, 13, Enable=1)
    assert pc.last["Status_1"]["FramesRefused"] == refused + 1
    assert pc.last["Corrections_1"]["Completed"] == 3
    pc.until("Status_1", {"State": "NOT_HOMED", "HoldWanted": 0}, Reset=1)
    pc.bus.shutdown()
    assert box.ended(signal.SIGINT) == 0 and "ended: Ctrl-C" in box.said

    box = terminal("box", *line, *CYCLE, "--design", "c", "--stand")
    box.wait_for("at home it waits for a PC")
    played = rtec("replay", "run.log", *line).stdout
    assert re.search(r"^1\d frames of the PC played", played) and "the same answers as in the log" in played
    box.type("home")
    box.wait_for("order: home")
    command = shlex.split(re.search(r"^rtec: in another terminal: rtec (.*)$", box.said, re.MULTILINE)[1])
    assert command == ["pc", *line, "--design", "c", *CYCLE]
    theirs = terminal(*command, "--reset")
    theirs.wait_for("every axis is homed and corrected")
    assert theirs.ended(signal.SIGINT) == 0
    box.type("quit")
    assert box.ended() == 0
