"""Algorithms for tests: users' classes without a process of their own, and fixed answers."""

import numpy as np

from rtec.injector import Response, Totals
from rtec.verify.contract._python_child import Player
from rtec.verify.contract.python_class import response_of


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
        return response_of(self.player.play(given), self.player.reasons)

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
