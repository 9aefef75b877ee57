"""Design C of NISTIR 4832 as an algorithm for `rtec check`: inverters behind A and B, a latch before them."""

UP, DOWN = (1, 3, 0, 2), (2, 0, 3, 1)  # levels A + 2 B a count later, and a count before
GAP_PS = 200_000  # between two changes


class DesignC:
    """Inverts the line that Gray code has next, waits, and inverts the other one: two counts a step."""

    def __init__(self):
        self.held, self.inverted, self.sign, self.completed, self.free_ps = -1, 0, 0, 0, 0

    def step(self, t_ps, ab, requested):
        """Return levels at the controller, completed steps, and when to be called again (0: at the next input)."""
        if self.held < 0:  # power-up
            self.held = ab
        if t_ps >= self.free_ps:
            halfway = self.inverted in (1, 2)
            if halfway or (ab == self.held and requested != self.completed):
                if not halfway:
                    self.sign = 1 if requested > self.completed else -1
                out = self.held ^ self.inverted
                self.inverted ^= out ^ (UP[out] if self.sign > 0 else DOWN[out])
                self.completed += self.sign if halfway else 0
                self.free_ps = t_ps + GAP_PS
            elif ab != self.held:  # let go of what came meanwhile
                self.held = ab
                self.free_ps = t_ps + GAP_PS
        busy = self.free_ps > t_ps
        return self.held ^ self.inverted, self.completed, self.free_ps if busy else 0
