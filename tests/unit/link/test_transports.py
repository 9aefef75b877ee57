"""One set of rules for every transport; a new one is one more entry of ``KINDS``."""

import contextlib
import gc
import getpass
import importlib.util
import itertools
import os
import socket
import tempfile
import threading
import time
import warnings
from pathlib import Path

import can
import pytest

from rtec.errors import ArgumentError, LinkError
from rtec.link.frame import Frame
from rtec.link.pseudo_terminal import Line
from rtec.link.python_can import SLICE_S, open_transport
from rtec.link.simulated import SimulatedBus, SimulatedTransport
from rtec.link.transport import BusState

MS = 10**9
S = 1000 * MS
FRESH = itertools.count()


def over_line(stack, interface):
    line = stack.enter_context(Line())
    return [
        stack.enter_context(open_transport(interface=interface, channel=channel, bitrate=500_000))
        for channel in (line.near, line.far)
    ]


def virtual(stack):
    channel = f"test {next(FRESH)}"
    return [stack.enter_context(open_transport(interface="virtual", channel=channel)) for _ in range(2)]


def multicast(stack):
    if importlib.util.find_spec("msgpack") is None:
        pytest.skip("udp_multicast needs msgpack: python -m pip install 'python-can[multicast]'")
    fcntl = pytest.importorskip("fcntl")
    # every socket of the machine on this port hears every group: one run of the tests at a time
    turn = stack.enter_context(open(Path(tempfile.gettempdir()) / f"rtec-multicast-test-{getpass.getuser()}", "w"))
    fcntl.flock(turn, fcntl.LOCK_EX)
    try:
        pair = [stack.enter_context(open_transport(interface="udp_multicast", channel="239.74.163.2")) for _ in "ab"]
        pair[0].send(Frame(identifier=1, data=b""))
    except LinkError as error:
        pytest.skip(f"no multicast on this machine: {error}")
    if pair[1].receive(soon(pair[1])) is None:
        pytest.skip("multicast does not come back on this machine")
    assert pair[0].receive(pair[0].now_ps() + 20 * MS) is None
    return pair


def socketcan(stack):
    if "vcan0" not in {name for _, name in socket.if_nameindex()}:
        pytest.skip("no vcan0: ip link add dev vcan0 type vcan && ip link set up vcan0")
    return [stack.enter_context(open_transport(interface="socketcan", channel="vcan0")) for _ in range(2)]


def simulated(stack):
    bus = SimulatedBus()
    return [stack.enter_context(bus.transport()) for _ in range(2)]


KINDS = {
    "simulated": simulated,
    "virtual": virtual,
    "slcan": lambda stack: over_line(stack, "slcan"),
    "serial": lambda stack: over_line(stack, "serial"),
    "udp_multicast": multicast,
    "socketcan": socketcan,
}


@pytest.fixture(params=list(KINDS))
def pair(request):
    with contextlib.ExitStack() as stack:
        yield KINDS[request.param](stack)


def soon(transport, time_ps=2 * S):
    return transport.now_ps() + time_ps


def numbered(count, first=0):
    return [Frame(identifier=0x100 + k % 5, data=(first + k).to_bytes(8, "little")) for k in range(count)]


def taken(transport, count):
    frames = []
    while len(frames) < count and (received := transport.receive(soon(transport))) is not None:
        frames.append(received.frame)
    return frames


# ---------------------------------------------------------------- all of them


@pytest.mark.parametrize(("sender", "reader"), [(0, 1), (1, 0)])
def test_a_burst_arrives_whole_and_in_order(pair, sender, reader):
    frames = numbered(200)
    for frame in frames:
        pair[sender].send(frame)
    assert taken(pair[reader], 200) == frames
    assert pair[sender].traffic.sent >= 200
    assert pair[sender].traffic.unsent == 0
    assert pair[reader].receive(pair[reader].now_ps() + 5 * MS) is None


@pytest.mark.parametrize("extended", [False, True])
def test_every_length_and_format_passes_unchanged(pair, extended):
    data = bytes([*range(250, 256), 0, 0])
    frames = [Frame(identifier=0x12A, data=data[:length], extended=extended) for length in range(9)]
    for frame in frames:
        pair[0].send(frame)
    assert taken(pair[1], 9) == frames


def test_nothing_of_ones_own_comes_back(pair):
    for frame in numbered(20):
        pair[0].send(frame)
    assert pair[0].receive(pair[0].now_ps() + 30 * MS) is None
    assert len(taken(pair[1], 20)) == 20


