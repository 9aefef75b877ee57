"""Motion programs: feed moves, rapids and dwells, in the order in which the axis carries them out.

A program says where the axis goes and how fast; :func:`rtec.axis.profile.plan` turns it into motion over time.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import InitVar, dataclass, field

from rtec.checks import number_within
from rtec.errors import ArgumentError
from rtec.units import seconds_to_ps

MAX_POSITION_MM = 1e5
"""Largest distance of a position from zero: up to here a float64 resolves better than 1e-10 mm."""
SPEED_RANGE_MM_S = (1e-9, 1e4)
"""Speeds that can be programmed."""
MAX_TIME_S = 8.64e6
"""Longest dwell and longest program: 100 days, where int64 picoseconds end."""


def _position(name: str, value: object) -> float:
    return number_within(name, value, -MAX_POSITION_MM, MAX_POSITION_MM, unit="mm")


@dataclass(frozen=True, slots=True, kw_only=True)
class Move:
    """A move in a straight line at a programmed feed (G01).

    Parameters
    ----------
    target_mm
        Where the move ends, absolute, within ±1e5 mm.
    feed_mm_s
        Feed, 1e-9 to 1e4 mm/s.

    Raises
    ------
    ArgumentError
        A value outside its range.

    Examples
    --------
    >>> Move(target_mm=25.4, feed_mm_s=20)
    Move(target_mm=25.4, feed_mm_s=20.0)
    """

    target_mm: float
    feed_mm_s: float

    def __post_init__(self) -> None:
        feed = number_within("feed_mm_s", self.feed_mm_s, *SPEED_RANGE_MM_S, unit="mm/s")
        object.__setattr__(self, "target_mm", _position("target_mm", self.target_mm))
        object.__setattr__(self, "feed_mm_s", feed)


@dataclass(frozen=True, slots=True, kw_only=True)
class Rapid:
    """A move at the rapid speed of the axis (G00).

    Parameters
    ----------
    target_mm
        Where the move ends, absolute, within ±1e5 mm.

    Raises
    ------
    ArgumentError
        A target outside its range.

    Examples
    --------
    >>> Rapid(target_mm=-3)
    Rapid(target_mm=-3.0)
    """

    target_mm: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "target_mm", _position("target_mm", self.target_mm))


@dataclass(frozen=True, slots=True, kw_only=True)
class Dwell:
    """A stay at the position reached (G04).

    Parameters
    ----------
    seconds
        Length of the stay, 0 to 8.64e6 s; kept as whole picoseconds in ``dwell_ps``.

    Raises
    ------
    ArgumentError
        A length outside its range.

    Examples
    --------
    >>> Dwell(seconds=6)
    Dwell(dwell_ps=6000000000000)
    """

    seconds: InitVar[float]
    dwell_ps: int = field(init=False)

    def __post_init__(self, seconds: float) -> None:
        length_s = number_within("seconds", seconds, 0.0, MAX_TIME_S, unit="s")
        object.__setattr__(self, "dwell_ps", seconds_to_ps(length_s, name="seconds"))


Block = Move | Rapid | Dwell
"""One block of a program."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Program:
    """Blocks in the order in which the axis carries them out.

    Parameters
    ----------
    blocks
        Moves, rapids and dwells; a list is kept as a tuple.
    start_mm
        Position before the first block, within ±1e5 mm.

    Raises
    ------
    ArgumentError
        A start outside its range, or something in ``blocks`` that is no block.

    Examples
    --------
    >>> program = Program(blocks=(Move(target_mm=10, feed_mm_s=20), Dwell(seconds=1)), start_mm=0)
    >>> len(program.blocks)
    2
    """

    blocks: tuple[Block, ...]
    start_mm: float = 0.0

    def __post_init__(self) -> None:
        if not isinstance(self.blocks, Iterable):
            raise ArgumentError("blocks", repr(self.blocks)[:60], "a tuple of Move, Rapid and Dwell")
        object.__setattr__(self, "blocks", tuple(self.blocks))
        for index, block in enumerate(self.blocks):
            if not isinstance(block, Block):
                raise ArgumentError(f"blocks[{index}]", repr(block)[:60], "a Move, a Rapid or a Dwell")
        object.__setattr__(self, "start_mm", _position("start_mm", self.start_mm))
