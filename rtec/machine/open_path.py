"""The open signal path: an encoder at constant speed or in a motion, the box, and the controller's input."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from rtec._jit import Record, new_record
from rtec.axis import Encoder
from rtec.axis.encoder import crosses_evenly
from rtec.axis.motion import Motion
from rtec.board import Board, Microcontroller
from rtec.board.board import START_UP_READINGS, reading_ps
from rtec.checks import number_within, whole_within
from rtec.controller import ReceiverResult, ReceiverSettings
from rtec.controller.receiver import result_of
from rtec.errors import ArgumentError
from rtec.injector import InjectorSettings, Insertions, RealEdges
from rtec.injector.box import insertions_of
from rtec.machine import _ahead_kernels, _open_kernels
from rtec.machine.motion_run import MotionRun
from rtec.machine.tape import NOBODY, Tape, Viewer, WaveFile
from rtec.signal._kernels import NEVER
from rtec.units import LONGEST_RUN_PS, PS_PER_S

MAX_EDGES = 1 << 40
_CHUNK_EDGES = 2_000_000


@dataclass(frozen=True, slots=True, kw_only=True)
class OpenPath:
    """A run of the open path.

    Parameters
    ----------
    injector
        Design, timing and choices of the box.
    encoder
        The encoder with its imperfections.
    receiver
        The controller's input.
    frequency_hz
        Of the encoder's A (or B) square wave.
    cycles
        Length of the motion in cycles of four counts.
    corrections
        Steps asked for, spread evenly over the motion; negative ones take counts away.
    direction
        +1 or -1.
    microcontroller
        A processor that runs the design's firmware in the box, in place of the behavioural model of it. Design and
        hold latch are those of ``injector``; its times are the firmware's own.
    motion
        In place of a constant speed, with times of its own at which it asks for the corrections
        (`rtec.machine.set_in_motion`).

    Raises
    ------
    ArgumentError
        A value outside its range.

    Examples
    --------
    >>> from rtec.injector import Design, Processor, Timing
    >>> box = InjectorSettings(design=Design.C, timing=Timing.of(Design.C, Processor.FAST))
    >>> path = OpenPath(injector=box, frequency_hz=500e3, cycles=1000, corrections=40)
    >>> result = simulate(path)
    >>> result.encoder_counts, result.controller_counts, result.audit
    (4000, 4080, True)
    """

    injector: InjectorSettings
    frequency_hz: float
    cycles: int
    corrections: int = 0
    direction: int = 1
    encoder: Encoder = field(default_factory=Encoder)
    receiver: ReceiverSettings = field(default_factory=ReceiverSettings)
    microcontroller: Microcontroller | None = None
    motion: Motion | None = None

    def __post_init__(self) -> None:
        """Check the ranges."""
        cycles = whole_within("cycles", self.cycles, 1, MAX_EDGES // 4)
        frequency_hz = number_within("frequency", self.frequency_hz, 1e-3, 1e8, unit="Hz")
        if cycles / frequency_hz * PS_PER_S > LONGEST_RUN_PS:
            most = int(LONGEST_RUN_PS / PS_PER_S * frequency_hz)
            raise ArgumentError("cycles", cycles, f"at most {most}, 50 days at this frequency")
        if self.direction not in (1, -1):
            raise ArgumentError("direction", self.direction, "+1 or -1")
        most, why = 16 * cycles, "(at most 4 an edge)"
        word = self.injector.design.word_limit
        if self.microcontroller is not None and word < most:
            most, why = word, "(the total that the firmware's word holds)"
        whole_within("corrections", self.corrections, -most, most, unit=why)
        if self.motion is not None and self.motion.asks_ps.size != abs(self.corrections):
            raise ArgumentError("corrections", self.corrections, f"those of the motion, {self.motion.asks_ps.size}")

    def state(self) -> Record:
        """Return the kernel's state at the start."""
        state = new_record(_open_kernels.OPEN_PATH)
        self.encoder.fill_steady(state.encoder, self.frequency_hz, 1 if self.direction > 0 else -1)
        self.injector.fill(state.injector)
        self.receiver.fill(state.receiver)
        state.edges = 4 * self.cycles
        state.in_blocks = 1
        state.corrections = abs(self.corrections)
        state.sign = 1 if self.corrections >= 0 else -1
        _open_kernels.start(state, 0)
        return state

    def board(self) -> Board | None:
        """Return the box with its firmware, homed and with its lines through, before time 0."""
        if self.microcontroller is None:
            return None
        board = Board(
            self.injector.design,
            self.microcontroller,
            initial=self.encoder.level_at_home,
            hold_latch=self.injector.real_edges is RealEdges.HOLD,
            start_ps=-2 * START_UP_READINGS * reading_ps(self.microcontroller),
        )
        board.start_up()
        board.idle(until_ps=0)
        board.begin_counting()
        return board


