"""What an axis does by itself: a slow shuttle, or the moves of a measuring program."""

from __future__ import annotations

from pathlib import Path

from rtec.axis.command import Move
from rtec.io import read_text
from rtec.metrology import Dwell, Move as Feed, parse_program

SHUTTLE_MM, SHUTTLE_MM_S, SHUTTLE_REST_S = 100.0, 10.0, 1.0


def shuttle() -> list[Move]:
    """Return a slow way there and back.

    Examples
    --------
    >>> [move.target_mm for move in shuttle()]
    [100.0, 0.0]
    """
    return [Move(target_mm=target, speed_mm_s=SHUTTLE_MM_S, rest_s=SHUTTLE_REST_S) for target in (SHUTTLE_MM, 0.0)]


def from_home(moves: list[Move], *, rest_s: float) -> list[Move]:
    """Return moves that begin with a rest at home: the PC has to read the home position before the axis leaves it.

    Examples
    --------
    >>> [(move.target_mm, move.rest_s) for move in from_home(shuttle(), rest_s=2.0)]
    [(0.0, 2.0), (100.0, 1.0), (0.0, 1.0)]
    """
    return [Move(target_mm=0.0, speed_mm_s=moves[0].speed_mm_s, rest_s=rest_s), *moves]


def read_moves(path: Path, *, home_mm: float) -> list[Move]:
    """Read a measuring program as moves; at its stops the operator continues at once.

    Parameters
    ----------
    path
        G-code as `rtec.metrology.measuring_program` writes it.
    home_mm
        Where the axis' home is in its positions.

    Raises
    ------
    FileFormatError
        The file cannot be read or is no such program.
    """
    lines = read_text(path, "a measuring program in G-code").splitlines()
    moves: list[Move] = []
    for block in parse_program(lines, source=str(path)):
        if isinstance(block, Feed):
            moves.append(Move(target_mm=block.position_mm - home_mm, speed_mm_s=block.feed_mm_s))
        elif isinstance(block, Dwell) and moves:
            last = moves[-1]
            rest_s = last.rest_s + block.duration_s
            moves[-1] = Move(target_mm=last.target_mm, speed_mm_s=last.speed_mm_s, rest_s=rest_s)
    return moves
