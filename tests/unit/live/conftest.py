"""A bus in memory with a clock that goes on only where somebody waits: nothing sleeps, nothing depends on the machine."""

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
def cable():
    """Return two ends of a cable with one clock each, kept together by whoever steps them."""
    clock = Clock()
    near, far = FakeTransport(clock), FakeTransport(clock)
    near.other, far.other = far, near
    return near, far
