"""Compiled step from what a box drives and owes, moment by moment, to the changes of the signals that show it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rtec._jit import array_kernel
from rtec.signal._kernels import ILLEGAL, count_delta, state_of_level

TIME, LEVEL_IN, LEVEL_OUT, REQUESTED, COMPLETED, INSERTING, COLUMNS = 0, 1, 2, 3, 4, 5, 6
"""Columns of a row: what holds from a time in ps on."""
COUNT_IN, COUNT_OUT, IS_ILLEGAL, REMEMBERED = 6, 7, 8, 9
"""What is remembered beside the columns of the last row."""
ENC_A, CTL_A, BUSY, WRONG, STATES, COUNTS, TOTALS, SIGNALS = 0, 2, 4, 5, 6, 8, 10, 12
"""Where the signals stand: those that belong to encoder and controller, or to requested and completed, in pairs."""


@array_kernel
def changes_of_rows(
    rows: NDArray[np.int64],
    last: NDArray[np.int64],
    count_mask: int,
    total_mask: int,
    times_ps: NDArray[np.int64],
    signals: NDArray[np.int64],
    values: NDArray[np.int64],
) -> int:
    """Write the changes that lead from ``last`` through all rows, and return their number; ``last`` is kept up.

    Counts are those of an ideal decoder; an illegal transition has none. ``SIGNALS`` changes a row are the most.
    """
    n = 0
    for i in range(rows.shape[0]):
        t_ps = rows[i, TIME]
        for side in range(2):
            ab = rows[i, LEVEL_IN + side]
            before = last[LEVEL_IN + side]
            if ab != before:
                for bit in range(2):
                    if (ab ^ before) >> bit & 1:
                        times_ps[n], signals[n], values[n] = t_ps, ENC_A + 2 * side + bit, ab >> bit & 1
                        n += 1
                times_ps[n], signals[n], values[n] = t_ps, STATES + side, state_of_level(ab) + 1
                n += 1
                delta = count_delta(before, ab)
                if delta != ILLEGAL:
                    last[COUNT_IN + side] += delta
                    times_ps[n], signals[n], values[n] = t_ps, COUNTS + side, last[COUNT_IN + side] & count_mask
                    n += 1
                wrong = 1 if delta == ILLEGAL else 0
                if side == 1 and wrong != last[IS_ILLEGAL]:
                    last[IS_ILLEGAL] = wrong
                    times_ps[n], signals[n], values[n] = t_ps, WRONG, wrong
                    n += 1
                last[LEVEL_IN + side] = ab
            total = rows[i, REQUESTED + side]
            if total != last[REQUESTED + side]:
                last[REQUESTED + side] = total
                times_ps[n], signals[n], values[n] = t_ps, TOTALS + side, total & total_mask
                n += 1
        if rows[i, INSERTING] != last[INSERTING]:
            last[INSERTING] = rows[i, INSERTING]
            times_ps[n], signals[n], values[n] = t_ps, BUSY, rows[i, INSERTING]
            n += 1
    return n
