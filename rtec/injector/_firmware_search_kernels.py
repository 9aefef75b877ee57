"""Compiled timing of the firmware: readings, search and insertion of the Original, A and C."""

from __future__ import annotations

from rtec._jit import Record, step
from rtec.injector._design_kernels import ORIGINAL, A, C
from rtec.injector._firmware_pins_kernels import (
    ADVANCE,
    ARMED,
    ARMING,
    ARMING_1,
    ARMING_2,
    ARMING_3,
    BETWEEN,
    BETWEEN_FELL,
    CHANGING,
    CLOSED,
    CLOSING,
    COMPARING,
    COUNTING,
    DRIVE,
    ENDING,
    FIRST,
    GATED,
    IDLING,
    INTERRUPT,
    KEEP,
    LATCHING,
    LEVELLING,
    OPENING,
    OVER,
    READING_CYCLES,
    READING_STATE,
    RELEASING,
    REQUESTING,
    RESTING,
    RESTING_LOW,
    RESUMING,
    TIMED,
    TIMING,
    TIMING_CUTS,
    TO_READING,
    WAITING,
    go,
    line,
    loop,
    put,
    remembered,
    search,
    see,
    time_of,
)
from rtec.injector._firmware_reading_kernels import (
    count_in_reading,
    count_insertion,
    end_reading,
    request_in_reading,
    see_owed,
)
from rtec.signal._kernels import state_of_level


@step
def begin_reading(s: Record, cycle: int) -> None:
    """Read decoder and request, answer, and see what is owed."""
    s.alarm = cycle + READING_CYCLES
    go(s, COUNTING, cycle, cycle + 12, 0)


@step
def fire_reading(s: Record) -> None:
    """Go on in a reading (Original, A, C)."""
    if s.place == COUNTING:
        count_in_reading(s)
        go(s, REQUESTING, s.at, s.at + 56 + (1 if s.delta < 0 else 0), 0)
    elif s.place == REQUESTING:
        request_in_reading(s)
        see_owed(s)
        late = s.judging + (s.owed if s.enabled == 1 else -12)
        go(s, ENDING, s.at, s.at + 136 + late, 0)
    else:
        begin_work(s, end_reading(s, s.at))


# --- the search of Original, A and C ---
@step
def begin_work(s: Record, cycle: int) -> None:
    """Insert, search, or wait for the next reading."""
    if s.owed == 0 or s.fast == 1:
        go(s, IDLING, cycle, cycle + (2 if s.owed == 0 else 4), 0)
    elif s.rest == 1:
        go(s, RESTING, cycle, cycle + 6, 0)
    else:
        begin_search(s, cycle + 6)


@step
def begin_search(s: Record, cycle: int) -> None:
    """Go on timing where the last timing still holds, else look for a first transition."""
    s.rest = 0
    if s.design == ORIGINAL:
        if s.timed == 1:
            loop(s, TIMED, cycle + 4, cycle + 4, 0, 2, 1)
        else:
            loop(s, FIRST, cycle + 4, cycle + 4, 0, 2, 1)
        return
    enabled = cycle + 1
    if s.design == A:
        enabled += 6 if s.minus == 1 else 4
    if s.timed == 1:
        search(s, RESUMING, enabled + 3, enabled + 3, 0)
    else:
        search(s, FIRST, enabled + 3, enabled + 3, 0)


@step
def start_timing(s: Record, begin: int, noting: int, cuts: int, level: int) -> None:
    """Start the gate's timer behind a transition; what leads there begins at ``begin``."""
    at = noting + (7 if s.design == ORIGINAL else 9)
    cuts |= (TIMING_CUTS & (0x7F if s.design == ORIGINAL else 0x1FF)) << (noting - begin)
    if s.design == ORIGINAL:
        loop(s, TIMED, begin, at, cuts, 2, 1)
    elif level == 1:
        search(s, TIMED, begin, at, cuts)
    else:
        loop(s, GATED, begin, at, cuts, 4, 1)
    s.half_gate = 0
    s.over_before = s.over
    s.over = noting + 5 + s.gate_counts
    s.chores = TIMING
    s.noting = noting
    s.noted = level
    s.refusing = 0


@step
def refuse(s: Record, begin: int, noting: int, cuts: int, level: int) -> None:
    """Refuse a transition that came too early, and time from it."""
    start_timing(s, begin, noting, cuts, level)
    s.refusing = 1


