"""Compiled recorder of the last changes of the lines, for pictures of an insertion."""

from __future__ import annotations

from rtec._jit import Record, helper

KEPT = 32
"""Changes of the lines that are kept, where they are."""
AFTER = 6
"""Of them, so many after the end of an insertion."""


@helper
def keep(st: Record, t_ps: int, ended: bool) -> None:
    """Keep what the lines say on both sides of the box; put it aside a few changes after an insertion has ended."""
    s = st.injector
    k = (st.kept - 1) % KEPT
    if st.kept == 0 or st.kept_in[k] != st.lines or st.kept_out[k] != s.ab_out:
        if st.kept == 0 or st.kept_ps[k] != t_ps:  # changes at one instant are one change
            k = st.kept % KEPT
            st.kept += 1
        st.kept_ps[k] = t_ps
        st.kept_in[k] = st.lines
        st.kept_out[k] = s.ab_out
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
        k = (first + i) % KEPT
        st.aside_ps[i] = st.kept_ps[k]
        st.aside_in[i] = st.kept_in[k]
        st.aside_out[i] = st.kept_out[k]


@helper
def keep_own(st: Record, t_ps: int) -> None:
    """Keep the lines of a box whose injector is modelled: its number of insertions tells when one has ended."""
    ended = st.injector.inserted != st.seen_inserted
    st.seen_inserted = st.injector.inserted
    keep(st, t_ps, ended)
