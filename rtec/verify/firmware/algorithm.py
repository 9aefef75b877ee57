"""The machine-code interface: a program on the board, homed, as an insertion algorithm."""

from __future__ import annotations

from collections.abc import Sequence, Sized

import numpy as np
from numpy.typing import NDArray

from rtec.board.board import PUBLICATIONS, WINDOW_STEPS, Snapshot
from rtec.errors import ArgumentError
from rtec.injector import Break, Reach, Response, Stimulus, Totals
from rtec.signal import EdgeStream
from rtec.verify.bench import Bench, Failed
from rtec.verify.firmware._run_kernels import play_runs
from rtec.verify.firmware.handshake import DOUBT, FATAL, MESSAGES, START

_ROOM = 16_384
"""Changes of the box, and publications, of all runs that are made in one go."""

_SOONEST_READING_PS = 500_000_000
"""Of a one-clock part: publications come no sooner one after the other."""

_LATEST_READINGS = 5
"""A step is inserted by one reading and said in the next; so long the count may be ahead of what is said."""


class Firmware:
    """A program on the board of a design as an `rtec.injector.Algorithm`.

    It is brought up once, takes home, and travels to each of the four states. Every run begins there; its time 0 is
    that moment. A program that does not come so far breaks every run at its begin, and says why.

    Parameters
    ----------
    bench
        The board after power-up; with ``homed``, after home has been taken.
    homed
        Whether it has been.

    Examples
    --------
    >>> from rtec.board import Microcontroller
    >>> from rtec.injector import Design
    >>> board = Firmware(Bench(Design.C, Microcontroller.named("8051-12mhz"), hold_latch=True))
    >>> asked = Stimulus(edges=EdgeStream([], [], initial=3), requests=Totals([1_000], [1]), until_ps=10**10)
    >>> response = board.play([asked])[0]
    >>> response.edges.counts().net, response.completed.final
    (2, 1)
    """

    def __init__(self, bench: Bench, *, homed: bool = False) -> None:
        self.bench = bench
        self._broken: Break | None = None
        self._homes: dict[int, Snapshot] = {}
        """By the level code at which a run begins."""
        try:
            if not homed:
                for step in START.values():
                    step(bench)
            for _ in range(4):
                bench.run_readings(2.0)
                self._homes[bench.axis.final] = bench.keep()
                bench.travel(1, 1_000.0)
            kept = self._homes.values()
            self._kept = (
                np.stack([np.frombuffer(each.circuits, np.uint8) for each in kept]),
                np.stack([each.memory for each in kept]),
                np.stack([each.hidden for each in kept]),
            )
        except Failed as failed:
            self._broken = Break(time_ps=failed.time_ps, reason=failed.detail)

    @property
    def name(self) -> str:
        """Return the image's name."""
        return self.bench.image.source

    @property
    def delay_ps(self) -> int:
        """Return how late the program may say what it has inserted: some readings of the PC's words."""
        return _LATEST_READINGS * self.bench.reading_ps

    @property
    def reach(self) -> Reach:
        """Return which totals the request's word holds, and how long a run may be."""
        return Reach(total=self.bench.design.word_limit, longest_ps=PUBLICATIONS * _SOONEST_READING_PS)

    def play(self, stimuli: Sequence[Stimulus]) -> list[Response]:
        """Return what comes out for each stimulus.

        Raises
        ------
        ArgumentError
            A total that the request's word cannot hold.
        """
        most = self.reach.total
        for stimulus in stimuli:
            beyond = stimulus.requests.totals[np.abs(stimulus.requests.totals) > most]
            if beyond.size:
                word = f"the request's word of {self.bench.design.title}: {-most} to {most} steps"
                raise ArgumentError("a requested total", int(beyond[0]), f"what fits into {word}")
        if self._broken is not None:
            return [
                Response(edges=EdgeStream([], [], each.edges.initial), completed=Totals(), broken=self._broken)
                for each in stimuli
            ]
        responses: list[Response] = []
        while len(responses) < len(stimuli):
            responses += self._quickly(stimuli[len(responses) :])
            if len(responses) < len(stimuli):
                responses.append(self._one(stimuli[len(responses)]))
        return responses

    def close(self) -> None:
        """Nothing runs behind it."""

    def replay(self, stimulus: Stimulus, *, to_ps: int | None = None) -> None:
        """Play a stimulus, all of it or up to a time, with all that a bench records.

        Raises
        ------
        Failed
            The processor has stopped.
        """
        bench = self.bench
        bench.reset(self._homes[stimulus.edges.initial])
        bench.axis = stimulus.edges.shift(bench.begun_ps)
        end_ps = stimulus.until_ps if to_ps is None else to_ps
        for at_ps, total in zip(stimulus.requests.times_ps.tolist(), stimulus.requests.totals.tolist(), strict=True):
            bench.run_until(bench.begun_ps + min(at_ps, end_ps))
            bench.board.ask(total)
        bench.run_until(bench.begun_ps + end_ps)

    def _quickly(self, stimuli: Sequence[Stimulus]) -> list[Response]:
        """Make runs in one go, up to one that stops the processor or says more than there is room for."""
        board, homes = self.bench.board, list(self._homes)
        edges, requests = [each.edges for each in stimuli], [each.requests for each in stimuli]
        changes = sum(len(each) for each in edges)
        out_ps, out_levels = np.empty(2 * changes + _ROOM, np.int64), np.empty(2 * changes + _ROOM, np.uint8)
        outs, tolds = (np.zeros(len(stimuli) + 1, np.int64) for _ in range(2))
        told, last = np.empty((_ROOM, 3), np.int64), np.empty((len(stimuli), 2), np.int64)
        memory, hidden, log = board.cpu.arrays
        made = play_runs(
            board.state, np.asarray(board.state.base).view(np.uint8), board.cpu.loop, memory, hidden, log,
            *self._kept, np.array([homes.index(each.initial) for each in edges], np.int64),
            np.concatenate([each.times_ps for each in edges]), np.concatenate([each.levels for each in edges]),
            _bounds(edges), np.concatenate([each.times_ps for each in requests]),
            np.concatenate([each.totals for each in requests]), _bounds(requests),
            np.array([each.until_ps for each in stimuli], np.int64), np.empty((PUBLICATIONS, 3), np.int64),
            out_ps, out_levels, outs, told, tolds, last,
        )  # fmt: skip
        responses = []
        for k, stimulus in enumerate(stimuli[:made]):
            out, level = slice(outs[k], outs[k + 1]), int(self._homes[stimulus.edges.initial].circuits.seen_out)
            seen, at_end = EdgeStream(out_ps[out], out_levels[out], level), int(last[k, 1]) if last[k, 0] else None
            responses.append(_response(stimulus, seen, told[tolds[k] : tolds[k + 1]], at_end))
        return responses

    def _one(self, stimulus: Stimulus) -> Response:
        """Make one run in which much comes out, or the processor stops."""
        bench, broken = self.bench, None
        try:
            self.replay(stimulus)
        except Failed as failed:
            broken = Break(time_ps=failed.time_ps - bench.begun_ps, reason=failed.detail)
        edges, told = bench.controller.shift(-bench.begun_ps), bench.told - (bench.begun_ps, 0, 0)
        return _response(stimulus, edges, told, bench.words.completed if bench.valid else None, broken)


