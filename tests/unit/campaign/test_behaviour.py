"""The behavioural box with the firmware's timing against the firmware on the board: no difference is left.

The oracle is the program itself, executed instruction by instruction on the board.
"""

import dataclasses

import numpy as np
import pytest

from rtec.board import Board, Microcontroller
from rtec.campaign._behaviour_streams import Exercise, long_run, steady_motion
from rtec.campaign.behaviour import (
    STAIRCASE,
    _addresses,
    _next_reading,
    _run,
    compare_behaviour,
    insertions_of,
    timing_with,
)
from rtec.errors import ArgumentError
from rtec.injector import Design, Effect, Injector, InjectorSettings, Processor, RealEdges, Timing
from rtec.signal import EdgeStream

ALL = Effect.ARMING | Effect.READINGS | Effect.INTERRUPT
MCU = Microcontroller.named("8051-12mhz")


def left(design, effects, **changes):
    """Return the only rung with these effects."""
    stair = (("some", "", timing_with(effects)),)
    return compare_behaviour(design, staircase=stair, phases=6, edges=8000, **changes).rungs[0]


@pytest.mark.parametrize("hold_latch", [False, True])
@pytest.mark.parametrize("design", Design)
def test_no_difference_is_left(design, hold_latch):
    if design is Design.B and hold_latch:
        pytest.skip("the lines of Design B end at the processor: it has no latch")
    rung = left(design, ALL, hold_latch=hold_latch)
    for part in (rung.steady, rung.long):
        assert part.insertions > 25
        assert (part.unmatched, part.worst_clocks, part.share_zero, part.share_same) == (0, 0.0, 1.0, 1.0)
    assert rung.identical


@pytest.mark.sweep
@pytest.mark.parametrize("design", Design)
def test_no_difference_is_left_at_any_phase(design):
    found = compare_behaviour(design, edges=300_000, seed=1)
    assert found.good
    assert found.rungs[-1].steady.insertions > 3 * 2 * 144


@pytest.mark.parametrize("without", [Effect.READINGS, Effect.INTERRUPT, Effect.ARMING])
@pytest.mark.parametrize("design", Design)
def test_each_effect_is_needed(design, without):
    if design is Design.B and without is Effect.ARMING:
        pytest.skip("Design B does not arm: it copies")
    rung = left(design, ALL & ~without)
    assert not rung.identical
    assert rung.long.worst_clocks > 0.0 or rung.long.share_same < 1.0


@pytest.mark.parametrize("rung", range(len(STAIRCASE) - 1))
def test_no_earlier_rung_is_good(rung):
    found = compare_behaviour(Design.C, phases=6, edges=8000, staircase=STAIRCASE[rung : rung + 1])
    assert not found.good


def test_the_report_differs_by_the_cycle_that_its_words_give_design_c_too_much():
    """Five cycles to the first change in the report's words, four in the program, a quarter more to the pin."""
    report = Timing.of(Design.C, Processor.MCS51)
    measured = Timing.of(Design.C, Processor.FIRMWARE)
    assert (report.decide_ps, measured.decide_ps) == (5_000_000, 4_250_000)


@pytest.mark.parametrize("switched_off", [False, True])
@pytest.mark.parametrize("design", Design)
def test_at_rest_and_with_the_switch_open(design, switched_off):
    """Insertions at rest, a total beyond the window, one back to zero, and the switch open meanwhile."""
    board = Board(design, MCU)
    board.start_up()
    tick = next(
        int(row.split()[0], 16)
        for row in MCU.image(design).with_suffix(".sym").read_text().splitlines()
        if row.split()[1] == "tick"
    )
    while board.cpu.pc != tick:
        board.idle(until_ps=board.now_ps + 1_000_000)
    begin_ps = board.cpu.cycles * 1_000_000
    box = Injector(InjectorSettings(design=design, timing=timing_with(ALL)(design, begin_ps)), initial=0)
    seen = []
    for number, total in enumerate((2, -1, 60, 60, 0)):
        at_ps = begin_ps + 20_000_000_000 * (number + 1) + 123_456_789
        board_part, box_part = board.idle(until_ps=at_ps), box.process(EdgeStream([], [], initial=0), until_ps=at_ps)
        if number:
            seen.append((board_part, box_part))
        on = not (switched_off and number in (1, 3))
        board.switch(on)
        box.enable(on, at_ps=at_ps)
        board.ask(total, large=True)
        box.request(total, at_ps=at_ps)
    seen.append(
        (board.idle(until_ps=at_ps + 10**11), box.process(EdgeStream([], [], initial=0), until_ps=at_ps + 10**11))
    )
    for of_board, of_box in seen:
        np.testing.assert_array_equal(of_box.times_ps, of_board.times_ps)
        np.testing.assert_array_equal(of_box.levels, of_board.levels)
    assert box.insertions.completed == board.words.completed == 0
    assert box.insertions.inserted > 50


