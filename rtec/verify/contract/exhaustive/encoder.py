"""The encoder as a finite machine on a grid: which edge it can send when, on an axis within a contract."""

from __future__ import annotations

import math
from dataclasses import dataclass

from rtec.verify.contract._stream_kernels import fastest_hz, too_soon
from rtec.verify.contract.contract import Contract

MOVING = 3
SPEEDS = 60
"""Classes of a motion that goes on: by the time between its last two edges, each time a bit slower."""


@dataclass(frozen=True, slots=True, kw_only=True)
class EncoderModel:
    """Least times between two edges, in points of the grid, by the class of the motion before.

    Classes are 0: no edge since power-up; 1: one; 2: the last edge took one back; from 3 on: the last two went one
    way, and the time between them was ``begins`` at least.

    Examples
    --------
    On an axis that reaches 500 kHz, a slow edge is not followed by a fast one, and nothing turns at speed:

    >>> model = EncoderModel.of(Contract(step_counts=4), grid_ps=20_000, quiet=100)
    >>> model.begins[-1], model.least_same[:4], model.least_same[-1], model.least_turn[:4], model.least_turn[-1]
    (107, (1, 22, 100, 22), 100, (1, 5, 5, 100), 5)
    """

    begins: tuple[int, ...]
    """The last class may turn at once."""
    least_same: tuple[int, ...]
    least_turn: tuple[int, ...]

    def motion_after(self, motion: int, since: int, *, turns: bool) -> int:
        """Return the class behind an edge that came so long after the last one, of a motion of some class."""
        last = len(self.begins) - 1
        if motion == 0:  # only the same direction is bound by the time from power-up
            return last if since >= self.begins[last] else 1
        return 2 if turns else max(k for k in range(MOVING, last + 1) if since >= self.begins[k])

    @classmethod
    def of(cls, contract: Contract, *, grid_ps: int, quiet: int, speeds: int = SPEEDS) -> EncoderModel:
        """Return the model of a contract; times of ``quiet`` points and more are not told apart.

        Notes
        -----
        Every stream that `rtec.verify.contract.streams.can_be` allows, all times rounded to the grid by the same
        rule, is one of the model: times between edges are rounded down, and a class begins a point later than it
        could.
        """
        jitter_ps = contract.jitter * contract.quarter_ps
        gain = float(contract.acceleration_hz_s)
        shortest = round(contract.quarter_ps - jitter_ps) // grid_ps
        turn = contract.turn_ps // grid_ps

        def least_after(fastest: float, most: int = quiet) -> int:
            """Return the whole points after which a count is possible from that speed, up to so many."""
            least = shortest
            while least < most and too_soon(fastest, (least + 1) * grid_ps, gain, jitter_ps):
                least += 1
            return least

        def same_after(interval: int) -> int:
            return least_after(fastest_hz(interval * grid_ps, True, gain, jitter_ps))

        turned_hz = math.sqrt(gain / 2.0)
        slowest = min(quiet, max(shortest, 7 * least_after(turned_hz, 2 * quiet) // 10))
        begins, same = [0, 0, 0, 0], [1, shortest, least_after(turned_hz), shortest]
        interval = shortest
        for k in range(1, speeds):
            goal = int(shortest * (slowest / shortest) ** (k / (speeds - 1)))
            while same_after(interval) < goal:
                interval += 1
            if same_after(interval) > same[-1]:
                begins.append(interval + 1)
                same.append(same_after(interval))
        turns = [_turn_after(begin, turn, quiet, grid_ps, gain, jitter_ps) for begin in begins[MOVING + 1 :]]
        return cls(begins=tuple(begins), least_same=tuple(same), least_turn=(1, turn, turn, *turns, turn))


def _turn_after(interval: int, turn: int, quiet: int, grid_ps: int, gain: float, jitter_ps: float) -> int:
    """Return the whole points after which an edge can be taken back that came so long after the one before."""
    least = turn
    while least < quiet and too_soon(
        fastest_hz((least + 1) * grid_ps, False, gain, jitter_ps), interval * grid_ps, gain, jitter_ps
    ):
        least += 1
    return least
