"""The lines on both sides of the box around an insertion, as text."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

HIGH, LOW = "▔", "▁"

_NARROWEST, _WIDEST = 2, 8
_US = 1e6
"""Picoseconds in a microsecond."""

Change = tuple[int, int, int]
"""Time in ps, levels at the encoder's side and at the controller's (A + 2 B)."""


def waveform_text(changes: Sequence[Change], *, most_columns: int = 60) -> dict[str, str]:
    r"""Draw the last changes, the latest at the right, by name: A and B, and A' and B' at the controller.

    Parameters
    ----------
    changes
        In order of time; at least one.
    most_columns
        Longest text.

    Notes
    -----
    The widths go with the logarithm of the times: an insertion takes microseconds, an encoder's edge milliseconds.

    Examples
    --------
    An insertion of +4 counts at rest, as Design A makes it:

    >>> us = 10**6
    >>> text = waveform_text([(0, 0, 0), (9 * us, 0, 1), (10 * us, 0, 3), (11 * us, 0, 2), (12 * us, 0, 0)])
    >>> print(text["A"], text["A'"], text["B'"], sep="\n")
    ▁▁▁▁▁▁▁▁▁▁▁▁▁
    ▁▁▁▁▁▔▔▔▔▁▁▁▁
    ▁▁▁▁▁▁▁▔▔▔▔▁▁
    """
    widths = [_width(after[0] - before[0]) for before, after in pairwise(changes)] + [_NARROWEST]
    first = len(changes) - 1
    while first > 0 and sum(widths[first - 1 :]) <= most_columns:
        first -= 1
    shown = range(first, len(changes))

    def draw(side: int, bit: int) -> str:
        return "".join((HIGH if changes[k][side] & bit else LOW) * widths[k] for k in shown)

    return {"A": draw(1, 1), "B": draw(1, 2), "A'": draw(2, 1), "B'": draw(2, 2)}


def _width(time_ps: int) -> int:
    decades = math.log10(max(time_ps, 1) / _US)
    return min(max(round(_NARROWEST + 3 * decades), _NARROWEST), _WIDEST)


def caption_of(changes: Sequence[Change]) -> str:
    """Say how long the last insertion took: changes of the box's own, close together."""
    own = [after[0] for before, after in pairwise(changes) if before[1] == after[1] and before[2] != after[2]]
    if not own:
        return "no change of the box's own"
    last = own[-1:]
    for time_ps in reversed(own[:-1]):
        if last[0] - time_ps > 5 * _US:
            break
        last.insert(0, time_ps)
    times = f"{len(last)} times in {(last[-1] - last[0]) / _US:.1f} µs" if len(last) > 1 else "once"
    return f"the box changed its lines {times}"
