"""Edge streams written as a waveform file: one call from the signals of a run to what GTKWave shows."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import BinaryIO

import numpy as np

from rtec.signal.stream import EdgeStream
from rtec.signal.vcd import VcdSignal, VcdWriter


def write_vcd(
    target: str | Path | BinaryIO,
    streams: Mapping[str, EdgeStream],
    *,
    end_ps: int,
    start_ps: int = 0,
    timescale: str = "1 ps",
) -> None:
    """Write streams as one VCD file; an existing file is replaced once the new one is complete.

    Parameters
    ----------
    target
        Path, or binary file object.
    streams
        Streams by name: one called ``encoder`` is shown as ``encoder.A`` and ``encoder.B``.
    end_ps
        Closing time, not before the last edge.
    start_ps
        Time of the initial values, not after the first edge. An edge at this very time is shown as the value there.
    timescale
        Unit of the times in the file; see :func:`rtec.signal.coarsest_timescale`.

    Raises
    ------
    ArgumentError
        A name that VCD does not allow, an edge outside ``start_ps .. end_ps`` or no multiple of the timescale.
    OutputError
        The file cannot be written; nothing is left behind.

    Examples
    --------
    >>> import io
    >>> file = io.BytesIO()
    >>> write_vcd(file, {"encoder": EdgeStream([3, 5], [1, 3], initial=0)}, end_ps=9)
    >>> print(file.getvalue().decode())
    $version rtec $end
    $timescale 1 ps $end
    $scope module encoder $end
    $var wire 1 a A $end
    $var wire 1 b B $end
    $upscope $end
    $enddefinitions $end
    #0
    $dumpvars
    0a
    0b
    $end
    #3
    1a
    #5
    1b
    #9
    <BLANKLINE>
    """
    signals: list[VcdSignal] = []
    changes = []
    for name, stream in streams.items():
        toggled = stream.levels ^ np.append(np.uint8(stream.initial), stream.levels[:-1])
        for bit, line in enumerate("AB"):
            changed = (toggled >> bit & 1).astype(bool)
            times_ps = stream.times_ps[changed]
            changes.append((times_ps, np.full(times_ps.size, len(signals)), stream.levels[changed] >> bit & 1))
            signals.append(VcdSignal(scope=name, name=line, initial=stream.initial >> bit & 1))
    with VcdWriter(target, signals=signals, timescale=timescale, start_ps=start_ps) as writer:
        times, which, values = (np.concatenate(column) for column in zip(*changes, strict=True))
        order = np.argsort(times, kind="stable")
        writer.write(times[order], which[order], values[order])
        writer.finish(end_ps)
