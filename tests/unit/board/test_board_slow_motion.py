"""A slow axis has one or two transitions between two readings: corrections go in all the same.

Design B inserts even where they keep step with the readings, so that each reading meets one of them. The others drop
what they have timed when a reading meets a transition; in step with it they wait, which no real axis is for long.
"""

import numpy as np
import pytest

from rtec.board import MICROCONTROLLERS, Board
from rtec.injector import Design
from rtec.signal import EdgeStream

LEVELS = np.array([1, 3, 2, 0], dtype=np.uint8)


@pytest.mark.one_in(5)
@pytest.mark.parametrize("share", [0.5, 1.0, 1.03])
@pytest.mark.parametrize("microcontroller", MICROCONTROLLERS.values(), ids=list(MICROCONTROLLERS))
@pytest.mark.parametrize("design", list(Design))
def test_three_steps_are_inserted_in_motion_whatever_the_phase(design, microcontroller, share):
    if design is not Design.B:
        share *= 1.07
    frequency_hz = round(1000 * share)
    quarter_ps = 10**12 // (4 * frequency_hz)
    edges = int((0.06 if design is Design.B else 0.15) * 4 * frequency_hz)
    for phase in np.arange(0.0, 1.0, 0.05):
        board = Board(design, microcontroller, hold_latch=True)  # the axis begins to move during an insertion at rest
        board.start_up()
        board.begin_counting()
        board.ask(3)
        begun_ps = board.now_ps + int(phase * quarter_ps)
        times_ps = begun_ps + quarter_ps * np.arange(1, edges + 1, dtype=np.int64)
        moving = EdgeStream(times_ps, LEVELS[np.arange(edges) % 4], initial=0)
        seen = board.process(moving, until_ps=int(times_ps[-1]) + quarter_ps)
        assert board.words.completed == 3, phase
        assert seen.counts() == (edges + 3 * design.step_counts, 0), phase
