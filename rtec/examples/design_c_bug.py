"""Design C of Yee (1992) as in design_c.py, with a bug: `rtec check` finds the stream that shows it."""

UP, DOWN = (1, 3, 0, 2), (2, 0, 3, 1)  # levels A + 2 B a count later, and a count before
GAP_PS = 200_000  # between two changes


class DesignC:
    """Inverts the line that Gray code has next, waits, and inverts the other one: two counts a step."""

    held = inverted = sign = completed = free_ps = 0  # at power-up

    def step(self, t_ps, ab, requested):
        """Return levels at the controller, completed steps, and when to be called again (0: at the next input)."""
        if t_ps == 0:
            self.held = ab
        elif t_ps >= self.free_ps and (self.sign != 0 or ab != self.held or requested != self.completed):
            self.free_ps = t_ps + GAP_PS
            if ab != self.held:  # lets an edge through
                self.held = ab
            else:
                second = self.sign != 0
                self.sign = self.sign if second else 1 if requested > self.completed else -1
                shown = self.held ^ self.inverted
                self.inverted ^= shown ^ (UP[shown] if self.sign > 0 else DOWN[shown])
                if second:
                    self.completed, self.sign = self.completed + self.sign, 0
        return self.held ^ self.inverted, self.completed, self.free_ps if self.free_ps > t_ps else 0