@dataclass(frozen=True, slots=True, kw_only=True)
class OpenPathResult:
    """What came out of a run of the open path."""

    design: str
    frequency_hz: float
    edges: int
    """Real edges of the encoder."""
    encoder_counts: int
    controller_counts: int
    corrections_requested: int
    corrections_inserted: int
    """Net total of steps completed."""
    step_counts: int
    insertions: Insertions
    received: ReceiverResult
    glitches: int
    audit: bool
    """Controller counts less encoder counts equal the completed steps, and so says the monitor at the gates."""
    simulated_s: float
    wall_s: float
    real_edges: str
    """What became of real edges inside insertions: ``hold`` or ``merge``."""
    motion: str
    top_hz: float
    """Highest frequency that the motion has reached."""

    @property
    def pending(self) -> int:
        """Return the steps asked for and not inserted."""
        return self.corrections_requested - self.corrections_inserted

    @property
    def good(self) -> bool:
        """Return whether all was inserted and every count is right."""
        return self.audit and self.pending == 0 and self.received.illegal_transitions == 0

    def to_dict(self) -> dict[str, object]:
        """Return the result under the names that scripts rely on."""
        return {
            "design": self.design,
            "frequency_hz": self.frequency_hz,
            "edges": self.edges,
            "encoder_counts": self.encoder_counts,
            "controller_counts": self.controller_counts,
            "corrections_requested": self.corrections_requested,
            "corrections_inserted": self.corrections_inserted,
            "corrections_pending": self.pending,
            "step_counts": self.step_counts,
            "illegal_transitions": self.received.illegal_transitions,
            "illegal_simultaneous": self.received.simultaneous,
            "illegal_unresolved": self.received.unresolved,
            "first_illegal_ps": [illegal.time_ps for illegal in self.received.first_illegal],
            "min_separation_ps": self.received.min_separation_ps,
            "filtered_pulses": self.received.filtered,
            "servo_fault_ps": self.received.fault_ps,
            "refused_too_fast": self.insertions.refused,
            "real_edges_inside_insertions": self.insertions.real_inside,
            "longest_insertion_ps": self.insertions.longest_ps,
            "monitor_inserted_counts": self.insertions.ahead_counts,
            "monitor_illegal": self.insertions.illegal,
            "glitches": self.glitches,
            "audit": self.audit,
            "simulated_s": self.simulated_s,
            "wall_s": self.wall_s,
            "edges_per_s": self.edges / self.wall_s if self.wall_s > 0 else None,
            "real_edges": self.real_edges,
            "motion": self.motion,
            "top_frequency_hz": self.top_hz,
        }


def simulate(
    path: OpenPath,
    *,
    vcd: Path | None = None,
    seen: Viewer | None = None,
    progress: Callable[[float], None] | None = None,
    in_blocks: bool = True,
) -> OpenPathResult:
    """Run the open path and return what came out.

    Parameters
    ----------
    path
        The run.
    vcd
        Waveform file to write both sides of the box to.
    seen
        Somebody else who looks at what the box does, such as a `rtec.machine.stretch.Stretch` for a picture.
    progress
        Called with the share done, now and then.
    in_blocks
        False sends every edge through the step functions one by one; the result is the same.

    Raises
    ------
    OutputError
        The waveform file could not be written.

    Notes
    -----
    Memory does not grow with the length of the run. At the end the axis stops: an insertion under way is ended, none
    is begun at rest. A motion ends at rest, and there the box makes what it owes.
    """
    state = path.state()
    state.in_blocks = int(in_blocks)
    moves = _Steady(4 * path.cycles) if path.motion is None else MotionRun(path.motion)
    board = path.board()
    box = _box_of(state, board)
    initial = path.encoder.level_at_home, int(state.receiver.raw)
    with ExitStack() as stack:
        file = None if vcd is None else stack.enter_context(WaveFile(path, vcd, initial))
        viewers = [viewer for viewer in (file, seen) if viewer is not None]
        tape = Tape(viewers, initial) if viewers else None
        arrays = None if tape is None else tape.arrays
        moves.run(state, 0, box, arrays)  # machine code is loaded before the clock starts
        wall_s = _run(state, moves, box, tape, progress)
        end_ps = moves.finish(state, _settle_ps(path), box, None if tape is None else tape.arrays)
        if tape is not None:
            tape.spool(state.injector)
        if file is not None:
            file.finish(int(end_ps))
    return _result(path, state, board, end_ps, wall_s)


