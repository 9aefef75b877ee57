"""Compiled timing of the firmware in the 12-clock part: where its processor waits, and what ends the waiting.

A list of waiting loops and of the work between them, with the cycles that they take; no instruction is executed.
The box's own next event is the next look that can tell something new, so a loop that waits costs nothing. Cycle k
begins at ``origin_ps + k * cycle_ps`` and samples its pins ``sample_ps`` later; an output changes at the beginning
of a cycle.

A look is the cycle whose S5P2 sees the pin; a boundary is a cycle in which an instruction begins.
Source: listings of `firmware_model/images`, docs/firmware.md.
"""

from __future__ import annotations

from rtec._jit import Record, helper, step
from rtec.injector._design_kernels import ORIGINAL
from rtec.signal._kernels import NEVER

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
 ARMING_3, ARMED, LATCHING, READING_STATE, CHANGING, RELEASING, LEVELLING, RESTING, RESTING_LOW, CLOSING, CLOSED,
 OPENING, COPYING, WRITING, PASSING, STEPPING, CONFIRMING) = range(30)  # fmt: skip

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
    """Be at a place whose look is in cycle ``at``; instructions on the way begin at ``begin`` + the bits of cuts."""
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
