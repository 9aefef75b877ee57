"""Any algorithm in place of the box on the open signal path: the same edges, the same controller, the same audit."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rtec.axis.motion import COUNT_MM, MotionKind, motion_of
from rtec.controller import Receiver, ReceiverResult
from rtec.errors import ArgumentError
from rtec.injector import Response, Stimulus, Totals
from rtec.injector.waves import rows_of_streams
from rtec.machine import OpenPath
from rtec.machine.faults import Fault
from rtec.machine.line_faults import differences, line_fault
from rtec.machine.open_fault_kinds import REQUEST, check_beside_box
from rtec.machine.open_fault_outcome import FaultEffect, FaultOutcome, Watched
from rtec.machine.open_faults import corrupted
from rtec.machine.open_run import settle_ps
from rtec.signal import NEVER
from rtec.units import PS_PER_S
from rtec.verify.contract.endurance import reach_of
from rtec.verify.contract.motions import stream_of
from rtec.verify.contract.streams import Stream
from rtec.verify.contract.trials import Trials

MOST_EDGES = 10_000_000
"""Of a run: what goes in and what comes out is kept in memory."""
_WAITED_STEPS = 100
"""So many steps that are still owed at the end are waited for."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlayedPath:
    """What came out of an open path with an algorithm in it."""

    algorithm: str
    """Its name."""
    path: OpenPath
    """The run; its box was not used."""
    stream: Stream
    """What the encoder sent, and what was asked for."""
    stimulus: Stimulus
    """What went in: the same, behind faults of lines and requests."""
    response: Response
    """What came out."""
    received: ReceiverResult
    """What the controller made of it."""
    wall_s: float
    outcome: FaultOutcome | None = None
    """What became of faults; None without any."""

    @property
    def step_counts(self) -> int:
        """Return how many counts a step is."""
        return self.path.injector.design.step_counts

    @property
    def encoder_counts(self) -> int:
        """Return the net counts of the encoder."""
        return int(self.stream.moves.sum())

    @property
    def controller_counts(self) -> int:
        """Return what the controller's counter shows."""
        return self.path.receiver.wrapped(self.received.count)

    @property
    def requested(self) -> int:
        """Return the total of steps asked for."""
        return self.path.corrections

    @property
    def completed(self) -> int:
        """Return the total of steps that the algorithm says it has inserted."""
        return self.response.completed.final

    @property
    def pending(self) -> int:
        """Return the steps asked for and not inserted."""
        return self.requested - self.completed

    @property
    def audit(self) -> bool:
        """Return whether the controller's count is the encoder's and the completed steps, to ideal decoders, too."""
        added, seen = self.completed * self.step_counts, self.response.edges.counts()
        right = self.path.receiver.counted(self.encoder_counts + added, self.stream.state)
        return self.received.count == right and seen.net == self.encoder_counts + added

    def watched(self) -> Watched:
        """Return what can be noticed, by the counts of the lines that go into the algorithm."""
        lines = self.stimulus.edges.counts()
        by_box = lines.net + self.completed * self.step_counts
        count = self.path.receiver.counted(by_box, self.stream.state)
        return Watched(
            illegal=self.received.illegal_transitions, illegal_in=lines.illegal,
            agrees=self.received.count == count and self.response.edges.counts().net == by_box,
            pending=self.pending, stopped=self.received.fault_ps is not None,
        )  # fmt: skip

    @property
    def good(self) -> bool:
        """Return whether all was inserted and every count is right."""
        legal = self.received.illegal_transitions == 0 and self.response.broken is None
        return self.audit and self.pending == 0 and legal

    def rows(self) -> NDArray[np.int64]:
        """Return both sides as rows for pictures and waveforms, as `rtec.injector.waves.rows_of_streams`."""
        stimulus = self.stimulus
        return rows_of_streams(stimulus.edges, self.response.edges, stimulus.requests, self.response.completed)

    def to_dict(self) -> dict[str, Any]:
        """Return the result under the names of `rtec.machine.OpenPathResult`, as far as they mean something."""
        received, broken, path = self.received, self.response.broken, self.path
        edges = int(self.stream.edges_ps.size)
        return ({} if self.outcome is None else self.outcome.to_dict()) | {
            "algorithm": self.algorithm,
            "design": path.injector.design.key,
            "frequency_hz": path.frequency_hz,
            "edges": edges,
            "encoder_counts": self.encoder_counts,
            "controller_counts": self.controller_counts,
            "corrections_requested": self.requested,
            "corrections_inserted": self.completed,
            "corrections_pending": self.pending,
            "step_counts": self.step_counts,
            "illegal_transitions": received.illegal_transitions,
            "illegal_simultaneous": received.simultaneous,
            "illegal_unresolved": received.unresolved,
            "first_illegal_ps": [illegal.time_ps for illegal in received.first_illegal],
            "min_separation_ps": received.min_separation_ps,
            "filtered_pulses": received.filtered,
            "servo_fault_ps": received.fault_ps,
            "refusals": len(self.response.refusals),
            "broken": None if broken is None else broken.reason,
            "monitor_inserted_counts": self.response.edges.counts().net - self.encoder_counts,
            "monitor_illegal": self.response.edges.counts().illegal,
            "audit": self.audit,
            "simulated_s": self.stream.until_ps / PS_PER_S,
            "wall_s": self.wall_s,
            "edges_per_s": edges / self.wall_s if self.wall_s > 0 else None,
            "motion": "steady" if path.motion is None else path.motion.kind.value,
            "top_frequency_hz": path.frequency_hz if path.motion is None else path.motion.top_hz,
        }