def test_an_equal_frame_of_another_node_does_come(pair):
    frame = numbered(1)[0]
    pair[0].send(frame)
    pair[1].send(frame)
    assert taken(pair[0], 1) == [frame]
    assert taken(pair[1], 1) == [frame]


@pytest.mark.parametrize("wait_ms", [0, 1, 30])
def test_a_time_is_kept(pair, wait_ms):
    until_ps = pair[0].now_ps() + wait_ms * MS
    assert pair[0].receive(until_ps) is None
    late_ps = pair[0].now_ps() - until_ps
    assert 0 <= late_ps < 100 * MS  # an idle machine is 0.1 ms late, a loaded one gets some slack


def test_what_has_arrived_is_there_without_waiting(pair):
    first, second = numbered(2)
    pair[0].send(first)
    pair[0].send(second)
    assert taken(pair[1], 1) == [first]
    deadline_ps = soon(pair[1])
    while (received := pair[1].receive(0)) is None and pair[1].now_ps() < deadline_ps:
        pass
    assert received.frame == second
    assert pair[1].receive(0) is None


def test_it_arrives_after_it_was_sent_and_before_now(pair):
    before_ps = pair[1].now_ps()
    pair[0].send(numbered(1)[0])
    received = pair[1].receive(soon(pair[1]))
    assert before_ps < received.arrival_ps <= pair[1].now_ps()


def test_the_other_end_may_leave_meanwhile(pair):
    outcome = []

    def wait():
        outcome.append(pair[1].receive(pair[1].now_ps() + 100 * MS))

    thread = threading.Thread(target=wait)
    thread.start()
    pair[0].close()
    thread.join(5)
    assert outcome == [None]
    assert pair[1].state in (BusState.ACTIVE, BusState.WARNING)


def test_closing_wakes_who_waits(pair):
    if isinstance(pair[1], SimulatedTransport):
        pytest.skip("nobody waits in simulated time")
    errors = []

    def wait():
        try:
            pair[1].receive(soon(pair[1], 60 * S))
        except LinkError as error:
            errors.append(str(error))

    thread = threading.Thread(target=wait)
    thread.start()
    time.sleep(0.02)  # so that it does wait
    begun_s = time.monotonic()
    pair[1].close()
    thread.join(5)
    assert not thread.is_alive()
    assert time.monotonic() - begun_s < SLICE_S + 1
    assert "is closed" in errors[0]


def test_after_closing_every_call_says_so(pair):
    assert pair[0].state is BusState.ACTIVE
    pair[0].close()
    pair[0].close()
    assert pair[0].state is BusState.GONE
    for call in (lambda: pair[0].send(numbered(1)[0]), lambda: pair[0].receive(0)):
        with pytest.raises(LinkError, match="is closed; open it again"):
            call()


# ------------------------------------------------------- frames that are not ours


@pytest.fixture
def raw():
    """A transport and a bare bus of python-can on the same channel."""
    channel = f"raw {next(FRESH)}"
    with open_transport(interface="virtual", channel=channel) as transport, can.Bus(
        interface="virtual", channel=channel, protocol=can.CanProtocol.CAN_FD, ignore_config=True
    ) as bus:  # fmt: skip
        yield transport, bus


def test_remote_error_and_fd_frames_are_counted_and_passed_over(raw):
    transport, bus = raw
    bus.send(can.Message(arbitration_id=1, is_remote_frame=True, is_extended_id=False))
    bus.send(can.Message(arbitration_id=0x20, is_error_frame=True, dlc=8, data=bytes(8)))
    bus.send(can.Message(arbitration_id=1, is_fd=True, data=bytes(64)))
    bus.send(can.Message(arbitration_id=0x7FF, data=b"\x05", is_extended_id=False))
    assert taken(transport, 1) == [Frame(identifier=0x7FF, data=b"\x05")]
    counted = transport.traffic
    assert (counted.remote, counted.error, counted.foreign, counted.received) == (1, 1, 1, 1)


def test_a_message_that_contradicts_itself_is_garbled(raw):
    transport, bus = raw
    bus.send(can.Message(arbitration_id=0x800, is_extended_id=False, data=b""))
    bus.send(can.Message(arbitration_id=1, is_extended_id=False, dlc=8, data=b"\x01"))
    assert transport.receive(transport.now_ps() + 10 * MS) is None
    assert transport.traffic.garbled == 2


