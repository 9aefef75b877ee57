"""The injector on its own: edges in, edges out, one stream at a time."""

from __future__ import annotations

import enum
from dataclasses import dataclass

import numpy as np

from rtec._jit import Record, new_record
from rtec.checks import whole_within
from rtec.injector import _kernels
from rtec.injector._state_kernels import INJECTOR
from rtec.injector.design import DesignRow
from rtec.injector.timing import Timing
from rtec.signal import NEVER, EdgeStream


class RealEdges(enum.Enum):
    """What happens to a real transition while an insertion is under way."""

    MERGE = "merge"
    """The gates merge it with the pulses, whatever comes of it."""
    HOLD = "hold"
    """A latch holds it back until the insertion is over (the report's alternative)."""


class PowerLoss(enum.Enum):
    """What Design C's inverters do when the box loses its power."""

    KEEP = "keep"
    """A latch powered by the controller keeps their state."""
    RELEASE = "release"
    """They drop out; with an odd total both lines flip at once."""


@dataclass(frozen=True, slots=True, kw_only=True)
class InjectorSettings:
    """A design with its timing and its choices.

    Examples
    --------
    >>> from rtec.injector import Design
    >>> InjectorSettings(design=Design.C, timing=Timing()).real_edges
    <RealEdges.MERGE: 'merge'>
    """

    design: DesignRow
    timing: Timing
    real_edges: RealEdges = RealEdges.MERGE
    power_loss: PowerLoss = PowerLoss.KEEP

    def fill(self, state: Record) -> None:
        """Write the parameters into a kernel's state."""
        timing = self.timing
        design = self.design
        state.changes, state.in_path = design.step_counts, int(design.in_path)
        state.inverts, state.one_state = int(design.inverts), int(design.one_state)
        state.poll_ps = timing.poll_ps
        state.poll_offset_ps = timing.poll_offset_ps
        state.decide_ps = timing.decide_ps
        state.step_ps = timing.step_ps
        state.recover_ps = timing.recover_ps
        state.latency_ps = timing.latency_ps
        state.gate_ps = timing.gate_ps(design)
        state.rest_ps = timing.rest_ps
        state.holds = int(self.real_edges is RealEdges.HOLD)
        state.releases = int(self.power_loss is PowerLoss.RELEASE)


@dataclass(frozen=True, slots=True, kw_only=True)
class Insertions:
    """What the box did, and what its monitor saw."""

    requested: int
    """Total of steps asked for."""
    completed: int
    """Total of steps that the box takes as inserted."""
    inserted: int
    """Insertions made, of either sign."""
    refused: int
    """Moments at which the speed gate refused to insert."""
    ahead_counts: int
    """Counts by which the controller's side went ahead of the encoder's, by ideal decoders on both sides."""
    illegal: int
    """Changes of both lines at one instant at the controller's side that the encoder's side did not make."""
    real_inside: int | None
    """Real edges that fell between the look that begins an insertion and its last change; None where a program runs,
    whose looks are its own."""
    longest_ps: int | None
    """Longest time from a transition to the last change of the insertion that followed it; None as above."""


