"""A bus in memory with a clock that goes on only where somebody waits: nothing sleeps."""

from collections import deque

import pytest

from rtec.errors import LinkError
from rtec.link.transport import BusState, Received, Traffic

MS = 10**9


class Clock:
    def __init__(self):
        self.now_ps = 0


class FakeTransport:
    """One end of a cable between two nodes; ``events`` are what happens at times of the clock."""

    def __init__(self, clock):
        self.clock = clock
        self.inbox = deque()
        self.sent = []
        self.other = None
        self.traffic = Traffic()
        self.state = BusState.ACTIVE
        self.gone = False
        self.delay_ps = 0

    def now_ps(self):
        return self.clock.now_ps

    def send(self, frame):
        if self.gone:
            raise LinkError("fake", "cable", "has vanished", "plug it in")
        self.traffic.sent += 1
        self.sent.append((self.clock.now_ps, frame))
        if self.other is not None:
            self.other.inbox.append((self.clock.now_ps + self.delay_ps, frame))

    def put(self, frame, at_ps=None):
        self.inbox.append((self.clock.now_ps if at_ps is None else at_ps, frame))

    def receive(self, until_ps):
        if self.gone:
            raise LinkError("fake", "cable", "has vanished", "plug it in")
        if self.inbox and self.inbox[0][0] <= max(until_ps, self.clock.now_ps):
            at_ps, frame = self.inbox.popleft()
            self.clock.now_ps = max(self.clock.now_ps, at_ps)
            self.traffic.received += 1
            return Received(frame=frame, arrival_ps=self.clock.now_ps)
        self.clock.now_ps = max(self.clock.now_ps, until_ps)
        return None

    def close(self):
        self.gone = True


@pytest.fixture
def fresh():
    """Return a maker of cables: two ends with a clock, kept together by whoever steps them."""

    def make():
        clock = Clock()
        near, far = FakeTransport(clock), FakeTransport(clock)
        near.other, far.other = far, near
        return near, far

    return make


@pytest.fixture
def cable(fresh):
    """Return two ends of a cable."""
    return fresh()


class Together:
    """A box loop and a PC loop on one cable: whoever has a frame or is due first takes the next step."""

    def __init__(self, cable, stations, nodes, **options):
        from rtec.live.box_loop import BoxLoop
        from rtec.live.pc_loop import PcLoop

        self.near, self.far = cable
        self.clock = self.near.clock
        self.box = BoxLoop(stations, self.near, **options)
        self.pc = PcLoop(nodes, self.far)
        self.box_lives = self.pc_lives = True

    def step(self):
        if self.box_lives and self.near.inbox:
            self.box.step()
        elif self.pc_lives and self.far.inbox:
            self.pc.step()
        else:
            loops = [self.box] * self.box_lives + [self.pc] * self.pc_lives
            min(loops, key=lambda loop: loop.due_ps).step()

    def run(self, seconds):
        end_ps = self.clock.now_ps + round(seconds * 1e12)
        while self.clock.now_ps < end_ps:
            self.step()


@pytest.fixture
def together(cable):
    """Return a maker of a box and a PC on a cable; the axis is off by 12 µm everywhere, 3 steps of 4 counts."""
    from rtec.machine.station import Station, StationSettings
    from rtec.predictors import BidirectionalTable
    from rtec.requester.pc_node import PcNode
    from rtec.requester.settings import HandshakeSettings, Outside
    from rtec.requester.supervision import SupervisionLimits

    def make(moves=(), axes=(1,), table=None, speed=1.0, setup=None, outside=Outside.HOLD):
        table = table or BidirectionalTable(
            forward_positions_mm=[-50, 50],
            forward_errors_mm=[0.012, 0.012],
            reverse_positions_mm=[-50, 50],
            reverse_errors_mm=[0.012, 0.012],
        )
        stations = [Station(StationSettings(axis=axis), moves) for axis in axes]
        nodes = [
            PcNode(
                HandshakeSettings(outside=outside),
                SupervisionLimits(),
                axis=axis,
                predictor=table,
                count_mm=0.001,
                step_counts=4,
                word_limit=127,
                setup=setup,
                start_ps=cable[0].clock.now_ps + (2 + k) * MS,
            )
            for k, axis in enumerate(axes)
        ]
        return Together(cable, stations, nodes, speed=speed)

    return make
