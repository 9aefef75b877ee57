"""Twenty mutants of the four designs: each with one fault as an engineer makes it, which `rtec check` finds.

``rtec check rtec/examples/mutants.py:CRawPins --design c``. The right ones stand in designs.py, beside this file.
"""

from rtec.examples.designs import DOWN, UP, A, B, C, Original


class OriginalPeriod(Original):
    """The speed gate takes four edges, a whole period of A, for the interval between two."""

    first_ps = 0  # times of the last edges, the oldest first
    second_ps = 0
    third_ps = 0

    def see(self, t_ps, ab):
        """Time the edges."""
        if t_ps > 0 and ab != self.last:
            self.apart_ps = t_ps - self.first_ps
            self.first_ps, self.second_ps, self.third_ps, self.edge_ps = (
                self.second_ps,
                self.third_ps,
                self.edge_ps,
                t_ps,
            )
        self.last = ab


class OriginalPowerUp(Original):
    """At power-up it assumes that the axis has been at rest for long."""

    edge_ps = -Original.SLOW_PS


class OriginalOneLine(Original):
    """It takes A low for A and B low, and so inserts in state 01, too."""

    def may_begin(self, t_ps, requested):
        """Say whether a step may begin."""
        return requested != self.completed and self.held & 1 == 0 and self.is_slow(t_ps)


class OriginalWithdrawn(Original):
    """It ends its pulses at once where the request is withdrawn between them."""

    def go_on(self, t_ps, ab, requested):
        """Make the next change."""
        if requested == self.completed:
            self.pulses = 0
            self.sign = 0
            self.free_ps = t_ps + self.GAP_PS
        else:
            self.change_once(t_ps, ab, requested)


class OriginalRecovery(Original):
    """The latch opens with the end of the last pulse, without the time to recover."""

    def book(self, ab, requested):
        """Count a step as completed."""
        self.completed += self.sign
        self.held = ab


class ARawPins(A):
    """The gates stand before the latch: a real edge goes through them during the pulses."""

    def gates(self, ab):
        """Return the levels behind the gates."""
        return ((self.held if self.sign == 0 else ab) | self.high) & ~self.low


class ALateDirection(A):
    """The sign of the step is latched with its second change, not with its first."""

    def go_on(self, t_ps, ab, requested):
        """Make the next change."""
        if self.done == 1 and requested != self.completed:
            self.sign = 1 if requested > self.completed else -1
        self.change_once(t_ps, ab, requested)


class AEarlyRelease(A):
    """The latch opens half a pulse early, with the last change still to come."""

    def change(self, ab):
        """Begin or end a pulse."""
        if self.done == 3:
            self.held = ab
        shown = self.gates(ab)
        wanted = UP[shown] if self.sign > 0 else DOWN[shown]
        self.high, self.low = wanted & ~self.held, self.held & ~wanted


class ANotWoken(A):
    """What the latch holds back at the end of a step waits there for the next edge or request."""

    def wake(self, t_ps, requested):
        """Return when to be called again."""
        pending = self.sign != 0 or requested != self.completed
        return self.free_ps if self.free_ps > t_ps and pending else 0


class ATooSlow(A):
    """Pulses of 250 ns: at 500 kHz two edges fall into a step, and the latch keeps one."""

    GAP_PS = 250_000


class BBooksRequest(B):
    """It books what is asked for now, not what it has inserted."""

    def book(self, ab, requested):
        """Count a step as completed."""
        self.completed = requested


class BTooSoon(B):
    """A count may come 30 ns after an edge, before the receiver has seen the edge."""

    PASS_PS = 30_000


class BOffset(B):
    """The counts that it is ahead stop at two instead of going round."""

    def change(self, ab):
        """Show one count more, or less."""
        ahead = self.ahead - 4 if self.ahead == 3 else self.ahead
        self.ahead = max(-1, min(2, ahead + self.sign)) & 3


class BCountsEdges(B):
    """Edges that come while it is busy are counted, and shown afterwards in the direction of the last one shown."""

    GAP_PS = 300_000
    forward = 1
    waiting = 0
    last = 0

    def see(self, t_ps, ab):
        """Count the edges."""
        if t_ps > 0 and ab != self.last:
            self.waiting += 1
            if self.waiting == 1:
                self.forward = 1 if ab == UP[self.last] else -1
        self.last = ab

    def let_through(self, t_ps, ab):
        """Show one edge."""
        if self.waiting > 0:
            self.held = UP[self.held] if self.forward > 0 else DOWN[self.held]
            self.waiting -= 1
            self.free_ps = t_ps + self.PASS_PS


class BLosesEdge(B):
    """Its note that there was an edge is wiped 30 ns after the lines were read: an edge between goes unseen."""

    noted = 0
    reading = 0
    read = 0
    last = 0

    def see(self, t_ps, ab):
        """Note an edge."""
        if ab != self.last:
            self.noted = 1
        self.last = ab

    def step(self, t_ps, ab, requested):
        """Return levels at the controller, completed steps, and when to be called again."""
        self.see(t_ps, ab)
        if t_ps == 0:
            self.held = ab
            self.noted = 0
        elif t_ps >= self.free_ps:
            if self.reading == 1:
                self.held, self.noted, self.reading = self.read, 0, 0
                self.free_ps = t_ps + self.PASS_PS
            elif self.noted == 1:
                self.read, self.reading = ab, 1
                self.free_ps = t_ps + 30_000
            elif requested != self.completed:
                self.begin(t_ps, ab, requested)
        return self.gates(ab), self.completed, self.wake(t_ps, requested)


class CRawPins(C):
    """Which line is next is taken from the encoder's pins, not from the levels behind the latch."""

    def change(self, ab):
        """Invert the line that takes the levels one count on."""
        shown = ab ^ self.inverted
        self.inverted ^= shown ^ (UP[shown] if self.sign > 0 else DOWN[shown])


class COrder(C):
    """In state 01 it takes the order of the lines for A = B: a line of the state table copied wrong."""

    def change(self, ab):
        """Invert the line that takes the levels one count on."""
        shown = self.held ^ self.inverted
        adds = (self.sign > 0) != (shown == 2 and self.done == 0)
        self.inverted ^= shown ^ (UP[shown] if adds else DOWN[shown])


class CPowerUp(C):
    """The latch comes up open only in state 00: elsewhere it shows 00 until the first edge."""

    def power_up(self, ab):
        """Come up with the latch in state 00."""


class CTakesBack(C):
    """A step whose request is withdrawn halfway is taken back, and booked all the same."""

    def go_on(self, t_ps, ab, requested):
        """Go on with a step."""
        withdrawn = self.done == 1 and requested == self.completed
        self.change_once(t_ps, ab, requested)
        if withdrawn:
            self.inverted = 0


class CBooksLate(C):
    """The sign of what it books is that of the request at the end of the step."""

    def book(self, ab, requested):
        """Count a step as completed."""
        self.completed += 1 if requested >= self.completed else -1
