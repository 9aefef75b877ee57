"""Compiled parts of the controller's input: line receiver with digital filter, quadrature decoder, latches.

The receiver samples each line at the ticks of its clock, tick k at k / clock_hz, and takes a new level over once
``samples`` ticks in a row have seen it; a change that falls on a tick is seen by it. Nothing runs at the clock: each
raw change settles what the ticks before it must have seen.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rtec._jit import Record, helper, kernel, step
from rtec.signal._kernels import NEVER, count_delta, count_of_one_line, level_of_state, state_of_level
from rtec.units._time_kernels import PS_PER_S

LOG_LENGTH = 64
"""Illegal transitions kept with their times; all of them are counted."""

X1, X2, X4 = 1, 2, 4
IGNORE, FAULT, GUESS = 0, 1, 2
SIMULTANEOUS, UNRESOLVED = 0, 1
"""Classes of an illegal transition: both lines changed at one instant, or too soon after each other to tell apart."""

RECEIVER = np.dtype(
    [
        # parameters
        ("samples", np.int64),  # of the filter; 0: no filter, every change counts at once
        ("clock_hz", np.int64),
        ("tick_num", np.int64),  # the clock's period is tick_num / tick_den picoseconds
        ("tick_den", np.int64),
        ("ticks_per_ps", np.float64),
        ("unseen_ps", np.int64),  # a level that stands for so long is seen by a tick at least (0: there is no filter)
        ("sure_ps", np.int64),  # a level that has stood for longer is through the filter, wherever the ticks fell
        ("multiplication", np.int64),
        ("policy", np.int64),
        # state
        ("raw", np.int64),  # levels at the input
        ("accepted", np.int64),  # levels behind the filter
        ("changed_a_ps", np.int64),  # last raw change of each line
        ("changed_b_ps", np.int64),
        ("reference_ps", np.int64),  # a whole second, and the number of its tick
        ("reference_tick", np.int64),
        ("count", np.int64),
        ("direction", np.int64),
        # observations
        ("dipped_a_ps", np.int64),  # what changed_a_ps was when the line last went back to what the filter holds
        ("dipped_b_ps", np.int64),
        ("last_ps", np.int64),
        ("min_separation_ps", np.int64),
        ("filtered", np.int64),  # changes taken back before the filter saw them often enough
        ("simultaneous", np.int64),
        ("unresolved", np.int64),
        ("fault", np.int64),
        ("fault_ps", np.int64),
        ("index_count", np.int64),
        ("index_pulses", np.int64),
        ("probe_count", np.int64),
        ("probe_trips", np.int64),
        ("log_ps", np.int64, (LOG_LENGTH,)),
        ("log_class", np.int64, (LOG_LENGTH,)),
    ],
    align=True,
)


@helper
def first_tick(rx: Record, t_ps: int) -> int:
    """Return the number of the first tick at or after ``t_ps``, exactly, whatever the clock's period."""
    if t_ps - rx.reference_ps >= PS_PER_S or t_ps < rx.reference_ps:
        seconds = (t_ps - rx.reference_ps) // PS_PER_S
        rx.reference_ps += seconds * PS_PER_S
        rx.reference_tick += seconds * rx.clock_hz
    since_ps = t_ps - rx.reference_ps
    # the product in floating point is off by one at most, and the remainder tells; a division would cost more
    tick = int(since_ps * rx.ticks_per_ps)
    rest = since_ps * rx.tick_den - tick * rx.tick_num
    if rest < 0:
        tick -= 1
        rest += rx.tick_num
    elif rest >= rx.tick_num:
        tick += 1
        rest -= rx.tick_num
    return rx.reference_tick + tick + (1 if rest > 0 else 0)


@helper
def time_of_tick(rx: Record, tick: int) -> int:
    """Return the first whole picosecond at or after tick number ``tick``, near the reference."""
    return rx.reference_ps - (rx.reference_tick - tick) * rx.tick_num // rx.tick_den


@helper
def count_step(rx: Record, before_ab: int, after_ab: int, delta: int) -> None:
    """Count one transition, by ``delta`` where the multiplication counts it."""
    if rx.multiplication == X4:
        rx.count += delta
    elif (before_ab ^ after_ab) & 1 and (rx.multiplication == X2 or after_ab & 2 == 0):
        rx.count += delta  # x2 counts both edges of A; x1 those while B is low


