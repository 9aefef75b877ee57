"""The lines and pins around an insertion as a waveform file."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from rtec.campaign.firmware_check_results import Trace
from rtec.signal import EdgeStream, VcdSignal, VcdWriter

_PINS = ("P1_0", "P1_1", "P1_2", "P1_3", "P1_4", "P1_5", "P1_6", "P1_7")


def write_trace(trace: Trace, file: Path) -> None:
    """Write A and B on both sides of the box and the pins of port 1, in time since power-up.

    Parameters
    ----------
    trace
        What is written: the whole record, not the part that a figure shows.
    file
        The file; one that exists is overwritten.

    Raises
    ------
    OutputError
        It cannot be written.
    """
    start_ps = 0
    streams = (("encoder", trace.encoder), ("controller", trace.controller))
    signals = [
        VcdSignal(scope=scope, name=name, initial=stream.initial >> bit & 1)
        for scope, stream in streams
        for bit, name in enumerate("AB")
    ]
    signals += [
        VcdSignal(scope="P1", name=name, initial=trace.initial_pins >> bit & 1) for bit, name in enumerate(_PINS)
    ]
    signals.append(VcdSignal(scope="check", name="failed"))
    rows = [row for first, (_, stream) in zip((0, 2), streams, strict=True) for row in _changes(stream, first)]
    before = trace.initial_pins
    for t_ps, level in zip(trace.pin_times_ps.tolist(), trace.pin_levels.tolist(), strict=True):
        rows += [(t_ps, 4 + bit, level >> bit & 1) for bit in range(8) if (before ^ level) >> bit & 1]
        before = level
    if trace.mark_ps is not None:
        rows.append((trace.mark_ps, len(signals) - 1, 1))
    rows.sort()
    with VcdWriter(file, signals=signals, start_ps=start_ps) as writer:
        if rows:
            times, which, values = (np.array(column, np.int64) for column in zip(*rows, strict=True))
            writer.write(times, which, values)
        writer.finish(max(trace.to_ps, rows[-1][0] if rows else 0))


def _changes(stream: EdgeStream, first: int) -> list[tuple[int, int, int]]:
    """Return the changes of A and B, whose signals have the numbers ``first`` and the next."""
    return [
        (t_ps, first + bit, t % 2)
        for bit, line in enumerate(stream.lines())
        for t, t_ps in enumerate(line.times_ps.tolist(), 1 + (stream.initial >> bit & 1))
    ]
