"""Motions to try an insertion in: steady, ramp, reversal, dither, a programme, a seeded adversary.

A motion is a plan of the axis and the moments at which corrections are asked for. `reversal` and ``adversary`` aim
crossings of a line into the insertions; the others spread the requests evenly.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rtec.axis._aimed import GOLDEN, LEAST_TRAVEL, Make, Place, Window, adversary, depth_of, reversal
from rtec.axis._laid_out import laid_out, moves, planned
from rtec.axis.profile import Limits, MotionSegments, plan
from rtec.axis.program import Dwell, Move, Program
from rtec.checks import number_within, whole_within
from rtec.errors import ArgumentError, meant
from rtec.units import LONGEST_RUN_PS, PS_PER_S

COUNT_MM = 1.0
"""Motions are planned for an encoder with counts of 1 mm: their millimetres are counts."""
ACCELERATION_HZ_S = 1e8
"""Of the encoder's frequency where nothing else is said: 100 MHz/s, ten times gravity at a signal period of 1 um."""
MOST_CORRECTIONS = 100_000
"""Corrections that a motion can ask for."""
_MOST_MOVES = 1_000_000
_MOST_SWING = 0.45
"""Counts to either side of a line."""
_MOST_COUNTS = 1 << 40

_IntArray = NDArray[np.int64]


class MotionKind(enum.Enum):
    """How the axis moves while corrections are asked for."""

    STEADY = "steady"
    """At constant speed."""
    RAMP = "ramp"
    """From rest to the top speed and to rest again."""
    REVERSAL = "reversal"
    """Turns, aimed so that edges fall into every phase of an insertion."""
    DITHER = "dither"
    """To and fro over one line, then the next, from the shortest swing to nearly a count."""
    ADVERSARY = "adversary"
    """Creeping edges, edges over and back, turns and starts, drawn at random and aimed into insertions."""
    PROGRAMME = "programme"
    """A G-code programme, its fastest feed at the top speed."""
    CAPTURE = "capture"
    """The edges of a captured stream, each at its measured time."""


NAMES = tuple(kind.value for kind in MotionKind if kind not in (MotionKind.PROGRAMME, MotionKind.CAPTURE))
PROGRAMME_ENDINGS = (".nc", ".ngc", ".gcode", ".tap", ".txt")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Motion:
    """A motion with its requests."""

    kind: MotionKind
    """What it is."""
    segments: MotionSegments
    """Pieces of constant acceleration, for an encoder with counts of `COUNT_MM`."""
    requests_ps: _IntArray
    """When one step more is asked for, ascending; int64 (n,)."""
    acceleration_hz_s: float
    """Of the encoder's frequency, at most."""

    def __post_init__(self) -> None:
        if self.total_ps > LONGEST_RUN_PS:
            raise ArgumentError("cycles", f"{self.total_ps / PS_PER_S / 86400:.3g} days", "50 days at this frequency")

    @property
    def top_hz(self) -> float:
        """Return the highest frequency of the encoder's square waves that it reaches."""
        return float(np.abs(self.segments.v0_mm_s).max(initial=0.0)) / (4.0 * COUNT_MM)

    @property
    def total_ps(self) -> int:
        """Return when it ends, or when the last step is asked for."""
        return max(self.segments.total_ps, int(self.requests_ps.max(initial=0)))


def motion_named(text: str) -> MotionKind | Path:
    """Return the kind of motion of a name, or the file of a programme.

    Raises
    ------
    ArgumentError
        Neither.

    Examples
    --------
    >>> motion_named("dither"), motion_named("part.nc").name
    (<MotionKind.DITHER: 'dither'>, 'part.nc')
    >>> motion_named("revresal")
    Traceback (most recent call last):
    rtec.errors.ArgumentError: --motion: 'revresal' is not a motion; use steady, ramp, reversal, dither, \
adversary, or a G-code file (.nc, .ngc, .gcode, .tap, .txt); did you mean 'reversal'?
    """
    word = text.strip().lower()
    if word in NAMES:
        return MotionKind(word)
    if word.endswith(PROGRAMME_ENDINGS):
        return Path(text)
    allowed = f"{', '.join(NAMES)}, or a G-code file ({', '.join(PROGRAMME_ENDINGS)})"
    hint = meant(word[:60], NAMES)
    raise ArgumentError("--motion", repr(text[:60]), allowed, hint, problem="is not a motion")


