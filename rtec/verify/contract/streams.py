"""Streams that a run is made of: edges and requests that can be cut, written in one line and read again."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from decimal import Decimal

import numpy as np
from numpy.typing import NDArray

from rtec.errors import ArgumentError
from rtec.injector import Stimulus, Totals
from rtec.io import read_text
from rtec.readable import hertz_text
from rtec.signal import EdgeStream
from rtec.units import PS_PER
from rtec.verify.contract._stream_kernels import first_impossible
from rtec.verify.contract.contract import STATES, Contract

LONGEST_PS = 2**61
LONGEST_TEXT = 50_000_000
"""Characters of a stream: some million edges."""

_EVENT = re.compile(
    r"(?P<time>\d{1,20}(?:\.\d{0,20})?)(?P<unit>ps|ns|us|ms|s):(?:(?P<move>[+-])|r(?P<total>[+-]?\d{1,9})|(?P<end>end))",
    re.ASCII,
)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Stream:
    """Edges as counts up and down from a state, and requests, from power-up to an end.

    Examples
    --------
    >>> stream = Stream.read("00 1us:+ 1.5us:r1 1.62us:- 3us:end")
    >>> stream.edges_ps.tolist(), stream.moves.tolist(), stream.final_state
    ([1000000, 1620000], [1, -1], 0)
    >>> str(stream)
    '00 1us:+ 1.5us:r1 1.62us:- 3us:end'
    """

    state: int
    """Angle state 0..3 of the encoder at power-up."""
    edges_ps: NDArray[np.int64]
    moves: NDArray[np.int64]
    """Its edges, each a count up (+1) or down (-1); int64 ps and int64, shape (n,)."""
    requests_ps: NDArray[np.int64]
    totals: NDArray[np.int64]
    """Changes of the total that is asked for."""
    until_ps: int
    """End of the run."""

    @classmethod
    def of(
        cls,
        state: int,
        edges: Sequence[tuple[int, int]] | NDArray[np.int64],
        requests: Sequence[tuple[int, int]],
        until_ps: int,
    ) -> Stream:
        """Make a stream of (time, move) and (time, total)."""
        (edges_ps, moves), (requests_ps, totals) = columns(edges), columns(requests)
        return cls(
            state=state, edges_ps=edges_ps, moves=moves, requests_ps=requests_ps, totals=totals, until_ps=until_ps
        )

    @classmethod
    def read(cls, text: str) -> Stream:
        """Read a stream as `str` writes it.

        Raises
        ------
        ArgumentError
            Words that are none of a stream, times that do not increase, no end, too long a text.
        """
        shape = "a state and events, as in '00 1us:+ 1.5us:r1 1.62us:- 3us:end'"
        if len(text) > LONGEST_TEXT:
            raise ArgumentError("stream", f"{len(text)} characters", f"{LONGEST_TEXT} at most")
        words = text.split()
        if not words or words[0] not in STATES:
            raise ArgumentError("stream", repr(" ".join(words[:1])[:40]), f"{shape}; it begins with 00, 10, 11 or 01")
        edges: list[tuple[int, int]] = []
        requests: list[tuple[int, int]] = []
        until_ps, last_ps = None, 0
        for word in words[1:]:
            match = _EVENT.fullmatch(word)
            if match is None:
                raise ArgumentError("stream", repr(word[:40]), shape)
            exact_ps = Decimal(match["time"]) * PS_PER[match["unit"]]  # a float would lose a picosecond in an hour
            t_ps = int(exact_ps)
            if (
                exact_ps != t_ps
                or t_ps > LONGEST_PS
                or t_ps < last_ps
                or until_ps is not None
                or t_ps < 1
                or (edges and match["move"] and t_ps == edges[-1][0])
            ):
                raise ArgumentError(
                    "stream", repr(word[:40]), "whole ps from 1 to 2^61 that increase, and the end last"
                )
            last_ps = t_ps
            if match["move"]:
                edges.append((t_ps, 1 if match["move"] == "+" else -1))
            elif match["total"]:
                requests.append((t_ps, int(match["total"])))
            else:
                until_ps = t_ps
        if until_ps is None:
            raise ArgumentError("stream", repr(words[-1][:40]), "a stream that closes with its end, as in 3us:end")
        stream = cls.of(STATES.index(words[0]), edges, requests, until_ps)
        stream.stimulus()
        return stream

    @classmethod
    def given(cls, said: str) -> Stream:
        """Read a stream as `read`, or from a file with such a text.

        Raises
        ------
        ArgumentError
            As for `read`.
        FileFormatError
            A file that cannot be read.
        """
        if said.split(maxsplit=1)[:1] and said.split(maxsplit=1)[0] in STATES:
            return cls.read(said)
        if not os.path.exists(said):  # Path would raise where a name is too long
            allowed = "a state and events, as in '00 1us:+ 3us:end', or a file with them"
            raise ArgumentError("stream", repr(said[:40]), allowed)
        return cls.read(read_text(said, "a stream", most_bytes=LONGEST_TEXT, may_be_empty=True))

    def __str__(self) -> str:
        events = [(t, 1, "+" if move > 0 else "-") for t, move in _pairs(self.edges_ps, self.moves)]
        events += [(t, 0, f"r{total}") for t, total in _pairs(self.requests_ps, self.totals)]
        said = [f"{_exact(t)}:{what}" for t, _, what in sorted(events)]
        return " ".join([STATES[self.state], *said, f"{_exact(self.until_ps)}:end"])

    def __len__(self) -> int:
        return int(self.edges_ps.size + self.requests_ps.size)

    @property
    def final_state(self) -> int:
        """Return the state in which the axis stops."""
        return int(self.state + self.moves.sum()) % 4

    @property
    def last_ps(self) -> int:
        """Return the time of the last edge or request."""
        return int(max(self.edges_ps.max(initial=0), self.requests_ps.max(initial=0)))

    def stimulus(self) -> Stimulus:
        """Return what goes into an algorithm."""
        states = (self.state + np.cumsum(self.moves)) % 4
        return Stimulus(
            edges=EdgeStream.from_states(self.edges_ps, states, self.state),
            requests=Totals(self.requests_ps, self.totals),
            until_ps=self.until_ps,
        )

    def asking(self, *requests: tuple[int, int]) -> Stream:
        """Return the same motion with other requests."""
        requests_ps, totals = columns(requests)
        return replace(self, requests_ps=requests_ps, totals=totals)

    def moving(self, edges: Sequence[tuple[int, int]] | NDArray[np.int64]) -> Stream:
        """Return the same requests in another motion."""
        edges_ps, moves = columns(edges)
        return replace(self, edges_ps=edges_ps, moves=moves)

    def later(self, by_ps: int) -> Stream:
        """Return it with everything so much later after power-up."""
        return replace(
            self, edges_ps=self.edges_ps + by_ps, requests_ps=self.requests_ps + by_ps, until_ps=self.until_ps + by_ps
        )


def columns(pairs: Sequence[tuple[int, int]] | NDArray[np.int64]) -> NDArray[np.int64]:
    """Return pairs as two rows, each in one block of memory: for others kernels would be compiled anew."""
    return np.ascontiguousarray(np.asarray(pairs, np.int64).reshape(-1, 2).T)


def can_be(stream: Stream, contract: Contract) -> bool:
    """Return whether an encoder on an axis within the contract can send the edges.

    Notes
    -----
    Two edges of one direction are a quarter of a cycle apart at least, less the jitter; after a turn the same line
    changes back after ``turn_ps`` at least. How fast the axis can be at the end of such an interval follows from the
    acceleration: somewhere inside it is no faster than its mean, and from there on it has the rest of the time, and
    not more than one count, to gain speed. With this speed the next count has to be possible in its time; towards a
    turn the same holds backwards. The time from power-up to the first edge is an interval, too. A halt may come at
    once: an encoder that sends no more edges is no trial for anybody.

    Examples
    --------
    Over an edge and back is possible at rest, and impossible at full speed:

    >>> slow = Stream.read("00 1us:+ 1.2us:- 9us:end")
    >>> fast = Stream.read("00 1us:+ 1.5us:+ 1.7us:- 9us:end")
    >>> can_be(slow, Contract(step_counts=2)), can_be(fast, Contract(step_counts=2))
    (True, False)
    """
    return first_that_cannot_be(stream, contract) == stream.edges_ps.size


def first_that_cannot_be(stream: Stream, contract: Contract) -> int:
    """Return the place of the first edge that comes too early, or the number of edges; see `can_be`."""
    jitter_ps = contract.jitter * contract.quarter_ps
    shortest_ps = round(contract.quarter_ps - jitter_ps)
    gain_hz_s = float(contract.acceleration_hz_s)
    return int(first_impossible(stream.edges_ps, stream.moves, shortest_ps, contract.turn_ps, gain_hz_s, jitter_ps))


def why_it_cannot_be(stream: Stream, contract: Contract) -> str:
    """Return which edge of a stream no encoder of a contract sends, and why, or "".

    Examples
    --------
    >>> why_it_cannot_be(Stream.read("00 1us:+ 1.2us:+ 9us:end"), Contract(step_counts=2))
    'the edge at 1.2us comes 200ns after the one before; at most 500 kHz with 10% jitter they are 450ns apart'
    """
    k = first_that_cannot_be(stream, contract)
    if k == stream.edges_ps.size:
        return ""
    apart_ps = int(stream.edges_ps[k] - stream.edges_ps[k - 1])
    said = f"the edge at {_exact(int(stream.edges_ps[k]))} comes {_exact(apart_ps)} after the one before"
    if stream.moves[k] != stream.moves[k - 1] and apart_ps < contract.turn_ps:
        return f"{said}, which it takes back; a turn takes {_exact(contract.turn_ps)} at least"
    least_ps = round(contract.quarter_ps * (1.0 - contract.jitter))
    if apart_ps < least_ps:
        top = f"at most {hertz_text(contract.frequency_hz)} with {contract.jitter:.0%} jitter"
        return f"{said}; {top} they are {_exact(least_ps)} apart"
    return f"{said}; the axis would have to gain or lose more than {hertz_text(contract.acceleration_hz_s)}/s"


def _pairs(times: NDArray[np.int64], values: NDArray[np.int64]) -> list[tuple[int, int]]:
    return list(zip(times.tolist(), values.tolist(), strict=True))


def _exact(t_ps: int) -> str:
    for unit, digits in (("ms", 9), ("us", 6), ("ns", 3)):
        if t_ps >= 10**digits:
            whole, rest = divmod(t_ps, 10**digits)
            return f"{whole}.{rest:0{digits}d}".rstrip("0").rstrip(".") + unit
    return f"{t_ps}ps"
