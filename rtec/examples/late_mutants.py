"""Mutants of the four designs whose fault shows late: after many steps, long travel, a long rest or a large jump.

``rtec check rtec/examples/late_mutants.py:CByteTotal --design c``. Those that show soon stand in mutants.py, the
right designs in designs.py, beside this file.
"""

from rtec.examples.designs import DOWN, UP, A, B, C, Original

MS = 1_000_000_000


def wrapped(value, size):
    """Return a value as a signed word that has so many values holds it."""
    return (value + size // 2) % size - size // 2


class CByteTotal(C):
    """The total of steps is a signed byte: behind 127 comes -128."""

    def book(self, ab, requested):
        """Count a step as completed."""
        self.completed = wrapped(self.completed + self.sign, 1 << 8)


class AWordTotal(A):
    """The total of steps has 16 bits: behind 32 767 comes -32 768."""

    def book(self, ab, requested):
        """Count a step as completed."""
        self.completed = wrapped(self.completed + self.sign, 1 << 16)


class BLongTravel(B):
    """It inserts by a position of 16 bits; where that wraps, after 32 768 counts, it is ahead by one count more."""

    position = 0

    def let_through(self, t_ps, ab):
        """Let an edge through."""
        self.position += 1 if ab == UP[self.held] else -1
        self.held = ab
        self.free_ps = t_ps + self.PASS_PS
        if self.position == wrapped(self.position, 1 << 16):
            return
        self.position = wrapped(self.position, 1 << 16)
        self.ahead = (self.ahead + 1) & 3


class CTwentieth(C):
    """The 20th insertion is booked twice."""

    number = 0

    def book(self, ab, requested):
        """Count a step as completed."""
        self.number += 1
        self.completed += 2 * self.sign if self.number == 20 else self.sign


class _Restless(Original):
    """What some of them share: how long nothing had come in when something comes in."""

    last_requested = 0
    quiet_since_ps = 0
    rested_ps = 0

    def step(self, t_ps, ab, requested):
        """Return levels at the controller, completed steps, and when to be called again."""
        if ab != self.last or requested != self.last_requested:
            self.rested_ps = t_ps - self.quiet_since_ps
            self.quiet_since_ps = t_ps
        self.last_requested = requested
        self.see(t_ps, ab)
        if t_ps == 0:
            self.power_up(ab)
        elif t_ps >= self.free_ps:
            if self.sign != 0:
                self.go_on(t_ps, ab, requested)
            elif ab != self.held:
                self.let_through(t_ps, ab)
            elif self.may_begin(t_ps, requested):
                self.begin(t_ps, ab, requested)
        return self.gates(ab), self.completed, self.wake(t_ps, requested)


class OriginalRested(_Restless):
    """After 20 ms of rest the pulses come in each other's place, and counts are taken instead of added."""

    def change(self, ab):
        """Begin or end a pulse."""
        adds = (self.sign > 0) != (self.rested_ps > 20 * MS)
        self.pulses = UP[self.pulses] if adds else DOWN[self.pulses]


class AIgnoresJump(A):
    """A request that is more than 100 steps away is ignored, and no reason given."""

    def may_begin(self, t_ps, requested):
        """Say whether a step may begin."""
        return requested != self.completed and abs(requested - self.completed) <= 100

    def wake(self, t_ps, requested):
        """Return when to be called again."""
        return self.free_ps if self.free_ps > t_ps else 0


class CByteUnsigned(C):
    """The total of steps forward is an unsigned byte: behind 255 comes 0."""

    def book(self, ab, requested):
        """Count a step as completed."""
        self.completed += self.sign
        if self.completed == 256:
            self.completed = 0


class BWordUnsigned(B):
    """The total of steps forward has 16 bits without a sign: behind 65 535 comes 0."""

    def book(self, ab, requested):
        """Count a step as completed."""
        self.completed += self.sign
        if self.completed == 65_536:
            self.completed = 0


class BDrift(B):
    """Each 1000th insertion adds a count too many."""

    number = 0

    def book(self, ab, requested):
        """Count a step as completed."""
        self.number += 1
        self.completed += self.sign
        if self.number % 1000 == 0:
            self.ahead = (self.ahead + 1) & 3


class ASaturatesDown(A):
    """Steps back are counted in a byte that stays at 255."""

    back = 0

    def book(self, ab, requested):
        """Count a step as completed."""
        if self.sign > 0:
            self.completed += 1
        elif self.back < 255:
            self.back += 1
            self.completed -= 1


class BTwoCounters(B):
    """Steps forward and steps back are counted in a byte each, and the total is their difference."""

    forth = 0
    back = 0

    def book(self, ab, requested):
        """Count a step as completed."""
        if self.sign > 0:
            self.forth = (self.forth + 1) % 256
        else:
            self.back = (self.back + 1) % 256
        self.completed = self.forth - self.back


class CReversal(C):
    """After more than 200 steps in one direction the first one in the other is booked without being inserted."""

    in_a_row = 0
    before = 0

    def begin(self, t_ps, ab, requested):
        """Begin a step with its first change."""
        self.sign = 1 if requested > self.completed else -1
        turned = self.sign != self.before and self.in_a_row > 200
        self.in_a_row = self.in_a_row + 1 if self.sign == self.before else 1
        self.before = self.sign
        if turned:
            self.completed += self.sign
            self.sign = 0
            self.free_ps = t_ps + self.GAP_PS
        else:
            self.done = 0
            self.go_on(t_ps, ab, requested)


class ATimerOfMicroseconds(A):
    """A timer of 16 bits counts us: 65.536 ms after the last edge one within 5 us is taken for a bounce of it."""

    last = 0
    edge_ps = 0

    def let_through(self, t_ps, ab):
        """Let an edge through the latch."""
        since_ps = t_ps - self.edge_ps
        self.edge_ps = t_ps
        if since_ps >= 65_536_000_000 and since_ps % 65_536_000_000 < 5_000_000:
            self.free_ps = t_ps + 70_000_000  # the bounce is waited out
        else:
            self.held = ab
            self.free_ps = t_ps + self.PASS_PS


class COverflow(C):
    """The time since the last edge has 31 bits of ps: after 2.1 ms an edge seems to come before it, and waits."""

    last = 0
    edge_ps = 0
    due = 1

    def see(self, t_ps, ab):
        """Time the edges."""
        if t_ps > 0 and ab != self.last:
            self.due = 1 if t_ps - self.edge_ps < 1 << 31 else 0
            self.edge_ps = t_ps
        self.last = ab

    def let_through(self, t_ps, ab):
        """Let an edge through the latch."""
        if self.due == 1:
            self.held = ab
        self.free_ps = t_ps + self.PASS_PS

    def wake(self, t_ps, requested):
        """Return when to be called again."""
        return self.free_ps if self.free_ps > t_ps and self.due == 1 else 0


class OriginalTimerOfNanoseconds(_Restless):
    """A timer of 32 bits counts ns: behind 4.3 s of rest the latch opens for the time of a step."""

    def begin(self, t_ps, ab, requested):
        """Begin a step with its first change."""
        self.sign = 1 if requested > self.completed else -1
        self.done = 1 if self.rested_ps > (1 << 32) * 1000 else 0
        self.go_on(t_ps, ab, requested)


class OriginalWatchdog(_Restless):
    """A watchdog starts it anew after a second in which nothing came: the total begins at zero again."""

    def may_begin(self, t_ps, requested):
        """Say whether a step may begin."""
        if self.rested_ps > 1000 * MS:
            self.rested_ps = 0
            self.completed = 0
        return requested != self.completed and self.held == 0 and self.is_slow(t_ps)


class CReleases(C):
    """The inverters are released after 500 ms without an edge, to save power."""

    last = 0
    edge_ps = 0

    def see(self, t_ps, ab):
        """Time the edges."""
        if ab != self.last:
            if t_ps - self.edge_ps > 500 * MS:
                self.inverted = 0
            self.edge_ps = t_ps
        self.last = ab


class ALimitsRequest(A):
    """A request beyond 1000 steps is taken for 1000, and no reason given."""

    def may_begin(self, t_ps, requested):
        """Say whether a step may begin."""
        return max(-1000, min(1000, requested)) != self.completed

    def begin(self, t_ps, ab, requested):
        """Begin a step with its first change."""
        self.sign = 1 if max(-1000, min(1000, requested)) > self.completed else -1
        self.done = 0
        self.go_on(t_ps, ab, requested)


class BWordDifference(B):
    """What is owed has 16 bits: from one end of the word to the other it is less than nothing."""

    def may_begin(self, t_ps, requested):
        """Say whether a step may begin."""
        return wrapped(requested - self.completed, 1 << 16) != 0

    def begin(self, t_ps, ab, requested):
        """Begin a step with its first change."""
        self.sign = 1 if wrapped(requested - self.completed, 1 << 16) > 0 else -1
        self.done = 0
        self.go_on(t_ps, ab, requested)


class CByteDifference(C):
    """What is owed is a signed byte: a jump of 256 steps is none."""

    def may_begin(self, t_ps, requested):
        """Say whether a step may begin."""
        return wrapped(requested - self.completed, 1 << 8) != 0

    def begin(self, t_ps, ab, requested):
        """Begin a step with its first change."""
        self.sign = 1 if wrapped(requested - self.completed, 1 << 8) > 0 else -1
        self.done = 0
        self.go_on(t_ps, ab, requested)


class AWithdrawnAtWrap(A):
    """Where the low byte of the total overflows, a request withdrawn in that very step keeps it from being booked."""

    def book(self, ab, requested):
        """Count a step as completed."""
        carries = self.sign > 0 and self.completed > 0 and self.completed % 256 == 255
        if not (carries and requested <= self.completed):
            self.completed += self.sign


class BEdgeAtWrap(B):
    """An edge that comes in the step in which the low seven bits of the total overflow is lost."""

    last = 0
    edge_ps = 0

    def see(self, t_ps, ab):
        """Time the edges."""
        if ab != self.last:
            self.edge_ps = t_ps
        self.last = ab

    def let_through(self, t_ps, ab):
        """Let an edge through."""
        if t_ps > self.edge_ps and self.completed != 0 and self.completed % 128 == 0:
            self.ahead = (self.ahead - (1 if ab == UP[self.held] else -1)) & 3
        self.held = ab
        self.free_ps = t_ps + self.PASS_PS


class BSaturatesTravel(B):
    """The position of the axis stops at 65 535: further edges forward are not passed."""

    position = 0

    def let_through(self, t_ps, ab):
        """Let an edge through."""
        way = 1 if ab == UP[self.held] else -1
        if self.position + way <= 65_535:
            self.position += way
            self.held = ab
            self.free_ps = t_ps + self.PASS_PS
        else:
            self.free_ps = t_ps + 50 * self.PASS_PS


class CTravelsBack(C):
    """Below a position of -32 768 the order of the lines is the wrong one."""

    position = 0

    def let_through(self, t_ps, ab):
        """Let an edge through the latch."""
        self.position += 1 if ab == UP[self.held] else -1
        self.held = ab
        self.free_ps = t_ps + self.PASS_PS

    def change(self, ab):
        """Invert the line that takes the levels one count on."""
        shown = self.held ^ self.inverted
        adds = (self.sign > 0) != (self.position < -32_768)
        self.inverted ^= shown ^ (UP[shown] if adds else DOWN[shown])


class BEdgeCounter(B):
    """Edges are counted in 16 bits, and the one with which the counter overflows is lost."""

    edges = 0

    def let_through(self, t_ps, ab):
        """Let an edge through."""
        self.edges = (self.edges + 1) % 65_536
        if self.edges == 0:
            self.ahead = (self.ahead - (1 if ab == UP[self.held] else -1)) & 3
        self.held = ab
        self.free_ps = t_ps + self.PASS_PS


class OriginalSleeps(_Restless):
    """After 300 ms of rest it sleeps, and the request that wakes it is booked without pulses."""

    def begin(self, t_ps, ab, requested):
        """Begin a step with its first change."""
        self.sign = 1 if requested > self.completed else -1
        if self.rested_ps > 300 * MS:
            self.rested_ps = 0
            self.completed += self.sign
            self.sign = 0
        else:
            self.done = 0
            self.go_on(t_ps, ab, requested)


class BFourThousand(B):
    """With each 4096th insertion the counts that it is ahead begin at zero again."""

    number = 0

    def book(self, ab, requested):
        """Count a step as completed."""
        self.number += 1
        self.completed += self.sign
        if self.number % 4096 == 4095:
            self.ahead = 0


class OriginalHalfHour(Original):
    """Its clock has 31 bits of us: 36 minutes after power-up time turns negative, and no step is late enough."""

    def is_slow(self, t_ps):
        """Say whether the axis is slow."""
        slow = self.apart_ps >= self.SLOW_PS or t_ps - self.edge_ps >= self.SLOW_PS
        return slow and t_ps < (1 << 31) * 1_000_000


class AHour(A):
    """Its clock has 32 bits of us: after 72 minutes the gates are no longer driven low."""

    late = 0

    def see(self, t_ps, ab):
        """Look at the clock."""
        self.late = 1 if t_ps > (1 << 32) * 1_000_000 else 0

    def gates(self, ab):
        """Return the levels behind the gates."""
        return (self.held | self.high) & ~(self.low if self.late == 0 else 0)


class CQueue(C):
    """Steps that wait stand in a queue of 16; a jump that it cannot take is cut off, and no reason given."""

    target = 0
    seen = 0

    def may_begin(self, t_ps, requested):
        """Say whether a step may begin."""
        if requested != self.seen:
            self.seen = requested
            self.target = max(self.completed - 16, min(self.completed + 16, requested))
        return self.target != self.completed

    def begin(self, t_ps, ab, requested):
        """Begin a step with its first change."""
        self.sign = 1 if self.target > self.completed else -1
        self.done = 0
        self.go_on(t_ps, ab, requested)


class BWithoutRest(B):
    """It counts the edges that come within 1 ms of each other, and loses one when there are 10 000."""

    edges = 0
    edge_ps = 0

    def let_through(self, t_ps, ab):
        """Let an edge through."""
        self.edges = self.edges + 1 if t_ps - self.edge_ps < MS else 0
        self.edge_ps = t_ps
        self.free_ps = t_ps + self.PASS_PS
        if self.edges == 10_000:
            self.ahead = (self.ahead - (1 if ab == UP[self.held] else -1)) & 3
        self.held = ab
