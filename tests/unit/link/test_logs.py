"""Logs against python-can's own readers and writers, and against everything that can be wrong with a file."""

import os
import random
import struct
import subprocess
import sys
import time
import zlib
from pathlib import Path

import can
import pytest
from hypothesis import HealthCheck, given, settings, strategies as st

from rtec.errors import ArgumentError, FileFormatError, LinkError, OutputError
from rtec.link.frame import Frame
from rtec.link.logs import (
    SIMULATED_ZERO_UNIX_S,
    Direction,
    Existing,
    Log,
    Recorded,
    read_log,
    wall_zero_unix_s,
)
from rtec.link.python_can import open_transport
from rtec.link.replay import replay
from rtec.link.transport import BusState, Received, Traffic

US, MS, S = 10**6, 10**9, 10**12
SUFFIXES = [".log", ".asc", ".blf"]
FRAMES = [
    (Frame(identifier=0x120, data=bytes(range(8))), 0, Direction.SENT),
    (Frame(identifier=0x7FF, data=b""), 1 * MS, Direction.RECEIVED),
    (
        Frame(identifier=0x1ABCDEF0, data=b"\xff\x00", extended=True),
        1 * S + 7 * US,
        Direction.SENT,
    ),
    (Frame(identifier=5, data=b"\x0a", extended=True), 3600 * S, Direction.RECEIVED),
]


def record(path, frames=FRAMES, **options):
    with Log(path, **options) as log:
        for frame, time_ps, direction in frames:
            log.record(frame, time_ps, direction)
    return path


def numbered(count):
    return [
        (Frame.of_payload(0x100 + k % 3, k * 7919), k * 10 * MS, Direction.SENT if k % 2 else Direction.RECEIVED)
        for k in range(count)
    ]


def plain(logged):
    return (logged.frame, logged.time_ps, logged.direction)


def of_message(message):
    frame = Frame(identifier=message.arbitration_id, data=bytes(message.data), extended=message.is_extended_id)
    return frame, Direction.RECEIVED if message.is_rx else Direction.SENT