@pytest.mark.parametrize(
    ("identifier", "byte_1", "state"),  # linux/can/error.h
    [
        (0x040, 0x00, BusState.OFF),
        (0x004, 0x04, BusState.WARNING),  # receive errors reached 96
        (0x004, 0x20, BusState.WARNING),  # error passive in sending
        (0x004, 0x40, BusState.ACTIVE),
        (0x100, 0x00, BusState.ACTIVE),
    ],
)
def test_error_frames_of_socketcan_tell_the_state(raw, identifier, byte_1, state):
    transport, bus = raw
    transport._adapter.interface = "socketcan"
    bus.send(can.Message(arbitration_id=0x040 if state is BusState.ACTIVE else 1, is_error_frame=True))
    bus.send(can.Message(arbitration_id=identifier, is_error_frame=True, data=bytes([0, byte_1, 0, 0, 0, 0, 0, 0])))
    assert transport.receive(transport.now_ps() + 10 * MS) is None
    assert transport.state is state


# ---------------------------------------------------------------- broken input


@pytest.fixture
def terminal():
    """The side of a pseudo-terminal that nobody relays, and the path of the other."""
    master, slave = os.openpty()
    path = os.ttyname(slave)
    os.close(slave)
    yield master, path
    with contextlib.suppress(OSError):
        os.close(master)


@pytest.mark.parametrize(
    "noise",
    [
        b"t12\r",
        b"t1238zz\r",
        b"\xff\xfe\r",
        b"t12380011\r",
        b"q\r",
        b"tFFF0\r",
        b"t\r",
        b"\a",
        b"tzzz0\r",
        b"d1239\r",
    ],
)
def test_slcan_goes_on_after_noise(terminal, noise):
    master, path = terminal
    with open_transport(interface="slcan", channel=path) as transport:
        os.write(master, noise)
        assert transport.receive(transport.now_ps() + 5 * MS) is None
        os.write(master, b"t1232BEEF\r")
        assert taken(transport, 1) == [Frame(identifier=0x123, data=b"\xbe\xef")]


def test_noise_without_end_does_not_pile_up(terminal):
    master, path = terminal
    with open_transport(interface="slcan", channel=path) as transport:
        for _ in range(600):
            os.write(master, b"x" * 20)
            assert transport.receive(transport.now_ps() + MS) is None
        assert transport.traffic.garbled >= 1
        assert len(transport._bus._buffer) < 600 * 20
        os.write(master, b"\rt1230\r")
        assert taken(transport, 1) == [Frame(identifier=0x123, data=b"")]


SOUND = bytes([0xAA, 0, 0, 0, 0, 1, 0x23, 1, 0, 0, 0x55, 0xBB])  # 0x123, one byte, as python-can documents it


@pytest.mark.parametrize(
    "noise",
    [b"\x00" * 30, SOUND[:-1] + b"\x00", SOUND[:6], bytes([0xAA, 0, 0, 0, 0, 9]), b"\xaa" * 7 + b"\x00" * 40],
)
def test_serial_goes_on_after_noise(terminal, noise):
    master, path = terminal
    with open_transport(interface="serial", channel=path) as transport:
        os.write(master, noise)
        for _ in range(5):  # what was cut off swallows the beginning of what follows
            transport.receive(transport.now_ps() + 100 * MS)
        os.write(master, SOUND)
        assert taken(transport, 1) == [Frame(identifier=0x123, data=b"\x55")]


# ------------------------------------------------------------- full and vanished


@pytest.mark.parametrize("interface", ["slcan", "serial"])
def test_a_terminal_that_nobody_empties_is_full_and_not_waited_for(terminal, interface):
    master, path = terminal
    frame = numbered(1)[0]
    with open_transport(interface=interface, channel=path) as transport:
        begun_s = time.monotonic()
        for _ in range(3000):
            transport.send(frame)
        assert time.monotonic() - begun_s < 5
        assert transport.traffic.unsent > 0
        assert transport.traffic.sent + transport.traffic.unsent == 3000
        assert transport.state is BusState.WARNING
        os.set_blocking(master, False)
        with contextlib.suppress(BlockingIOError):
            while os.read(master, 65536):
                time.sleep(0.001)
        transport.send(frame)
        assert transport.state is BusState.ACTIVE


def test_a_node_that_does_not_read_fills_only_its_own_queue():
    with contextlib.ExitStack() as stack:
        sender, reader = virtual(stack)
        for frame in numbered(4096):
            sender.send(frame)
        assert sender.state is BusState.ACTIVE
        sender.send(numbered(1)[0])
        assert (sender.state, sender.traffic.unsent) == (BusState.WARNING, 1)
        assert len(taken(reader, 1)) == 1
        sender.send(numbered(1)[0])
        assert sender.state is BusState.ACTIVE