class Injector:
    """The box between encoder and controller, fed with edge streams.

    Parameters
    ----------
    settings
        Design, timing and choices.
    initial
        Level code ``A + 2 * B`` at the start.

    Examples
    --------
    Design C adds two counts behind the first of five forward edges:

    >>> from rtec.injector import Design
    >>> box = Injector(InjectorSettings(design=Design.C, timing=Timing()), initial=0)
    >>> box.request(1, at_ps=0)
    >>> quarter = 1_000_000
    >>> moving = EdgeStream([quarter * k for k in range(1, 6)], [1, 3, 2, 0, 1], initial=0)
    >>> box.process(moving, until_ps=6 * quarter).counts()
    Counts(net=7, illegal=0)
    >>> box.insertions.completed, box.insertions.ahead_counts
    (1, 2)
    """

    def __init__(self, settings: InjectorSettings, *, initial: int = 0) -> None:
        self.settings = settings
        self._state = new_record(INJECTOR)
        settings.fill(self._state)
        _kernels.reset(self._state, whole_within("initial", initial, 0, 3))
        self._now_ps = -NEVER
        self._level = initial
        self._made: list[EdgeStream] = []

    def request(self, total: int, *, at_ps: int) -> None:
        """Ask for a total of steps from ``at_ps`` on, which lies at or after the last edge processed."""
        total = whole_within("total", total, -(2**31), 2**31)
        _kernels.request(self._state, self._run_to(at_ps), total)

    def enable(self, enabled: bool, *, at_ps: int) -> None:
        """Allow or forbid insertions; one under way is carried to its end."""
        _kernels.switch(self._state, self._run_to(at_ps), int(enabled), int(self._state.powered))

    def power(self, on: bool, *, at_ps: int) -> None:
        """Take the box's power away, whatever is under way, or give it back."""
        _kernels.switch(self._state, self._run_to(at_ps), int(self._state.enabled), int(on))

    def process(self, edges: EdgeStream, *, until_ps: int) -> EdgeStream:
        """Return what the controller sees of ``edges`` and of the box's own changes before ``until_ps``.

        The stream joins the last one returned. Of an instant at which a request or a switch comes, it is the first
        to happen, before changes of the box and edges at that instant.

        Raises
        ------
        ArgumentError
            Edges that do not join the last ones, or lie at or after ``until_ps``.
        """
        state = self._state
        until_ps = whole_within("until_ps", until_ps, self._now_ps, NEVER - 1, unit="ps (time never runs back)")
        edges.check_joins(int(state.ab_in), self._now_ps, until_ps)
        self._run(edges, until_ps)
        made, before = self._made, self._level
        self._made, self._level = [], int(state.seen_out)
        times = np.concatenate([stream.times_ps for stream in made])
        levels = np.concatenate([stream.levels for stream in made])
        return EdgeStream(times, levels, initial=before)

    @property
    def insertions(self) -> Insertions:
        """Return what happened so far."""
        return insertions_of(self._state)

    def _run_to(self, t_ps: int) -> int:
        """Carry out the box's own changes before ``t_ps``."""
        self._run(EdgeStream([], [], initial=int(self._state.ab_in)), t_ps)
        return self._now_ps

    def _run(self, edges: EdgeStream, until_ps: int) -> None:
        state, from_ps, before = self._state, self._now_ps, int(self._state.seen_out)
        most = (self._later(until_ps) - from_ps) // int(state.decide_ps) + 1
        at_rest = min(most, abs(int(state.requested) - int(state.completed)))
        room = 6 * edges.times_ps.size + 5 * at_rest + 8
        times = np.empty(room, dtype=np.int64)
        levels = np.empty(room, dtype=np.uint8)
        used = _kernels.inject(state, edges.times_ps, edges.levels, from_ps, self._now_ps, times, levels)
        self._made.append(EdgeStream(times[:used].copy(), levels[:used].copy(), initial=before))

    def _later(self, t_ps: int) -> int:
        self._now_ps = whole_within("time", t_ps, self._now_ps, NEVER - 1, unit="ps (time never runs back)")
        return self._now_ps


def insertions_of(state: Record, board: Record | None = None) -> Insertions:
    """Return the observations in a kernel's state, those of the lines by a board's monitor where there is one."""
    monitor = state if board is None else board
    return Insertions(
        requested=int(state.requested),
        completed=int(state.completed),
        inserted=int(state.inserted),
        refused=int(state.refused),
        ahead_counts=int(monitor.ahead),
        illegal=int(monitor.illegal_out),
        real_inside=int(state.real_inside) if board is None else None,
        longest_ps=int(state.longest_ps) if board is None else None,
    )