@step
def arm(s: Record, cycle: int) -> None:
    """Make ready for the transition to the awaited level, from ``cycle`` on."""
    if s.effects & ARMING == 0:
        loop(s, ARMED, cycle, cycle, 0, 2, s.awaited)
    elif s.design == ORIGINAL:
        search(s, ARMING_2, cycle, cycle, 0)
    elif s.design == A:
        search(s, ARMING_1, cycle, cycle, 0)
    else:
        search(s, ARMING_1, cycle, cycle + 2, 1)


@step
def be_late(s: Record, look: int) -> None:
    """Take a transition that came while arming as the one between, or as too early."""
    came = s.awaited
    if s.half == 1:
        refuse(s, look + 2, look + 9, 0b1010101, came)
        return
    noting = look + 6
    at = noting + (4 if came == 0 else 3)
    cuts = 0b1010101 | 0b111 << 4 if came == 1 else 0b1010101 | 0b1111 << 4
    s.awaited = 1 - came
    begin = look + 2
    if s.design == A:
        search(s, ARMING_1, begin, at, cuts)
    else:
        search(s, ARMING_1, begin, at + 2, cuts | 1 << (at - begin))
    s.chores = BETWEEN if came == 1 else BETWEEN_FELL
    s.noting = noting
    s.refusing = 0


@step
def fire_search(s: Record) -> None:
    """Take what the look at this place tells."""
    look = s.event_cycle
    if s.place == FIRST:
        if s.design == ORIGINAL:
            loop(s, WAITING, look + 2, look + 2, 0, 2, 0)
        else:
            loop(s, WAITING, look + 2, look + 2, 0, 2, 1 - s.pin)
    elif s.place == WAITING:
        if s.design == ORIGINAL:
            start_timing(s, look + 2, look + 2, 0, 0)
        else:
            start_timing(s, look + 2, look + 4, 1, s.awaited)
    elif s.place == RESUMING:
        if remembered(s, look):
            search(s, FIRST, look + 2, look + 2, 0)
        else:
            search(s, COMPARING, look + 2, look + 3, 1)
    elif s.place == COMPARING:
        if s.pin != s.level:
            search(s, FIRST, look + 2, look + 4, 1)
        else:
            loop(s, GATED, look + 2, look + (4 if s.pin == 1 else 6), 1 if s.pin == 1 else 5, 4, 1 - s.pin)
            s.half_gate = 0
    elif s.place == TIMED:
        if s.design == ORIGINAL:
            loop(s, GATED, look + 2, look + 2, 0, 4, 0)
        elif remembered(s, look):
            refuse(s, look + 2, look + 3, 1, 0)
        else:
            loop(s, GATED, look + 2, look + 2, 0, 4, 0)
            s.half_gate = 0
    elif s.place == GATED:
        if s.event == OVER:
            arm(s, look + 2)
        elif s.design == ORIGINAL:
            refuse(s, look + 2, look + 5, 0b11, 0)
        elif s.half_gate == 1:
            refuse(s, look + 2, look + 5, 0b101, s.awaited)
        else:
            came = s.awaited
            loop(s, GATED, look + 2, look + (6 if came == 0 else 5), 0b1111 if came == 0 else 0b111, 4, 1 - came)
            s.half_gate = 1
            s.chores = BETWEEN_FELL if came == 0 else BETWEEN
            s.noting = look + 2
            s.refusing = 0
    elif s.place == ARMING_1:
        if s.pin == s.awaited:
            be_late(s, look)
        else:
            search(s, ARMING_2, look + 2, look + 2, 0)
    elif s.place == ARMING_2:
        if s.design == ORIGINAL:
            if remembered(s, look):
                refuse(s, look + 2, look + 5, 0b11, 0)
            else:
                search(s, ARMING_3, look + 2, look + 4, 0b1)
        elif remembered(s, look):
            refuse(s, look + 2, look + 5, 0b101, s.awaited)
        else:
            search(s, ARMING_3, look + 2, look + 2, 0)
    elif s.place == ARMING_3:
        if s.pin != s.awaited:
            loop(s, ARMED, look + 2, look + 2, 0, 2, s.awaited)
        elif s.design == ORIGINAL:
            refuse(s, look + 2, look + 5, 0b11, 0)
        else:
            be_late(s, look)
    elif s.effects & INTERRUPT != 0 and s.alarm + 1 <= look + 2:  # the reading comes before interrupts are off
        break_in(s, look + 2)
    else:
        s.trigger_ps = s.last_edge_ps
        if s.design == C:
            s.origin = s.awaited
        begin_insertion(s, look + 3, look + 4)


