"""Compiled recorders of a box: a tape of all that it does, and the last changes of its lines.

The tape has a row for each moment at which something changes of what the box drives and owes.

A tape is ``(rows, used)``: rows as of `rtec.injector._wave_kernels`, first what held before, and how many there are.
One without rows keeps nothing.
"""

from __future__ import annotations

from typing import Any

from rtec._jit import Record, helper
from rtec.board._board_kernels import inserting
from rtec.injector._state_kernels import ARMED, INSERTING as IN_INSERTION
from rtec.injector._wave_kernels import COMPLETED, INSERTING, LEVEL_IN, LEVEL_OUT, REQUESTED, TIME

STEPS_AN_EDGE = 4
"""Steps that may become due with an edge."""
ROWS_AN_EDGE = 16
"""With its glitch, with what passes late, and with what is let go."""
KEPT = 32
"""Changes of the lines that are kept, where they are."""
AFTER = 6
"""Of them, so many after the end of an insertion."""


@helper
def rows_ahead(s: Record) -> int:
    """Return how many rows may come with the next edge: everything that is owed may be inserted before it."""
    owed = abs(s.requested - s.completed) + STEPS_AN_EDGE
    return int(ROWS_AN_EDGE + owed * (s.changes + 4))


@helper
def has_room(tape: Any, s: Record, asks: int) -> bool:
    """Return whether the next edge fits on the tape, with so many requests before it."""
    rows, used = tape
    return bool(rows.shape[0] == 0 or used[0] + rows_ahead(s) + asks * (s.changes + 4) <= rows.shape[0])


@helper
def add_row(tape: Any, t_ps: int, ab_in: int, ab_out: int, requested: int, completed: int, busy: int) -> None:
    """Write a row, if anything in it is new."""
    rows, used = tape
    n = used[0]
    last = n - 1
    if (
        rows[last, LEVEL_IN] == ab_in
        and rows[last, LEVEL_OUT] == ab_out
        and rows[last, REQUESTED] == requested
        and rows[last, COMPLETED] == completed
        and rows[last, INSERTING] == busy
    ):
        return
    rows[n, TIME] = t_ps
    rows[n, LEVEL_IN] = ab_in
    rows[n, LEVEL_OUT] = ab_out
    rows[n, REQUESTED] = requested
    rows[n, COMPLETED] = completed
    rows[n, INSERTING] = busy
    used[0] = n + 1


@helper
def keep_box(tape: Any, s: Record, t_ps: int) -> None:
    """Write the box at ``t_ps``; an insertion shows from the look that begins it to its last change."""
    rows, used = tape
    if rows.shape[0] == 0:
        return
    last = used[0] - 1
    busy = s.phase == IN_INSERTION or (s.phase == ARMED and s.recognised_ps <= t_ps)
    ended = s.completed != rows[last, COMPLETED]
    if (busy or ended) and rows[last, INSERTING] == 0:
        # the look itself changed nothing, so it has no row yet
        begun_ps = max(s.recognised_ps, rows[last, TIME])
        if begun_ps < t_ps:
            add_row(
                tape,
                begun_ps,
                rows[last, LEVEL_IN],
                rows[last, LEVEL_OUT],
                rows[last, REQUESTED],
                rows[last, COMPLETED],
                1,
            )
    add_row(tape, t_ps, s.ab_in, s.ab_out, s.requested, s.completed, 1 if busy else 0)


@helper
def keep_board(tape: Any, s: Record, b: Record, t_ps: int) -> None:
    """Write the box with its firmware at ``t_ps``.

    An insertion shows from its first to its last change. The outputs of lines that pass through the processor do not
    tell it: there it shows from the request until the total says that it is completed.
    """
    rows, _ = tape
    if rows.shape[0] == 0:
        return
    busy = s.requested != s.completed if b.in_path == 1 else inserting(b)
    add_row(tape, t_ps, b.ab_in, b.ab_out, s.requested, s.completed, 1 if busy else 0)


@helper
def keep(st: Record, t_ps: int, ended: bool) -> None:
    """Keep what the lines say on both sides of the box; put it aside a few changes after an insertion has ended."""
    rows, out = st.kept_rows, st.injector.ab_out
    k = (st.kept - 1) % KEPT
    if st.kept == 0 or rows[k, 1] != st.lines or rows[k, 2] != out:
        if st.kept == 0 or rows[k, 0] != t_ps:  # changes at one instant are one change
            k = st.kept % KEPT
            st.kept += 1
        rows[k, 0] = t_ps
        rows[k, 1] = st.lines
        rows[k, 2] = out
    elif not ended:
        return
    if ended:
        st.still_to_keep = AFTER
    elif st.still_to_keep > 0:
        st.still_to_keep -= 1
        if st.still_to_keep == 0:
            put_aside(st)


@helper
def put_aside(st: Record) -> None:
    """Copy the changes kept, the oldest first."""
    st.aside = min(st.kept, KEPT)
    first = st.kept - st.aside
    for i in range(st.aside):
        for column in range(3):
            st.aside_rows[i, column] = st.kept_rows[(first + i) % KEPT, column]


@helper
def keep_own(st: Record, t_ps: int) -> None:
    """Keep the lines of a box whose injector is modelled: its number of insertions tells when one has ended."""
    ended = st.injector.inserted != st.seen_inserted
    st.seen_inserted = st.injector.inserted
    keep(st, t_ps, ended)