def _box_of(state: Record, board: Board | None) -> Any:
    """Return the box with its firmware as the kernel wants it, its lines where the controller begins to count."""
    if board is None:
        return None
    _open_kernels.switch_on_controller(state, board.state.ab_out)
    return board.state, board.cpu.loop, *board.cpu.arrays, np.zeros((0, 3), np.int64)


def _settle_ps(path: OpenPath) -> int:
    """Return how long to wait after the last edge: more than four clocks of the filter beyond its delay."""
    return path.receiver.delay_ps + -(-5 * PS_PER_S // path.receiver.clock_hz)


def move(state: Record, edges: int, box: Any, tape: Any) -> int:
    """Move over lines at constant speed; return how many are left where the tape is full."""
    if box is None and tape is None and crosses_evenly(state.encoder):
        _ahead_kernels.run_ahead(state, edges)
        return 0
    return int(_open_kernels.run(state, edges, box, _tape_beside(box, tape)))


def stop(state: Record, settle_ps: int, box: Any, tape: Any) -> int:
    """Stop after a constant speed, beginning no insertion at rest; return the time at which all is settled."""
    if state.encoder.glitch_next_ps < NEVER:  # else their part of the path need not be compiled
        _open_kernels.end_glitches(state, box, _tape_beside(box, tape))
    return int(_open_kernels.finish(state, settle_ps, box, _tape_beside(box, tape)))


def _tape_beside(box: Any, tape: Any) -> Any:
    """Return the tape: beside a processor in any case, so that it is compiled into the path once."""
    return tape if box is None else tape or NOBODY


class _Steady:
    """A motion at constant speed on its way through the open path."""

    asks_left = 0
    """Requests are made with edges, none at rest."""

    def __init__(self, edges: int) -> None:
        self.edges, self.done = edges, 0

    def run(self, state: Record, edges: int, box: Any, tape: Any) -> float:
        part = min(edges, self.edges - self.done)
        self.done += part - move(state, part, box, tape)
        return self.done / self.edges

    def finish(self, state: Record, settle_ps: int, box: Any, tape: Any) -> int:
        return stop(state, settle_ps, box, tape)


def _run(
    state: Record,
    moves: _Steady | MotionRun,
    box: Any,
    tape: Tape | None,
    progress: Callable[[float], None] | None,
) -> float:
    """Run all edges chunk by chunk; return the wall-clock seconds."""
    begun = time.perf_counter()
    done = 0.0
    while done < 1.0:
        done = moves.run(state, _CHUNK_EDGES, box, None if tape is None else tape.arrays)
        if tape is not None:
            tape.spool(state.injector, moves.asks_left)
        if progress is not None:
            progress(done)
    return time.perf_counter() - begun


def _result(path: OpenPath, state: Record, board: Board | None, end_ps: int, wall_s: float) -> OpenPathResult:
    """Collect what the run's state says."""
    insertions = insertions_of(state.injector, None if board is None else board.state)
    received = result_of(state.receiver)
    encoder_counts = int(state.encoder.count)
    step = path.injector.design.step_counts
    added = insertions.completed * step
    # the count before it wraps: modulo a narrow counter's width, a loss of whole turns would go unseen
    off = received.count - path.receiver.counted(encoder_counts + added, path.encoder.home_state)
    return OpenPathResult(
        design=path.injector.design.key,
        frequency_hz=path.frequency_hz,
        edges=int(state.encoder.serial),
        encoder_counts=encoder_counts,
        controller_counts=path.receiver.wrapped(received.count),
        corrections_requested=insertions.requested,
        corrections_inserted=insertions.completed,
        step_counts=step,
        insertions=insertions,
        received=received,
        glitches=int(state.encoder.glitches),
        audit=off == 0 and insertions.ahead_counts == added,
        simulated_s=end_ps / 1e12,
        wall_s=wall_s,
        real_edges=path.injector.real_edges.value,
        motion="steady" if path.motion is None else path.motion.kind.value,
        top_hz=path.frequency_hz if path.motion is None else path.motion.top_hz,
    )
