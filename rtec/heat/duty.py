"""What a machine does over a shift: pieces of constant speed, feed and cutting force."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from rtec.checks import number_within, one_of_types, whole_within
from rtec.errors import ArgumentError

HOUR_S = 3600.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Piece:
    """A stretch of time in which nothing changes.

    Parameters
    ----------
    duration_s
        How long.
    spindle_rpm
        Speed of the spindle.
    feed_mm_s
        Mean speed of the feed axis, which goes to and fro.
    force_n
        Cutting force.

    Examples
    --------
    >>> Piece(duration_s=60.0, spindle_rpm=-3.0)
    Traceback (most recent call last):
        ...
    rtec.errors.ArgumentError: spindle_rpm: -3 rpm is too small; use 0 to 100000 rpm
    """

    duration_s: float
    spindle_rpm: float = 0.0
    feed_mm_s: float = 0.0
    force_n: float = 0.0

    def __post_init__(self) -> None:
        number_within("duration_s", self.duration_s, 1e-3, 1e8)
        number_within("spindle_rpm", self.spindle_rpm, 0.0, 1e5, unit="rpm")
        number_within("feed_mm_s", self.feed_mm_s, 0.0, 1e4)
        number_within("force_n", self.force_n, 0.0, 1e5, unit="N")


@dataclass(frozen=True, slots=True)
class Duty:
    """A duty cycle: pieces, one after the other.

    Examples
    --------
    >>> duty = Duty.paper(spindle_rpm=4000.0)
    >>> duty.duration_s / 3600.0, duty.at([0.0, 9000.0]).tolist()
    (4.5, [[4000.0, 20.0, 0.0], [0.0, 0.0, 0.0]])
    >>> Duty.shop(seed=1, hours=8.0) == Duty.shop(seed=1, hours=8.0)
    True
    """

    pieces: tuple[Piece, ...]
    starts_s: npt.NDArray[np.float64] = field(init=False, repr=False, compare=False)
    """When each piece starts, shape (pieces,)."""

    def __post_init__(self) -> None:
        if not self.pieces:
            raise ArgumentError("pieces", "no piece", "one or more of them")
        for piece in self.pieces:
            one_of_types("pieces", piece, Piece)
        starts = np.cumsum([0.0, *(piece.duration_s for piece in self.pieces)])[:-1]
        object.__setattr__(self, "starts_s", starts)

    @property
    def duration_s(self) -> float:
        """How long all pieces take."""
        return float(self.starts_s[-1] + self.pieces[-1].duration_s)

    def at(self, time_s: npt.ArrayLike) -> npt.NDArray[np.float64]:
        """Return speed (rev/min), feed (mm/s) and force (N) that hold from each time on, shape (times, 3)."""
        rows = np.searchsorted(self.starts_s, np.asarray(time_s, dtype=np.float64), side="right") - 1
        table = np.array([(piece.spindle_rpm, piece.feed_mm_s, piece.force_n) for piece in self.pieces])
        return table[np.maximum(rows, 0)]

    @classmethod
    def paper(cls, *, spindle_rpm: float = 4000.0, feed_mm_s: float = 20.0, force_n: float = 0.0) -> Duty:
        """Return the duty of Yao et al.: 2.5 h running, 2 h cooling (paper 003, section 4.2).

        The paper does not state its speed.
        """
        running = Piece(duration_s=2.5 * HOUR_S, spindle_rpm=spindle_rpm, feed_mm_s=feed_mm_s, force_n=force_n)
        return cls((running, Piece(duration_s=2.0 * HOUR_S)))

    @classmethod
    def steps(
        cls, speeds_rpm: tuple[float, ...], *, running_h: float = 4.0, resting_h: float = 4.0, feed_mm_s: float = 0.0
    ) -> Duty:
        """Return one speed after the other, each followed by a rest, as machines are tested (ISO 230-3, annex)."""
        pieces: list[Piece] = []
        for rpm in speeds_rpm:
            pieces.append(Piece(duration_s=running_h * HOUR_S, spindle_rpm=rpm, feed_mm_s=feed_mm_s))
            if resting_h > 0.0:
                pieces.append(Piece(duration_s=resting_h * HOUR_S))
        return cls(tuple(pieces))

    @classmethod
    def shop(cls, seed: int, *, hours: float = 8.0, fastest_rpm: float = 6000.0) -> Duty:
        """Return a shift as a workshop has it, drawn from a seed.

        Jobs of 5 to 40 min at a speed from a tenth of the fastest up, with feed and cutting force; between them rests
        of 1 to 10 min, and one in eight of 30 to 60 min.
        """
        whole_within("seed", seed, 0, 2**63 - 1)
        number_within("hours", hours, 0.1, 10_000.0)
        rng = np.random.default_rng(seed)
        pieces: list[Piece] = []
        left_s = hours * HOUR_S
        while left_s > 0.0:
            job_s = min(float(np.round(60.0 * rng.uniform(5.0, 40.0))), left_s)
            rpm = float(np.round(fastest_rpm * rng.uniform(0.1, 1.0), -1))
            feed, force = (float(np.round(rng.uniform(0.0, most))) for most in (60.0, 400.0))
            pieces.append(Piece(duration_s=job_s, spindle_rpm=rpm, feed_mm_s=feed, force_n=force))
            left_s -= job_s
            low, high = (30.0, 60.0) if rng.random() < 1 / 8 else (1.0, 10.0)
            rest_s = min(float(np.round(60.0 * rng.uniform(low, high))), left_s)
            if rest_s > 0.0:
                pieces.append(Piece(duration_s=rest_s))
            left_s -= rest_s
        return cls(tuple(pieces))
