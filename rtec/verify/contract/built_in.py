"""The designs that come with rtec, through the interface that every algorithm has."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rtec._jit import new_record
from rtec.injector import InjectorSettings, Response, Stimulus, Totals, _kernels
from rtec.injector._state_kernels import INJECTOR
from rtec.signal import EdgeStream
from rtec.verify.contract._built_in_kernels import play


class BuiltIn:
    """A design of rtec as an `rtec.injector.Algorithm`.

    Parameters
    ----------
    settings
        Design, timing, and what becomes of real transitions during an insertion.

    Examples
    --------
    >>> from rtec.injector import Design, Timing
    >>> box = BuiltIn(InjectorSettings(design=Design.C, timing=Timing()))
    >>> asked = Stimulus(edges=EdgeStream([], [], initial=0), requests=Totals([1_000], [1]), until_ps=10**10)
    >>> response = box.play([asked])[0]
    >>> response.edges.counts().net, response.completed.final
    (2, 1)
    """

    def __init__(self, settings: InjectorSettings) -> None:
        self.settings = settings

    @property
    def name(self) -> str:
        """Return the design's title."""
        return self.settings.design.title

    def play(self, stimuli: Sequence[Stimulus]) -> list[Response]:
        """Return what comes out for each stimulus."""
        return [self._one(stimulus) for stimulus in stimuli]

    def close(self) -> None:
        """Nothing runs behind it."""

    def _one(self, stimulus: Stimulus) -> Response:
        edges, requests = stimulus.edges, stimulus.requests
        room = 8 * len(edges) + 64
        while True:
            state = new_record(INJECTOR)
            self.settings.fill(state)
            _kernels.reset(state, edges.initial)
            state.last_edge_ps = 0  # the axis may have moved until power-up: a rest counts only once it was seen
            out_ps, levels = np.empty(room, np.int64), np.empty(room, np.uint8)
            done_ps, done = np.empty(room, np.int64), np.empty(room, np.int64)
            made, booked = play(
                state, edges.times_ps, edges.levels, requests.times_ps, requests.totals, stimulus.until_ps, out_ps,
                levels, done_ps, done,
            )  # fmt: skip
            if made >= 0:
                break
            room *= 4
        return Response(
            edges=EdgeStream(out_ps[:made].copy(), levels[:made].copy(), initial=edges.initial),
            completed=Totals(done_ps[:booked].copy(), done[:booked].copy()),
        )
