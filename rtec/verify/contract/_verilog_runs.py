"""The rows that go into a simulation and come out of it, ours or cocotb's."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rtec.injector import Break, Response, Stimulus, Totals
from rtec.signal import EdgeStream
from rtec.verify.contract.verilog_pins import Pins

SETTLE_TICKS = 100
"""Ticks between the end of the reset and time 0, in which synchronizers and filters take up the first levels."""
_CHANGE, _END, _FINISH = 1, 3, 4


@dataclass(frozen=True, slots=True)
class Runs:
    """The plays of one stream as rows: what it is, time in ps, levels, completed, refused, which are unknown.

    The first row is power-up, the last one the end; where the last play has no end, ``reason`` says why, or is empty
    where nothing came any more.
    """

    plays: Sequence[NDArray[np.int64]]
    reason: str = ""


def stream_rows(stimulus: Stimulus) -> NDArray[np.int64]:
    """Return a stream as rows in the order of time: time in ps, 1 for levels or 2 for the total, the value."""
    edges, requests = stimulus.edges, stimulus.requests
    levels = np.column_stack([edges.times_ps, np.full(len(edges), 1), edges.levels.astype(np.int64)])
    totals = np.column_stack([requests.times_ps, np.full(len(requests), 2), requests.totals])
    rows = np.concatenate([levels, totals]).astype(np.int64)
    return rows[np.argsort(rows[:, 0], kind="stable")]


def response_of(stimulus: Stimulus, runs: Runs, pins: Pins) -> Response:
    """Return what came out of the first play, up to where a play is broken or two of them differ."""
    breaks = [found for play in runs.plays if (found := _broken(play, runs.reason, pins)) is not None]
    breaks += [found for play in runs.plays[1:] if (found := _difference(runs.plays[0], play, pins)) is not None]
    broken = min(breaks, key=lambda found: found.time_ps, default=None)
    until_ps = stimulus.until_ps if broken is None else broken.time_ps
    rows = runs.plays[0]
    if not len(rows) or rows[0, 0] != 0:
        rows = np.zeros((1, 6), np.int64)
    changes = rows[(rows[:, 0] == _CHANGE) & (rows[:, 1] > 0) & (rows[:, 1] < until_ps)]
    changes = np.concatenate([rows[:1], changes])
    # a total of 32 bits has one value more below zero than above it
    done = np.maximum(changes[:, 3], 1 - 2**31)
    edges_ps, levels = _changes(changes[:, 1], changes[:, 2] & 3)
    done_ps, totals = _changes(np.append(-1, changes[:, 1]), np.append(0, done))
    codes_ps, codes = _changes(np.append(-1, changes[:, 1]), np.append(0, changes[:, 4]))
    return Response(
        edges=EdgeStream(edges_ps, levels, initial=int(rows[0, 2]) & 3),
        completed=Totals(done_ps, totals),
        refusals=tuple((int(t), f"code {code}") for t, code in zip(codes_ps, codes, strict=True) if code),
        broken=broken,
    )


def _changes(times_ps: NDArray[np.int64], values: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return when a value differs from the one before it, the last one of each instant counting."""
    last = np.append(np.diff(times_ps) > 0, True)
    times_ps, values = times_ps[last], values[last]
    changed = np.flatnonzero(np.diff(values)) + 1
    return times_ps[changed], values[changed]


def _broken(play: NDArray[np.int64], reason: str, pins: Pins) -> Break | None:
    unknown = np.flatnonzero(play[:, 5])
    if unknown.size:
        row = play[unknown[0]]
        names = [name for bit, name in enumerate(pins.outputs) if row[5] >> bit & 1]
        return Break(time_ps=int(row[1]), reason=f"{' and '.join(names)}: unknown (X) or floating (Z)")
    if len(play) and play[-1, 0] == _END:
        return None
    time_ps = int(play[-1, 1]) if len(play) else 0
    if len(play) and play[-1, 0] == _FINISH:
        return Break(time_ps=time_ps, reason="the design called $finish or $stop")
    return Break(time_ps=time_ps, reason=reason or "it never comes back, or changes its outputs without end")


def _difference(play: NDArray[np.int64], other: NDArray[np.int64], pins: Pins) -> Break | None:
    """Say where two plays that began with other values in open registers differ first."""
    lasts = [rows[rows[:, 0] <= _CHANGE][:, 1:5] for rows in (play, other)]
    shared = min(len(lasts[0]), len(lasts[1]))
    differs = np.flatnonzero((lasts[0][:shared] != lasts[1][:shared]).any(axis=1))
    at = int(differs[0]) if differs.size else shared
    after = [rows[at] for rows in lasts if at < len(rows)]
    if not after:
        return None
    time_ps = int(min(row[0] for row in after))
    states = [rows[: at + 1][rows[: at + 1, 0] <= time_ps][-1] for rows in lasts if len(rows)]
    if len(states) < 2:
        return None
    a, b = ((int(row[1]) & 1, int(row[1]) >> 1 & 1, int(row[2]), int(row[3])) for row in states)
    names = [f"{name} is {x} or {y}" for name, x, y in zip(pins.outputs, a, b, strict=False) if x != y]
    said = f"outputs depend on initial values of registers that nothing sets: {', '.join(names)}"
    return Break(time_ps=time_ps, reason=said)