# ------------------------------------------------------------------------ as intended


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_what_is_written_reads_back(tmp_path, suffix):
    path = record(tmp_path / f"z{suffix}")
    got = [plain(logged) for logged in read_log(path)]
    assert [(frame, way) for frame, _, way in got] == [(frame, way) for frame, _, way in FRAMES]
    for (_, time_ps, _), (_, wanted_ps, _) in zip(got, FRAMES, strict=True):
        assert abs(time_ps - wanted_ps) <= US  # python-can keeps seconds as a float


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_python_can_reads_what_is_written(tmp_path, suffix):
    path = record(tmp_path / f"z{suffix}", zero_unix_s=1.7e9)
    options = {"relative_timestamp": False} if suffix == ".asc" else {}
    with can.LogReader(path, **options) as reader:
        messages = list(reader)
    assert [of_message(message) for message in messages] == [(frame, way) for frame, _, way in FRAMES]
    for message, (_, time_ps, _) in zip(messages, FRAMES, strict=True):
        assert message.timestamp == pytest.approx(1.7e9 + time_ps / S, abs=2e-3)  # the heads hold milliseconds


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("count", [1, 3000])  # BLF: 3000 frames are more than one container
def test_what_python_can_writes_is_read(tmp_path, suffix, count):
    path = tmp_path / f"z{suffix}"
    with can.Logger(path) as logger:
        for k in range(count):
            logger(
                can.Message(
                    timestamp=1.7e9 + k / 64, arbitration_id=k % 0x800, is_extended_id=False, data=[k % 256] * 8
                )
            )
            logger(can.Message(timestamp=1.7e9 + k / 64, is_fd=True, arbitration_id=1, data=bytes(64)))
            logger(can.Message(timestamp=1.7e9 + k / 64, is_remote_frame=True, arbitration_id=1, dlc=3))
            logger(can.Message(timestamp=1.7e9 + k / 64, is_error_frame=True))
    got = list(read_log(path))
    assert [logged.frame for logged in got] == [
        Frame(identifier=k % 0x800, data=bytes([k % 256] * 8)) for k in range(count)
    ]
    assert all(abs(logged.time_ps - k * S // 64) <= US for k, logged in enumerate(got))


def test_candump_of_can_utils(tmp_path):
    path = tmp_path / "z.LOG"
    path.write_text(
        "(1436509052.249713) vcan0 044#2A366C2BBA\n(1436509052.449847) vcan0 00000123#R\n\n"
        "(1436509053.850870) can-1 1F334455#1122334455667788 T\n(1436509054.0) c 20000004#0000\n"
    )
    got = [plain(logged) for logged in read_log(path)]
    assert got == [
        (Frame(identifier=0x44, data=bytes.fromhex("2A366C2BBA")), 0, Direction.RECEIVED),
        (
            Frame(
                identifier=0x1F334455,
                data=bytes.fromhex("1122334455667788"),
                extended=True,
            ),
            1_601_157 * US,
            Direction.SENT,
        ),
    ]


@pytest.mark.parametrize(("times", "wanted_ms"), [("absolute", [0, 500, 1000]), ("relative", [0, 1100, 2600])])
@pytest.mark.parametrize(("base", "ten"), [("hex", 16), ("dec", 10)])
def test_asc_as_other_tools_write_it(tmp_path, times, wanted_ms, base, ten):
    """Absolute times count from the start, relative ones from the event before, whatever that was."""
    path = tmp_path / "z.asc"
    path.write_text(
        f"date Sat Sep 30 10:06:13.191 pm 2017\nbase {base}  timestamps {times}\n"
        "internal events logged\n// version 9\n"
        "   0.000000 Start of measurement\n   0.500000 1  10             Rx   d 2 10 11  Length = 0 BitCount = 64\n"
        "   0.100000 1  Statistic: D 1 R 0\n   1.000000 2  10  Tx   d 1 12\n   1.500000 1  10x  Rx   d 0\n"
    )
    got = list(read_log(path))
    assert [logged.frame.data for logged in got] == [bytes([ten, ten + 1]), bytes([ten + 2]), b""]
    assert {logged.frame.identifier for logged in got} == {ten}
    assert [logged.time_ps // MS for logged in got] == wanted_ms


# ------------------------------------------------------------ crashes and other files


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_crash_leaves_every_frame(tmp_path, suffix):
    path = tmp_path / f"z{suffix}"
    script = (
        "import os, sys\nfrom rtec.link.logs import Direction, Log\nfrom rtec.link.frame import Frame\n"
        "log = Log(sys.argv[1], zero_unix_s=1.7e9)\n"
        "for k in range(50): log.record(Frame.of_payload(0x100, k), k * 10**9, Direction.SENT)\n"
        "os._exit(9)\n"
    )
    environment = os.environ | {"PYTHONPATH": str(Path(__file__).parents[3])}
    subprocess.run([sys.executable, "-c", script, str(path)], env=environment, check=False)
    assert [logged.frame.payload for logged in read_log(path)] == list(range(50))
    with can.LogReader(path) as reader:
        messages = list(reader)
    assert [int.from_bytes(message.data, "little") for message in messages] == list(range(50))
    assert messages[49].timestamp - messages[0].timestamp == pytest.approx(0.049, abs=2e-6)
    if suffix == ".blf":
        assert messages[0].timestamp == pytest.approx(1.7e9, abs=2e-3)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_nothing_is_overwritten_without_being_asked(tmp_path, suffix):
    path = tmp_path / f"z{suffix}"
    path.write_text("mine")
    with pytest.raises(OutputError, match="there is a file already"):
        Log(path)
    assert path.read_text() == "mine"
    record(path, existing=Existing.REPLACE)
    assert len(list(read_log(path))) == len(FRAMES)


def test_a_folder_that_is_not_there(tmp_path):
    with pytest.raises(OutputError, match="cannot be written: No such file"):
        Log(tmp_path / "none" / "z.log")


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_full_disk(suffix, tmp_path):
    if not os.path.exists("/dev/full"):
        pytest.skip("this system has no /dev/full")
    path = tmp_path / f"z{suffix}"
    path.symlink_to("/dev/full")
    with pytest.raises(OutputError, match="No space left"):
        record(path, existing=Existing.REPLACE)


@pytest.mark.parametrize(
    ("name", "nearest"), [("z.lgo", ".log"), ("z.acs", ".asc"), ("z.blff", ".blf"), ("z", "known")]
)
def test_an_unknown_suffix_names_the_nearest(tmp_path, name, nearest):
    for call in (Log, read_log):
        with pytest.raises(ArgumentError, match=r"ends in \.log") as caught:
            call(tmp_path / name)
        assert nearest in str(caught.value).rpartition(";")[2]
    assert list(tmp_path.iterdir()) == []


def test_after_closing_nothing_is_recorded(tmp_path):
    log = Log(tmp_path / "z.log")
    log.close()
    log.close()
    with pytest.raises(OutputError, match="is closed"):
        log.record(FRAMES[0][0], 0, Direction.SENT)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_missing_log_a_folder_and_an_empty_one(tmp_path, suffix):
    with pytest.raises(FileFormatError, match="no such file"):
        next(read_log(tmp_path / f"none{suffix}"))
    (tmp_path / f"folder{suffix}").mkdir()
    with pytest.raises(FileFormatError, match="no regular file"):
        read_log(tmp_path / f"folder{suffix}")
    empty = tmp_path / f"empty{suffix}"
    empty.write_bytes(b"")
    if suffix == ".log":  # candump has no header: nothing was recorded
        assert list(read_log(empty)) == []
    else:
        with pytest.raises(FileFormatError):
            next(read_log(empty))


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("content", SUFFIXES)
def test_another_format_under_this_name(tmp_path, suffix, content):
    whole = record(tmp_path / f"z{content}")
    other = tmp_path / f"other{suffix}"
    other.write_bytes(whole.read_bytes())
    if suffix == content:
        assert len(list(read_log(other))) == 4
        return
    with pytest.raises(FileFormatError, match="0 frames before it read well"):
        list(read_log(other))


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_cut_off_anywhere_the_frames_before_are_right(tmp_path, suffix):
    """Cut after every byte: what is handed out is a beginning of the log, and a torn frame is never one of them."""
    frames = numbered(6)
    data = record(tmp_path / f"z{suffix}", frames).read_bytes()
    cut = tmp_path / f"cut{suffix}"
    wanted = [frame for frame, _, _ in frames]
    errors = 0
    for size in range(len(data)):
        cut.write_bytes(data[:size])
        got = []
        try:
            for logged in read_log(cut):
                got.append(logged.frame)
        except FileFormatError as error:
            errors += 1
            assert f"{len(got)} frame" in str(error)
        assert got == wanted[: len(got)]
    assert errors > 0.8 * len(data)


def test_cut_off_text_names_the_line(tmp_path):
    path = record(tmp_path / "z.log", numbered(5))
    path.write_bytes(path.read_bytes()[:-3])
    with pytest.raises(FileFormatError, match=r"z.log, line 5: the log is cut off: .*; 4 frames before it read well"):
        list(read_log(path))


def test_cut_off_blf_names_the_byte(tmp_path):
    path = record(tmp_path / "z.blf", numbered(5))
    size = len(path.read_bytes()) - 3
    os.truncate(path, size)
    with pytest.raises(FileFormatError, match=rf"cut off at byte {size}; 4 frames before it read well"):
        list(read_log(path))


# ------------------------------------------------------------------------- hostile files


def container(data, *, size=None, method=2, packed=None):
    body = struct.pack("<H6xL4x", method, len(data)) + (zlib.compress(data) if packed is None else packed)
    size = len(body) + 16 if size is None else size
    return struct.pack("<4sHHLL", b"LOBJ", 16, 1, size, 10) + body + bytes(size % 4 if size < 1 << 20 else 0)


def item(*, size=48, head=32, version=1, kind=1, length=8, identifier=0x123):
    begin = struct.pack("<4sHHLL", b"LOBJ", head, version, size, kind) + struct.pack("<LHHQ", 2, 0, 0, 10**9)
    return begin + struct.pack("<HBBL8s", 1, 0, length, identifier, bytes(8))


def blf(tmp_path, *containers, head=144):
    path = tmp_path / "hostile.blf"
    path.write_bytes(struct.pack("<4sL", b"LOGG", head) + bytes(136) + b"".join(containers))
    return path


def test_the_hostile_builder_makes_sound_files(tmp_path):
    half = item() * 3
    path = blf(tmp_path, container(item()), container(half[:70]), container(half[70:], method=0, packed=half[70:]))
    assert [logged.frame.identifier for logged in read_log(path)] == [0x123] * 4


@pytest.mark.parametrize(
    ("containers", "problem"),
    [
        ([container(bytes(1 << 26))], "unpacks to more than"),
        ([container(b"", size=0xFFFFFFF0)], "an object of 4294967280 bytes"),
        ([container(item(), size=3)], "an object of 3 bytes"),
        ([container(item(), method=7)], "packing method 7"),
        ([container(b"", packed=b"no zlib at all")], "is damaged"),
        ([container(item(size=0))], "an object of 0 bytes"),
        ([container(item(version=9, size=0, kind=77))], "an object of 0 bytes"),
        ([container(item(size=0xFFFFFFFF))], "an object of 4294967295 bytes"),
        ([container(item(size=33))], "unpack_from requires"),
        ([container(item(length=9))], "9 bytes in a classic frame"),
        ([container(item(identifier=0x7FFFFFFF))], "identifier"),
        ([container(item(identifier=0x800))], "identifier"),
        ([container(b"x" * 100)], "no object"),
        ([b"garbage that is longer than a head"], "b'garb'"),
        ([container(item() + item(size=1000))], "cut off"),
    ],
)
def test_hostile_blf(tmp_path, containers, problem):
    with pytest.raises(FileFormatError, match=problem):
        list(read_log(blf(tmp_path, *containers)))


def test_a_hostile_file_head(tmp_path):
    with pytest.raises(FileFormatError, match="a file header of 4294967295 bytes"):
        list(read_log(blf(tmp_path, head=0xFFFFFFFF)))


@pytest.mark.parametrize(
    ("name", "text", "problem"),
    [
        ("z.log", "(1.0) can0 123#" + "00" * 9 + "\n", "candump -L"),
        ("z.log", "(nan) can0 123#00\n", "candump -L"),
        ("z.log", "(1.0) can0 123#0\n", "candump -L"),
        ("z.log", "(1.0) can0 -12#00\n", "candump -L"),
        ("z.log", "(1.0) can0 800#00\n", "identifier 800"),
        ("z.log", "(1.0) can0 FFFFFFFF#00\n(1.0) can0 9FFFFFFF#00\n", "identifier 9FFFFFFF"),
        ("z.log", "(1.0) can0 123#00\n(999999999999.0) can0 123#00\n", "104 days"),
        ("z.log", "(1.0) can0 " + "x" * 5000 + "\n", "too long"),
        ("z.log", "(1.0) can0 123#\0\n", "NUL"),
        ("z.asc", "base hex timestamps absolute\n 1.0 1 123 Rx d 8 01 02\n", "2 bytes where 8"),
        ("z.asc", "base hex timestamps absolute\n 1.0 1 123 Rx d 9 " + "01 " * 9 + "\n", "9 bytes where 9"),
        ("z.asc", "base hex timestamps absolute\n 1.0 1 123 Rx d 1 0z\n", "invalid literal"),
        ("z.asc", "base hex timestamps absolute\n 1.0 1 123 Rx d 1 100\n", "range"),
        ("z.asc", "base hex timestamps absolute\n 1.0 1 800 Rx d 0\n", "identifier"),
        ("z.asc", "base hex timestamps absolute\n 1.0 1 123 Rx q 0\n", "time, channel"),
        ("z.asc", " 1.0 1 123 Rx d 0\n", "before the header"),
        ("z.asc", "hello\n", "no header"),
    ],
)
def test_hostile_text(tmp_path, name, text, problem):
    path = tmp_path / name
    path.write_text(text)
    with pytest.raises(FileFormatError, match=problem):
        list(read_log(path))


@pytest.mark.parametrize("suffix", SUFFIXES)
@settings(max_examples=200, suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(seed=st.integers(0, 2**32))
def test_turned_over_bytes_never_raise_anything_else(tmp_path, suffix, seed):
    whole = tmp_path / f"z{suffix}"
    if not whole.exists():
        with can.Logger(whole) as logger:  # packed containers
            for frame, time_ps, _ in FRAMES * 5:
                logger(can.Message(timestamp=1.7e9 + time_ps / S, arbitration_id=frame.identifier, data=frame.data))
    draw = random.Random(seed)  # noqa: S311 - no secret
    data = bytearray(whole.read_bytes())
    for _ in range(draw.randrange(1, 5)):
        data[draw.randrange(len(data))] = draw.randrange(256)
    torn = tmp_path / f"torn{suffix}"
    torn.write_bytes(data)
    try:
        assert len(list(read_log(torn))) <= len(FRAMES) * 5 + 5
    except FileFormatError as error:
        assert "torn" in str(error)


# -------------------------------------------------------------- recording and replaying


class Simulated:
    """A bus in simulated time: what is sent is kept, what shall arrive is given beforehand."""

    def __init__(self, arrivals=()):
        self.time_ps, self.sent, self.arrivals, self.closed = 0, [], list(arrivals), False
        self.traffic, self.state, self.full = Traffic(), BusState.ACTIVE, False

    def now_ps(self):
        return self.time_ps

    def send(self, frame):
        if self.full:
            self.traffic.unsent += 1
        else:
            self.sent.append((self.time_ps, frame))

    def receive(self, until_ps):
        if self.arrivals and self.arrivals[0][0] <= until_ps:
            arrival_ps, frame = self.arrivals.pop(0)
            self.time_ps = max(self.time_ps, arrival_ps)
            return Received(frame=frame, arrival_ps=self.time_ps)
        self.time_ps = max(self.time_ps, until_ps)
        return None

    def close(self):
        self.closed = True


@pytest.mark.parametrize("speed", [1.0, 4.0])
def test_a_replay_keeps_the_pace_of_the_log(tmp_path, speed):
    path = record(tmp_path / "z.log", numbered(10))
    bus = Simulated([(25 * MS, FRAMES[0][0])])
    bus.time_ps = 5 * MS
    heard = []
    assert replay(read_log(path), bus, speed=speed, on_received=heard.append) == 10
    assert bus.sent == [(5 * MS + round(time_ps / speed), frame) for frame, time_ps, _ in numbered(10)]
    assert [received.frame for received in heard] == [FRAMES[0][0]]


class Babbling(Simulated):
    """There is always one more frame, and each takes 0.1 ms to read."""

    def receive(self, until_ps):
        self.time_ps += 100 * US
        assert self.time_ps < 10 * S
        return Received(frame=FRAMES[0][0], arrival_ps=self.time_ps)


def test_a_replay_on_a_babbling_bus(tmp_path):
    path = record(tmp_path / "z.asc", numbered(10))
    bus = Babbling()
    assert replay(read_log(path), bus) == 10
    assert [frame for _, frame in bus.sent] == [frame for frame, _, _ in numbered(10)]


@pytest.mark.parametrize("speed", [0, -1, float("nan"), "2"])
def test_a_speed_is_a_positive_number(speed):
    with pytest.raises(ArgumentError, match="speed"):
        replay([], Simulated(), speed=speed)


def test_a_recorded_transport_writes_both_ways(tmp_path):
    path = tmp_path / "z.log"
    bus = Simulated([(3 * MS, FRAMES[1][0])])
    with Recorded(bus, Log(path)) as recorded:
        recorded.send(FRAMES[0][0])
        assert recorded.receive(10 * MS).frame == FRAMES[1][0]
        assert recorded.receive(12 * MS) is None
        bus.full = True
        recorded.send(FRAMES[2][0])  # finds no room, so it never was on the bus
        assert recorded.state is BusState.ACTIVE
        assert recorded.traffic.unsent == 1
        assert recorded.now_ps() == 12 * MS
    assert bus.closed
    assert [plain(logged) for logged in read_log(path)] == [
        (FRAMES[0][0], 0, Direction.SENT),
        (FRAMES[1][0], 3 * MS, Direction.RECEIVED),
    ]


def test_a_live_log_has_the_time_of_day(tmp_path):
    path = tmp_path / "z.log"
    with open_transport(interface="virtual", channel="clock") as live:
        zero_unix_s = wall_zero_unix_s(live)
        before_s = time.time()
        with Recorded(live, Log(path, zero_unix_s=zero_unix_s)) as recorded:
            recorded.send(FRAMES[0][0])
    with can.LogReader(path) as reader:
        assert abs(next(iter(reader)).timestamp - before_s) < 1
    with pytest.raises(LinkError, match="is closed"):
        recorded.receive(0)
    assert SIMULATED_ZERO_UNIX_S < before_s
