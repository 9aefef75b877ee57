"""Motion profiles: a program of moves becomes pieces of constant jerk, laid end to end on the picosecond scale.

Every move starts and ends at rest. Two shapes exist: constant acceleration (trapezoidal speed) and constant jerk
(seven pieces, the "double S"). Both are solved in closed form for all moves of a program at once.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np
import numpy.typing as npt

from rtec.axis._profile_kernels import FloatArray, Ramp
from rtec.axis.program import MAX_TIME_S, SPEED_RANGE_MM_S, Dwell, Move, Program
from rtec.checks import number_within
from rtec.errors import ArgumentError
from rtec.units import PS_PER_S

IntArray = npt.NDArray[np.int64]

_CRUISE = 3


class ProfileShape(Enum):
    """How the speed of a move rises and falls."""

    TRAPEZOIDAL = "trapezoidal"
    JERK_LIMITED = "jerk-limited"


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """What the axis can do.

    Parameters
    ----------
    max_speed_mm_s
        Largest speed, 1e-9 to 1e4 mm/s.
    max_acceleration_mm_s2
        Largest acceleration and deceleration, 1e-6 to 1e6 mm/s².
    rapid_mm_s
        Speed of rapid moves, at most ``max_speed_mm_s``.
    max_jerk_mm_s3
        Largest jerk, 1e-6 to 1e10 mm/s³, or None where only the trapezoidal shape is used.

    Raises
    ------
    ArgumentError
        A value outside its range.

    Examples
    --------
    >>> Limits(max_speed_mm_s=100, max_acceleration_mm_s2=500, rapid_mm_s=80).rapid_mm_s
    80.0
    """

    max_speed_mm_s: float
    max_acceleration_mm_s2: float
    rapid_mm_s: float
    max_jerk_mm_s3: float | None = None

    def __post_init__(self) -> None:
        low, high = SPEED_RANGE_MM_S
        speed = number_within("max_speed_mm_s", self.max_speed_mm_s, low, high)
        object.__setattr__(self, "max_speed_mm_s", speed)
        rapid = number_within("rapid_mm_s", self.rapid_mm_s, low, speed, unit="mm/s (max_speed_mm_s)")
        object.__setattr__(self, "rapid_mm_s", rapid)
        acceleration = number_within("max_acceleration_mm_s2", self.max_acceleration_mm_s2, 1e-6, 1e6)
        object.__setattr__(self, "max_acceleration_mm_s2", acceleration)
        if self.max_jerk_mm_s3 is not None:
            jerk = number_within("max_jerk_mm_s3", self.max_jerk_mm_s3, 1e-6, 1e10)
            object.__setattr__(self, "max_jerk_mm_s3", jerk)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MotionSegments:
    """Motion as pieces of constant jerk: x = x0 + v0 τ + a0 τ²/2 + j0 τ³/6, τ in seconds since the piece's start.

    Parameters
    ----------
    start_ps, duration_ps : int64 (n,)
        Start and length (> 0) of each piece; each starts where the one before it ends.
    x0_mm, v0_mm_s, a0_mm_s2, j0_mm_s3 : float64 (n,)
        State at the start of each piece. Within a piece neither velocity nor acceleration changes its sign (but for
        the last half picosecond of one that ends at rest).
    block : int64 (n,)
        Index of the program block to which the piece belongs, never falling.
    block_end_ps : int64 (blocks,)
        Time at which each block ends. A block that lasts less than half a picosecond has no piece.
    end_mm
        Position at rest after the last piece.

    Raises
    ------
    ArgumentError
        Arrays of another type or length, a piece without length, or pieces that do not join in time.

    Notes
    -----
    Lengths are whole picoseconds, rounded; ``x0_mm`` is the planned position of each joint and no rounding
    accumulates. Where a piece ends, its polynomial misses the next ``x0_mm`` by at most half a picosecond of motion
    (5e-10 mm at 1000 mm/s) and the resolution of float64. Before the first piece and after the last the axis rests.

    Examples
    --------
    >>> from rtec.axis.program import Move, Program
    >>> program = Program(blocks=(Move(target_mm=10, feed_mm_s=20),))
    >>> motion = plan(program, Limits(max_speed_mm_s=50, max_acceleration_mm_s2=100, rapid_mm_s=50))
    >>> motion.duration_ps.tolist()
    [200000000000, 300000000000, 200000000000]
    >>> motion.position_at([0, 200_000_000_000, 700_000_000_000]).tolist()
    [0.0, 2.0, 10.0]
    """

    start_ps: IntArray
    duration_ps: IntArray
    x0_mm: FloatArray
    v0_mm_s: FloatArray
    a0_mm_s2: FloatArray
    j0_mm_s3: FloatArray
    block: IntArray
    block_end_ps: IntArray
    end_mm: float

    def __post_init__(self) -> None:
        whole, real = np.dtype(np.int64), np.dtype(np.float64)
        for name, kind in [("start_ps", whole), ("duration_ps", whole), ("block", whole), ("x0_mm", real),
                           ("v0_mm_s", real), ("a0_mm_s2", real), ("j0_mm_s3", real)]:  # fmt: skip
            array = getattr(self, name)
            if not isinstance(array, np.ndarray) or array.dtype != kind or array.shape != self.start_ps.shape:
                raise ArgumentError(name, type(array).__name__, f"a {kind} array, as long as start_ps")
        if self.start_ps.ndim != 1:
            raise ArgumentError("start_ps", f"an array of {self.start_ps.ndim} dimensions", "one dimension")
        if np.any(self.duration_ps <= 0):
            raise ArgumentError("duration_ps", int(self.duration_ps.min()), "lengths above 0 ps")
        if np.any(np.diff(self.start_ps) != self.duration_ps[:-1]):
            raise ArgumentError("start_ps", "a gap or an overlap", "pieces that join in time")

    @property
    def total_ps(self) -> int:
        """Time at which the motion ends, in picoseconds."""
        return int(self.start_ps[-1] + self.duration_ps[-1]) if self.start_ps.size else 0

    def position_at(self, t_ps: npt.ArrayLike) -> FloatArray:
        """Return the position in mm at whole picoseconds, in the shape of ``t_ps``; at rest before and after.

        Raises
        ------
        ArgumentError
            Times that are not integers of at most 64 bits.
        """
        t, piece, tau = self._locate(t_ps)
        if not self.start_ps.size:
            return np.full(t.shape, self.end_mm)
        x0, v0, a0, j0 = self.x0_mm[piece], self.v0_mm_s[piece], self.a0_mm_s2[piece], self.j0_mm_s3[piece]
        x = x0 + tau * (v0 + tau * (a0 / 2 + tau * (j0 / 6)))
        return np.where(t >= self.total_ps, self.end_mm, x)

    def velocity_at(self, t_ps: npt.ArrayLike) -> FloatArray:
        """Return the velocity in mm/s; at a joint that of the piece that starts there. Otherwise as position."""
        t, piece, tau = self._locate(t_ps)
        if not self.start_ps.size:
            return np.zeros(t.shape)
        v = self.v0_mm_s[piece] + tau * (self.a0_mm_s2[piece] + tau * (self.j0_mm_s3[piece] / 2))
        return np.where(self._moving(t), v, 0.0)

    def acceleration_at(self, t_ps: npt.ArrayLike) -> FloatArray:
        """Return the acceleration in mm/s²; at a joint that of the piece that starts there. Otherwise as position."""
        t, piece, tau = self._locate(t_ps)
        if not self.start_ps.size:
            return np.zeros(t.shape)
        return np.where(self._moving(t), self.a0_mm_s2[piece] + tau * self.j0_mm_s3[piece], 0.0)

    def _locate(self, t_ps: npt.ArrayLike) -> tuple[IntArray, npt.NDArray[np.intp], FloatArray]:
        """Return the times, the piece of each (a joint belongs to the later one) and the seconds since its start."""
        given = np.asarray(t_ps)
        if not np.can_cast(given.dtype, np.int64):
            raise ArgumentError("t_ps", f"an array of {given.dtype}", "whole picoseconds (int64)")
        t = given.astype(np.int64)
        if not self.start_ps.size:
            return t, np.zeros(t.shape, np.intp), np.zeros(t.shape)
        inside = np.clip(t, self.start_ps[0], self.total_ps)
        piece = np.searchsorted(self.start_ps, inside, side="right") - 1
        return t, piece, (inside - self.start_ps[piece]) / PS_PER_S

    def _moving(self, t: IntArray) -> npt.NDArray[np.bool_]:
        inside: npt.NDArray[np.bool_] = (t >= self.start_ps[0]) & (t < self.total_ps)
        return inside


def plan(program: Program, limits: Limits, shape: ProfileShape = ProfileShape.TRAPEZOIDAL) -> MotionSegments:
    """Turn a program into motion, as fast as the limits allow.

    Every move starts and ends at rest (exact stop, as under G61): there is no blending from one block into the next.
    Constant jerk needs ``limits.max_jerk_mm_s3``.

    Returns
    -------
    MotionSegments
        Starts at 0 ps at ``program.start_mm``; each move ends exactly at its target and cruises at exactly its feed.

    Raises
    ------
    ArgumentError
        A feed above the largest speed, no limit of jerk for the jerk-limited shape, more than 100 days in all.

    Notes
    -----
    A ramp from rest to the speed v, limited to the acceleration A and the jerk J, takes T = v/A + Tj with
    Tj = A/J if v ≥ A²/J (else T = 2 Tj with Tj = √(v/J)) and covers v T/2; braking is its mirror image. A move of
    length d < v T does not reach its feed. It then peaks where v T = d:

    - v = (2 d)/(A/J + √((A/J)² + 4 d/A)) if d ≥ 2 A³/J²,
    - v = J ∛(d/2J)² otherwise, without a phase of constant acceleration,
    - v = √(A d) for the trapezoidal shape (J → ∞), then a triangle.

    References
    ----------
    L. Biagiotti, C. Melchiorri, Trajectory Planning for Automatic Machines and Robots (Springer, 2008), chapter 3,
    the sections on trapezoidal and on double S velocity profiles, for the case of rest at both ends.

    Examples
    --------
    >>> from rtec.axis.program import Dwell, Move, Program
    >>> program = Program(blocks=(Move(target_mm=10, feed_mm_s=20), Dwell(seconds=1)))
    >>> limits = Limits(max_speed_mm_s=50, max_acceleration_mm_s2=100, rapid_mm_s=50, max_jerk_mm_s3=1000)
    >>> plan(program, limits, ProfileShape.JERK_LIMITED).block_end_ps.tolist()
    [800000000000, 1800000000000]
    """
    start, target, speed, dwell_ps = _table(program, limits)
    jerk = _jerk(limits, shape)
    return plan_moves(start, target, speed, dwell_ps, limits.max_acceleration_mm_s2, jerk, at_mm=program.start_mm)


def plan_moves(
    start_mm: FloatArray,
    target_mm: FloatArray,
    speed_mm_s: FloatArray,
    dwell_ps: IntArray,
    acceleration_mm_s2: float,
    jerk_mm_s3: float | None = None,
    *,
    at_mm: float = 0.0,
) -> MotionSegments:
    """Turn moves from rest to rest, each with a dwell after its cruise, into motion.

    Parameters
    ----------
    start_mm, target_mm, speed_mm_s, dwell_ps
        Of each move, shape (n,); a move of no length is a dwell. Where one ends the next one starts.
    acceleration_mm_s2, jerk_mm_s3
        Of all of them; without a jerk the acceleration is constant.
    at_mm
        Where the axis rests if there is no move.

    Raises
    ------
    ArgumentError
        More than 100 days in all.

    Examples
    --------
    >>> there, back = np.array([0.0, 10.0]), np.array([10.0, 0.0])
    >>> motion = plan_moves(there, back, np.array([20.0, 20.0]), np.zeros(2, np.int64), 100.0)
    >>> motion.block_end_ps.tolist()
    [700000000000, 1400000000000]
    """
    distance = np.abs(target_mm - start_mm)
    ramp = Ramp.of(distance, speed_mm_s, acceleration_mm_s2, jerk_mm_s3)
    lengths_s = ramp.lengths_s()
    if not lengths_s.sum() + dwell_ps.sum(dtype=np.float64) / PS_PER_S <= MAX_TIME_S:
        raise ArgumentError("program", "longer than 100 days", "at most 100 days", "split it, or raise its feeds")
    duration_ps = np.rint(lengths_s * PS_PER_S).astype(np.int64)
    duration_ps[:, _CRUISE] += dwell_ps
    sign = np.sign(target_mm - start_mm)[:, None]
    covered = ramp.distances_mm()
    x0 = np.hstack([start_mm[:, None] + sign * covered[:, :4], target_mm[:, None] - sign * covered[:, 4:]])
    kept = duration_ps > 0
    lengths = duration_ps[kept]
    return MotionSegments(
        start_ps=np.cumsum(lengths) - lengths,
        duration_ps=lengths,
        x0_mm=x0[kept],
        v0_mm_s=(sign * ramp.speeds_mm_s())[kept],
        a0_mm_s2=(sign * ramp.accelerations_mm_s2())[kept],
        j0_mm_s3=(sign * ramp.jerks_mm_s3())[kept],
        block=np.nonzero(kept)[0].astype(np.int64),
        block_end_ps=np.cumsum(duration_ps.sum(axis=1)),
        end_mm=float(target_mm[-1]) if target_mm.size else at_mm,
    )


def _jerk(limits: Limits, shape: ProfileShape) -> float | None:
    if shape is ProfileShape.TRAPEZOIDAL:
        return None
    if limits.max_jerk_mm_s3 is None:
        raise ArgumentError("max_jerk_mm_s3", None, "a jerk in mm/s^3", "the jerk-limited shape needs it")
    return limits.max_jerk_mm_s3


def _table(program: Program, limits: Limits) -> tuple[FloatArray, FloatArray, FloatArray, IntArray]:
    """Return start, target, speed and dwell of every block; a dwell starts and ends at one position."""
    here = program.start_mm
    rows: list[tuple[float, float, int]] = []
    for index, block in enumerate(program.blocks):
        if isinstance(block, Dwell):
            rows.append((here, limits.max_speed_mm_s, block.dwell_ps))
            continue
        here = block.target_mm
        speed = block.feed_mm_s if isinstance(block, Move) else limits.rapid_mm_s
        if speed > limits.max_speed_mm_s:
            allowed = f"at most max_speed_mm_s, {limits.max_speed_mm_s:g} mm/s"
            raise ArgumentError(f"feed_mm_s of blocks[{index}]", speed, allowed)
        rows.append((here, speed, 0))
    target = np.array([row[0] for row in rows], dtype=np.float64)
    speed_mm_s = np.array([row[1] for row in rows], dtype=np.float64)
    dwell_ps = np.array([row[2] for row in rows], dtype=np.int64)
    return np.concatenate([[program.start_mm], target])[:-1], target, speed_mm_s, dwell_ps
