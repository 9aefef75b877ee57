"""The bus in simulated time: when frames arrive, who moves the clock, what faults do to whom."""

import pytest

from rtec.errors import ArgumentError, LinkError
from rtec.link.frame import Frame
from rtec.link.simulated import BACKLOG, POLL_PS, SimulatedBus
from rtec.link.transport import BusState
from rtec.machine.faults import Fault, FaultKind
from rtec.units import PS_PER_S

US, MS = 10**6, 10**9
FRAME_PS = 135 * 2 * US  # 135 bits of 2 us at 500 kbit/s


def frame(identifier=0x201, data=bytes(8), **options):
    return Frame(identifier=identifier, data=data, **options)


@pytest.fixture
def bus():
    return SimulatedBus()


def arrivals(transport, until_ps):
    taken = []
    while (received := transport.receive(until_ps)) is not None:
        taken.append((received.arrival_ps, received.frame.identifier))
    return taken


@pytest.mark.parametrize(("bitrate", "frame_ps"), [(1_000_000, 135 * US), (500_000, 270 * US), (125_000, 1080 * US)])
def test_a_frame_takes_135_bits(bitrate, frame_ps):
    bus = SimulatedBus(bitrate=bitrate)
    one, other = bus.transport(), bus.transport()
    one.send(frame())
    assert other.receive(PS_PER_S).arrival_ps == frame_ps
    assert bus.now_ps == other.now_ps() == one.now_ps() == frame_ps  # no later than needed


def test_the_base_format_goes_before_the_extended_of_the_same_first_bits(bus):
    a, b, c, d = (bus.transport() for _ in range(4))
    a.send(frame(0x7FF))
    a.send(frame(0x100 << 18, extended=True))
    b.send(frame(0x100, b""))
    c.send(frame((0x0FF << 18) + 5, b"\x01", extended=True))
    received = [d.receive(PS_PER_S).frame for _ in range(4)]
    assert [(f.identifier, f.extended, len(f.data)) for f in received] == [
        (0x7FF, False, 8), ((0x0FF << 18) + 5, True, 1), (0x100, False, 0), (0x100 << 18, True, 8),
    ]  # fmt: skip


def test_who_waits_moves_the_clock_for_all(bus):
    a, b, c = (bus.transport() for _ in range(3))
    a.send(frame(0x181))
    a.send(frame(0x281))
    assert b.receive(10 * MS).arrival_ps == FRAME_PS
    assert arrivals(b, 10 * MS) == [(2 * FRAME_PS, 0x281)]
    assert bus.now_ps == 10 * MS
    # c was busy meanwhile: it finds both, with the times at which they arrived
    assert arrivals(c, 10 * MS) == [(FRAME_PS, 0x181), (2 * FRAME_PS, 0x281)]


def test_a_look_that_may_not_wait_costs_little_and_is_no_standstill(bus):
    a, b = bus.transport(), bus.transport()
    assert a.receive(0) is None
    assert bus.now_ps == POLL_PS
    b.send(frame())
    looks = 1
    while a.receive(0) is None:
        looks += 1
    assert looks == FRAME_PS // POLL_PS


def test_the_same_calls_give_the_same_frames():
    def play():
        faults = [Fault(kind=FaultKind.FRAME_CORRUPTED, from_ps=0, most=3, seed=5)]
        bus = SimulatedBus(faults=faults)
        a, b = bus.transport(), bus.transport()
        for k in range(10):
            a.send(frame(0x100 + k))
            b.send(frame(0x200 - k))
        return taken(a) + taken(b)

    def taken(transport):
        found = []
        while (received := transport.receive(PS_PER_S)) is not None:
            found.append((received.arrival_ps, received.frame))
        return found

    assert play() == play()


def test_frames_wait_for_a_full_bus_and_are_dropped_beyond(bus):
    a, b = bus.transport(), bus.transport()
    for k in range(BACKLOG + 16):
        a.send(frame(0x100 + k % 7))
    assert (a.state, a.traffic.unsent) == (BusState.ACTIVE, 0)  # 1 on the wires, 16 on their way to it
    for _ in range(3):
        a.send(frame())
    assert a.state is BusState.WARNING
    assert a.traffic.unsent == 2
    assert len(arrivals(b, 5 * PS_PER_S)) == a.traffic.sent == BACKLOG + 17
    a.send(frame())
    assert a.state is BusState.ACTIVE


def test_who_never_looks_does_not_fill_the_memory(bus):
    a, b, c = (bus.transport() for _ in range(3))
    for _ in range(BACKLOG + 5):
        a.send(frame())
        assert b.receive(PS_PER_S * 10) is not None
    assert c.overrun == 5


