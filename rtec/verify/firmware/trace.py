"""What a bench has recorded of an insertion: when it was, how long it took, the lines and pins around it."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import groupby
from operator import itemgetter

import numpy as np

from rtec.injector import Totals
from rtec.verify.bench import Bench
from rtec.verify.contract.trials import Run
from rtec.verify.firmware.results import Trace

_SAME_INSERTION_CYCLES = {"12-clock": 30, "one-clock": 60}
"""Changes of drive pins closer than this belong to one insertion; to book it takes longer."""

_MARGIN = 0.6
"""Of the span of an insertion, shown before and behind it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Insertion:
    """The changes of drive pins that belong together."""

    first_ps: int
    last_ps: int
    edge_ps: int | None
    """The encoder's edge before them, in motion."""

    @property
    def latency_ps(self) -> int | None:
        """Return the time from the edge to the last change."""
        return None if self.edge_ps is None else self.last_ps - self.edge_ps


def insertions(bench: Bench) -> list[Insertion]:
    """Return the insertions since the bench began, by the changes of the drive pins.

    The pins of Design B follow the encoder, too: there an insertion is where they change twice after one edge, or
    without one.
    """
    mask = bench.design.pins
    changed = [t_ps for t_ps, before, after in bench.changes(1) if (before ^ after) & mask]
    edges = bench.encoder.times_ps
    moving = edges.size > 8
    groups: list[list[int]] = []
    if bench.design.in_path:
        after = np.searchsorted(edges, changed, side="right").tolist()
        for index, pairs in groupby(zip(after, changed, strict=True), key=itemgetter(0)):
            times = [t for _, t in pairs]
            at_rest = index == 0 or (index == edges.size and times[0] - edges[-1] > bench.reading_ps)
            if len(times) > 1 or at_rest:
                groups.append(times)
    else:
        gap_ps = bench.cycles_ps(_SAME_INSERTION_CYCLES[bench.microcontroller.timing])
        for t in changed:
            if groups and t - groups[-1][-1] < gap_ps:
                groups[-1].append(t)
            else:
                groups.append([t])
    found = []
    for times in groups:
        before = int(np.searchsorted(edges, times[0], side="right"))
        edge_ps = int(edges[before - 1]) if before else None
        in_motion = moving and edge_ps is not None and times[0] - edge_ps < bench.reading_ps
        found.append(Insertion(first_ps=times[0], last_ps=times[-1], edge_ps=edge_ps if in_motion else None))
    return found


def trace_of(bench: Bench, run: Run) -> Trace:
    """Return the lines around the first insertion of a run that the bench has just played, or around its fault."""
    begun_ps = bench.begun_ps
    violation, stimulus, done = run.judgement.violation, run.case.stream.stimulus(), run.response.completed
    title, mark_ps = run.case.title, None
    if violation is not None:
        title, mark_ps = violation.reason, begun_ps + violation.time_ps
    near_ps, made = bench.cycles_ps(200), insertions(bench)
    around = next((e for e in made if mark_ps is None or e.last_ps >= mark_ps - near_ps), None)
    first = around.first_ps if around else (bench.now_ps if mark_ps is None else mark_ps)
    last = around.last_ps if around else first
    edge = around.edge_ps if around else None
    if edge is not None and first - edge > near_ps:
        edge = None
    begin, end = min(first, mark_ps or first, edge or first), max(last, mark_ps or last)
    margin_ps = max(round(_MARGIN * (end - begin)), bench.cycles_ps(8))
    rows = [(t_ps, after) for t_ps, _, after in bench.changes(1)]
    start = next(bench.changes(1), (0, bench.latches[1], 0))[1]
    return Trace(
        title=title,
        encoder=bench.encoder,
        controller=bench.controller,
        requested=Totals(stimulus.requests.times_ps + begun_ps, stimulus.requests.totals),
        completed=Totals(done.times_ps + begun_ps, done.totals),
        insertions_ps=tuple((each.first_ps, each.last_ps) for each in made),
        pin_times_ps=np.array([t for t, _ in rows], np.int64),
        pin_levels=np.array([level for _, level in rows], np.int64),
        initial_pins=start,
        from_ps=max(begin - margin_ps, bench.begun_ps),
        to_ps=min(end + margin_ps, bench.now_ps),
        zero_ps=edge if edge is not None else first,
        mark_ps=mark_ps,
        cycle_ps=float(np.divide(*bench.microcontroller.cycle_ps)),
    )
