"""Random programs and operators of the soak: cutting, rapids, rests, reversals, probing, large corrections."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rtec.axis.command import Move
from rtec.units import PS_PER_S
from rtec.verify.safety.phases import Order, Orders

_FEEDS_MM_S = (0.5, 5.0)
_RAPIDS_MM_S = (20.0, 117.0)
_SHARE_RAPID = 0.08
_LONGEST_CUT_MM = 20.0
_LOW_MM, _HIGH_MM = 0.0, 95.0
_ACCELERATION_MM_S2 = 500.0
_REST_S = (0.0, 3.0)
_SETTLING_S = 3.0
_FOR_GOOD_S = 1e5


@dataclass(frozen=True, slots=True, kw_only=True)
class Programs:
    """A program for each axis, and when all of them have come to their ends for certain."""

    moves: list[list[Move]]
    end_ps: int


def draw_programs(generator: np.random.Generator, *, axes: int, length_s: float) -> Programs:
    """Return random programs of about the length that is wanted.

    Examples
    --------
    >>> programs = draw_programs(np.random.default_rng(1), axes=3, length_s=60.0)
    >>> len(programs.moves), all(0.0 <= move.target_mm <= 95.0 for moves in programs.moves for move in moves)
    (3, True)
    """
    longest_s = 0.0
    programs = []
    for _ in range(axes):
        moves, took_s = _draw_moves(generator, length_s)
        programs.append(moves)
        longest_s = max(longest_s, took_s)
    return Programs(moves=programs, end_ps=int((longest_s * 1.02 + _SETTLING_S) * PS_PER_S))


def _draw_moves(generator: np.random.Generator, length_s: float) -> tuple[list[Move], float]:
    """Return one axis' program and how long it takes: the servo's lag at each end included."""
    moves: list[Move] = []
    at_mm, took_s = 0.0, 0.0
    while took_s < length_s:
        if generator.random() < _SHARE_RAPID:
            target_mm = float(generator.uniform(_LOW_MM, _HIGH_MM))
            speed_mm_s = float(generator.uniform(*_RAPIDS_MM_S))
        else:
            low, high = math.log(_FEEDS_MM_S[0]), math.log(_FEEDS_MM_S[1])
            speed_mm_s = math.exp(float(generator.uniform(low, high)))
            away_mm = float(generator.uniform(-_LONGEST_CUT_MM, _LONGEST_CUT_MM))
            target_mm = min(max(at_mm + away_mm, _LOW_MM), _HIGH_MM)
        rest_s = float(generator.uniform(*_REST_S)) if generator.random() < 0.5 else 0.0
        target_mm, speed_mm_s = round(target_mm, 3), round(speed_mm_s, 3)
        took_s += abs(target_mm - at_mm) / speed_mm_s + speed_mm_s / _ACCELERATION_MM_S2 + rest_s + 0.002
        at_mm = target_mm
        moves.append(Move(target_mm=target_mm, speed_mm_s=speed_mm_s, rest_s=rest_s))
    moves.append(Move(target_mm=at_mm, speed_mm_s=1.0, rest_s=_FOR_GOOD_S))
    return moves, took_s


def draw_orders(generator: np.random.Generator, *, length_s: float) -> Orders:
    """Return when the PC enters and leaves probing, and when a hot machine's table comes at once."""
    orders: Orders = []
    if generator.random() < 0.3:
        at_s = float(generator.uniform(2.0, 0.7 * length_s))
        for_s = float(generator.uniform(2.0, 0.2 * length_s))
        orders += [(int(at_s * PS_PER_S), Order.PROBE), (int((at_s + for_s) * PS_PER_S), Order.CUT)]
    if generator.random() < 0.3:
        orders.append((int(float(generator.uniform(1.0, 0.9 * length_s)) * PS_PER_S), Order.LARGE))
    return sorted(orders, key=lambda order: order[0])
