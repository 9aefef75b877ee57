"""Encoders: a linear scale or a rotary disc with its imperfections, and the edges that a motion makes of it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from rtec._jit import Record, new_record
from rtec.axis import _kernels
from rtec.axis.profile import MotionSegments
from rtec.checks import number_within, whole_within
from rtec.errors import ArgumentError
from rtec.signal import EdgeStream
from rtec.units import PS_PER_S

MIN_LINE_SPACING_COUNTS = 0.05
"""Neighbouring lines may come so close, not closer: beyond, A and B would change places."""
_CHUNK_EDGES = 1 << 18


@dataclass(frozen=True, slots=True, kw_only=True)
class Imperfections:
    """What a real encoder's lines and signals do; all are off by default.

    Parameters
    ----------
    phase_error_deg
        B lags A by 90° plus this, in degrees of one cycle.
    duty_error_a, duty_error_b
        Share of a cycle by which the high part of A or B is longer than one half.
    eccentricity_counts
        Amplitude of the once-per-revolution displacement of a rotary encoder's lines, counts.
    eccentricity_deg
        Its phase at count 0.
    jitter_ps
        Bound of the jitter of each edge in time, triangular between minus and plus this.
    glitch_probability
        Probability that a glitch on one line follows an edge, resolved to 1/65536.
    glitch_ps
        Width of a glitch.

    Raises
    ------
    ArgumentError
        A value outside its range, or errors that would make neighbouring lines change places.

    Examples
    --------
    >>> Imperfections(phase_error_deg=10.0, jitter_ps=5_000).shifts_counts()
    (0.1111111111111111, 0.0, 0.1111111111111111, 0.0)
    """

    phase_error_deg: float = 0.0
    duty_error_a: float = 0.0
    duty_error_b: float = 0.0
    eccentricity_counts: float = 0.0
    eccentricity_deg: float = 0.0
    jitter_ps: int = 0
    glitch_probability: float = 0.0
    glitch_ps: int = 20_000

    def __post_init__(self) -> None:
        number_within("phase_error_deg", self.phase_error_deg, -89.0, 89.0, unit="deg")
        number_within("duty_error_a", self.duty_error_a, -0.45, 0.45)
        number_within("duty_error_b", self.duty_error_b, -0.45, 0.45)
        number_within("eccentricity_counts", self.eccentricity_counts, 0.0, 1e9)
        number_within("eccentricity_deg", self.eccentricity_deg, -360.0, 360.0, unit="deg")
        whole_within("jitter_ps", self.jitter_ps, 0, 1_000_000_000, unit="ps")
        number_within("glitch_probability", self.glitch_probability, 0.0, 0.5)
        whole_within("glitch_ps", self.glitch_ps, 1, PS_PER_S, unit="ps")
        if self.closest_counts < MIN_LINE_SPACING_COUNTS:
            raise ArgumentError(
                "phase_error_deg",
                f"{self.phase_error_deg:g} deg with duties {self.duty_error_a:g} and {self.duty_error_b:g}",
                f"lines at least {MIN_LINE_SPACING_COUNTS} counts apart",
                "make one of them smaller",
                problem="brings lines too close together",
            )

    @property
    def closest_counts(self) -> float:
        """Least distance of neighbouring lines, in counts, eccentricity apart."""
        shifts = self.shifts_counts()
        return min(1.0 + shifts[(kind + 1) % 4] - shifts[kind] for kind in range(4))

    def shifts_counts(self) -> tuple[float, float, float, float]:
        """Return the displacement of the lines at which B falls, A rises, B rises and A falls, in counts."""
        lag = self.phase_error_deg / 90.0
        a, b = 2.0 * self.duty_error_a, 2.0 * self.duty_error_b
        return lag + b, 0.0 - a, lag - b, a


PERFECT = Imperfections()
"""Lines where they belong, edges without jitter."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Encoder:
    """A position encoder with A and B signals, and an index Z where it has one.

    Parameters
    ----------
    count_mm
        Travel of one count (x4), mm.
    counts_per_rev
        Counts of one revolution of a rotary encoder; 0 for a linear scale.
    index_counts
        Counts between index pulses; 0 for none, -1 for one a revolution.
    home_state
        Angle state 0..3 at the home position.
    imperfections
        What its lines and signals do.
    seed
        Of jitter and glitches.

    Raises
    ------
    ArgumentError
        A value outside its range.

    Notes
    -----
    Count k covers the positions from k - 1/2 to k + 1/2 counts.

    Examples
    --------
    >>> Encoder(count_mm=0.001).level_at_home
    0
    """

    count_mm: float = 0.001
    counts_per_rev: int = 0
    index_counts: int = 0
    home_state: int = 0
    imperfections: Imperfections = PERFECT
    seed: int = 0

    def __post_init__(self) -> None:
        number_within("count_mm", self.count_mm, 1e-9, 1e3, unit="mm")
        whole_within("counts_per_rev", self.counts_per_rev, 0, 1 << 32)
        whole_within("index_counts", self.index_counts, -1, 1 << 40)
        whole_within("home_state", self.home_state, 0, 3)
        whole_within("seed", self.seed, 0, (1 << 62) - 1)
        if self.index_counts < 0 and not self.counts_per_rev:
            raise ArgumentError(
                "index_counts", self.index_counts, "0 or more for a linear scale", "set counts_per_rev"
            )
        eccentric = self.imperfections.eccentricity_counts
        if eccentric and not self.counts_per_rev:
            raise ArgumentError("eccentricity_counts", eccentric, "0 for a linear scale", "set counts_per_rev")
        if self.counts_per_rev:
            if self.counts_per_rev % 4:
                raise ArgumentError("counts_per_rev", self.counts_per_rev, "a multiple of four: whole cycles")
            room = self.imperfections.closest_counts - MIN_LINE_SPACING_COUNTS
            largest = room * self.counts_per_rev / (2.0 * math.pi)
            number_within("eccentricity_counts", eccentric, 0.0, largest)

    @property
    def level_at_home(self) -> int:
        """Return the level code at count 0."""
        return self.home_state ^ (self.home_state >> 1)

    def fill(self, state: Record) -> None:
        """Write the parameters into a kernel's state."""
        flaws = self.imperfections
        state.home = self.home_state
        for kind, shift in enumerate(flaws.shifts_counts()):
            state.shift[kind] = shift
        state.counts_per_rev = self.counts_per_rev
        state.eccentric_counts = flaws.eccentricity_counts
        state.eccentric_rad = math.radians(flaws.eccentricity_deg)
        state.index_every = self.counts_per_rev if self.index_counts < 0 else self.index_counts
        state.jitter_ps = flaws.jitter_ps
        state.glitch_level = round(flaws.glitch_probability * 65536)
        state.glitch_ps = flaws.glitch_ps
        state.seed = self.seed

    def fill_steady(self, state: Record, frequency_hz: float, sign: int) -> None:
        """Write the parameters of a motion at constant speed, ``frequency_hz`` being that of the A square wave.

        Raises
        ------
        ArgumentError
            A frequency outside 1 mHz to 100 MHz, or jitter that would make neighbouring edges change places.
        """
        number_within("frequency_hz", frequency_hz, 1e-3, 1e8, unit="Hz")
        self.fill(state)
        # a float64 is a ratio of whole numbers, so the quarter of its period is one, too, and nothing drifts
        num, den = (4.0 * frequency_hz).as_integer_ratio()
        period_num, period_den = PS_PER_S * den, num
        shared = math.gcd(period_num, period_den)
        period_num, period_den = period_num // shared, period_den // shared
        while period_den >= 1 << 60:
            period_num, period_den = period_num >> 1, period_den >> 1
        state.quarter_whole_ps, state.quarter_left = divmod(period_num, period_den)
        state.quarter_den = period_den
        quarter_ps = period_num / period_den
        state.quarter_ps = quarter_ps
        for kind, shift in enumerate(self.imperfections.shifts_counts()):
            state.shift_ps[kind] = round(sign * shift * quarter_ps)
        state.step_sign = sign
        # the first line lies half a count away
        state.steady_ps = -(state.quarter_whole_ps // 2)
        closest = self.imperfections.closest_counts * quarter_ps
        if 2 * self.imperfections.jitter_ps >= closest:
            raise ArgumentError(
                "jitter_ps",
                f"{self.imperfections.jitter_ps} ps",
                f"less than {closest / 2:.0f} ps at this frequency",
                "edges must keep their order",
            )

    def edges(self, motion: MotionSegments) -> EdgeStream:
        """Return the edges of a motion that starts at its first segment, solved for from the motion.

        Examples
        --------
        >>> from rtec.axis import Limits, Move, Program, plan
        >>> there_and_back = Program(blocks=(Move(target_mm=0.01, feed_mm_s=1.0), Move(target_mm=0.0, feed_mm_s=1.0)))
        >>> limits = Limits(max_speed_mm_s=10.0, max_acceleration_mm_s2=100.0, rapid_mm_s=10.0)
        >>> stream = Encoder(count_mm=0.001).edges(plan(there_and_back, limits))
        >>> len(stream.times_ps), stream.counts().net
        (20, 0)
        """
        chunks = list(self.edge_chunks(motion))
        times = np.concatenate([chunk.times_ps for chunk in chunks])
        levels = np.concatenate([chunk.levels for chunk in chunks])
        return EdgeStream(times, levels, initial=chunks[0].initial)

    def edge_chunks(self, motion: MotionSegments, state: Record | None = None) -> Iterator[EdgeStream]:
        """Yield the same edges in chunks of bounded memory; at least one, empty where nothing moves.

        Who wants to know count, number of edges and glitches so far has the ``state``, a record of the kernels.
        """
        state = new_record(_kernels.ENCODER) if state is None else state
        piece = new_record(_kernels.PIECE)
        self.fill(state)
        per_mm = 1.0 / self.count_mm
        columns = [motion.x0_mm, motion.v0_mm_s, motion.a0_mm_s2, motion.j0_mm_s3]
        x0, v0, a0, j0 = (np.ascontiguousarray(column * per_mm) for column in columns)
        start = motion.start_ps
        span_s = motion.duration_ps / PS_PER_S
        longest = np.abs(v0) * span_s + np.abs(a0) * span_s**2 / 2 + np.abs(j0) * span_s**3 / 6
        # where eccentricity brings the lines closest; a glitch adds two edges to a line's own
        crowding = 2.0 * math.pi * self.imperfections.eccentricity_counts / max(self.counts_per_rev, 1)
        edges_a_count = 3.0 / (1.0 - crowding)
        room = max(_CHUNK_EDGES, int(edges_a_count * (longest.max(initial=0.0) + 8)) + 1)
        _kernels.reset_at(state, x0[0] if x0.size else motion.end_mm * per_mm)
        first = 0
        level = int(_kernels.level_now(state))
        while True:
            times = np.empty(room, dtype=np.int64)
            levels = np.empty(room, dtype=np.uint8)
            used, first = _kernels.trace_edges(
                state, piece, start, motion.duration_ps, x0, v0, a0, j0, first, edges_a_count, times, levels
            )
            yield EdgeStream(times[:used], levels[:used], initial=level)
            level = int(levels[used - 1]) if used else level
            if first >= start.size:
                return


def crosses_evenly(state: Record) -> bool:
    """Return whether nothing but the kinds of the lines and jitter make an encoder's edges come early or late.

    Examples
    --------
    >>> state = new_record(_kernels.ENCODER)
    >>> Encoder(imperfections=Imperfections(jitter_ps=5_000)).fill_steady(state, 500e3, 1)
    >>> crosses_evenly(state)
    True
    """
    return int(state.glitch_level) == 0 and float(state.eccentric_counts) == 0.0