@helper
def note_illegal(rx: Record, t_ps: int) -> None:
    """Record an illegal transition under the chosen policy."""
    kind = SIMULTANEOUS if rx.changed_a_ps == rx.changed_b_ps else UNRESOLVED
    n = rx.simultaneous + rx.unresolved
    if n < LOG_LENGTH:
        rx.log_ps[n] = t_ps
        rx.log_class[n] = kind
    if kind == SIMULTANEOUS:
        rx.simultaneous += 1
    else:
        rx.unresolved += 1
    if rx.policy == FAULT and rx.fault == 0:
        rx.fault = 1
        rx.fault_ps = t_ps
    elif rx.policy == GUESS and rx.direction != 0:
        between = level_of_state((state_of_level(rx.accepted) + rx.direction) & 3)
        count_step(rx, rx.accepted, between, rx.direction)
        count_step(rx, between, rx.accepted ^ 3, rx.direction)


@helper
def accept(rx: Record, t_ps: int, ab: int) -> None:
    """Take the filtered levels ``ab`` over and count their transition."""
    delta = count_delta(rx.accepted, ab)
    if delta == 2:
        note_illegal(rx, t_ps)
    else:
        rx.direction = delta
        count_step(rx, rx.accepted, ab, delta)
    rx.accepted = ab


@helper
def is_through(rx: Record, changed_ps: int, t_ps: int) -> bool:
    """Return whether enough ticks before ``t_ps`` have seen a level that stands since ``changed_ps``."""
    tick = first_tick(rx, t_ps) - rx.samples - rx.reference_tick
    return tick * rx.tick_num >= (changed_ps - rx.reference_ps) * rx.tick_den


@helper
def settle_closely(rx: Record, t_ps: int) -> None:
    """Settle both lines, which are under way, by the numbers of the ticks."""
    tick = first_tick(rx, t_ps)
    ready_a = first_tick(rx, rx.changed_a_ps) + rx.samples - 1
    ready_b = first_tick(rx, rx.changed_b_ps) + rx.samples - 1
    if ready_a == ready_b < tick:
        accept(rx, time_of_tick(rx, ready_a), rx.accepted ^ 3)
    else:
        if ready_b < min(ready_a, tick):
            accept(rx, t_ps, rx.accepted ^ 2)
        if ready_a < tick:
            accept(rx, t_ps, rx.accepted ^ 1)
        if ready_a < ready_b < tick:
            accept(rx, t_ps, rx.accepted ^ 2)


@step
def settle_before(rx: Record, t_ps: int) -> None:
    """Let the filter take over what its ticks before ``t_ps`` have seen often enough."""
    pending = rx.raw ^ rx.accepted
    if pending == 3:
        apart_ps = rx.changed_b_ps - rx.changed_a_ps
        if t_ps - max(rx.changed_a_ps, rx.changed_b_ps) > rx.sure_ps and abs(apart_ps) >= rx.unseen_ps:
            first = 1 if apart_ps > 0 else 2  # a tick lies between them
            accept(rx, t_ps, rx.accepted ^ first)
            accept(rx, t_ps, rx.raw)
        else:
            settle_closely(rx, t_ps)
    elif pending != 0:
        changed_ps = rx.changed_a_ps if pending == 1 else rx.changed_b_ps
        if t_ps - changed_ps > rx.sure_ps or is_through(rx, changed_ps, t_ps):
            accept(rx, t_ps, rx.raw)


@helper
def receiver_settle(rx: Record, t_ps: int) -> None:
    """Bring the count up to ``t_ps``: what a tick before the end of this picosecond has completed is counted."""
    settle_before(rx, t_ps + 1)


@helper
def note_going_back(rx: Record, lines: int) -> None:
    """Note that ``lines`` go back to what the filter still holds."""
    rx.filtered += 1
    if lines & 1:
        rx.dipped_a_ps = rx.changed_a_ps
    if lines & 2:
        rx.dipped_b_ps = rx.changed_b_ps


@helper
def end_of_dip(rx: Record, t_ps: int, changed_ps: int, dipped_ps: int) -> int:
    """Return since when a line has its level: where no tick fell into the dip before ``t_ps``, since before it."""
    return dipped_ps if first_tick(rx, changed_ps) == first_tick(rx, t_ps) else t_ps


