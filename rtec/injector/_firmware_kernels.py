"""Compiled timing of the firmware in the 12-clock part: what the box calls, event by event."""

from __future__ import annotations

from rtec._jit import Record, helper
from rtec.injector._design_kernels import B
from rtec.injector._firmware_copy_kernels import (
    begin_reading_b,
    begin_work_b,
    copy_loop,
    fire_b,
)
from rtec.injector._firmware_pins_kernels import (
    BREAK,
    CHANGING,
    COPYING,
    COUNTING,
    DECODER_PS,
    ENDING,
    FAR,
    IDLING,
    INTERRUPT,
    KEEP,
    LATCHING,
    LEVELLING,
    OFF,
    OPENING,
    READINGS,
    RESTING,
    circuit,
    go,
    plan,
    see,
    seeing_cycle,
    write_down,
)
from rtec.injector._firmware_reading_kernels import see_owed
from rtec.injector._firmware_search_kernels import (
    begin_reading,
    begin_work,
    break_in,
    fire_at_rest,
    fire_insertion,
    fire_reading,
    fire_search,
)
from rtec.signal._kernels import NEVER, count_delta


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
    elif RESTING <= s.place <= OPENING:
        order = fire_at_rest(s)
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
    s.half = 1 if s.design == B else 0  # Design B's first copy, when switched on, is taken for a transition
    s.running = 0
    s.owed = 0
    s.rest = 0
    s.fast = 0
    s.accepted = s.completed
    s.read_count = s.count
    if s.effects & READINGS != 0 and s.design == B:
        begin_reading_b(s, 0)
    elif s.effects & READINGS != 0:
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
