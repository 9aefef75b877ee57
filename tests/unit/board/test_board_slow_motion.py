"""An axis that moves slowly has a transition or two between two readings: corrections must find their way in all the same."""

import numpy as np
import pytest

from rtec.board import MICROCONTROLLERS, Board
from rtec.injector import Design
from rtec.signal import EdgeStream

LEVELS = np.array([1, 3, 2, 0], dtype=np.uint8)


@pytest.mark.parametrize("frequency_hz", [300, 500, 1000, 1100, 2000])
@pytest.mark.parametrize("microcontroller", MICROCONTROLLERS.values(), ids=list(MICROCONTROLLERS))
@pytest.mark.parametrize("design", list(Design))
def test_three_steps_are_inserted_within_two_hundred_milliseconds(design, microcontroller, frequency_hz):
    board = Board(design, microcontroller)
    board.start_up()
    board.begin_counting()
    board.ask(3)
    quarter_ps = 10**12 // (4 * frequency_hz)
    edges = int(0.2 * 4 * frequency_hz)
    times_ps = board.now_ps + quarter_ps * np.arange(1, edges + 1, dtype=np.int64)
    moving = EdgeStream(times_ps, LEVELS[np.arange(edges) % 4], initial=0)
    seen = board.process(moving, until_ps=int(times_ps[-1]) + quarter_ps)
    assert board.words.completed == 3
    assert seen.counts() == (edges + 3 * design.step_counts, 0)
