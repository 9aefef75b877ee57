"""The controller's input on its own: edges in, counts and faults out."""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass

from rtec._jit import Record, new_record
from rtec.checks import whole_within
from rtec.controller import _kernels
from rtec.errors import ArgumentError
from rtec.signal import NEVER, EdgeStream
from rtec.units import PS_PER_S


class Multiplication(enum.Enum):
    """Counts that the decoder makes of one encoder cycle."""

    X1 = 1
    X2 = 2
    X4 = 4


class IllegalPolicy(enum.Enum):
    """What the decoder does with a transition whose direction it cannot know."""

    IGNORE = "ignore"
    """Take the new levels over, leave the count."""
    FAULT = "fault"
    """The same, and latch a servo fault."""
    GUESS = "guess"
    """Count it as two transitions in the direction of the last one; before the first one, leave the count."""


class IllegalClass(enum.Enum):
    """Why a transition was illegal."""

    SIMULTANEOUS = "simultaneous"
    """Both lines changed at one instant."""
    UNRESOLVED = "unresolved"
    """They changed one after the other, too fast for the filter's clock to tell apart."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ReceiverSettings:
    """Line receiver with digital filter, decoder and counter.

    Parameters
    ----------
    filter_samples
        Ticks in a row that must see a new level before it counts; 0 for no filter.
    clock_hz
        Clock of the filter, whole hertz.
    multiplication
        Counts a cycle.
    policy
        What an illegal transition does.
    counter_bits
        Width of the signed counter; 0 for one that never wraps.

    Raises
    ------
    ArgumentError
        A value outside its range, or a clock whose period in picoseconds needs too large a denominator.

    Examples
    --------
    >>> ReceiverSettings().delay_ps
    60000
    """

    filter_samples: int = 3
    clock_hz: int = 50_000_000
    multiplication: Multiplication = Multiplication.X4
    policy: IllegalPolicy = IllegalPolicy.IGNORE
    counter_bits: int = 32

    def __post_init__(self) -> None:
        """Check the ranges."""
        whole_within("filter_samples", self.filter_samples, 0, 1_000_000)
        whole_within("clock_hz", self.clock_hz, 1_000, 10_000_000_000, unit="Hz")
        bits = whole_within("counter_bits", self.counter_bits, 0, 62)
        if bits == 1:
            raise ArgumentError("counter_bits", 1, "0, or a width from 2 to 62")
        if self._period[1] > 5_000_000:
            raise ArgumentError(
                "clock_hz",
                self.clock_hz,
                "a clock whose period is a ratio of smaller whole numbers of picoseconds",
                "round it to a multiple of 1 kHz",
            )

    @property
    def _period(self) -> tuple[int, int]:
        shared = math.gcd(PS_PER_S, self.clock_hz)
        return PS_PER_S // shared, self.clock_hz // shared

    @property
    def delay_ps(self) -> int:
        """Return the longest time that a level needs through the filter, rounded up."""
        num, den = self._period
        return -(-self.filter_samples * num // den)

    def fill(self, state: Record) -> None:
        """Write the parameters into a kernel's state."""
        state.samples = self.filter_samples
        state.clock_hz = self.clock_hz
        state.tick_num, state.tick_den = self._period
        state.ticks_per_ps = self.clock_hz / PS_PER_S
        state.unseen_ps = -(-state.tick_num // state.tick_den) if self.filter_samples else 0
        state.sure_ps = self.delay_ps
        state.multiplication = self.multiplication.value
        state.policy = {"ignore": _kernels.IGNORE, "fault": _kernels.FAULT, "guess": _kernels.GUESS}[
            self.policy.value
        ]

    def counted(self, transitions: int, home_state: int) -> int:
        """Return what the decoder makes of net ``transitions`` that begin in angle state ``home_state``.

        x4 counts all of them, x2 those of A, x1 those of A while B is low: once a cycle, into state 1.

        Examples
        --------
        >>> single = ReceiverSettings(multiplication=Multiplication.X1)
        >>> [single.counted(transitions, 0) for transitions in (-1, 0, 1, 4, 5)]
        [0, 0, 1, 1, 2]
        """
        width = 4 // self.multiplication.value
        return (transitions + home_state - 1) // width - (home_state - 1) // width

    def wrapped(self, count: int) -> int:
        """Return ``count`` as the counter of finite width shows it.

        Examples
        --------
        >>> ReceiverSettings(counter_bits=12).wrapped(2048)
        -2048
        """
        if self.counter_bits == 0:
            return count
        half = 1 << (self.counter_bits - 1)
        return (count + half) % (2 * half) - half


@dataclass(frozen=True, slots=True, kw_only=True)
class IllegalTransition:
    """One illegal transition at the decoder."""

    time_ps: int
    kind: IllegalClass


@dataclass(frozen=True, slots=True, kw_only=True)
class ReceiverResult:
    """What the controller's input made of its signals."""

    count: int
    """Counts since the start, as if the counter never wrapped."""
    illegal_transitions: int
    simultaneous: int
    unresolved: int
    first_illegal: tuple[IllegalTransition, ...]
    """The first of them, with their times; all are counted above."""
    filtered: int
    """Level changes that the filter swallowed."""
    min_separation_ps: int | None
    """Least time between two edges at the input; None with fewer than two."""
    fault_ps: int | None
    """When the servo fault was latched."""
    index_count: int | None
    """Count at the last index pulse."""
    probe_count: int | None
    """Count at the last probe trip."""


class Receiver:
    """The controller's input, fed with edge streams.

    Parameters
    ----------
    settings
        Filter, decoder and counter.
    initial
        Level code ``A + 2 * B`` at the start.

    Examples
    --------
    >>> receiver = Receiver(ReceiverSettings(), initial=0)
    >>> receiver.process(EdgeStream([1_000_000, 2_001_000, 2_011_000], [1, 3, 2], initial=0))
    >>> result = receiver.result(at_ps=3_000_000)
    >>> result.count, result.illegal_transitions
    (1, 1)
    """

    def __init__(self, settings: ReceiverSettings, *, initial: int = 0) -> None:
        self.settings = settings
        self._state = new_record(_kernels.RECEIVER)
        settings.fill(self._state)
        _kernels.reset(self._state, whole_within("initial", initial, 0, 3))
        self._now_ps = -NEVER

    def process(self, edges: EdgeStream) -> None:
        """Take edges that join the last ones.

        Raises
        ------
        ArgumentError
            Edges that do not join, or lie before what was settled.
        """
        if edges.initial != self._state.raw:
            raise ArgumentError(
                "edges.initial", edges.initial, f"{int(self._state.raw)}, where the last stream ended"
            )
        if edges.times_ps.size:
            self._later(int(edges.times_ps[0]))
            _kernels.receive(self._state, edges.times_ps, edges.levels)
            self._later(int(edges.times_ps[-1]))

    def index(self, *, at_ps: int) -> None:
        """Latch the count at an index pulse."""
        _kernels.latch(self._state, self._later(at_ps), 1)

    def probe(self, *, at_ps: int) -> None:
        """Latch the count at a probe trip."""
        _kernels.latch(self._state, self._later(at_ps), 0)

    def result(self, *, at_ps: int) -> ReceiverResult:
        """Return what has been counted by ``at_ps``."""
        _kernels.settle(self._state, self._later(at_ps))
        return result_of(self._state)

    def _later(self, t_ps: int) -> int:
        self._now_ps = whole_within("time", t_ps, self._now_ps, NEVER - 1, unit="ps (time never runs back)")
        return self._now_ps


def result_of(state: Record) -> ReceiverResult:
    """Return the observations in a kernel's state."""
    illegal = int(state.simultaneous + state.unresolved)
    kinds = {_kernels.SIMULTANEOUS: IllegalClass.SIMULTANEOUS, _kernels.UNRESOLVED: IllegalClass.UNRESOLVED}
    return ReceiverResult(
        count=int(state.count),
        illegal_transitions=illegal,
        simultaneous=int(state.simultaneous),
        unresolved=int(state.unresolved),
        first_illegal=tuple(
            IllegalTransition(time_ps=int(state.log_ps[i]), kind=kinds[int(state.log_class[i])])
            for i in range(min(illegal, _kernels.LOG_LENGTH))
        ),
        filtered=int(state.filtered),
        # with one edge alone, or none, it is counted from before all times
        min_separation_ps=int(state.min_separation_ps) if state.min_separation_ps < NEVER // 2 else None,
        fault_ps=int(state.fault_ps) if state.fault else None,
        index_count=int(state.index_count) if state.index_pulses else None,
        probe_count=int(state.probe_count) if state.probe_trips else None,
    )
