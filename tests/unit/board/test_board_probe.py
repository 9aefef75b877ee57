"""A probe trips at any moment of the program: the lines to the controller must not suffer from its routine."""

import numpy as np
import pytest

from rtec.board import Board, Microcontroller
from rtec.injector import Design
from rtec.signal import EdgeStream

LEVELS = np.array([1, 3, 2, 0], dtype=np.uint8)
QUARTER_PS = 10**12 // (4 * 3000)  # at 4 kHz a trip may let Design B miss a transition (docs/firmware.md)


@pytest.mark.parametrize("name", ["8051-12mhz", "one-clock-100mhz"])
@pytest.mark.parametrize("design", list(Design))
def test_a_trip_in_any_cycle_of_a_reading_changes_no_count(design, name):
    board = Board(design, Microcontroller.named(name))
    board.start_up()
    board.begin_counting()
    board.ask(3)  # Design B then adds three states to what it copies
    board.idle(until_ps=board.now_ps + 10_000_000_000)
    assert board.words.completed == 3
    begin = board.snapshot()
    begun_ps = board.now_ps
    edges = 48  # four milliseconds
    times_ps = begun_ps + QUARTER_PS * np.arange(1, edges + 1, dtype=np.int64)
    moving = EdgeStream(times_ps, LEVELS[np.arange(edges) % 4], initial=0)
    for after_us in np.arange(1000.0, 2100.0, 3.25):
        board.restore(begin)
        trip_ps = begun_ps + int(after_us * 1e6)
        first = int(np.searchsorted(times_ps, trip_ps))
        before = board.process(moving.part(0, first), until_ps=trip_ps)
        board.probe(True)
        after = board.process(moving.part(first, edges), until_ps=int(times_ps[-1]) + 2_000_000_000)
        counts = EdgeStream.concatenate([before, after]).counts()
        assert counts == (edges, 0), after_us
        assert board.words.trips == 1
        assert board.words.trip_position == pytest.approx(first, abs=1)
