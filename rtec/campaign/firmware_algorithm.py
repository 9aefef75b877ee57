"""The door for machine code: a program on the board, homed, as an insertion algorithm."""

from __future__ import annotations

from collections.abc import Sequence

from firmware_model import Image
from rtec.board import Microcontroller
from rtec.campaign import firmware_check_answers as conversation
from rtec.campaign.firmware_check_bench import Bench, BenchState
from rtec.campaign.firmware_check_contract import DOUBT, FATAL, MESSAGES, Failed
from rtec.campaign.firmware_check_motion import Given
from rtec.injector import Break, Design, Response, Stimulus, Totals
from rtec.signal import EdgeStream

_LOOKS = 8
"""At the completed total, in a reading."""

_LATEST_READINGS = 5
"""A step is inserted by one reading and said in the next; so long the count may be ahead of what is said."""


class Firmware:
    """A program on the board of a design as an `rtec.injector.Algorithm`.

    It is brought up once, takes home, and travels to each of the four states. Every run begins there; its time 0 is
    that moment.

    Parameters
    ----------
    design, microcontroller, image, hold_latch
        As of `rtec.board.Board`.

    Examples
    --------
    >>> from firmware_model import read_hex
    >>> chip = Microcontroller.named("8051-12mhz")
    >>> board = Firmware(Design.C, chip, read_hex(chip.image(Design.C)), hold_latch=True)
    >>> asked = Stimulus(edges=EdgeStream([], [], initial=3), requests=Totals([1_000], [1]), until_ps=10**10)
    >>> response = board.play([asked])[0]
    >>> response.edges.counts().net, response.completed.final
    (2, 1)
    """

    def __init__(self, design: Design, microcontroller: Microcontroller, image: Image, *, hold_latch: bool) -> None:
        self.bench = Bench(design, microcontroller, image, hold_latch=hold_latch)
        self.image = image
        self._broken: Break | None = None
        self._homes: dict[int, BenchState] = {}
        """By the level code at which a run begins."""
        try:
            for step in (conversation.starts, conversation.answers, conversation.takes_home):
                step(self.bench)
            for _ in range(4):
                self.bench.run_readings(2.0)
                kept = self.bench.keep()
                self._homes[kept.level] = kept
                self.bench.travel(1, 1_000.0)
        except Failed as failed:
            self._broken = Break(time_ps=failed.time_ps, reason=failed.detail)

    @property
    def name(self) -> str:
        """Return the image's name."""
        return self.image.source

    @property
    def delay_ps(self) -> int:
        """Return how late the program may say what it has inserted: some readings of the PC's words."""
        return _LATEST_READINGS * self.bench.reading_ps

    def play(self, stimuli: Sequence[Stimulus]) -> list[Response]:
        """Return what comes out for each stimulus."""
        return [self._one(stimulus) for stimulus in stimuli]

    def close(self) -> None:
        """Nothing runs behind it."""

    def _one(self, stimulus: Stimulus) -> Response:
        bench, level = self.bench, stimulus.edges.initial
        if self._broken is not None:
            return Response(edges=EdgeStream([], [], level), completed=Totals(), broken=self._broken)
        bench.go_back(self._homes[level])
        begun_ps = bench.now_ps
        bench.motion = Given(EdgeStream(stimulus.edges.times_ps + begun_ps, stimulus.edges.levels, level))
        requests, done, refusals = stimulus.requests, list[tuple[int, int]](), list[tuple[int, str]]()
        broken: Break | None = None
        try:
            for at_ps, total in zip(
                [*requests.times_ps.tolist(), stimulus.until_ps], [*requests.totals.tolist(), None], strict=True
            ):
                self._run_to(begun_ps, at_ps, done, refusals)
                if total is not None:
                    bench.board.ask(total)
        except Failed as failed:
            broken = Break(time_ps=failed.time_ps - begun_ps, reason=failed.detail)
        seen = bench.controller
        return Response(
            edges=EdgeStream(seen.times_ps - begun_ps, seen.levels, seen.initial),
            completed=Totals(*zip(*done, strict=True)) if done else Totals(),
            refusals=tuple(refusals),
            broken=broken,
        )

    def _run_to(
        self, begun_ps: int, at_ps: int, done: list[tuple[int, int]], refusals: list[tuple[int, str]]
    ) -> None:
        """Run, looking at the words often."""
        bench = self.bench
        while (left_ps := begun_ps + at_ps - bench.now_ps) > 0:
            bench.run_for(min(left_ps, bench.reading_ps // _LOOKS))
            if not bench.valid:
                continue
            words, now_ps = bench.words, bench.now_ps - begun_ps
            if words.completed != (done[-1][1] if done else 0):
                done.append((now_ps, words.completed))
            if words.message in (DOUBT, FATAL) and not refusals:
                refusals.append((now_ps, MESSAGES[words.message]))
