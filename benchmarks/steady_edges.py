"""The edges of an encoder at constant speed, one after the other: what the open path makes many at once of."""

import numba

from rtec.axis._kernels import emit, encoder_level, glitch_toggle, steady_crossing


@numba.njit(error_model="numpy")
def steady_edges(e, out_ps, out_levels):
    """Write the next edges at constant speed, a chunk of at most the arrays' length; return their number.

    Real edges and the toggles of glitches come in the order of their times.
    """
    n = 0
    while n + 3 <= out_ps.size:
        crossing_ps = steady_crossing(e)
        while e.glitch_next_ps < crossing_ps and n + 2 <= out_ps.size:
            out_ps[n] = max(glitch_toggle(e), e.last_ps + 1)
            e.last_ps = out_ps[n]
            out_levels[n] = encoder_level(e)
            n += 1
        out_ps[n] = emit(e, crossing_ps, e.step_sign)
        out_levels[n] = encoder_level(e)
        n += 1
    return n
