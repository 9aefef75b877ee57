"""A corrector with a place on the ring of the four states: it owes the controller edges, and steps of two places."""

RING = [0b00, 0b01, 0b11, 0b10]  # levels A + 2 B, one count from each to the next
PLACE = [0, 1, 3, 2]  # of such levels on the ring
APART_PS = 150_000  # between two changes at the controller


class Ring:
    place = 0  # at the controller
    seen = 0  # at the encoder
    owed = 0  # edges of the encoder that the controller has not had yet
    left = 0  # places of the step under way
    booked = 0  # steps completed
    free_ps = 0  # nothing changes before

    def step(self, t_ps, ab, requested):
        if t_ps == 0:
            self.place = self.seen = PLACE[ab]
        moved = (PLACE[ab] - self.seen) % 4
        self.seen = PLACE[ab]
        if moved == 1:
            self.owed += 1
        elif moved == 3 and self.left <= 0:
            self.owed -= 1
        way = 0
        if t_ps >= self.free_ps:
            if self.owed != 0:
                way = 1 if self.owed > 0 else -1
                self.owed -= way
            elif self.left != 0:
                way = 1 if self.left > 0 else -1
                self.left -= way
                self.booked += way
            elif requested != self.booked:
                way = self.left = 1 if requested > self.booked else -1
        if way != 0:
            self.place = (self.place + way) % 4
            self.free_ps = t_ps + APART_PS
        return RING[self.place], self.booked, self.free_ps if self.free_ps > t_ps else 0