@pytest.mark.parametrize("interface", ["slcan", "serial"])
@pytest.mark.parametrize("call", ["send", "receive"])
def test_a_terminal_that_vanishes_is_one_clear_error(terminal, interface, call):
    master, path = terminal
    with open_transport(interface=interface, channel=path) as transport:
        os.close(master)
        for _ in range(2):
            with pytest.raises(LinkError, match=rf"{interface} {path}: has vanished \(.+\); check the cable"):
                _ = transport.send(numbered(1)[0]) if call == "send" else transport.receive(soon(transport, 20 * S))
            assert transport.state is BusState.GONE


def test_a_line_taken_away_wakes_who_waits():
    line = Line()
    errors = []
    with open_transport(interface="slcan", channel=line.far) as transport:

        def wait():
            try:
                transport.receive(soon(transport, 60 * S))
            except LinkError as error:
                errors.append(str(error))

        thread = threading.Thread(target=wait)
        thread.start()
        line.close()
        thread.join(5)
        assert "has vanished" in errors[0]


# ------------------------------------------------------------------------ opening


def refusal(**wanted):
    with pytest.raises(LinkError) as caught:
        open_transport(**wanted)
    return str(caught.value)


def test_an_unknown_interface_names_the_nearest_and_all():
    message = refusal(interface="slcam", channel="x")
    assert "did you mean 'slcan'" in message
    assert all(name in message for name in ("virtual", "socketcan", "pcan", "udp_multicast"))
    assert "known:" in refusal(interface="zzzzzz", channel="x")


def test_a_device_that_is_not_there():
    message = refusal(interface="slcan", channel="/dev/ttyNONE", bitrate=500_000)
    assert message.startswith("slcan /dev/ttyNONE: cannot be opened (No such file or directory); ")
    assert "list_ports" in message


def test_a_file_is_no_terminal(tmp_path):
    file = tmp_path / "z"
    file.write_text("kept")
    assert "is no terminal" in refusal(interface="serial", channel=str(file))
    assert file.read_text() == "kept"


def test_a_channel_in_use_is_not_disturbed():
    with Line() as line, open_transport(interface="slcan", channel=line.near) as first, open_transport(
        interface="slcan", channel=line.far
    ) as other:  # fmt: skip
        assert "is in use by another program" in refusal(interface="slcan", channel=line.near)
        assert "is in use by another program" in refusal(interface="serial", channel=line.far)
        other.send(numbered(1)[0])
        assert len(taken(first, 1)) == 1
        first.close()
        open_transport(interface="slcan", channel=line.near).close()


def test_a_bitrate_that_the_adapter_does_not_have():
    with Line() as line:
        message = refusal(interface="slcan", channel=line.near, bitrate=123_456)
        assert "choose one of 10000" in message
        open_transport(interface="slcan", channel=line.near).close()  # and the lock is given back


@pytest.mark.parametrize("bitrate", [0, 1_000_001, 2.5])
def test_a_bitrate_that_can_does_not_have(bitrate):
    with pytest.raises(ArgumentError, match="bitrate"):
        open_transport(interface="virtual", channel="x", bitrate=bitrate)


def test_no_channel():
    assert "no channel is named" in refusal(interface="virtual", channel="")


def test_a_socketcan_channel_that_is_not_there():
    message = refusal(interface="socketcan", channel="cannot9")
    assert "ip link" in message or "kernel has no CAN" in message


def test_a_driver_that_is_not_installed(monkeypatch):
    monkeypatch.setitem(can.interfaces.BACKENDS, "canine", ("no_such_module_of_anybody", "Bus"))
    monkeypatch.setattr(can, "VALID_INTERFACES", can.VALID_INTERFACES | {"canine"})
    assert "install its driver" in refusal(interface="canine", channel="0")


def test_an_address_that_is_no_multicast():
    message = refusal(interface="udp_multicast", channel="127.0.0.1")
    assert "multicast" in message


@pytest.fixture
def unclosed_sockets():
    """Pyserial forgets to close a socket whose other end has gone."""
    yield
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ResourceWarning)
        gc.collect()


@pytest.mark.usefixtures("unclosed_sockets")
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # where it is collected sooner
def test_a_line_over_tcp():
    """slcan over ``socket://``, as offered where there are no pseudo-terminals."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
        with open_transport(interface="slcan", channel=f"socket://127.0.0.1:{port}") as transport:
            peer, _ = server.accept()
            with peer:
                peer.sendall(b"t1231AA\rt1231BB\r")
                assert [frame.data for frame in taken(transport, 2)] == [b"\xaa", b"\xbb"]
                transport.send(Frame(identifier=0x7, data=b"\x01"))
                heard = b""
                while not heard.endswith(b"t007101\r"):
                    heard += peer.recv(100)
            with pytest.raises(LinkError, match="has vanished"):
                transport.receive(soon(transport, 20 * S))
