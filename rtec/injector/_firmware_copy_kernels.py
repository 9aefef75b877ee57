"""Compiled timing of the firmware: Design B, which copies its lines in a loop and between all other work."""

from __future__ import annotations

from rtec._jit import Record, step
from rtec.injector._firmware_pins_kernels import (
    ADVANCE,
    BREAK,
    CONFIRMING,
    COPYING,
    COUNTING,
    DRIVE,
    ENDING,
    FAR,
    INTERRUPT,
    KEEP,
    PASSING,
    READING_CYCLES,
    REQUESTING,
    STEPPING,
    WRITING,
    go,
    put,
    time_of,
)
from rtec.injector._firmware_reading_kernels import (
    count_in_reading,
    count_insertion,
    end_reading,
    request_in_reading,
    see_owed,
)


@step
def pass_next(s: Record, index: int, look: int) -> None:
    """Go on to the copy ``index`` of a job."""
    go(s, PASSING, look, look, 0)
    s.piece = index


@step
def begin_reading_b(s: Record, cycle: int) -> None:
    """Begin a reading, with the first copy after the timer is set."""
    s.alarm = cycle + READING_CYCLES
    pass_next(s, 0, cycle + 10)


@step
def void_gate(s: Record) -> None:
    """Stop the gate's timer and forget what it said."""
    s.running = 0
    s.over = FAR


@step
def copy_loop(s: Record, cycle: int) -> None:
    """Copy in the waiting loop from ``cycle`` on."""
    go(s, COPYING, cycle, cycle, 0)


@step
def begin_work_b(s: Record, cycle: int) -> None:
    """Plan the next insertion, or only copy."""
    if s.owed == 0 or s.fast == 1:
        void_gate(s)
        copy_loop(s, cycle + (6 if s.owed == 0 else 8))
    else:
        pass_next(s, 30, cycle + 6)


@step
def piece_of_reading(s: Record) -> tuple[int, int]:
    """Return the cycles from this copy of a reading to the next one, and which that is."""
    i = s.piece
    if i == 1:
        return 18 + (1 if s.delta < 0 else 0), 2
    if i == 2:
        return 25, 3
    if i == 3:
        return 22, 4
    if i == 6:
        if s.enabled == 1:
            return 24, 7
        return (32 if s.requested == 0 else 34), 13
    if i == 7:
        return 15, 8
    if i == 8:
        return 18, (13 if s.judging == 0 else 9)
    if i == 9:
        return (19, 11) if s.judging == 17 else (15 if s.judging == 20 else 11, 10)
    if i == 10:
        return 15, 11
    if i == 11:
        return 14, 13
    if i == 16:
        return 14, 17
    if i == 17:
        return 20, 18
    if i == 23:
        return 15, 24
    return 16, i + 1  # the words to the PC, two at a time


@step
def fire_pass(s: Record) -> None:
    """Go on from a copy of a job; ``at`` is its look, later by what the copying took."""
    i, look = s.piece, s.at
    if i == 0:
        go(s, COUNTING, look, look + 10, 0)
    elif i == 4:
        go(s, REQUESTING, look, look + 13, 0)
    elif i == 5:
        go(s, CONFIRMING, look, look + 11, 0)
    elif i == 24:
        go(s, ENDING, look, look + 7, 0)
    elif i in (13, 42):
        if s.enabled == 1:
            pass_next(s, i + 1, look + 19)
        else:
            see_owed(s)
            if i == 13:
                pass_next(s, 16, look + 21)
            else:
                begin_work_b(s, look + 21)
    elif i in (14, 43):
        see_owed(s)
        if s.owed == 1:
            pass_next(s, i + 1, look + 21)
        elif i == 14:
            pass_next(s, 16, look + 22)
        else:
            begin_work_b(s, look + 22)
    elif i == 15:
        pass_next(s, 16, look + 10)
    elif i == 44:
        begin_work_b(s, look + 10)
    elif i == 30:
        pass_next(s, 31, look + 14 + s.minus)
    elif i == 31:
        if s.rest == 0:
            copy_loop(s, look + 8)
        elif s.moved == 1:
            copy_loop(s, look + 10)
        else:
            s.trigger_ps = s.next_ps
            put(s, STEPPING, look + 17)
    elif i == 40:
        pass_next(s, 41, look + 18 + 2 * (1 if s.sign < 0 else 0))
    elif i == 41:
        pass_next(s, 42, look + 18)
    else:
        cycles, following = piece_of_reading(s)
        pass_next(s, following, look + cycles)


@step
def copied(s: Record, look: int) -> None:
    """Go on from a copy of the waiting loop: insert, or time."""
    s.moved = 1
    if s.over <= look + 9:
        s.trigger_ps = s.last_edge_ps
        put(s, STEPPING, look + 17)
        return
    if s.owed == 0:
        copy_loop(s, look + 14)
        return
    timing = look + 16
    if s.running == 1:
        if s.half == 0:
            s.half = 1
            copy_loop(s, look + 21)
            return
        s.half = 0
        s.refused += 1
        timing = look + 19
    if s.fast == 1:
        copy_loop(s, timing + 2)
        return
    if s.over > timing + 4:  # what has run out stays so
        s.over = timing + (4 if s.running == 1 else 6) + s.gate_counts
    s.half = 0
    s.running = 1
    copy_loop(s, timing + 8)


@step
def passed(s: Record, look: int) -> None:
    """Take a transition met in a job as the one between; a second one makes void what was timed."""
    s.moved = 1
    if s.half == 0:
        s.half = 1
        s.at = look + 9
    else:
        s.half = 0
        void_gate(s)
        s.at = look + 10


@step
def fire_b(s: Record) -> int:
    """Go on in Design B; return what its lines are to do."""
    if s.place == COPYING:
        if s.event == BREAK:
            begin_reading_b(s, s.event_cycle + (4 if s.effects & INTERRUPT != 0 else 0))
        else:
            s.sampled = s.ab_in
            look = s.event_cycle
            put(s, WRITING, look + 9)
            s.piece = -1
    elif s.place == PASSING:
        if s.ab_in != s.sampled:
            s.sampled = s.ab_in
            put(s, WRITING, s.at + 9)
        else:
            fire_pass(s)
    elif s.place == WRITING:
        look = s.at - 9
        if s.piece < 0:
            copied(s, look)
        else:
            passed(s, look)
            fire_pass(s)
        return DRIVE
    elif s.place == STEPPING:
        s.sign = -1 if s.minus == 1 else 1
        count_insertion(s, time_of(s, s.at))
        void_gate(s)
        s.half = 0
        see_owed(s)
        pass_next(s, 40, s.at + 9)
        return ADVANCE
    elif s.place == COUNTING:
        count_in_reading(s)
        pass_next(s, 1, s.begin + 20)
    elif s.place == REQUESTING:
        s.asked = s.requested
        pass_next(s, 5, s.begin + 18)
    elif s.place == CONFIRMING:
        if (s.requested ^ s.asked) & 255 == 0:
            request_in_reading(s)
            pass_next(s, 6, s.begin + 24)
        else:  # the PC wrote between the bytes: not until the next reading
            s.judging = 0
            pass_next(s, 6, s.begin + 20)
    else:
        begin_work_b(s, end_reading(s, s.at))
    return KEEP
