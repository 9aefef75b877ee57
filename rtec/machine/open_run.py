"""The open signal path, run: edge by edge or many at once, with observers."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np

from rtec._jit import Record, new_record
from rtec.axis._kernels import PIECE
from rtec.axis.encoder import crosses_evenly
from rtec.axis.motion import COUNT_MM, Motion
from rtec.board import Board
from rtec.controller._kernels import reset as reset_receiver
from rtec.controller.receiver import result_of
from rtec.injector.box import insertions_of
from rtec.machine import _ahead_kernels, _open_kernels
from rtec.machine._open_kernels import ASKED, PIECE_AT
from rtec.machine.open_path import OpenPath, OpenPathResult
from rtec.machine.tape import NO_SINK, TraceRecorder, TraceSink, WaveFile
from rtec.signal._kernels import NEVER
from rtec.units import PS_PER_S

_CHUNK_EDGES = 2_000_000


def simulate(
    path: OpenPath,
    *,
    vcd: Path | None = None,
    seen: TraceSink | None = None,
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
        An observer of the box, such as a `rtec.injector.insertion_capture.InsertionCapture` for a picture.
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
    box = box_of(state, board)
    initial = path.encoder.level_at_home, int(state.receiver.raw)
    with ExitStack() as stack:
        file = None if vcd is None else stack.enter_context(WaveFile(path, vcd, initial))
        sinks = [sink for sink in (file, seen) if sink is not None]
        tape = TraceRecorder(sinks, initial) if sinks else None
        arrays = None if tape is None else tape.arrays
        moves.run(state, 0, box, arrays)  # machine code is loaded before the clock starts
        wall_s = _run(state, moves, box, tape, progress)
        end_ps = moves.finish(state, settle_ps(path), box, None if tape is None else tape.arrays)
        if tape is not None:
            tape.flush(state.injector)
        if file is not None:
            file.finish(int(end_ps))
    return result_of_path(path, state, board, end_ps, wall_s)


def settle_ps(path: OpenPath) -> int:
    """Return how long a level takes into the count: more than four clocks of the filter beyond its delay."""
    return path.receiver.delay_ps + -(-5 * PS_PER_S // path.receiver.clock_hz)


def box_of(state: Record, board: Board | None) -> Any:
    """Return the box with its firmware as the kernel wants it, its lines where the controller begins to count."""
    if board is None:
        return None
    reset_receiver(state.receiver, board.state.ab_out)
    return board.state, board.cpu.loop, *board.cpu.arrays, np.zeros((0, 3), np.int64)


def move(state: Record, edges: int, box: Any, tape: Any) -> int:
    """Move over lines at constant speed; return how many are left where the tape is full."""
    if box is None and tape is None and crosses_evenly(state.encoder):
        _ahead_kernels.run_ahead(state, edges)
        return 0
    return int(_open_kernels.run(state, None, edges, box, _tape_beside(box, tape)))


def stop(state: Record, settle_ps: int, box: Any, tape: Any, motion: Any = None, total_ps: int = 0) -> int:
    """Stop after a constant speed, or at the end of a motion; return the time at which all is settled."""
    tape = _tape_beside(box, tape)
    if state.encoder.glitch_next_ps < NEVER:  # else their part of the path need not be compiled
        _open_kernels.end_glitches(state, motion, box, tape)
    return int(_open_kernels.finish(state, motion, total_ps, settle_ps, box, tape))


def _tape_beside(box: Any, tape: Any) -> Any:
    """Return the tape: beside a processor in any case, so that it is compiled into the path once."""
    return tape if box is None else tape or NO_SINK


class MotionRun:
    """A motion that is carried out some edges at a time."""

    def __init__(self, motion: Motion) -> None:
        segments = motion.segments
        self.motion = motion
        shape = np.stack([segments.x0_mm, segments.v0_mm_s, segments.a0_mm_s2]) / COUNT_MM
        self._at = np.zeros(2, np.int64)
        times = segments.start_ps, segments.duration_ps
        self._parts = new_record(PIECE), *times, shape, motion.requests_ps, self._at

    @property
    def requests_left(self) -> int:
        """Return how many requests are still to be made."""
        return int(self.motion.requests_ps.size - self._at[ASKED])

    def skip_requests(self) -> None:
        """Make none of the requests: somebody else does."""
        self._at[ASKED] = self.motion.requests_ps.size

    def run(self, state: Record, edges: int, box: Any, tape: Any) -> float:
        """Pass at most so many edges; return the share of the time that is over, 1 at the end."""
        segments = self.motion.segments
        _open_kernels.run(state, self._parts, edges, box, tape or NO_SINK)
        over = self._at[PIECE_AT] == segments.start_ps.size
        return 1.0 if over else min(max(int(state.encoder.last_ps), 0) / segments.total_ps, 0.999)

    def finish(self, state: Record, settle_ps: int, box: Any, tape: Any) -> int:
        """Let the box insert the pending steps at rest; return when all is settled."""
        return stop(state, settle_ps, box, tape or NO_SINK, self._parts, self.motion.total_ps)


class _Steady:
    """A motion at constant speed on its way through the open path."""

    requests_left = 0
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
    tape: TraceRecorder | None,
    progress: Callable[[float], None] | None,
) -> float:
    """Run all edges chunk by chunk; return the wall-clock seconds."""
    begun = time.perf_counter()
    done = 0.0
    while done < 1.0:
        done = moves.run(state, _CHUNK_EDGES, box, None if tape is None else tape.arrays)
        if tape is not None:
            tape.flush(state.injector, moves.requests_left)
        if progress is not None:
            progress(done)
    return time.perf_counter() - begun


def result_of_path(path: OpenPath, state: Record, board: Board | None, end_ps: int, wall_s: float) -> OpenPathResult:
    """Return what came out, by the records of encoder, box and controller at the end."""
    insertions = insertions_of(state.injector, None if board is None else board.state)
    received = result_of(state.receiver)
    encoder_counts = int(state.encoder.count)
    added = insertions.completed * path.injector.design.step_counts
    # the count before it wraps: modulo a narrow counter's width, a loss of whole turns would go unseen
    off = received.count - path.receiver.counted(encoder_counts + added, path.encoder.home_state)
    return OpenPathResult(
        path=path,
        edges=int(state.encoder.serial),
        encoder_counts=encoder_counts,
        controller_counts=path.receiver.wrapped(received.count),
        insertions=insertions,
        received=received,
        glitches=int(state.encoder.glitches),
        audit=off == 0 and insertions.ahead_counts == added,
        simulated_s=end_ps / PS_PER_S,
        wall_s=wall_s,
    )