def test_faults_strike_and_prove_it():
    faults = [
        Fault(kind=FaultKind.FRAME_LOST, place=0, from_ps=0, most=1),
        Fault(kind=FaultKind.FRAME_DUPLICATED, place=0, from_ps=2 * MS, most=1, delay_ps=5 * MS),
        Fault(kind=FaultKind.FRAME_LATE, place=1, from_ps=0, identifier=0x182, delay_ps=MS),
    ]
    bus = SimulatedBus(faults=faults)
    a, b = bus.transport(0), bus.transport(1)
    a.send(frame(0x201))
    a.send(frame(0x202))
    assert arrivals(b, 2 * MS) == [(2 * FRAME_PS, 0x202)]
    a.send(frame(0x203))
    assert arrivals(b, 20 * MS) == [(2 * MS + FRAME_PS, 0x203), (7 * MS + FRAME_PS, 0x203)]
    assert [(activation.fault, activation.times, activation.first_ps) for activation in bus.fired] == [
        (faults[0], 1, FRAME_PS), (faults[1], 1, 2 * MS + FRAME_PS), (faults[2], 0, None),
    ]  # fmt: skip


def test_a_fault_may_come_later(bus):
    a, b = bus.transport(), bus.transport()
    a.send(frame())
    assert len(arrivals(b, MS)) == 1
    bus.add_fault(Fault(kind=FaultKind.FRAME_LOST, from_ps=MS))
    a.send(frame())
    assert arrivals(b, 2 * MS) == []
    assert bus.fired[0].times == 1


def test_a_node_that_is_off_neither_sends_nor_hears():
    bus = SimulatedBus(faults=[Fault(kind=FaultKind.BUS_OFF, place=0, from_ps=MS, until_ps=3 * MS)])
    a, b, c = (bus.transport() for _ in range(3))
    assert a.receive(MS) is None
    assert (a.state, b.state) == (BusState.OFF, BusState.ACTIVE)
    a.send(frame(0x201))
    b.send(frame(0x202))
    assert arrivals(c, 4 * MS) == [(MS + FRAME_PS, 0x202)]
    assert a.state is BusState.ACTIVE
    assert arrivals(a, 4 * MS) == []
    assert a.traffic.unsent == 1
    a.send(frame(0x203))
    assert [identifier for _, identifier in arrivals(c, 5 * MS)] == [0x203]


class Beacon:
    """A device that says the time every millisecond and counts what it hears."""

    def __init__(self):
        self.now_ps, self.due_ps, self.heard = 0, MS, []

    def advance(self, *, until_ps):
        assert until_ps >= self.now_ps
        sent = []
        while self.due_ps < until_ps:
            sent.append((self.due_ps, frame(0x181, self.due_ps.to_bytes(8, "little"))))
            self.due_ps += MS
        self.now_ps = until_ps
        return sent

    def receive(self, received):
        self.heard.append((self.now_ps, received.identifier))


def test_devices_live_on_the_clock(bus):
    beacon = Beacon()
    assert bus.attach(beacon, 1) == 1
    pc = bus.transport(0)
    received = pc.receive(PS_PER_S)
    assert (received.arrival_ps, int.from_bytes(received.frame.data, "little")) == (MS + FRAME_PS, MS)
    pc.send(frame(0x201))
    assert [t for t, _ in arrivals(pc, 5 * MS)] == [k * MS + FRAME_PS for k in (2, 3, 4)]
    assert beacon.heard == [(MS + 2 * FRAME_PS, 0x201)]
    assert beacon.now_ps >= 5 * MS


def test_what_is_planned_happens_in_its_time_and_order(bus):
    beacon, done = Beacon(), []
    bus.attach(beacon)
    pc = bus.transport()
    for k, t_ps in enumerate((3 * MS, 2 * MS, 3 * MS)):
        bus.at(t_ps, lambda k=k: done.append((k, bus.now_ps, beacon.now_ps)))
    bus.at(4 * MS, pc.close)
    with pytest.raises(LinkError, match="is closed; open it again"):
        while True:
            pc.receive(PS_PER_S)
    assert [(k, t_ps) for k, t_ps, _ in done] == [(1, 2 * MS), (0, 3 * MS), (2, 3 * MS)]
    assert all(reached_ps >= t_ps for _, t_ps, reached_ps in done)
    with pytest.raises(ArgumentError, match="time_ps"):
        bus.at(MS, pc.close)


def test_a_node_has_one_place_and_gives_it_back(bus):
    first = bus.transport(3)
    with pytest.raises(ArgumentError, match="a free node: 0, 1, 2, 4, 5, 6, 7"):
        bus.transport(3)
    first.close()
    first.close()
    assert bus.transport(3).node == 3
    for _ in range(7):
        bus.transport()
    with pytest.raises(ArgumentError, match="all are taken"):
        bus.transport()


@pytest.mark.parametrize("bitrate", [0, 2_000_000, 500.0])
def test_a_bitrate_that_can_does_not_have(bitrate):
    with pytest.raises(ArgumentError, match="bitrate"):
        SimulatedBus(bitrate=bitrate)


def test_only_faults_of_a_bus():
    with pytest.raises(ArgumentError, match="a fault of the bus"):
        SimulatedBus(faults=[Fault(kind=FaultKind.GLITCHES, place=1, from_ps=0)])


def test_time_never_runs_back(bus):
    bus.run(until_ps=MS)
    with pytest.raises(ArgumentError, match="time never runs back"):
        bus.run(until_ps=MS - 1)
