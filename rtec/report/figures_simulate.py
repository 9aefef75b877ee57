"""One insertion of an open path as a picture: both sides of the box before, during and after it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rtec.injector.insertion_capture import SeenInsertion
from rtec.report.waveform import waveform

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_CHANGES_WIDE = 40
"""Most of what is shown, in distances of two changes of the insertion: their numbers stay legible."""
_LEVELS = {1: "00", 2: "10", 3: "11", 4: "01"}


def insertion_figure(seen: SeenInsertion, name: str, step_counts: int) -> Figure:
    """Draw an insertion of a design that adds ``step_counts`` a step, as a stretch of a run has seen it."""
    added = f"{seen.steps * step_counts:+d}".replace("-", "−")
    return waveform(
        seen.encoder,
        seen.controller,
        requested=seen.requested,
        completed=seen.completed,
        window_ps=shown_ps(seen, step_counts),
        title=f"{name}: {added} from state {seen.state} ({_LEVELS[seen.state]})",
    )


def shown_ps(seen: SeenInsertion, step_counts: int) -> tuple[int, int]:
    """Return begin and end of what is shown: two edges before and after, or less of them where they are far apart.

    Examples
    --------
    >>> from rtec.injector import Totals
    >>> from rtec.signal import EdgeStream
    >>> encoder = EdgeStream([500, 1000, 1500, 2000, 2500], [1, 3, 2, 0, 1], initial=0)
    >>> controller = EdgeStream([500, 1000, 1100, 1200, 1500, 2000, 2500], [1, 3, 2, 0, 1, 3, 2], initial=0)
    >>> seen = SeenInsertion(encoder=encoder, controller=controller, requested=Totals([1000], [1]), state=3,
    ...                      completed=Totals([1200], [1]), begin_ps=1100, end_ps=1200, steps=1)
    >>> shown_ps(seen, 2)
    (400, 2000)
    """
    before = [times[times < seen.begin_ps] for times in (seen.encoder.times_ps, seen.requested.times_ps)]
    cause_ps = int(max(np.concatenate(before), default=seen.begin_ps))
    length_ps = seen.end_ps - seen.begin_ps
    change_ps = length_ps // (step_counts - 1) if length_ps else seen.begin_ps - cause_ps
    most_ps = max(_CHANGES_WIDE * change_ps, 40)
    if seen.end_ps - cause_ps > most_ps // 2:  # at rest, or at a late look
        cause_ps = seen.begin_ps - most_ps // 4
    core_ps = max(seen.end_ps - cause_ps, 1)
    margin_ps = min((most_ps - core_ps) // 2, 4 * core_ps)
    edges = seen.encoder.times_ps
    left_ps = min(edges[edges < cause_ps][-2:], default=cause_ps - margin_ps)
    right_ps = max(edges[edges > seen.end_ps][:2], default=seen.end_ps + margin_ps)
    pad_ps = core_ps // 2
    return max(int(left_ps) - pad_ps, cause_ps - margin_ps, 0), min(int(right_ps) + pad_ps, seen.end_ps + margin_ps)
