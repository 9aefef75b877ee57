"""The report's figures read off the board, and what a reset in the middle of an insertion does."""

import pytest

from rtec.board import Board, Microcontroller
from rtec.injector import Design
from rtec.signal import EdgeStream

US = 1_000_000
LEVELS = (0, 1, 3, 2)  # A + 2 B in the order of forward motion
STEP = {Design.ORIGINAL: 4, Design.A: 4, Design.B: 1, Design.C: 2}
MCU = Microcontroller.named("8051-12mhz")


def motion(begin_ps, gap_ps, count, *, direction=1, initial=0, first=0):
    state = LEVELS.index(initial)
    levels = [LEVELS[(state + direction * (k + 1)) % 4] for k in range(count)]
    return EdgeStream([begin_ps + first + k * gap_ps for k in range(count)], levels, initial=initial)


def homed(design, **options):
    board = Board(design, MCU, **options)
    assert board.start_up().name == "OK"
    return board


def test_the_originals_nine_microseconds():
    """At least 4 us to the first pulse, pulses 2 us wide that overlap by half, 2 us after (Yee 1992)."""
    board = homed(Design.ORIGINAL, hold_latch=True)
    board.ask(1)
    real = motion(board.now_ps, 60 * US, 30, first=345_678)
    out = board.process(real, until_ps=int(real.times_ps[-1]) + 60 * US)
    own = [k for k in range(len(out)) if int(out.times_ps[k]) not in set(real.times_ps.tolist())]
    a_up, b_up, a_down, b_down = (int(out.times_ps[k]) for k in own)
    assert [int(out.levels[k]) for k in own] == [1, 3, 2, 0]
    edge_ps = max(int(t) for t in real.times_ps if t < a_up)
    assert out.level_at(edge_ps) == 0, "A and B low"
    assert a_up - edge_ps >= 4 * US
    assert (a_down - a_up, b_down - b_up, a_down - b_up, b_down - a_up) == (2 * US, 2 * US, US, 3 * US)
    # then the lines are held for one cycle more: an edge that comes meanwhile reaches the controller behind it
    again = homed(Design.ORIGINAL, hold_latch=True)
    again.ask(1)
    before = real.times_ps <= edge_ps
    late = EdgeStream([*real.times_ps[before], b_down + US // 2], [*real.levels[before], 1], initial=0)
    held = again.process(late, until_ps=b_down + 20 * US)
    assert int(held.times_ps[-1]) == b_down + US
    # the program is busy with it still: a jump of 2 us, then `CLR ET0`
    single = homed(Design.ORIGINAL, hold_latch=True)
    single.ask(1)
    single.process(EdgeStream(real.times_ps[before], real.levels[before], initial=0), until_ps=b_down + 3 * US + 1)
    clear_et0 = bytes.fromhex("C2A9")
    assert single.cpu.code[single.cpu.pc :][:2] == clear_et0 or single.cpu.code[single.cpu.pc - 2 :][:2] == clear_et0


# --- resets


def inserting(design, sign):
    """A board at rest that inserts next, the same each time, and when its first change comes."""
    board = homed(design)
    board.ask(sign)
    return board


def first_change_ps(design, sign):
    board = inserting(design, sign)
    begin_ps = board.now_ps
    return int(board.idle(until_ps=begin_ps + 4000 * US).times_ps[0])


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("design", list(Design))
def test_a_reset_at_every_cycle_of_an_insertion(design, sign):
    """All lines are let go at once: illegal only where both pulses are on (docs/firmware.md, "Active low")."""
    change_ps = first_change_ps(design, sign)
    illegal_at = []
    for cycle in range(-6, 12):
        board = inserting(design, sign)
        reset_ps = change_ps + cycle * US + US // 3
        inserted = board.idle(until_ps=reset_ps)
        board.reset()
        assert int(board.cpu.sfr[0x90 - 0x80]) == 0xFF
        released = board.idle(until_ps=reset_ps + 1)
        # nothing drives the lines: the axis stands at 00, and B, whose lines come from the processor, has both high
        high = 3 if design is Design.B else 0
        jump = (LEVELS.index(high) - LEVELS.index(int(released.initial))) % 4
        assert [int(code) for code in released.levels] == ([high] if jump else [])
        assert (released.counts().net, released.counts().illegal) == {0: (0, 0), 1: (1, 0), 2: (0, 1), 3: (-1, 0)}[
            jump
        ]
        if jump == 2:
            illegal_at.append(cycle)
        if design is not Design.B and jump != 2:
            assert inserted.counts().net + released.counts().net in {0, STEP[design] * sign}
        # it starts again and takes home anew; then it corrects as before
        assert board.words.completed in {0, sign}
        assert board.start_up().name == "OK"
        words = board.words
        assert (words.position, words.completed, words.accepted) == (0, 0, 0)
        board.ask(sign)
        more = board.idle(until_ps=board.now_ps + 4000 * US)
        assert (more.counts().net, more.counts().illegal) == (STEP[design] * sign, 0)
        assert board.words.completed == sign
    # the changes come in cycles 0, 1, 2, 3: after the second, both pulses are on, or both inverters for good; B has
    # copied 00 before its step and 10 or 01 after it
    both = {Design.ORIGINAL: [1], Design.A: [1], Design.C: list(range(1, 12)), Design.B: list(range(-6, 0))}
    assert illegal_at == both[design]


@pytest.mark.parametrize("state", range(4))
@pytest.mark.parametrize("design", [Design.ORIGINAL, Design.A, Design.C])
def test_counts_of_the_encoder_are_right_after_a_reset(design, state):
    """The decoder is zeroed at start-up; what the axis moves from then on is what the words say."""
    board = homed(design)
    for _ in range(2):
        real = motion(board.now_ps, 50 * US, 40 + state, initial=int(board._state.ab_in), first=US)
        board.process(real, until_ps=board.now_ps + 4000 * US)
        board.reset()
        assert board.start_up().name == "OK"
        assert board.words.position == 0
    real = motion(board.now_ps, 50 * US, 50, direction=-1, initial=int(board._state.ab_in), first=US)
    board.process(real, until_ps=board.now_ps + 5000 * US)
    assert board.words.position == -50