@helper
def stood_long(rx: Record, t_ps: int) -> bool:
    """Return whether one line is on its way through the filter, and surely through it at ``t_ps``, as is the rule."""
    pending = rx.raw ^ rx.accepted
    return (pending == 1 or pending == 2) and t_ps - rx.last_ps > rx.sure_ps


@helper
def take_over(rx: Record, t_ps: int, ab: int) -> None:
    """Count the transition of one line that has stood long, and take the levels ``ab`` from ``t_ps`` on.

    What :func:`take_closely` asks is settled then: no line goes back to what the filter holds, none had a dip.
    """
    before_ab, raw = rx.accepted, rx.raw
    delta = count_of_one_line(before_ab, raw)
    rx.direction = delta
    count_step(rx, before_ab, raw, delta)
    rx.accepted = raw
    rx.raw = ab
    rx.min_separation_ps = min(rx.min_separation_ps, t_ps - rx.last_ps)
    rx.last_ps = t_ps
    if (raw ^ ab) & 1:
        rx.changed_a_ps = t_ps
    if (raw ^ ab) & 2:
        rx.changed_b_ps = t_ps


@helper
def take_closely(rx: Record, t_ps: int, ab: int) -> None:
    """Take the levels ``ab`` from ``t_ps`` on, however close to the changes before."""
    settle_before(rx, t_ps)
    change = rx.raw ^ ab
    back = change & (rx.raw ^ rx.accepted)
    if back:
        note_going_back(rx, back)
    separation_ps = t_ps - rx.last_ps
    if separation_ps < rx.min_separation_ps:
        rx.min_separation_ps = separation_ps
    rx.last_ps = t_ps
    rx.raw = ab
    if change & 1:
        soon = t_ps - rx.changed_a_ps < rx.unseen_ps and not back & 1
        rx.changed_a_ps = end_of_dip(rx, t_ps, rx.changed_a_ps, rx.dipped_a_ps) if soon else t_ps
    if change & 2:
        soon = t_ps - rx.changed_b_ps < rx.unseen_ps and not back & 2
        rx.changed_b_ps = end_of_dip(rx, t_ps, rx.changed_b_ps, rx.dipped_b_ps) if soon else t_ps
    if rx.samples == 0:
        accept(rx, t_ps, ab)


@step
def receiver_edge(rx: Record, t_ps: int, ab: int) -> None:
    """Take the levels ``ab`` from ``t_ps`` on; times never decrease, and ``ab`` differs from the levels before."""
    if stood_long(rx, t_ps):
        take_over(rx, t_ps, ab)
    else:
        take_closely(rx, t_ps, ab)


@helper
def receiver_index(rx: Record, t_ps: int) -> None:
    """Latch the count at an index pulse."""
    receiver_settle(rx, t_ps)
    rx.index_count = rx.count
    rx.index_pulses += 1


@helper
def receiver_probe(rx: Record, t_ps: int) -> None:
    """Latch the count at a probe trip."""
    receiver_settle(rx, t_ps)
    rx.probe_count = rx.count
    rx.probe_trips += 1


@helper
def receiver_reset(rx: Record, ab: int) -> None:
    """Start at time 0 with the levels ``ab`` at rest and the count zero."""
    rx.raw = ab
    rx.accepted = ab
    rx.changed_a_ps = -NEVER
    rx.changed_b_ps = -NEVER + 1
    rx.last_ps = -NEVER
    rx.min_separation_ps = NEVER


@kernel
def receive(rx: Record, times_ps: NDArray[np.int64], levels: NDArray[np.uint8]) -> None:
    """Run the receiver over a chunk of edges."""
    for i in range(times_ps.size):
        receiver_edge(rx, times_ps[i], int(levels[i]))


@kernel
def settle(rx: Record, t_ps: int) -> None:
    """Bring the count up to ``t_ps``."""
    receiver_settle(rx, t_ps)


@kernel
def latch(rx: Record, t_ps: int, index: int) -> None:
    """Latch the count at ``t_ps``, for the index if ``index`` is 1, else for the probe."""
    if index == 1:
        receiver_index(rx, t_ps)
    else:
        receiver_probe(rx, t_ps)


@kernel
def reset(rx: Record, ab: int) -> None:
    """Start with the levels ``ab`` at rest and the count zero."""
    receiver_reset(rx, ab)
