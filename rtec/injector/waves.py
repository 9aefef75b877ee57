"""What a box does as signals that viewers show: lines, states, counts, totals, insertions, illegal transitions."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rtec.injector import _wave_kernels as kernels
from rtec.injector.protocol import Totals
from rtec.signal import ILLEGAL, EdgeStream, VcdSignal, VcdWriter, coarsest_timescale, count_deltas, states_of_levels

Changes = tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]
"""Times in ps, indices of signals and new values, as `rtec.signal.VcdWriter.write` takes them."""


class BoxWaves:
    """Signals of a box, fed with rows of what holds from a time on.

    A and B on both sides under names that are unique even without their groups, which PulseView does not show; then
    ``inserting`` and ``illegal`` (the last change at the controller was one of both lines at once); the report's
    states 1..4; the counts of an ideal decoder on each side, and the totals of steps, as two's complements.

    Parameters
    ----------
    initial
        Level codes of encoder and controller at the start.
    most_counts, most_steps
        How far counts and totals may go from 0, for the width of their signals.

    Examples
    --------
    Design C, asked for one step in state 1, inverts A and then B:

    >>> rows = np.array([[1_000, 0, 0, 1, 0, 0], [2_000, 0, 1, 1, 0, 1], [3_000, 0, 3, 1, 1, 0]])
    >>> waves = BoxWaves((0, 0), most_counts=2, most_steps=1)
    >>> times, which, values = waves.changes(rows)
    >>> [(int(t), waves.signals[s].name, int(v)) for t, s, v in zip(times, which, values)][-4:]
    [(3000, 'ctl_state', 3), (3000, 'ctl_count', 2), (3000, 'completed', 1), (3000, 'inserting', 0)]
    """

    def __init__(self, initial: tuple[int, int], *, most_counts: int, most_steps: int) -> None:
        counts, totals = (2 * most + 1 for most in (most_counts, most_steps))
        self._count_mask, self._total_mask = (1 << counts.bit_length()) - 1, (1 << totals.bit_length()) - 1
        self._last = np.zeros(kernels.REMEMBERED, np.int64)
        self._last[[kernels.LEVEL_IN, kernels.LEVEL_OUT]] = initial
        sides = tuple(zip((("encoder", "enc"), ("controller", "ctl")), initial, strict=True))
        self.signals = [
            *(
                VcdSignal(scope=scope, name=f"{short}_{line}", initial=level >> bit & 1, also=line)
                for (scope, short), level in sides
                for bit, line in enumerate("AB")
            ),
            *(VcdSignal(scope="box", name=name) for name in ("inserting", "illegal")),
            *(
                VcdSignal(scope=scope, name=f"{short}_state", width=3, initial=int(states_of_levels([level])[0]) + 1)
                for (scope, short), level in sides
            ),
            *(
                VcdSignal(scope=scope, name=f"{short}_count", width=counts.bit_length())
                for (scope, short), _ in sides
            ),
            *(VcdSignal(scope="box", name=name, width=totals.bit_length()) for name in ("requested", "completed")),
        ]
        """Signals by the index that changes give them."""

    def changes(self, rows: NDArray[np.int64]) -> Changes:
        """Return the changes that rows make, in the order of time.

        Parameters
        ----------
        rows
            Time in ps, level codes of encoder and controller, totals requested and completed, whether an insertion is
            under way; int64, shape (n, 6), times not decreasing, nor below those of the rows before.
        """
        room = rows.shape[0] * kernels.SIGNALS
        times, which, values = (np.empty(room, np.int64) for _ in range(3))
        n = kernels.changes_of_rows(rows, self._last, self._count_mask, self._total_mask, times, which, values)
        return times[:n], which[:n], values[:n]


def rows_of_streams(
    encoder: EdgeStream,
    controller: EdgeStream,
    requested: Totals,
    completed: Totals,
    *,
    inserted: Sequence[tuple[int, int]] | None = None,
) -> NDArray[np.int64]:
    """Return the rows of a box of which nothing is known but what goes in and comes out.

    An insertion is shown from its first to its last change; where there is but one, from the edge or the request
    before it.

    Parameters
    ----------
    encoder, controller
        Both sides.
    requested, completed
        Totals of steps.
    inserted
        First and last change of each insertion; without it, what the lines show (`insertions`).

    Examples
    --------
    >>> controller = EdgeStream([2_000, 3_000], [1, 3], initial=0)
    >>> rows_of_streams(EdgeStream([], [], 0), controller, Totals([1_000], [1]), Totals([3_000], [1])).tolist()
    [[1000, 0, 0, 1, 0, 0], [2000, 0, 1, 1, 0, 1], [3000, 0, 3, 1, 1, 0]]
    """
    begins, ends = [], []
    for begin_ps, end_ps in insertions(encoder, controller, completed) if inserted is None else inserted:
        before = [times[times < begin_ps][-1:] for times in (encoder.times_ps, requested.times_ps)]
        begins.append(int(max(np.concatenate(before), default=begin_ps)) if begin_ps == end_ps else begin_ps)
        ends.append(end_ps)
    events = (encoder.times_ps, controller.times_ps, requested.times_ps, completed.times_ps, begins, ends)
    times = np.unique(np.concatenate([np.asarray(part, np.int64) for part in events]))
    busy = np.searchsorted(np.sort(begins), times, side="right") - np.searchsorted(np.sort(ends), times, side="right")
    totals = (
        np.concatenate([[0], total.totals])[np.searchsorted(total.times_ps, times, side="right")]
        for total in (requested, completed)
    )
    levels = (side.levels_at(times) for side in (encoder, controller))
    return np.column_stack([times, *levels, *totals, busy > 0]).astype(np.int64)


def write_waves(
    file: Path,
    rows: NDArray[np.int64],
    *,
    initial: tuple[int, int],
    start_ps: int = 0,
    end_ps: int,
    beside: Sequence[tuple[VcdSignal, NDArray[np.int64], NDArray[np.int64]]] = (),
) -> None:
    """Write rows, and other signals, as a waveform file on the coarsest timescale that holds every time.

    Parameters
    ----------
    file
        One that exists is replaced once the new one is complete.
    rows
        As of `BoxWaves.changes`.
    initial
        Level codes of encoder and controller at the start.
    start_ps, end_ps
        Time of the initial levels, and closing time; a change after it moves it there.
    beside
        Other signals, with times in ps and values of their changes.

    Raises
    ------
    OutputError
        It cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> file = Path(tempfile.mkdtemp()) / "f.vcd"
    >>> write_waves(file, np.array([[1_000, 1, 1, 0, 0, 0]]), initial=(0, 0), end_ps=9_000)
    >>> file.read_text().split("$end")[-1].split()
    ['#1', '1a', '0g', '1m', '1i', '1c', '0h', '1n', '1j', '#9']
    """
    totals = rows[:, [kernels.REQUESTED, kernels.COMPLETED]]
    most_steps = int(np.abs(totals).max(initial=0))
    waves = BoxWaves(initial, most_counts=2 * rows.shape[0], most_steps=most_steps)
    own = waves.changes(rows)
    first = len(waves.signals)
    others = [(times, np.full(times.size, first + k), values) for k, (_, times, values) in enumerate(beside)]
    times, which, values = (np.concatenate(column) for column in zip(own, *others, strict=True))
    order = np.argsort(times, kind="stable")
    end_ps = max(end_ps, int(times.max(initial=0)))
    timescale = coarsest_timescale(np.append(times, [start_ps, end_ps]))
    signals = [*waves.signals, *(row[0] for row in beside)]
    with VcdWriter(file, signals=signals, timescale=timescale, start_ps=start_ps) as writer:
        writer.write(times[order], which[order], values[order])
        writer.finish(end_ps)


def insertions(
    encoder: EdgeStream, controller: EdgeStream, completed: Totals, *, from_ps: int = 0
) -> list[tuple[int, int]]:
    """Return begin and end of each insertion as the lines show it: its first and last change at the controller.

    Parameters
    ----------
    encoder, controller
        Both sides of the box.
    completed
        Totals of steps; an insertion ends with the last change up to the moment at which it is booked.
    from_ps
        From when on they are looked for.

    Notes
    -----
    Lines that pass through a processor come late, so a change that the encoder does not make at the same instant may
    be a real one. What tells them apart is the difference of both counts: an insertion begins where that leaves, for
    the last time, the value which it had for the longest time since ``from_ps`` or the last booking.

    Examples
    --------
    Design B passes an edge a microsecond late and then adds a count of its own:

    >>> encoder = EdgeStream([10_000_000], [1], initial=0)
    >>> controller = EdgeStream([11_000_000, 12_000_000], [1, 3], initial=0)
    >>> insertions(encoder, controller, Totals([12_000_000], [1]))
    [(12000000, 12000000)]
    """
    times = np.union1d(encoder.times_ps, controller.times_ps)
    ahead = _count_at(controller, times) - _count_at(encoder, times)
    found = []
    before_ps = from_ps
    for booked_ps in completed.times_ps[completed.times_ps > from_ps].tolist():
        own = controller.times_ps[(controller.times_ps > before_ps) & (controller.times_ps <= booked_ps)]
        if own.size:
            first, last = np.searchsorted(times, (before_ps, int(own[-1])), side="right")
            values = np.concatenate([ahead[first - 1 : first] if first else [0], ahead[first:last]])
            own = own[own >= _departure(np.concatenate([[before_ps], times[first:last]]), values)]
            found.append((int(own[0]), int(own[-1])))
        before_ps = booked_ps
    return found


def _departure(times_ps: NDArray[np.int64], values: NDArray[np.int64]) -> int:
    """Return when the value that lasted longest was left for the last time; the last time where it never was."""
    lasted: dict[int, int] = {}
    for value, time_ps in zip(values[:-1].tolist(), np.diff(times_ps).tolist(), strict=True):
        lasted[value] = lasted.get(value, 0) + time_ps
    usual = max(lasted, key=lambda value: lasted[value])
    left = np.flatnonzero((values[:-1] == usual) & (values[1:] != usual))
    return int(times_ps[left[-1] + 1] if left.size else times_ps[-1])


def counts_along(stream: EdgeStream) -> NDArray[np.int64]:
    """Return the count from the start and from each edge on, int64 of shape (n + 1,); illegal transitions have none.

    Examples
    --------
    >>> counts_along(EdgeStream([10, 20, 30], [1, 3, 0], initial=0)).tolist()
    [0, 1, 2, 2]
    """
    deltas = count_deltas(stream.levels, stream.initial)
    return np.concatenate([[0], np.cumsum(np.where(deltas == ILLEGAL, 0, deltas))]).astype(np.int64)


def _count_at(stream: EdgeStream, times_ps: NDArray[np.int64]) -> NDArray[np.int64]:
    return counts_along(stream)[np.searchsorted(stream.times_ps, times_ps, side="right")]
