"""Compiled monitor of a box: levels on either side of it, and the difference of the counts that they make.

It serves the behavioural box and the board alike: their records have the same fields for it.
"""

from __future__ import annotations

from rtec._jit import Record, helper, step
from rtec.signal._kernels import ILLEGAL, count_delta, state_of_level


@step
def observe(s: Record) -> bool:
    """Let the monitor see both sides of the box; return whether the levels at the controller changed.

    To be called once all events of one instant are carried out: changes at one instant are one change. While the
    angle between the two sides stays, so does their difference in counts.
    """
    angle = (state_of_level(s.ab_out) - state_of_level(s.ab_in)) & 3
    if angle != s.angle:
        ahead = count_delta(s.seen_out, s.ab_out)
        if s.seen_in == s.ab_in and ahead != ILLEGAL:  # as when a box inserts
            s.ahead += ahead
        else:
            count_difference(s)
        s.angle = angle
    s.seen_in = s.ab_in
    if s.ab_out == s.seen_out:
        return False
    s.seen_out = s.ab_out
    return True


@helper
def count_difference(s: Record) -> None:
    """Count how far the controller's side went ahead of the encoder's, by an ideal decoder on each."""
    delta_out = count_delta(s.seen_out, s.ab_out)
    delta_in = count_delta(s.seen_in, s.ab_in)
    if delta_out == ILLEGAL or delta_in == ILLEGAL:
        s.illegal_out += 1
    else:
        s.ahead += delta_out - delta_in
