"""Motion programs: feed moves, rapids and dwells, in the order in which the axis carries them out.

A program says where the axis goes and how fast; :func:`rtec.axis.profile.plan` turns it into motion over time.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence
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
MAX_BLOCKS = 1_000_000
"""Most blocks that :meth:`Program.back_and_forth` writes."""


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

    @classmethod
    def back_and_forth(
        cls,
        targets_mm: Iterable[float],
        *,
        feed_mm_s: float,
        dwell_s: float = 0.0,
        overshoot_mm: float = 0.0,
        runs: int = 1,
    ) -> Program:
        """Visit targets in order, turn round, visit them in reverse order, and so on.

        At each turn the axis goes ``overshoot_mm`` beyond the last target, so that every target is approached in the
        direction of the pass, as the bidirectional runs of the thesis do. It starts, and ends each run, at rest
        ``overshoot_mm`` before the first target.

        Parameters
        ----------
        targets_mm
            At least two targets, strictly rising or strictly falling.
        feed_mm_s
            Feed of every move.
        dwell_s
            Stay at each target, and at each turn.
        overshoot_mm
            Distance beyond the first and the last target at which the axis turns; 0 turns at the targets.
        runs
            Number of passes there and back.

        Returns
        -------
        Program
            ``2 * runs * len(targets_mm)`` visits, each a move and (if ``dwell_s`` is not 0) a dwell.

        Raises
        ------
        ArgumentError
            Fewer than two targets, targets out of order, a value outside its range, too many blocks.

        References
        ----------
        Thesis, Appendix B (measuring program with overshoot for the backlash moves).

        Examples
        --------
        >>> program = Program.back_and_forth([10, 20], feed_mm_s=5, overshoot_mm=1)
        >>> program.start_mm, [block.target_mm for block in program.blocks]
        (9.0, [10.0, 20.0, 21.0, 20.0, 10.0, 9.0])
        """
        targets = [_position(f"targets_mm[{index}]", value) for index, value in enumerate(targets_mm)]
        overshoot = number_within("overshoot_mm", overshoot_mm, 0.0, MAX_POSITION_MM, unit="mm")
        sign = _direction(targets)
        most = MAX_BLOCKS // (4 * len(targets) + 4)
        if isinstance(runs, bool) or not isinstance(runs, int) or not 1 <= runs <= most:
            raise ArgumentError("runs", repr(runs)[:60], f"a whole number from 1 to {most}")
        near, far = targets[0] - sign * overshoot, targets[-1] + sign * overshoot
        turn_far, turn_near = ([far], [near]) if overshoot else ([], [])
        one_run = [*targets, *turn_far, *reversed(targets), *turn_near]
        dwell = Dwell(seconds=dwell_s)
        blocks: list[Block] = []
        for target in one_run:
            blocks.append(Move(target_mm=target, feed_mm_s=feed_mm_s))
            if dwell.dwell_ps:
                blocks.append(dwell)
        return cls(blocks=tuple(blocks * runs), start_mm=near)


def _direction(targets: Sequence[float]) -> float:
    """Return +1 for strictly rising targets and −1 for strictly falling ones."""
    steps = [later - earlier for earlier, later in itertools.pairwise(targets)]
    if steps and all(step > 0 for step in steps):
        return 1.0
    if steps and all(step < 0 for step in steps):
        return -1.0
    allowed = "at least two targets, strictly rising or strictly falling"
    raise ArgumentError("targets_mm", f"a list of {len(targets)}", allowed)
