"""The four designs of Yee (1992) as algorithms for `rtec check`, with a latch that holds real edges back.

Each passes: ``rtec check rtec/examples/designs.py:Original --design original``. What may go wrong in them stands in
mutants.py.
"""

UP, DOWN = (1, 3, 0, 2), (2, 0, 3, 1)  # levels A + 2 B a count later, and a count before


class Latched:
    """What the four share: a step is so many changes one after the other, while the latch keeps the encoder's levels.

    The class attributes are what a new object begins with.
    """

    TIMES: tuple[str, ...] = ("free_ps",)  # for ``rtec check --exhaustive``: which attributes are times
    TOTALS = ("completed",)  # and which are totals
    GRID_PS, FORGETS_PS = 50_000, 200_000  # divides all its times; older times make no difference
    CHANGES = 4  # of one step
    GAP_PS = 100_000  # between two of them, and after the last
    PASS_PS = 100_000  # after an edge that was let through
    held = 0  # the encoder's levels behind the latch
    sign = 0  # of the step under way, 0 between two
    done = 0  # changes of it
    completed = 0
    free_ps = 0  # nothing changes before

    def step(self, t_ps, ab, requested):
        """Return levels at the controller, completed steps, and when to be called again (0: at the next input)."""
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

    def see(self, t_ps, ab):
        """Look at the encoder's levels."""

    def power_up(self, ab):
        """Come up with the latch open."""
        self.held = ab

    def let_through(self, t_ps, ab):
        """Let an edge through the latch."""
        self.held = ab
        self.free_ps = t_ps + self.PASS_PS

    def may_begin(self, t_ps, requested):
        """Say whether a step may begin."""
        return requested != self.completed

    def begin(self, t_ps, ab, requested):
        """Begin a step with its first change."""
        self.sign = 1 if requested > self.completed else -1
        self.done = 0
        self.go_on(t_ps, ab, requested)

    def go_on(self, t_ps, ab, requested):
        """Go on with a step."""
        self.change_once(t_ps, ab, requested)

    def change_once(self, t_ps, ab, requested):
        """Make the next change, and book the step with the last one."""
        self.change(ab)
        self.done += 1
        self.free_ps = t_ps + self.GAP_PS
        if self.done == self.CHANGES:
            self.book(ab, requested)
            self.sign = 0

    def book(self, ab, requested):
        """Count a step as completed."""
        self.completed += self.sign

    def change(self, ab):
        """Make one change at the gates."""
        raise NotImplementedError

    def gates(self, ab):
        """Return the levels behind the gates."""
        raise NotImplementedError

    def wake(self, t_ps, requested):
        """Return when to be called again."""
        return self.free_ps if self.free_ps > t_ps else 0


class Original(Latched):
    """Pulses through OR gates in state 00, 1 us apart as an 8051 makes them; a gate lets no step begin at speed."""

    TIMES = ("free_ps", "edge_ps")
    GRID_PS, FORGETS_PS = 100_000, 5_100_000
    GAP_PS = 1_000_000
    SLOW_PS = 5_000_000  # without an edge for so long the axis is slow: no two of them come within a step
    pulses = 0
    last = 0  # levels at the last look
    edge_ps = 0  # time of the last edge, or of power-up
    apart_ps = 0  # from the edge before

    def see(self, t_ps, ab):
        """Time the edges."""
        if t_ps > 0 and ab != self.last:
            self.apart_ps = t_ps - self.edge_ps
            self.edge_ps = t_ps
        self.last = ab

    def may_begin(self, t_ps, requested):
        """Say whether a step may begin: in state 00, after a long interval or in one."""
        return requested != self.completed and self.held == 0 and self.is_slow(t_ps)

    def is_slow(self, t_ps):
        """Say whether the axis is slow."""
        return self.apart_ps >= self.SLOW_PS or t_ps - self.edge_ps >= self.SLOW_PS

    def change(self, ab):
        """Begin or end a pulse: A first for more counts, B first for fewer."""
        self.pulses = UP[self.pulses] if self.sign > 0 else DOWN[self.pulses]

    def gates(self, ab):
        """Return the levels behind the OR gates."""
        return self.held | self.pulses

    def wake(self, t_ps, requested):
        """Return when to be called again; a step that waits for rest asks for it."""
        if self.free_ps > t_ps:
            return self.free_ps
        rest_ps = self.edge_ps + self.SLOW_PS
        return rest_ps if requested != self.completed and rest_ps > t_ps else 0


class A(Latched):
    """Pulses of either polarity in any state: high ones through OR gates, low ones through AND gates."""

    high = 0
    low = 0

    def change(self, ab):
        """Begin or end a pulse, so that the levels go one count on."""
        shown = self.gates(ab)
        wanted = UP[shown] if self.sign > 0 else DOWN[shown]
        self.high, self.low = wanted & ~self.held, self.held & ~wanted

    def gates(self, ab):
        """Return the levels behind the gates."""
        return (self.held | self.high) & ~self.low


class B(Latched):
    """The lines pass through the processor, which shows them some counts ahead or behind."""

    CHANGES = 1
    ahead = 0  # counts, 0 to 3

    def change(self, ab):
        """Show one count more, or less."""
        self.ahead = (self.ahead + self.sign) & 3

    def gates(self, ab):
        """Return the levels that the processor writes."""
        shown = self.held
        for _ in range(self.ahead):
            shown = UP[shown]
        return shown


class C(Latched):
    """Inverters in both lines: the line that is next in Gray code is inverted, then the other one."""

    CHANGES = 2
    inverted = 0

    def change(self, ab):
        """Invert the line that takes the levels one count on."""
        shown = self.held ^ self.inverted
        self.inverted ^= shown ^ (UP[shown] if self.sign > 0 else DOWN[shown])

    def gates(self, ab):
        """Return the levels behind the inverters."""
        return self.held ^ self.inverted
