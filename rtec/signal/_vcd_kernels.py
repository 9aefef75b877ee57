"""Compiled formatting of value changes: a million a second and more, where Python's strings give a tenth of it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rtec._jit import array_kernel

DIGITS = 20
"""Bytes that the digits of any int64 need."""


@array_kernel
def format_changes(
    ticks: NDArray[np.int64],
    signals: NDArray[np.int64],
    values: NDArray[np.int64],
    widths: NDArray[np.int64],
    first_wire: NDArray[np.int64],
    names: NDArray[np.uint8],
    last_values: NDArray[np.int64],
    last_tick: int,
    out: NDArray[np.uint8],
) -> int:
    """Write changes as text into ``out`` and return the number of bytes.

    A time line is written where the tick differs from the one before, first from ``last_tick``. Of a signal of
    several bits those are written that differ from ``last_values``, which is kept up. ``names`` holds one row of
    printable bytes for each bit, ended by a zero: those of a signal from row ``first_wire`` on, the lowest bit first.
    """
    digits = np.empty(DIGITS, dtype=np.uint8)
    size = 0
    for i in range(ticks.size):
        tick = ticks[i]
        if tick != last_tick:
            last_tick = tick
            out[size] = 35  # '#'
            size += 1
            n = 0
            while True:
                digits[n] = 48 + tick % 10
                tick //= 10
                n += 1
                if tick == 0:
                    break
            for k in range(n):
                out[size + k] = digits[n - 1 - k]
            size += n
            out[size] = 10
            size += 1
        signal = signals[i]
        value = values[i]
        changed = value ^ last_values[signal] if widths[signal] > 1 else 1
        last_values[signal] = value
        wire = first_wire[signal]
        while changed != 0:
            if changed & 1:
                out[size] = 48 + (value & 1)
                size += 1
                k = 0
                while names[wire, k] != 0:
                    out[size] = names[wire, k]
                    size += 1
                    k += 1
                out[size] = 10
                size += 1
            changed >>= 1
            value >>= 1
            wire += 1
    return size
