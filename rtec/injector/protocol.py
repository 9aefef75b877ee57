"""The contract for insertion algorithms: levels of A and B and requests go in, levels and completed totals come out.

The four designs, the board with machine code, a Python class and Verilog are all algorithms in this sense. Whoever
plays one sees two streams and the totals, and nothing of its inside. What has to hold between them stands in
docs/algorithm.md and is tried by `rtec.verify.contract`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rtec.checks import whole_within
from rtec.errors import ArgumentError
from rtec.signal import EdgeStream

LARGEST_TOTAL = 2**31
"""Totals of steps stay below this, whatever the word of a box could hold."""


@dataclass(frozen=True, slots=True, eq=False)
class Totals:
    """A total of steps over time: what is requested of an algorithm, or what it says it has completed.

    Parameters
    ----------
    times_ps
        When it changed, strictly increasing, int64 ps, shape (n,).
    totals
        The total from then on, int64, shape (n,); before the first change it is 0.

    Raises
    ------
    ArgumentError
        Arrays of different lengths, times that do not increase, a total that is too large.

    Examples
    --------
    >>> asked = Totals([1_000, 9_000], [1, -1])
    >>> asked.final, [asked.at(t) for t in (0, 1_000, 8_999, 9_000)]
    (-1, [0, 1, 1, -1])
    """

    times_ps: NDArray[np.int64]
    totals: NDArray[np.int64]

    def __init__(self, times_ps: ArrayLike = (), totals: ArrayLike = ()) -> None:
        # read-only, in one block of memory: so kernels are compiled once for all of them
        times, values = (np.array(given, np.int64, order="C") for given in (times_ps, totals))
        times.flags.writeable = values.flags.writeable = False
        if times.ndim != 1 or times.shape != values.shape:
            raise ArgumentError("totals", f"{values.shape}", f"one for each of {times.size} times")
        late = times[1:] <= times[:-1]
        if late.any():
            raise ArgumentError("times_ps", times[:-1][late][0], "strictly increasing times")
        if values.size and np.abs(values).max() >= LARGEST_TOTAL:
            raise ArgumentError("totals", np.abs(values).max(), f"totals below {LARGEST_TOTAL}")
        object.__setattr__(self, "times_ps", times)
        object.__setattr__(self, "totals", values)

    def __len__(self) -> int:
        return int(self.times_ps.size)

    @property
    def final(self) -> int:
        """Return the last total."""
        return int(self.totals[-1]) if len(self) else 0

    def at(self, t_ps: int) -> int:
        """Return the total at a time; a change at that very time has happened."""
        index = int(np.searchsorted(self.times_ps, t_ps, side="right"))
        return int(self.totals[index - 1]) if index else 0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Stimulus:
    """What goes into an algorithm in one run from power-up on.

    Parameters
    ----------
    edges
        A and B at the encoder, from time 1 ps on; ``edges.initial`` are the levels at power-up, time 0.
    requests
        Totals of steps that are to have been inserted.
    until_ps
        End of the run: what the algorithm does before it is seen.

    Raises
    ------
    ArgumentError
        Edges or requests outside 1 ps to before ``until_ps``.

    Examples
    --------
    Four edges forward, and one step asked for behind the second:

    >>> edges = EdgeStream.from_states([1_000, 2_000, 3_000, 4_000], [1, 2, 3, 0], 0)
    >>> stimulus = Stimulus(edges=edges, requests=Totals([2_500], [1]), until_ps=10_000)
    >>> stimulus.edges.counts().net
    4
    """

    edges: EdgeStream
    requests: Totals
    until_ps: int

    def __post_init__(self) -> None:
        """Check that everything lies inside the run."""
        whole_within("until_ps", self.until_ps, 2, 2**61, unit="ps")
        for name, times in (("edges", self.edges.times_ps), ("requests", self.requests.times_ps)):
            if times.size and not 1 <= times[0] <= times[-1] < self.until_ps:
                raise ArgumentError(f"{name}.times_ps", f"{times[0]} to {times[-1]}", f"1 to {self.until_ps - 1} ps")


@dataclass(frozen=True, slots=True, kw_only=True)
class Break:
    """Why an algorithm ended before its run: it raised, returned no levels, went back in time, never came back.

    Parameters
    ----------
    time_ps
        Simulated time of the call that broke it.
    reason
        What happened, in words.
    ended
        Whether what ran it has ended with it, so that another run costs a new start.
    """

    time_ps: int
    reason: str
    ended: bool = False


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Response:
    """What came out of an algorithm in one run.

    Parameters
    ----------
    edges
        A and B at the controller; ``edges.initial`` are the levels at power-up.
    completed
        Total of steps that it says it has inserted.
    refusals
        Times in ps at which it refused a request for good, with its reason.
    broken
        Why it ended early, or None.
    """

    edges: EdgeStream
    completed: Totals
    refusals: tuple[tuple[int, str], ...] = ()
    broken: Break | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Reach:
    """What can be asked of an algorithm through its interface; one without an attribute ``reach`` takes any run."""

    total: int = LARGEST_TOTAL - 1
    """Largest total, of either sign, that the request's word holds."""
    longest_ps: int | None = None
    """Length of the longest run whose output is kept whole, or None."""


class Algorithm(Protocol):
    """An insertion algorithm, whatever it is made of; each run begins at power-up.

    A context: a process or a simulator behind it ends with it.
    """

    @property
    def name(self) -> str:
        """Return what it is called in verdicts."""

    def play(self, stimuli: Sequence[Stimulus]) -> list[Response]:
        """Return what comes out for each stimulus, each run for itself from power-up on."""

    def close(self) -> None:
        """End what runs behind it."""


class Attached(Protocol):
    """An algorithm at work in one box."""

    def copied_to(self, own: Any) -> Attached:
        """Let a copy work in a box whose record was copied; ``own`` is that part of it."""

    def check(self) -> None:
        """Raise an `rtec.errors.RtecError` where the algorithm has come to an untimely end."""


class BoxAlgorithm(Protocol):
    """An algorithm that can work in the boxes of a machine, in the place of a design."""

    name: str
    """What it is called."""
    note: str
    """What there is to say about how it runs, or ""."""

    def attach(self, own: Any) -> Attached:
        """Let it work in a box for as long as what is returned is kept; ``own`` is `OWN` of the injector's record."""
