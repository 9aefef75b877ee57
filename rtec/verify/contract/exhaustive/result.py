"""What an exhaustive search ends with, and the way to a state that is wrong as a stream that is played again."""

from __future__ import annotations

import enum
import itertools
from collections.abc import Iterator
from dataclasses import dataclass

from rtec.readable import time_text
from rtec.verify.contract.contract import Contract
from rtec.verify.contract.streams import Stream, can_be
from rtec.verify.contract.trials import Case, Run, Trials

_MOST_TRIED = 5000
_LOOSE = 6
"""Events at the end of a way that may come a picosecond beside the grid."""


class Ending(enum.Enum):
    """How a search ends."""

    PROVED = "proved"
    """All reachable states are known, and right."""
    BROKEN = "broken"
    """One is wrong."""
    UNDECIDED = "not decided"
    """There are too many, or the model and the algorithm do not agree."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Event:
    """An edge or a request on the way to a state."""

    time_ps: int
    total: int
    """Of a request."""
    move: int
    """+1 or -1 for an edge, 0 for a request."""
    close: bool
    """Whether it comes just before or just after something else at this point of the grid."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Way:
    """Events from power-up to a state that is wrong."""

    state: int
    """Angle state at power-up."""
    events: tuple[Event, ...]
    end_ps: int
    late_ps: int
    """By so much later all of it fits to the looks of the processor, which come from power-up on."""
    grid_ps: int
    completed: int
    """Steps at the end."""
    levels: int
    """At the controller, at the end."""

    def streams(self, contract: Contract, until_ps: int) -> Iterator[Stream]:
        """Yield streams that may go this way: what is close a picosecond sooner or later, one gap a bit longer."""
        # one moves with the others, or it would come nearer to them than an encoder sends it
        some = any(event.close for event in self.events)
        loose = range(max(len(self.events) - _LOOSE, 0), len(self.events)) if some else range(0)
        stretched = [(0, 0), *itertools.product(range(1, len(self.events)), (self.grid_ps // 2, self.grid_ps))]
        few_first = sorted(itertools.product((0, -1, 1), repeat=len(loose)), key=lambda each: sum(map(abs, each)))
        for shifts, sense, (gap, by_ps) in itertools.product(few_first, (1, -1), stretched):
            times = [t_ps + self.late_ps for t_ps in self._times(contract, sense)]
            times[:gap] = [t_ps - by_ps for t_ps in times[:gap]]
            for k, shift in zip(loose, shifts, strict=True):
                times[k] += shift
            times = [max(t_ps, 1) for t_ps in times]
            timed = sorted(zip(times, self.events, strict=True), key=lambda pair: pair[0])
            edges = [(t, event.move) for t, event in timed if event.move]
            asked = [(t, event.total) for t, event in timed if not event.move]
            yield Stream.of(self.state, edges, asked, max(times, default=self.end_ps) + until_ps)

    def _times(self, contract: Contract, sense: int) -> list[int]:
        """Return the times of the events, moved apart by what the rounding to the grid has taken from them.

        With a sense of 1 the later events move, with -1 the earlier ones.
        """
        shortest_ps = round(contract.quarter_ps * (1.0 - contract.jitter))
        times, moved_ps, last = [], 0, Event(time_ps=0, total=0, move=0, close=False)
        for event in self.events[::sense]:
            if event.move and last.move:
                least_ps = shortest_ps if event.move == last.move else contract.turn_ps
                moved_ps += max(least_ps - abs(event.time_ps - last.time_ps), 0)
            times.append(event.time_ps + sense * moved_ps)
            last = event if event.move else last
        return times[::sense]

    def played(self, trials: Trials, longest_ps: int) -> Run | None:
        """Return the run that shows it, as the judge sees it; None where no run does."""
        for stream in itertools.islice(self.streams(trials.contract, longest_ps), _MOST_TRIED):
            if not can_be(stream, trials.contract):
                continue
            must_finish = stream.final_state in trials.contract.states
            run = trials.one(Case(title="the shortest way", stream=stream, must_finish=must_finish))
            if not run.right:
                return run
        return None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Exhausted:
    """Result of an exhaustive search."""

    algorithm: str
    contract: Contract
    ending: Ending
    states: int
    waiting: int
    """States whose successors were not looked at; 0 where all were."""
    successors: int
    grid_ps: int
    window: int | None
    """Steps that could be owed, either way; None for any number."""
    seconds: float
    delay_ps: int
    """Longest time for which a count was behind."""
    worst: Run | None = None
    """The shortest counterexample, as the judge sees it."""
    note: str = ""
    """Why it is not decided, or ""."""

    @property
    def passed(self) -> bool:
        """Return whether it is proved."""
        return self.ending is Ending.PROVED

    @property
    def reason(self) -> str:
        """Return the result in one sentence."""
        size = f"{self.states} states on a grid of {time_text(self.grid_ps)}"
        if self.ending is Ending.PROVED:
            return f"proved for streams of any length: all {size} are right"
        if self.worst is not None:
            return f"broken: {self.worst.judgement.violation}; {size} were searched up to there"
        return f"not decided: {self.note}; {size} were found, all right"

    @property
    def assumptions(self) -> tuple[str, ...]:
        """Return what the axis and the PC are taken to do."""
        contract = self.contract
        least_ps = round(contract.quarter_ps * (1.0 - contract.jitter))
        owed = "any number of steps" if self.window is None else f"at most {self.window} steps"
        return (
            f"two edges of one direction are {time_text(least_ps)} apart at least, a turn takes"
            f" {time_text(contract.turn_ps)}, the frequency changes by {contract.acceleration_hz_s:g} Hz/s at most",
            f"{owed} may be owed at any time, either way; a request comes at any time",
            "power, switch and lines do not fail",
        )

    def to_dict(self) -> dict[str, object]:
        """Return it as plain data."""
        return {
            "algorithm": self.algorithm,
            "passed": self.passed,
            "checks": [{"name": "exhaustive", "passed": self.passed, "reason": self.reason}],
            "exhaustive": {
                "ending": self.ending.value,
                "states": self.states,
                "waiting": self.waiting,
                "successors": self.successors,
                "grid_ps": self.grid_ps,
                "max_delay_ps": self.delay_ps,
                "seconds": round(self.seconds, 3),
                "assumptions": list(self.assumptions),
            },
        }
