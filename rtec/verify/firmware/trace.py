"""What a bench has recorded of an insertion: when it was, how long it took, the lines and pins around it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rtec.injector import Totals
from rtec.verify.bench import Bench
from rtec.verify.contract.trials import Run
from rtec.verify.firmware.results import Trace

_SAME_INSERTION_CYCLES = {"12-clock": 30, "one-clock": 60}
"""Changes of drive pins closer than this belong to one insertion; to book it takes longer."""
_MARGIN = 0.6
"""Of the span of an insertion, shown before and behind it."""


class Insertion(NamedTuple):
    """The first and the last change of drive pins that belong together; the encoder's edge before them, in motion."""

    first_ps: int
    last_ps: int
    edge_ps: int | None


def insertions(bench: Bench) -> list[Insertion]:
    """Return the insertions since the bench began, by the changes of the drive pins.

    The pins of Design B follow the encoder, too: there an insertion is where they change twice after one edge, or
    without one.
    """
    mask, in_path, edges = bench.design.pins, bench.design.in_path, bench.encoder.times_ps
    changed = np.array([t_ps for t_ps, before, after in bench.changes(1) if (before ^ after) & mask], np.int64)
    gap_ps = bench.cycles_ps(_SAME_INSERTION_CYCLES[bench.microcontroller.timing])
    apart = np.diff(np.searchsorted(edges, changed, side="right")) > 0 if in_path else np.diff(changed) >= gap_ps
    found = []
    for times in np.split(changed, np.flatnonzero(apart) + 1) if changed.size else ():
        first, before = int(times[0]), int(np.searchsorted(edges, times[0], side="right"))
        edge_ps = int(edges[before - 1]) if before else None
        rests = edge_ps is None or (before == edges.size and first - edge_ps > bench.reading_ps)
        if not in_path or times.size > 1 or rests:
            moving = edges.size > 8 and edge_ps is not None and first - edge_ps < bench.reading_ps
            found.append(Insertion(first, int(times[-1]), edge_ps if moving else None))
    return found


def trace_of(bench: Bench, run: Run) -> Trace:
    """Return the lines around the first insertion of a run that the bench has just played, or around its fault."""
    begun_ps = bench.begun_ps
    violation, stimulus, done = run.judgement.violation, run.case.stream.stimulus(), run.response.completed
    mark_ps = None if violation is None else begun_ps + violation.time_ps
    near_ps, made = bench.cycles_ps(200), insertions(bench)
    around = next((e for e in made if mark_ps is None or e.last_ps >= mark_ps - near_ps), None)
    nowhere = bench.now_ps if mark_ps is None else mark_ps
    first, last, edge = around or (nowhere, nowhere, None)
    if edge is not None and first - edge > near_ps:
        edge = None
    begin, end = min(first, mark_ps or first, edge or first), max(last, mark_ps or last)
    margin_ps = max(round(_MARGIN * (end - begin)), bench.cycles_ps(8))
    pins = np.array([(t_ps, after) for t_ps, _, after in bench.changes(1)], np.int64).reshape(-1, 2)
    return Trace(
        title=run.case.title if violation is None else violation.reason,
        encoder=bench.encoder,
        controller=bench.controller,
        requested=Totals(stimulus.requests.times_ps + begun_ps, stimulus.requests.totals),
        completed=Totals(done.times_ps + begun_ps, done.totals),
        insertions_ps=tuple(each[:2] for each in made),
        pin_times_ps=pins[:, 0],
        pin_levels=pins[:, 1],
        initial_pins=bench.first_latches[1],
        from_ps=max(begin - margin_ps, bench.begun_ps),
        to_ps=min(end + margin_ps, bench.now_ps),
        zero_ps=edge if edge is not None else first,
        mark_ps=mark_ps,
        cycle_ps=float(np.divide(*bench.microcontroller.cycle_ps)),
    )