@step
def break_in(s: Record, cycle: int) -> None:
    """Leave the search for a reading."""
    begin_reading(s, cycle + (TO_READING if s.effects & INTERRUPT != 0 else 0))


@step
def fire_at_rest(s: Record) -> int:
    """Insert while the axis rests, unless it has just begun to move; return what the gates are to do."""
    look = s.at
    if s.place == RESTING:
        if remembered(s, look):
            begin_search(s, look + 2)
        elif s.design == ORIGINAL:
            go(s, RESTING_LOW, look, look + 2, 0)  # in state 1 alone
        else:
            s.trigger_ps = s.next_ps
            if s.design == A:
                begin_insertion(s, look + 9 + (2 if s.minus == 1 else 0), look + 10 + (2 if s.minus == 1 else 0))
            else:
                put(s, LATCHING, look + 6)
                s.closing_cycle = look + 11
    elif s.place == RESTING_LOW:
        if s.pin == 1:
            begin_search(s, look + 2)
        else:
            put(s, CLOSING, look + 4)
    elif s.place == CLOSING:
        hold(s)
        go(s, CLOSED, look, look, 0)
        return DRIVE
    elif s.place == CLOSED:
        if s.pin == 1:  # it left state 1 before the latch was closed
            put(s, OPENING, look + 3)
        else:
            s.trigger_ps = s.next_ps
            begin_changing(s, look + 6)
    else:
        release(s)
        begin_search(s, look + 3)
        return DRIVE
    return KEEP


@step
def hold(s: Record) -> None:
    """Close the hold latch, if there is one."""
    if s.holds == 1:
        s.held = s.ab_in
        s.holding = 1


@step
def release(s: Record) -> None:
    """Open the hold latch at the beginning of the cycle ``at``."""
    if s.holding == 1:
        s.holding = 0
        see(s, s.at)


@step
def begin_insertion(s: Record, closing: int, latching: int) -> None:
    """Close the hold latch; ``closing`` is the cycle from which the first change is counted."""
    put(s, LATCHING, latching)
    s.closing_cycle = closing
    s.done = 0
    s.sign = -1 if s.minus == 1 else 1


@step
def begin_changing(s: Record, closing: int) -> None:
    """Go on to the first change of the Original, whose latch is closed already."""
    s.origin = 0
    s.done = 0
    s.sign = -1 if s.minus == 1 else 1
    put(s, CHANGING, closing + 2)


@step
def fire_insertion(s: Record) -> int:
    """Go on in an insertion; return what the gates are to do."""
    closing = s.closing_cycle
    if s.place == LATCHING:
        hold(s)
        if s.design == A:
            go(s, READING_STATE, s.at, closing + 1, 0)
        elif s.design == C and s.rest == 1:
            go(s, READING_STATE, s.at, s.at + 1, 0)
        else:
            if s.design == ORIGINAL:
                s.origin = 0
            put(s, CHANGING, closing + 2)
        return DRIVE
    if s.place == READING_STATE:
        s.origin = state_of_level(line(s)) if s.design == A else s.pin
        s.done = 0
        s.sign = -1 if s.minus == 1 else 1
        put(s, CHANGING, closing + (6 if s.design == A else 2))
        return KEEP
    if s.place == CHANGING:
        put(s, CHANGING, s.at + 1)
        changes = 2 if s.design == C else 4
        if s.done + 1 == changes:
            count_insertion(s, time_of(s, s.at - 1))
            s.place = RELEASING
        return ADVANCE
    if s.place == RELEASING:
        released = s.at
        release(s)
        if s.design == ORIGINAL:
            inserted = released + (1 if s.minus == 1 else 3)
            s.over = inserted + 2 + s.gate_counts
            s.forgotten = inserted + 4
            book(s, inserted + 8)
        else:
            inserted = released + 2
            s.over = inserted + 3 + s.gate_counts
            s.forgotten = inserted + 5
            go(s, LEVELLING, released, inserted + 5, 0)
        return DRIVE
    s.level = s.pin
    s.half = 0
    book(s, s.at + 8)
    return KEEP


@step
def book(s: Record, cycle: int) -> None:
    """Report the insertion and go back to work; ``cycle`` is that of the call, but for one where the axis moved."""
    s.timed = 1
    minus = s.minus
    if s.rest == 0:
        s.moved = 1
        cycle += 1
    see_owed(s)
    cycle += 2 + 47 + (2 if minus == 1 else 0) + (s.owed if s.enabled == 1 else -12)
    begin_work(s, cycle)
