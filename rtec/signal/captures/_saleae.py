"""Digital CSV of Saleae's Logic: seconds, and the level of each channel whenever one changes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from decimal import Decimal, InvalidOperation
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rtec.errors import FileFormatError
from rtec.io import read_text

Pick = Callable[[Sequence[str]], tuple[int, int]]
"""Says which of the channels are A and B."""
_LEVELS = {"0": 0, "1": 1}
_LONGEST_S = Decimal(4_600_000)
"""Before and after the trigger; differences of two such times fit into 64 bits of picoseconds."""


def read(path: Path, pick: Pick) -> tuple[NDArray[np.int64], NDArray[np.uint8]]:
    """Return times in ps, int64, and level codes, uint8, of the rows."""
    lines = read_text(path, "a capture").splitlines()
    head = [word.strip().strip('"') for word in lines[0].split(",")]
    if not head[0].casefold().startswith("time") or len(head) < 3:
        raise FileFormatError(path, 1, f"headings {lines[0][:60]!r}", "Time [s],A,B, as Logic exports digital data")
    a, b = (index + 1 for index in pick(head[1:]))
    times, codes = [], bytearray()
    for number, line in enumerate(lines[1:], start=2):
        if not line.strip():
            continue
        words = line.split(",")
        if len(words) != len(head):
            raise FileFormatError(path, number, f"{len(words)} columns", f"{len(head)}, as in the headings")
        try:
            code = _LEVELS[words[a].strip()] + 2 * _LEVELS[words[b].strip()]
        except KeyError:
            said = f"levels {words[a].strip()[:20]!r} and {words[b].strip()[:20]!r}"
            raise FileFormatError(path, number, said, "0 or 1 (X: the channel was not recorded)") from None
        try:
            seconds = Decimal(words[0].strip())
        except InvalidOperation:
            seconds = Decimal("inf")
        if seconds.is_nan() or abs(seconds) > _LONGEST_S:
            raise FileFormatError(path, number, f"time {words[0].strip()[:30]!r}", "seconds, as in 0.000125")
        times.append(round(seconds.scaleb(12)))
        codes.append(code)
    if not times:
        raise FileFormatError(path, None, "no rows", "a row for each change")
    return np.array(times, np.int64), np.frombuffer(bytes(codes), np.uint8)
