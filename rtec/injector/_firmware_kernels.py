"""Compiled timing of the firmware in the 12-clock part: when its processor looks, what it does in between, and how long.

A list of waiting loops and of the work between them, with the cycles that they take; no instruction is executed. The
box's own next event is the next look that can tell something new, so a loop that waits costs nothing. Cycle k begins
at ``origin_ps + k * cycle_ps`` and samples its pins ``sample_ps`` later; an output changes at the beginning of a cycle.

Letters: ``look`` or ``l`` is the cycle whose S5P2 sees the pin; a boundary is the cycle in which an instruction begins.
Source: listings of `firmware_model/images`, docs/firmware.md.
"""

from __future__ import annotations

from rtec._jit import Record, helper, step
from rtec.signal._kernels import NEVER, count_delta, state_of_level

ORIGINAL, A, B, C = 0, 1, 2, 3
READINGS, INTERRUPT, ARMING = 1, 2, 4
"""Effects that can be left out, to show what each of them does."""

FAR = NEVER // 4_000_000
"""A cycle that never comes."""
READING_CYCLES = 1001
"""From the beginning of a reading to the flag of timer 0 that asks for the next one."""
TO_READING = 12
"""From the boundary at which timer 0 breaks into a search to the beginning of the reading."""
START_UP_CYCLES = 312
DECODER_PS = 200_000
"""The decoder chip counts a transition after three of its clocks at 14 MHz."""

# where the processor is
(OFF, IDLING, COUNTING, REQUESTING, ENDING, RESUMING, COMPARING, FIRST, WAITING, TIMED, GATED, ARMING_1, ARMING_2,
 ARMING_3, ARMED, LATCHING, READING_STATE, CHANGING, RELEASING, LEVELLING, RESTING, RESTING_LOW, COPYING, WRITING,
 PASSING, STEPPING) = range(26)  # fmt: skip

# what ends its waiting
LOOK, OVER, BREAK = 0, 1, 2

# what the gates are to do
KEEP, DRIVE, ADVANCE = 0, 1, 2

# what it writes down between two looks
NOTHING, TIMING, BETWEEN, BETWEEN_FELL = 0, 1, 2, 3

TIMING_CUTS = 0b111101111
"""Boundaries of the instructions that start the gate's timer, one bit a cycle; the fourth takes two cycles."""


# --- time ---
@step
def time_of(s: Record, cycle: int) -> int:
    """Return when a cycle begins."""
    return int(s.origin_ps + cycle * s.cycle_ps)