def play_path(trials: Trials, path: OpenPath, faults: Sequence[Fault] = ()) -> PlayedPath:
    """Send the edges of an open path through an algorithm into the controller.

    Parameters
    ----------
    trials
        The algorithm; its time to settle is measured.
    path
        Encoder, motion, corrections and controller; of its box only the counts of a step are used. At the end the
        axis rests, and what is owed is waited for, up to a hundred steps.
    faults
        Of the lines and of a request, as `rtec.machine.open_faults.faults_at` returns them.

    Raises
    ------
    ArgumentError
        Too many edges, a fault of the box, or more corrections than the algorithm's word holds.

    Examples
    --------
    >>> from rtec.injector import Design, InjectorSettings, Timing
    >>> from rtec.verify.contract.built_in import BuiltIn
    >>> from rtec.verify.contract.contract import Contract
    >>> box = InjectorSettings(design=Design.C, timing=Timing())
    >>> trials = Trials(BuiltIn(box), Contract.of(Design.C))
    >>> trials.measure_settling()
    >>> played = play_path(trials, OpenPath(injector=box, frequency_hz=100e3, cycles=100, corrections=4))
    >>> played.encoder_counts, played.controller_counts, played.good
    (400, 408, True)
    """
    if 4 * path.cycles > MOST_EDGES:
        raise ArgumentError("--cycles", path.cycles, f"at most {MOST_EDGES // 4} with an algorithm")
    most = reach_of(trials.algorithm).total
    if abs(path.corrections) > most:
        raise ArgumentError("--corrections", path.corrections, f"at most {most}, the word of the algorithm")
    motion = path.motion or motion_of(
        MotionKind.STEADY, counts=4 * path.cycles, frequency_hz=path.frequency_hz, corrections=abs(path.corrections),
        direction=path.direction,
    )  # fmt: skip
    encoder = replace(path.encoder, count_mm=COUNT_MM)
    stream = stream_of(motion, encoder.home_state, -1 if path.corrections < 0 else 1, encoder=encoder)
    end_ps = max(stream.until_ps, stream.last_ps + 1)
    stream = replace(stream, until_ps=end_ps + (min(abs(path.corrections), _WAITED_STEPS) + 1) * trials.settle_ps)
    right, effects = stream.stimulus(), [FaultEffect(fault=fault) for fault in faults]
    wrong = _behind(right, effects, path)
    begun = time.perf_counter()
    responses = trials.algorithm.play([wrong, right] if faults else [right])
    wall_s = time.perf_counter() - begun
    played = [
        PlayedPath(
            algorithm=trials.algorithm.name, path=path, stream=stream, stimulus=stimulus, response=response,
            received=_received(path, response, stimulus.until_ps), wall_s=wall_s,
        )
        for stimulus, response in zip((wrong, right), responses, strict=False)
    ]  # fmt: skip
    if not faults:
        return played[0]
    whole, twin = played
    added = whole.completed * whole.step_counts
    outcome = FaultOutcome(
        effects=tuple(effects), noticed=whole.watched().noticed(twin.watched()), good_without=twin.good,
        sound_without=twin.audit and twin.received.illegal_transitions == 0,
        off_counts=whole.received.count - path.receiver.counted(whole.encoder_counts + added, stream.state),
    )  # fmt: skip
    return replace(whole, outcome=outcome)


def _received(path: OpenPath, response: Response, until_ps: int) -> ReceiverResult:
    receiver = Receiver(path.receiver, initial=response.edges.initial)
    receiver.process(response.edges)
    return receiver.result(at_ps=until_ps + settle_ps(path))


def _behind(stimulus: Stimulus, effects: Sequence[FaultEffect], path: OpenPath) -> Stimulus:
    """Return a stimulus behind faults of lines and requests; their effects are noted."""
    edges, asks = stimulus.edges, (stimulus.requests.times_ps, stimulus.requests.totals)
    for effect in effects:
        fault = effect.fault
        if fault.kind.code == REQUEST:
            asks, wrong_ps = corrupted(asks, fault, path.injector.design.word_limit.bit_length())
            effect.add((wrong_ps, int(wrong_ps is not None)))
        else:
            check_beside_box(fault.kind)
            wrong = line_fault(fault, stimulus.edges.initial).through(edges, 0, NEVER)
            effect.add(differences(edges, wrong))
            edges = wrong
    until_ps = max(stimulus.until_ps, int(edges.times_ps.max(initial=0)) + 1)
    return Stimulus(edges=edges, requests=Totals(*asks), until_ps=until_ps)