@pytest.mark.parametrize("hold_latch", [False, True])
@pytest.mark.parametrize("design", Design)
def test_an_axis_that_leaves_its_rest_at_any_moment(design, hold_latch):
    """The first transition at every third of a cycle from before the looks at rest to behind the insertion."""
    if design is Design.B and hold_latch:
        pytest.skip("the lines of Design B end at the processor: it has no latch")
    board = Board(design, MCU, hold_latch=hold_latch)
    board.start_up()
    begin_ps = _next_reading(board, *_addresses(MCU, design))
    begun = board.snapshot()
    edges = RealEdges.HOLD if hold_latch else RealEdges.MERGE
    settings = InjectorSettings(design=design, timing=timing_with(ALL)(design, begin_ps), real_edges=edges)

    def both(times_ps):
        exercise = Exercise(
            times_ps=np.asarray(times_ps, np.int64),
            levels=np.array([1, 3, 2, 0] * 3, np.uint8)[: len(times_ps)],
            asked_ps=np.array([begin_ps + 1_500_000_000]),
            totals=np.array([1]),
            end_ps=begin_ps + 6_000_000_000,
        )
        board.restore(begun)
        of_board = _run(exercise, lambda total, _: board.ask(total, large=True), board.process)
        box = Injector(settings, initial=0)
        of_box = _run(exercise, lambda total, at_ps: box.request(total, at_ps=at_ps), box.process)
        np.testing.assert_array_equal(of_box.times_ps, of_board.times_ps)
        np.testing.assert_array_equal(of_box.levels, of_board.levels)
        assert box.insertions.completed == board.words.completed
        return of_board, box.insertions.completed

    first_ps = int(both([])[0].times_ps[0])
    for thirds in range(-28 * 3, 12 * 3):
        leaves_ps = first_ps + thirds * 1_000_000 // 3
        inserted = both([leaves_ps, first_ps + 2_000_000_000])[1]
        # the Original has its latch closed 8 cycles before the first change, and looks in S5P2 of the cycle that then
        # begins; an axis that has left state 1 by that time does not come back to it
        left = design is Design.ORIGINAL and thirds / 3 < (-8.0 if hold_latch else -7.25)
        assert inserted == (0 if left else 1), thirds
        # a second one while the latch may still be closed, then a motion in which the next search inserts
        both([leaves_ps, *(leaves_ps + 2_500_000 + 60_000_000 * np.arange(11)).tolist()])


def test_insertions_are_read_off_the_lines():
    """Two inversions of Design C, 4.25 and 5.25 us behind the look, which sees a transition of 0.75 us before."""
    exercise = dataclasses.replace(
        long_run(Design.C, 100, 0),
        times_ps=np.array([10_000_000, 200_000_000]),
        levels=np.array([1, 3], np.uint8),
        asked_ps=np.array([0]),
        totals=np.array([1]),
    )
    lines = EdgeStream([10_000_000, 15_000_000, 16_000_000, 200_000_000], [1, 3, 2, 0], initial=0)
    behind, stretch, changes = insertions_of(Design.C, exercise, lines, Timing.of(Design.C, Processor.FIRMWARE))
    assert (behind.tolist(), stretch.tolist(), changes.tolist()) == ([0], [0], [[5_000_000, 6_000_000]])


def test_steady_motion_has_every_phase_of_a_cycle():
    """A clock apart over twelve cycles, and the same behind every transition, in loops of 2 and 6 cycles."""
    trials = steady_motion(Design.B, 144)
    clocks = {round((trial.times_ps[0] % 12_000_000) * 12 / 1e6) % 144 for trial in trials}
    assert clocks == set(range(144))
    assert all(np.all(np.diff(trial.times_ps) % 6_000_000 == 0) for trial in trials)
    assert len(trials) == 3 * 2 * 2 * 144


@pytest.mark.parametrize(("name", "value"), [("phases", 0), ("phases", 145), ("edges", 99), ("seed", -1)])
def test_ranges(name, value):
    with pytest.raises(ArgumentError, match=name):
        compare_behaviour(Design.C, **{name: value})


@pytest.mark.parametrize("real_edges", RealEdges)
@pytest.mark.parametrize("design", Design)
def test_good_order_of_switching_off(design, real_edges):
    """An insertion under way is carried to its end before the power goes; with it the box starts anew."""
    settings = InjectorSettings(design=design, timing=Timing.of(design, Processor.FIRMWARE), real_edges=real_edges)
    box = Injector(settings, initial=0)
    box.request(3, at_ps=0)
    begun = box.process(EdgeStream([], [], initial=0), until_ps=3_000_000_000)
    assert begun.times_ps.size > 0
    in_the_middle_ps = int(begun.times_ps[0]) + 500_000
    other = Injector(settings, initial=0)
    other.request(3, at_ps=0)
    head = other.process(EdgeStream([], [], initial=0), until_ps=in_the_middle_ps)
    other.shut_down(at_ps=in_the_middle_ps)
    tail = other.process(EdgeStream([], [], initial=0), until_ps=10**10)
    if design is Design.B:
        assert head.times_ps.size == 1  # a step is one change
    else:
        assert head.times_ps.size + tail.times_ps.size == design.step_counts
    other.power(True, at_ps=10**10)
    other.enable(True, at_ps=10**10)
    other.request(1, at_ps=10**10)
    assert other.process(EdgeStream([], [], initial=0), until_ps=2 * 10**10).times_ps.size >= design.step_counts