def motion_of(
    kind: MotionKind,
    *,
    counts: int,
    frequency_hz: float,
    corrections: int,
    acceleration_hz_s: float = ACCELERATION_HZ_S,
    direction: int = 1,
    window: Window | None = None,
    seed: int = 0,
    first: int = 0,
) -> Motion:
    """Plan a motion.

    Parameters
    ----------
    kind
        All but a programme.
    counts
        Travel there and back, all in all; at most that where crossings are aimed.
    frequency_hz
        The top speed, as the frequency of the encoder's square waves.
    corrections
        Steps asked for, one at a time. Where crossings are aimed each has an attack of its own.
    acceleration_hz_s
        Of that frequency, at most.
    direction
        +1 or -1.
    window
        An insertion of the box at rest; for ``REVERSAL`` and ``ADVERSARY``.
    seed
        Of the adversary.
    first
        Number of the first attack: each depends on nothing but its number (and the seed); of a dither, its phase.

    Returns
    -------
    Motion
        From rest at count 0 to rest (``STEADY`` is at speed from the beginning to the end).

    Raises
    ------
    ArgumentError
        A value outside its range, or too little travel for what is asked for.

    Examples
    --------
    Acceleration takes its way: a thousand cycles are too short for 500 kHz.

    >>> ramp = motion_of(MotionKind.RAMP, counts=4_000, frequency_hz=500e3, corrections=2)
    >>> round(ramp.top_hz), ramp.segments.end_mm, ramp.requests_ps.tolist()
    (316228, 4000.0, [1581138830, 4743416490])
    """
    counts = whole_within("cycles", counts, 1, _MOST_COUNTS)
    number_within("frequency_hz", frequency_hz, 1e-3, 1e8, unit="Hz")
    number_within("acceleration_hz_s", acceleration_hz_s, 1e-3, 1e12, unit="Hz/s")
    whole_within("corrections", corrections, 0, MOST_CORRECTIONS, unit="steps")
    speed, gain = 4.0 * frequency_hz, 4.0 * acceleration_hz_s
    sign = 1 if direction > 0 else -1
    if kind is MotionKind.STEADY:
        segments = _steady(sign * speed, counts)
        requests_ps = _evenly(segments.total_ps, corrections)
    elif kind is MotionKind.RAMP:
        segments = planned(*moves([sign * counts], [speed]), gain)
        requests_ps = _evenly(segments.total_ps, corrections)
    elif kind is MotionKind.DITHER:
        segments, requests_ps = _dither(counts, speed, gain, sign, range(first, first + corrections))
    elif kind in _ATTACKS:
        if window is None:
            raise ArgumentError("window", None, "an insertion of the box at rest", "what are crossings aimed at?")
        travel = counts // max(corrections, 1)
        if travel < LEAST_TRAVEL:
            needed = -(-LEAST_TRAVEL * corrections // 4)
            raise ArgumentError("cycles", f"{counts / 4:g}", f"at least {needed}: two cycles for each correction")
        place = Place(window=window, speed=speed, acceleration=gain, travel=travel, sign=sign, seed=seed)
        segments, requests_ps = laid_out(_ATTACKS[kind], place, range(first, first + corrections))
    else:
        raise ArgumentError("motion", kind.value, "a motion without a file", "see programme_motion")
    return Motion(kind=kind, segments=segments, requests_ps=requests_ps, acceleration_hz_s=acceleration_hz_s)


def programme_motion(
    program: Program, *, frequency_hz: float, corrections: int, acceleration_hz_s: float = ACCELERATION_HZ_S
) -> Motion:
    """Plan the motion of a programme, its scale such that the fastest feed gives a frequency.

    Parameters
    ----------
    program
        Moves and dwells; rapids run at the fastest feed.
    frequency_hz, corrections, acceleration_hz_s
        As of `motion_of`.

    Raises
    ------
    ArgumentError
        No feed move, or a value outside its range.

    Examples
    --------
    >>> program = Program(blocks=(Move(target_mm=10.0, feed_mm_s=20.0), Move(target_mm=0.0, feed_mm_s=5.0)))
    >>> motion = programme_motion(program, frequency_hz=100e3, corrections=4)
    >>> round(motion.top_hz), round(motion.segments.x0_mm.max())
    (100000, 200000)
    """
    number_within("frequency_hz", frequency_hz, 1e-3, 1e8, unit="Hz")
    number_within("acceleration_hz_s", acceleration_hz_s, 1e-3, 1e12, unit="Hz/s")
    whole_within("corrections", corrections, 0, MOST_CORRECTIONS, unit="steps")
    fastest = _fastest(program)
    per_mm = 4.0 * frequency_hz / fastest
    gain = 4.0 * acceleration_hz_s / per_mm
    limits = Limits(max_speed_mm_s=fastest, max_acceleration_mm_s2=gain, rapid_mm_s=fastest)
    moved = plan(program, limits)
    segments = MotionSegments(
        start_ps=moved.start_ps, duration_ps=moved.duration_ps, x0_mm=moved.x0_mm * per_mm,
        v0_mm_s=moved.v0_mm_s * per_mm, a0_mm_s2=moved.a0_mm_s2 * per_mm, j0_mm_s3=moved.j0_mm_s3 * per_mm,
        block=moved.block, block_end_ps=moved.block_end_ps, end_mm=moved.end_mm * per_mm,
    )  # fmt: skip
    requests_ps = _evenly(segments.total_ps, corrections)
    return Motion(
        kind=MotionKind.PROGRAMME, segments=segments, requests_ps=requests_ps, acceleration_hz_s=acceleration_hz_s
    )


def programme_counts(program: Program, frequency_hz: float) -> float:
    """Return the counts that a programme travels, there and back, with its fastest feed at a frequency.

    Examples
    --------
    >>> program = Program(blocks=(Move(target_mm=10.0, feed_mm_s=20.0), Move(target_mm=0.0, feed_mm_s=5.0)))
    >>> programme_counts(program, 100e3)
    400000.0
    """
    at, way_mm = program.start_mm, 0.0
    for block in program.blocks:
        if not isinstance(block, Dwell):
            at, way_mm = block.target_mm, way_mm + abs(block.target_mm - at)
    return way_mm * 4.0 * frequency_hz / _fastest(program)


def captured_motion(edges_ps: _IntArray, moves: _IntArray, end_ps: int, corrections: int) -> Motion:
    """Return the motion that sends given edges at exactly their times.

    Parameters
    ----------
    edges_ps
        Times, strictly increasing from 1 on, int64 ps of shape (n,), n at least 1.
    moves
        Counts of the edges, +1 or -1, int64 of shape (n,).
    end_ps
        When the axis has come to rest, after the last edge.
    corrections
        Steps asked for, evenly in time.

    Notes
    -----
    A piece begins on each line at the time of its edge, so that no crossing has to be solved for. Towards the next
    line it moves at the mean speed and falls short of it by a millionth of a count; before a turn, where nothing is
    known of the speed, by a thousandth of a count.

    Examples
    --------
    >>> motion = captured_motion(np.array([1_000_000, 1_500_000]), np.array([1, 1]), 2_000_000, 1)
    >>> round(motion.top_hz), motion.requests_ps.tolist()
    (500000, [1000000])
    """
    whole_within("corrections", corrections, 0, MOST_CORRECTIONS, unit="steps")
    starts_ps = np.concatenate([[0], edges_ps]).astype(np.int64)
    lasts_ps = np.diff(np.append(starts_ps, end_ps))
    # line k lies half a count below count k
    lines = np.cumsum(moves) - np.where(moves > 0, 0.5, -0.5)
    way = moves * np.where(np.append(moves[1:] == moves[:-1], False), 1.0 - 1e-6, 1e-3)
    none = np.zeros(starts_ps.size)
    at, speed = np.append(0.0, lines), np.append(0.0, way / (lasts_ps[1:] / PS_PER_S))
    segments = MotionSegments(
        start_ps=starts_ps, duration_ps=lasts_ps, x0_mm=at, v0_mm_s=speed, a0_mm_s2=none, j0_mm_s3=none,
        block=np.zeros(starts_ps.size, np.int64), block_end_ps=np.array([end_ps], np.int64),
        end_mm=float(moves.sum()),
    )  # fmt: skip
    requests_ps = np.maximum(_evenly(end_ps, corrections), 1)
    return Motion(kind=MotionKind.CAPTURE, segments=segments, requests_ps=requests_ps, acceleration_hz_s=0.0)


def _fastest(program: Program) -> float:
    fastest = max((block.feed_mm_s for block in program.blocks if isinstance(block, Move)), default=0.0)
    if fastest == 0.0:
        raise ArgumentError("programme", "no feed move", "moves with a feed, such as G53Z1.0F50.")
    return fastest


_ATTACKS: dict[MotionKind, Make] = {MotionKind.REVERSAL: reversal, MotionKind.ADVERSARY: adversary}


def _steady(speed: float, counts: int) -> MotionSegments:
    length_ps = np.array([max(round(counts / abs(speed) * PS_PER_S), 1)], np.int64)
    none, real = np.zeros(1, np.int64), np.zeros(1)
    return MotionSegments(
        start_ps=none, duration_ps=length_ps, x0_mm=real, v0_mm_s=np.array([speed]), a0_mm_s2=real, j0_mm_s3=real,
        block=none, block_end_ps=length_ps, end_mm=speed * int(length_ps[0]) / PS_PER_S,
    )  # fmt: skip


def _evenly(total_ps: int, number: int) -> _IntArray:
    return np.array([(2 * k + 1) * total_ps // (2 * number) for k in range(number)], np.int64)


def _dither(counts: int, speed: float, gain: float, sign: int, numbers: range) -> tuple[MotionSegments, _IntArray]:
    """Swing over a line, each swing of another size; a quarter of the swings at each of four lines."""
    if counts > _MOST_MOVES:
        raise ArgumentError("cycles", f"{counts / 4:g}", f"at most {_MOST_MOVES // 4} that dither")
    swing = np.arange(counts)
    # from the depth at which the line is crossed twice within the shortest time, to nearly half a count
    least = np.log(depth_of(0.0, gain))
    depth = np.exp(least + ((numbers.start + swing) * GOLDEN % 1.0) * (np.log(_MOST_SWING) - least))
    side = np.where(swing % 2 == 0, 1.0, -1.0)
    target = sign * (0.5 + 4 * swing // counts + side * depth)
    segments = planned(*moves(target.tolist(), [speed] * counts), gain)
    attacks = len(numbers)
    at = np.array([(2 * k + 1) * counts // (2 * attacks) for k in range(attacks)], np.int64)
    ends = np.concatenate([[0], segments.block_end_ps])
    share = (0.5 + np.array(numbers) * GOLDEN) % 1.0
    requests_ps = ends[at] + np.rint(share * (ends[at + 1] - ends[at])).astype(np.int64)
    return segments, np.maximum(requests_ps, 1)