def _bounds(parts: Sequence[Sized]) -> NDArray[np.int64]:
    return np.cumsum([0, *(len(part) for part in parts)], dtype=np.int64)


def _response(
    stimulus: Stimulus, edges: EdgeStream, said: NDArray[np.int64], at_end: int | None, broken: Break | None = None
) -> Response:
    """Return what has come out; a completed total that stands there at the end counts, too, if it is valid."""
    if at_end is not None and (said.size == 0 or said[-1, 0] < stimulus.until_ps - 1):
        said = np.vstack([said, (stimulus.until_ps - 1, at_end, 0)])
    changed = said[:, 1] != np.concatenate([[0], said[:-1, 1]])
    completed = Totals(said[changed, 0], said[changed, 1])
    return Response(edges=edges, completed=completed, refusals=_refusals(said, stimulus.requests), broken=broken)


def _refusals(said: NDArray[np.int64], requests: Totals) -> tuple[tuple[int, str], ...]:
    """Return when the box first rejected a total beyond the window."""
    steps = np.abs(np.diff(requests.totals, prepend=0))
    if not np.any(steps > WINDOW_STEPS):
        return ()
    first_ps = requests.times_ps[steps > WINDOW_STEPS][0]
    doubts = said[np.isin(said[:, 2], (DOUBT, FATAL)) & (said[:, 0] > first_ps)]
    return tuple((int(t_ps), MESSAGES[message]) for t_ps, _, message in doubts[:1].tolist())
