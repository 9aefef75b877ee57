"""Algorithms for tests: users' classes without a process of their own, and fixed answers."""

import numpy as np

from rtec.conformance._python_child import Player
from rtec.injector import Break, Response, Totals
from rtec.signal import EdgeStream


class InProcess:
    """A class with a step, as plain Python."""

    def __init__(self, kind):
        self.name = kind.__name__
        self.player = Player(kind, np.zeros(3, np.int64))

    def play(self, stimuli):
        return [self._one(stimulus) for stimulus in stimuli]

    def _one(self, stimulus):
        edges, asked = stimulus.edges, stimulus.requests
        given = (edges.times_ps, edges.levels, asked.times_ps, asked.totals, edges.initial, stimulus.until_ps, 0, 1)
        changes, levels, done_ps, done, no_ps, no, first, broken_ps, reason = self.player.play(given)
        return Response(
            edges=EdgeStream(changes, levels, initial=first),
            completed=Totals(done_ps, done),
            refusals=tuple((int(t), self.player.reasons[code]) for t, code in zip(no_ps, no, strict=True)),
            broken=None if broken_ps < 0 else Break(time_ps=broken_ps, reason=reason),
        )

    def close(self):
        pass


class Wires:
    """Passes every edge and inserts nothing."""

    name = "wires"

    def __init__(self):
        self.streams = []

    def play(self, stimuli):
        return [Response(edges=stimulus.edges, completed=Totals()) for stimulus in stimuli]

    def close(self):
        pass
