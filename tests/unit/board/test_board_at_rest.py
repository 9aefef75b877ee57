"""An axis that counts as at rest may creep on at any moment: a real edge meets an insertion that has just begun."""

import numpy as np
import pytest

from rtec.board import Board, Microcontroller
from rtec.injector import Design
from rtec.signal import EdgeStream

CLOCK_PS = 1_000_000 // 12
STATES = (0, 1, 3, 2)


def at_rest(design, sign, level):
    """Return a board in state ``level`` that owes a step, and when it begins to insert it."""
    board = Board(design, Microcontroller.named("8051-12mhz"), initial=level, hold_latch=True)
    board.start_up()
    board.begin_counting()
    board.ask(sign)
    return board


@pytest.mark.parametrize("design", [Design.ORIGINAL, Design.A, Design.C])
@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("towards", [1, -1])
def test_an_edge_in_any_clock_about_the_insertion_leaves_the_counts_right(design, sign, towards):
    level = 0
    found = at_rest(design, sign, level)
    begun_ps = found.now_ps
    first_ps = int(found.idle(until_ps=begun_ps + 4_000_000_000).times_ps[0])
    # what an ideal decoder makes of the lines: the steps, and the one real count
    wrong = []
    for clocks in range(-30 * 12, 12 * 12, 11):
        board = at_rest(design, sign, level)
        assert board.now_ps == begun_ps
        edge = EdgeStream([first_ps + clocks * CLOCK_PS], [STATES[towards % 4]], initial=level)
        counts = board.process(edge, until_ps=begun_ps + 8_000_000_000).counts()
        expected = towards + board.words.completed * design.step_counts
        if counts.illegal or counts.net != expected or board.words.accepted != sign:
            wrong.append((clocks, counts, board.words.completed))
    assert not wrong, wrong[:5]
    assert np.sign(board.words.completed) in (0, sign)
