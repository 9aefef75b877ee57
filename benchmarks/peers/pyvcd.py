"""Writing a VCD file, by pyvcd."""

from __future__ import annotations

import io
from typing import Any

from peers import PeerAbsent


def write(times_ps: Any, levels: Any) -> int:
    """Write the edges of A and B, one change each, into memory; return the length of the text.

    Raises
    ------
    PeerAbsent
        Where pyvcd is not installed.
    """
    try:
        from vcd import VCDWriter
    except ImportError as absent:
        raise PeerAbsent("pyvcd is not installed; python -m pip install pyvcd to compare") from absent
    file = io.StringIO()
    with VCDWriter(file, timescale="1 ps") as writer:
        lines = [writer.register_var("encoder", name, "wire", size=1, init=0) for name in "AB"]
        before = 0
        for t_ps, level in zip(times_ps.tolist(), levels.tolist(), strict=True):
            bit = 0 if (level ^ before) & 1 else 1
            writer.change(lines[bit], t_ps, level >> bit & 1)
            before = level
        writer.close(int(times_ps[-1]))
    return file.tell()
