"""What goes on around one insertion, picked out of a run of any length."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rtec.injector._wave_kernels import COLUMNS, COMPLETED, LEVEL_IN, LEVEL_OUT, REQUESTED, TIME
from rtec.injector.protocol import Totals
from rtec.injector.waves import insertions
from rtec.signal import EdgeStream, states_of_levels

_BEFORE, _AFTER = 400, 60
"""Rows kept before the booking of an insertion and after it: an edge makes one, an insertion a few."""
MOST_INSERTIONS = 10_000
"""Insertions among which one from a given state is looked for: what a steady motion has not shown by then, it never
shows."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SeenInsertion:
    """What went into a box and what came out of it around an insertion."""

    encoder: EdgeStream
    controller: EdgeStream
    """``encoder``, ``controller``: both sides, from a little before the insertion to a little after it."""
    requested: Totals
    completed: Totals
    """``requested``, ``completed``: steps since then."""
    begin_ps: int
    end_ps: int
    """``begin_ps``, ``end_ps``: first and last change of the insertion at the controller."""
    state: int
    """The encoder's when it began, 1..4 as the report counts."""
    steps: int
    """By how many steps the completed total has changed with it."""


class InsertionCapture:
    """Looks at the rows of a tape until an insertion has passed; a `rtec.machine.tape.TraceSink`.

    Parameters
    ----------
    state
        The encoder's state 1..4 when it begins; None takes the first insertion.

    Examples
    --------
    >>> from rtec.injector import Design, InjectorSettings, Timing
    >>> from rtec.machine import OpenPath, simulate
    >>> box = InjectorSettings(design=Design.C, timing=Timing())
    >>> capture = InsertionCapture()
    >>> simulate(OpenPath(injector=box, frequency_hz=500e3, cycles=9, corrections=1), seen=capture).audit
    True
    >>> seen = capture.found
    >>> seen.state, seen.begin_ps, seen.end_ps
    (4, 1350000, 1450000)
    """

    def __init__(self, state: int | None = None) -> None:
        self._state = state
        self._rows = np.empty((0, COLUMNS), np.int64)
        self._booked: int | None = None
        self.seen_in = dict.fromkeys(range(1, 5), 0)
        """How many insertions were looked at that began in each state."""

    @property
    def done(self) -> bool:
        """Return whether the insertion and what follows on it are kept, or it is not looked for any longer."""
        if self._booked is None:
            return sum(self.seen_in.values()) >= MOST_INSERTIONS
        return self._rows.shape[0] > self._booked + _AFTER

    @property
    def found(self) -> SeenInsertion | None:
        """Return the insertion, or None where there was none."""
        return None if self._booked is None else self._insertion(self._booked, self._booked + _AFTER)

    def show(self, rows: NDArray[np.int64]) -> None:
        """Take rows; the first of them is the last one shown before."""
        kept = self._rows if self._booked is not None else self._rows[-_BEFORE:]
        self._rows = np.concatenate([kept, rows[min(kept.shape[0], 1) :]])
        new = max(kept.shape[0], 1)
        if self._booked is not None:
            return
        completed = self._rows[:, COMPLETED]
        for index in (np.flatnonzero(completed[new:] != completed[new - 1 : -1]) + new).tolist():
            seen = self._insertion(index, index + 1)
            if seen is None:
                continue
            self.seen_in[seen.state] += 1
            if self._state in (None, seen.state):
                self._booked = index
                return
            if self.done:
                return

    def _insertion(self, booked: int, end: int) -> SeenInsertion | None:
        """Return the insertion that is booked with a row; None where the lines do not show it."""
        rows = self._rows[max(booked - _BEFORE, 0) : end]
        booked_ps = int(self._rows[booked, TIME])
        encoder, controller = (_stream(rows, column) for column in (LEVEL_IN, LEVEL_OUT))
        requested, completed = (_totals(rows, column) for column in (REQUESTED, COMPLETED))
        shown = [pair for pair in insertions(encoder, controller, completed, from_ps=int(rows[0, TIME]))
                 if pair[1] <= booked_ps]  # fmt: skip
        if not shown:
            return None
        begin_ps, end_ps = shown[-1]
        return SeenInsertion(
            encoder=encoder,
            controller=controller,
            requested=requested,
            completed=completed,
            begin_ps=begin_ps,
            end_ps=end_ps,
            state=int(states_of_levels([encoder.level_at(begin_ps - 1)])[0]) + 1,
            steps=int(self._rows[booked, COMPLETED] - self._rows[booked - 1, COMPLETED]),
        )


def _stream(rows: NDArray[np.int64], column: int) -> EdgeStream:
    times, levels = _changes(rows, column)
    return EdgeStream(times, levels, int(rows[0, column]))


def _totals(rows: NDArray[np.int64], column: int) -> Totals:
    times, totals = _changes(rows, column)
    return Totals(times, totals - rows[0, column])


def _changes(rows: NDArray[np.int64], column: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    at = np.flatnonzero(np.diff(rows[:, column])) + 1
    return rows[at, TIME], rows[at, column]
