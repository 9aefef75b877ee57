"""The open signal path set in motion, its crossings aimed at the insertions that its box makes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rtec.axis import Encoder, Program, Window
from rtec.axis.encoder import PERFECT
from rtec.axis.motion import (
    ACCELERATION_HZ_S,
    Motion,
    MotionKind,
    captured_motion,
    motion_of,
    programme_motion,
)
from rtec.axis.profile import plan_moves
from rtec.board import Microcontroller
from rtec.board.board import START_UP_READINGS, reading_ps
from rtec.controller import ReceiverSettings
from rtec.errors import ArgumentError
from rtec.injector import InjectorSettings
from rtec.injector._wave_kernels import COLUMNS, LEVEL_IN, LEVEL_OUT, TIME
from rtec.machine.open_path import OpenPath
from rtec.machine.open_run import MotionRun, box_of
from rtec.signal import states_of_levels
from rtec.signal.captures import Capture

_TAPE_ROWS = 4096
_FREQUENCIES_HZ = 1e-3, 1e8
"""That an open path takes."""
_AIMED = (MotionKind.REVERSAL, MotionKind.ADVERSARY)


def insertion_at_rest(path: OpenPath) -> Window:
    """Measure when the box of a path changes the lines after a request at rest.

    Parameters
    ----------
    path
        Design, timing or program, and the sign of its corrections; the encoder's imperfections are left out.

    Raises
    ------
    ArgumentError
        A box that inserts nothing at rest.

    Examples
    --------
    Design C on fast logic decides for 125 ns, and needs as long again for its second change:

    >>> from rtec.injector import Design, InjectorSettings, Processor, Timing
    >>> from rtec.machine import OpenPath
    >>> box = InjectorSettings(design=Design.C, timing=Timing.of(Design.C, Processor.FAST))
    >>> window = insertion_at_rest(OpenPath(injector=box, frequency_hz=500e3, cycles=100))
    >>> window.begin_ps, window.end_ps
    (125000, 250000)
    """
    if path.microcontroller is None:
        every_ps = max(path.injector.timing.poll_ps, 1)
        pause_ps = 2 * path.injector.timing.rest_ps
    else:
        every_ps = reading_ps(path.microcontroller)
        pause_ps = START_UP_READINGS * every_ps
    asked_ps = -(-pause_ps // every_ps) * every_ps
    sign = -1 if path.corrections < 0 else 1
    # the state 00, in which every design inserts
    still = replace(
        path,
        corrections=sign,
        motion=_at_rest(asked_ps),
        encoder=replace(path.encoder, home_state=0, imperfections=PERFECT),
    )
    state, board = still.state(), still.board()
    box = box_of(state, board)
    rows, used = np.zeros((_TAPE_ROWS, COLUMNS), np.int64), np.ones(1, np.int64)
    rows[0, LEVEL_IN], rows[0, LEVEL_OUT] = still.encoder.level_at_home, int(state.receiver.raw)
    run = MotionRun(_at_rest(asked_ps))
    run.run(state, 1, box, (rows, used))
    run.finish(state, 1, box, (rows, used))
    seen = rows[: int(used[0])]
    changes = seen[1:, TIME][np.diff(seen[:, LEVEL_OUT]) != 0] - asked_ps
    if state.injector.completed != sign or not changes.size:
        raise ArgumentError("--motion", "aimed", "a box that inserts at rest", "this one has not made a step at rest")
    return Window(begin_ps=max(int(changes[0]), 0), end_ps=int(changes[-1]), pause_ps=pause_ps, every_ps=every_ps)


def _at_rest(asked_ps: int) -> Motion:
    """Return a rest with one request at its end."""
    none = np.zeros(1)
    segments = plan_moves(none, none, np.ones(1), np.array([asked_ps], np.int64), 1.0)
    return Motion(
        kind=MotionKind.STEADY, segments=segments, requests_ps=np.array([asked_ps], np.int64), acceleration_hz_s=1.0
    )


def with_motion(
    path: OpenPath,
    kind: MotionKind,
    *,
    program: Program | None = None,
    acceleration_hz_s: float = ACCELERATION_HZ_S,
    seed: int = 0,
    window: Window | None = None,
) -> OpenPath:
    """Return a path that moves in another way than steadily.

    Parameters
    ----------
    path
        Its frequency is the top speed, its cycles are the travel there and back (a programme has its own), its
        corrections are asked for one at a time.
    kind
        How it moves; steady is as it is.
    program
        Of a programme.
    acceleration_hz_s
        Of the encoder's frequency, at most.
    seed
        Of an adversary.
    window
        An insertion at rest that crossings are aimed at; without it that of the path's box.

    Raises
    ------
    ArgumentError
        A value outside its range, too little travel for the corrections, a box that inserts nothing at rest.

    Examples
    --------
    >>> from rtec.injector import Design, InjectorSettings, Processor, RealEdges, Timing
    >>> from rtec.machine import OpenPath, simulate
    >>> box = InjectorSettings(design=Design.C, timing=Timing.of(Design.C, Processor.FAST), real_edges=RealEdges.HOLD)
    >>> path = OpenPath(injector=box, frequency_hz=500e3, cycles=200, corrections=100)
    >>> result = simulate(with_motion(path, MotionKind.REVERSAL))
    >>> result.good, result.insertions.completed
    (True, 100)
    """
    if kind is MotionKind.STEADY:
        return path
    corrections = abs(path.corrections)
    if kind is MotionKind.PROGRAMME:
        if program is None:
            raise ArgumentError("program", None, "the programme to run")
        motion = programme_motion(
            program, frequency_hz=path.frequency_hz, corrections=corrections, acceleration_hz_s=acceleration_hz_s
        )
    else:
        motion = motion_of(
            kind,
            counts=4 * path.cycles,
            frequency_hz=path.frequency_hz,
            corrections=corrections,
            acceleration_hz_s=acceleration_hz_s,
            direction=path.direction,
            window=(window or insertion_at_rest(path)) if kind in _AIMED else None,
            seed=seed,
        )
    return replace(path, motion=motion)


def on_capture(
    capture: Capture,
    *,
    injector: InjectorSettings,
    corrections: int = 0,
    receiver: ReceiverSettings | None = None,
    microcontroller: Microcontroller | None = None,
) -> OpenPath:
    """Return a path whose encoder sends captured edges at their measured times.

    Parameters
    ----------
    capture
        The edges; after its end the axis rests.
    injector, corrections, receiver, microcontroller
        As of `OpenPath`; corrections are asked for evenly in time.

    Raises
    ------
    ArgumentError
        More corrections than a motion can ask for.
    FileFormatError
        Both lines change at once somewhere.

    Examples
    --------
    >>> from pathlib import Path
    >>> from rtec.injector import Design, InjectorSettings, Processor, Timing
    >>> from rtec.machine import simulate
    >>> from rtec.signal import EdgeStream
    >>> edges = EdgeStream([2_000_000, 4_000_000, 9_000_000], [1, 3, 1], initial=0)
    >>> capture = Capture(path=Path("scope.csv"), edges=edges, end_ps=12_000_000)
    >>> box = InjectorSettings(design=Design.C, timing=Timing.of(Design.C, Processor.FAST))
    >>> result = simulate(on_capture(capture, injector=box, corrections=2))
    >>> result.encoder_counts, result.controller_counts, result.good
    (1, 5, True)
    """
    moves = capture.moves
    motion = captured_motion(capture.edges.times_ps, moves, capture.end_ps, abs(corrections))
    return OpenPath(
        injector=injector,
        encoder=Encoder(home_state=int(states_of_levels([capture.edges.initial])[0])),
        receiver=receiver or ReceiverSettings(),
        frequency_hz=float(np.clip(motion.top_hz, *_FREQUENCIES_HZ)),
        cycles=-(-moves.size // 4),
        corrections=corrections,
        direction=-1 if moves.sum() < 0 else 1,
        microcontroller=microcontroller,
        motion=motion,
    )
