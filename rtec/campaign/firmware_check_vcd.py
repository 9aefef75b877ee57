"""The lines and pins around an insertion as a waveform file."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from rtec.campaign.firmware_check_results import Trace
from rtec.injector.waves import rows_of_streams, write_waves
from rtec.signal import VcdSignal

_PINS = ("P1_0", "P1_1", "P1_2", "P1_3", "P1_4", "P1_5", "P1_6", "P1_7")


def write_trace(trace: Trace, file: Path) -> None:
    """Write both sides of the box, totals, insertions and the pins of port 1, in time since power-up.

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
    levels = np.concatenate([[trace.initial_pins], trace.pin_levels])
    beside = []
    for bit, name in enumerate(_PINS):
        at = np.flatnonzero(np.diff(levels >> bit & 1)) + 1
        signal = VcdSignal(scope="P1", name=name, initial=trace.initial_pins >> bit & 1)
        beside.append((signal, trace.pin_times_ps[at - 1], levels[at] >> bit & 1))
    mark_ps = np.array([] if trace.mark_ps is None else [trace.mark_ps], np.int64)
    beside.append((VcdSignal(scope="check", name="failed"), mark_ps, np.ones(mark_ps.size, np.int64)))
    rows = rows_of_streams(
        trace.encoder, trace.controller, trace.requested, trace.completed, inserted=trace.insertions_ps
    )
    initial = trace.encoder.initial, trace.controller.initial
    write_waves(file, rows, initial=initial, end_ps=trace.to_ps, beside=beside)