@step
def seeing_cycle(s: Record, t_ps: int) -> int:
    """Return the first cycle that samples its pins at or after ``t_ps``."""
    return int(-((s.origin_ps + s.sample_ps - t_ps) // s.cycle_ps))


# --- what the pins tell ---
@step
def line(s: Record) -> int:
    """Return the levels behind the hold latch."""
    return int(s.held if s.holding == 1 else s.ab_in)


@step
def circuit(s: Record) -> int:
    """Return the level that the AND (0: A and B are low) or the exclusive OR of the lines puts on the pin INT0."""
    ab = line(s)
    return int((ab | ab >> 1) & 1 if s.design == ORIGINAL else (ab ^ ab >> 1) & 1)


@step
def see(s: Record, cycle: int) -> None:
    """Let the pins be as the lines are from ``cycle`` on; the edge latch IE0 keeps a fall between two cycles."""
    level = circuit(s)
    if cycle > s.pin_cycle:
        s.pin_before = s.pin
        s.fell_before = s.fell
    s.pin = level
    s.fell = cycle + 1 if s.pin_before == 1 and level == 0 else s.fell_before
    s.pin_cycle = cycle


@step
def remembered(s: Record, cycle: int) -> bool:
    """Return whether IE0 is set as an instruction in ``cycle`` reads it."""
    if s.effects & ARMING == 0:
        return False
    # a fall in this very cycle is seen in the next one, and must not hide the one before
    return bool(s.forgotten < s.fell <= cycle or s.forgotten < s.fell_before <= cycle)


# --- the places and how they end ---
@step
def go(s: Record, place: int, begin: int, at: int, cuts: int) -> None:
    """Be at a place whose look is in cycle ``at``, reached by instructions that begin at ``begin`` + the bits of cuts."""
    s.place = place
    s.begin = begin
    s.at = at
    s.cuts = cuts
    s.turn = 0
    s.exact = 0
    s.breakable = 0
    s.chores = NOTHING


@step
def search(s: Record, place: int, begin: int, at: int, cuts: int) -> None:
    """Be at a place of the search: timer 0 may break in."""
    go(s, place, begin, at, cuts)
    s.breakable = 1


@step
def loop(s: Record, place: int, begin: int, at: int, cuts: int, turn: int, awaited: int) -> None:
    """Wait in a loop of the search for the pin to be at a level."""
    search(s, place, begin, at, cuts)
    s.turn = turn
    s.awaited = awaited


@step
def put(s: Record, place: int, cycle: int) -> None:
    """Change an output at the beginning of a cycle."""
    go(s, place, cycle, cycle, 0)
    s.exact = 1


@step
def turn_from(first: int, turn: int, cycle: int) -> int:
    """Return the first of the cycles ``first``, ``first + turn``, ... from ``cycle`` on."""
    return first if cycle <= first else first + (cycle - first + turn - 1) // turn * turn


@step
def boundary(s: Record, cycle: int) -> int:
    """Return the first cycle from ``cycle`` on in which the search begins an instruction."""
    for i in range(s.at - s.begin):
        if s.cuts >> i & 1 == 1 and s.begin + i >= cycle:
            return int(s.begin + i)
    if cycle <= s.at:
        return int(s.at)
    return turn_from(s.at, 2, cycle) if s.turn > 0 else FAR


@helper
def plan(s: Record) -> None:
    """Find the next event: a look that tells something, the gate's timer, or the break for a reading."""
    if s.place == OFF:
        s.next_ps = NEVER
        return
    cycle = s.at
    event = LOOK
    if s.place == IDLING:
        cycle = turn_from(s.at, 2, s.alarm) if s.effects & INTERRUPT != 0 else max(s.at, s.alarm - 1)
    elif s.place == COPYING:
        check = turn_from(s.at + 4, 6, s.alarm) if s.effects & INTERRUPT != 0 else max(s.at, s.alarm - 1)
        cycle = FAR
        if s.ab_in != s.sampled:
            cycle = turn_from(s.at, 6, s.pin_cycle)
        if check < cycle:
            cycle = check
            event = BREAK
    elif s.turn > 0:
        within = s.turn - 2
        cycle = FAR
        if s.pin == s.awaited:
            cycle = turn_from(s.at + within, s.turn, s.pin_cycle)
        if s.turn == 4:
            check = turn_from(s.at, 4, s.over)
            if check < cycle:
                cycle = check
                event = OVER
    if s.breakable == 1:
        if s.effects & INTERRUPT != 0:
            ends = boundary(s, max(s.alarm + 1, s.begin))
        else:
            ends = max(s.alarm - 1, s.begin)
        if ends <= cycle:
            cycle = ends
            event = BREAK
    s.event = event
    s.event_cycle = cycle
    if cycle >= FAR:
        s.next_ps = NEVER
    elif s.exact == 1:
        s.next_ps = time_of(s, cycle)
    else:
        s.next_ps = time_of(s, cycle) + s.sample_ps + 1  # a transition at the very instant is seen


@step
def write_down(s: Record, until: int) -> None:
    """Carry out what the instructions before the cycle ``until`` write down, one a cycle from ``s.noting`` on."""
    if s.chores == NOTHING:
        return
    n = until - s.noting
    if n > -1 and s.refusing == 1:
        s.refused += 1
    if n > 0:
        s.timed = 0
    if n > 1:
        s.moved = 1
    if n > 2 and s.chores != BETWEEN:
        s.forgotten = s.noting + 3  # the instruction writes at its end
    if s.chores != TIMING:
        s.half = 1 if n > 0 else s.half
    elif n > (6 if s.design == ORIGINAL else 8):
        s.timed = 1
        s.half = 0
        s.level = s.noted
    elif n <= 0:
        s.over = s.over_before
    s.chores = NOTHING


# --- readings ---
@step
def begin_reading(s: Record, cycle: int) -> None:
    """Read decoder and request, answer, and see what is owed."""
    s.alarm = cycle + READING_CYCLES
    s.rest = 0
    if s.design == B:
        pass_next(s, 0, cycle + 10)
    else:
        go(s, COUNTING, cycle, cycle + 12, 0)


@step
def count_in_reading(s: Record) -> None:
    """Take the decoder's count."""
    s.delta = s.count - s.read_count
    s.read_count = s.count


@step
def request_in_reading(s: Record) -> None:
    """Take the PC's total, where corrections are allowed, and note what its judgement takes longer."""
    change = s.requested - s.accepted
    if s.enabled == 0:
        s.judging = -9 if s.requested == 0 else -7
        return
    s.accepted = s.requested
    if change == 0:
        s.judging = 0
    elif -3 <= change <= 3:
        s.judging = 17
    else:
        s.judging = 20 if 0 < change <= 252 else 16


@step
def see_owed(s: Record) -> None:
    """Note whether an insertion is owed and of which sign."""
    s.owed = 1 if s.accepted != s.completed and s.enabled == 1 else 0
    if s.enabled == 1:
        s.minus = 1 if s.accepted < s.completed else 0


@step
def end_reading(s: Record, cycle: int) -> int:
    """Look at IE0 and at what was seen since the last reading; return the cycle in which the work begins."""
    fast = s.fast_counts
    s.fast = 1 if s.delta > fast or s.delta < -fast else 0
    s.rest = 0
    if remembered(s, cycle + 1):  # a test that also clears takes the pins of its own first cycle
        s.forgotten = cycle + 1
        s.timed = 0
        settled = cycle + 3
    elif s.moved == 1:
        settled = cycle + 4
    elif s.delta != 0:
        settled = cycle + 8
    else:
        s.rest = 1
        settled = cycle + 11
    s.moved = 0
    return int(settled + 3)


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
    """Make ready for the transition to the awaited level; ``cycle`` is where the gate's timer was found to be over."""
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
    """A transition came while arming: it is the one between, or too early."""
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
def fire_at_rest(s: Record) -> None:
    """Insert while the axis rests, unless it has just begun to move (Original: in state 1 alone)."""
    look = s.at
    if s.place == RESTING:
        if remembered(s, look):
            begin_search(s, look + 2)
        elif s.design == ORIGINAL:
            go(s, RESTING_LOW, look, look + 2, 0)
        else:
            s.trigger_ps = s.next_ps
            if s.design == A:
                begin_insertion(s, look + 9 + (2 if s.minus == 1 else 0), look + 10 + (2 if s.minus == 1 else 0))
            else:
                put(s, LATCHING, look + 6)
                s.closing_cycle = look + 11
    elif s.pin == 1:
        begin_search(s, look + 2)
    else:
        s.trigger_ps = s.next_ps
        begin_insertion(s, look + 7, look + 8)


@step
def begin_insertion(s: Record, closing: int, latching: int) -> None:
    """Close the hold latch; ``closing`` is the cycle from which the first change is counted."""
    put(s, LATCHING, latching)
    s.closing_cycle = closing
    s.done = 0
    s.sign = -1 if s.minus == 1 else 1


@step
def fire_insertion(s: Record) -> int:
    """Go on in an insertion; return what the gates are to do."""
    closing = s.closing_cycle
    if s.place == LATCHING:
        if s.holds == 1:
            s.held = s.ab_in
            s.holding = 1
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
        if s.holding == 1:
            s.holding = 0
            see(s, released)
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
def count_insertion(s: Record, t_ps: int) -> None:
    """Count the insertion whose last change is at ``t_ps``."""
    s.completed += s.sign
    s.inserted += 1
    s.longest_ps = max(s.longest_ps, t_ps - s.trigger_ps)


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


# --- Design B: copies in a loop, and between the pieces of all other work ---
@step
def pass_next(s: Record, index: int, look: int) -> None:
    """Go on to the copy ``index`` of a job."""
    go(s, PASSING, look, look, 0)
    s.piece = index


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
    if i == 5:
        return 24, 6
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
def fire_b(s: Record) -> int:
    """Go on in Design B; return what its lines are to do."""
    if s.place == COPYING:
        if s.event == BREAK:
            begin_reading(s, s.event_cycle + (4 if s.effects & INTERRUPT != 0 else 0))
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
            s.moved = 1
            void_gate(s)
            s.at = look + 8
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
        request_in_reading(s)
        pass_next(s, 5, s.begin + 18)
    else:
        begin_work_b(s, end_reading(s, s.at))
    return KEEP


# --- what the box calls ---
@helper
def firmware_fire(s: Record) -> int:
    """Carry out the processor's event at ``next_ps``; return what the gates are to do."""
    order = KEEP
    if s.design == B:
        order = fire_b(s)
    elif s.event == BREAK:
        write_down(s, s.event_cycle)
        break_in(s, s.event_cycle)
    elif s.place == IDLING:
        begin_reading(s, s.event_cycle + (4 if s.effects & INTERRUPT != 0 else 0))
    elif COUNTING <= s.place <= ENDING:
        fire_reading(s)
    elif LATCHING <= s.place <= LEVELLING:
        order = fire_insertion(s)
    elif s.place == RESTING or s.place == RESTING_LOW:
        fire_at_rest(s)
    else:
        write_down(s, s.event_cycle)
        fire_search(s)
    plan(s)
    if s.place == COUNTING:
        s.next_ps -= DECODER_PS + 1
    return order


@helper
def firmware_edge(s: Record, t_ps: int, before: int) -> None:
    """Let the processor's pins follow a transition at ``t_ps``."""
    s.count += count_delta(before, s.ab_in)
    if s.place == OFF:
        return
    if s.holding == 0:
        see(s, seeing_cycle(s, t_ps))
    if CHANGING >= s.place >= LATCHING:
        s.real_inside += 1
    if s.place != COUNTING:
        plan(s)


@helper
def firmware_request(s: Record, t_ps: int) -> None:
    """Take a new total where there are no readings, which would find it."""
    if s.effects & READINGS == 0:
        s.accepted = s.requested
        if s.place == IDLING or s.place == COPYING:
            see_owed(s)
            cycle = seeing_cycle(s, t_ps)
            if s.design != B:
                begin_work(s, cycle)
            elif s.owed == 1:
                begin_work_b(s, cycle)
            plan(s)


@helper
def firmware_start(s: Record) -> None:
    """Begin with a reading in cycle 0, all still."""
    s.alarm = FAR
    s.over = FAR
    s.forgotten = -FAR
    s.fell = -FAR
    s.fell_before = -FAR
    s.pin_cycle = -FAR
    s.pin = circuit(s)
    s.pin_before = s.pin
    s.moved = 0
    s.timed = 0
    s.half = 0
    s.running = 0
    s.owed = 0
    s.rest = 0
    s.fast = 0
    s.accepted = s.completed
    s.read_count = s.count
    if s.effects & READINGS != 0:
        begin_reading(s, 0)
    elif s.design == B:
        copy_loop(s, 0)
    else:
        go(s, IDLING, 0, 0, 0)
    plan(s)
    if s.place == COUNTING:
        s.next_ps -= DECODER_PS + 1


@helper
def firmware_off(s: Record) -> None:
    """Stop."""
    s.place = OFF
    s.next_ps = NEVER
