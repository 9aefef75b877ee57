"""What there is to see of a trial: lines, totals and words from before its fault until after the stop."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from rtec.injector import Totals
from rtec.machine._recorder_kernels import KEPT
from rtec.requester.settings import PcState
from rtec.requester.status import BoxState, Status
from rtec.requester.supervision import HoldReason
from rtec.signal import NEVER, EdgeStream
from rtec.units import PS_PER_MS, PS_PER_US
from rtec.verify.campaign.job import Parameters, Record, Value
from rtec.verify.campaign.trace import Trace, Word
from rtec.verify.safety.jobs import Injection, inject, injection_of
from rtec.verify.safety.monitor import MonitoredCell
from rtec.verify.safety.phases import cell_parts, run_through

_BEFORE_PS, _AFTER_PS, _UNDETECTED_PS = 25 * PS_PER_MS, 25 * PS_PER_MS, 120 * PS_PER_MS
"""Recorded before the first moment that matters, after the last, and of a fault that nobody notices."""
_LOOK_PS = 50 * PS_PER_US
"""Between looks at totals and words; of the lines every change is kept, of which fewer than ``KEPT`` may come."""
_NO_POWER, _HUNG = 1 + max(BoxState), 2 + max(BoxState)
_WORDS = {
    ("pc", "asked"): None,
    ("pc", "state"): {int(one): one.name.lower() for one in PcState},
    ("pc", "hold"): {int(one): one.name.lower().replace("_", " ") for one in HoldReason},
    ("box", "state"): {int(one): one.name.lower().replace("_", " ") for one in BoxState}
    | {_NO_POWER: "no power", _HUNG: "hung"},
    ("box", "status"): {int(one): one.name.lower().replace("_", " ") for one in Status},
    ("box", "accepted"): None,
    ("box", "completed"): None,
    ("axis", "true_count"): None,
}
"""Of axis 1, by scope and name, with what their values mean."""


class RecordedCell(MonitoredCell):
    """A machine of which axis 1 is recorded from a time on."""

    record_from_ps = NEVER

    def monitor(self, *, until_ps: int, stop_after_ps: int = NEVER // 4, slice_ps: int | None = None) -> None:
        """Run as a machine that is monitored does, in shorter stretches while it is recorded."""
        while self.now_ps < until_ps:
            recorded = self.now_ps >= self.record_from_ps
            to_ps = min(until_ps, self.now_ps + _LOOK_PS if recorded else self.record_from_ps)
            super().monitor(until_ps=to_ps, stop_after_ps=stop_after_ps, slice_ps=slice_ps)
            if self.now_ps >= self.record_from_ps:
                self._look()
            if self.now_ps < to_ps:
                return

    def record(self, *, from_ps: int) -> None:
        """Begin to record at a time."""
        self.record_from_ps = from_ps
        self._lines: dict[int, tuple[int, int]] = {}
        self._seen: list[tuple[int, ...]] = []
        self._stations[0].keeps = 1
        self._kept = 0

    def _look(self) -> None:
        st, pc = self._stations[0], self._pcs[0]
        if not self._seen:
            self._lines[self.now_ps] = int(st.lines), int(st.injector.ab_out)
        first = max(self._kept, int(st.kept) - KEPT) if self._seen else int(st.kept)
        for k in range(max(first - 1, 0) if self._seen else first, int(st.kept)):
            t_ps, lines, out = st.kept_rows[k % KEPT].tolist()
            if t_ps > self.record_from_ps:
                self._lines[t_ps] = lines, out
        self._kept = int(st.kept)
        box = st.node.box
        state = int(box.state) if st.powered == 1 else _HUNG if st.powered else _NO_POWER
        self._seen.append((
            self.now_ps, int(pc.pc.sent), int(pc.pc.state), int(pc.reason), state, int(box.status), int(box.accepted),
            int(st.injector.completed), int(st.encoder.count),
        ))  # fmt: skip

    def trace(self, title: str, marks: tuple[tuple[int, str], ...]) -> Trace:
        """Return what was recorded."""
        lines = np.array([[t_ps, *levels] for t_ps, levels in sorted(self._lines.items())], np.int64)
        seen = np.array(self._seen, np.int64)
        words = tuple(
            Word(scope=scope, name=name, **_changes(seen, column), texts=texts)
            for column, ((scope, name), texts) in enumerate(_WORDS.items(), start=1)
        )
        totals = {word.name: Totals(word.times_ps, word.values) for word in words}
        return Trace(
            title=title, encoder=_stream(lines, 1), controller=_stream(lines, 2), requested=totals["accepted"],
            completed=totals["completed"], from_ps=int(seen[0, 0]), until_ps=int(seen[-1, 0]), marks=marks,
            words=tuple(word for word in words if word.name not in ("accepted", "completed")),
        )  # fmt: skip


def trace_of(parameters: Parameters, seed: int, run: int) -> Trace:
    """Return what there is to see of a trial, as `rtec.verify.safety.jobs.inject` takes it.

    Examples
    --------
    >>> words = {"design": "c", "phase": "cutting", "fault": "pc-killed", "second": "none"}
    >>> trace = trace_of(words, seed=1, run=0)
    >>> [(t_ps // 10**9, word) for t_ps, word in trace.marks]
    [(1639, 'PC killed'), (1682, 'safe stop')]
    """
    record, injection = inject(parameters, seed, run), injection_of(parameters, seed, run)
    marks = [(t_ps, word) for t_ps, word in _moments(record, injection) if isinstance(t_ps, int)]
    first_ps, last_ps = min(t_ps for t_ps, _ in marks), max(t_ps for t_ps, _ in marks)
    after_ps = _UNDETECTED_PS if record["detected_ps"] is None else _AFTER_PS
    parts = cell_parts(injection.phase, injection.design, injection.run, algorithm=injection.algorithm)
    cell = RecordedCell(*parts, faults=injection.faults)
    cell.record(from_ps=max(first_ps - _BEFORE_PS, 0))
    run_through(cell, injection.phase, until_ps=last_ps + after_ps)
    faults = " and ".join(variant.name for variant in injection.variants)
    title = f"{injection.design.title}, {injection.phase.value}: {faults}: {record['outcome']}"
    return cell.trace(title, tuple(sorted(marks)))


def _moments(record: Record, injection: Injection) -> Iterator[tuple[Value, str]]:
    """Yield the moments of a trial, as far as they came, with their words."""
    names = [variant.kind.words for variant in injection.variants]
    yield record["activated_ps"] if record["activated_ps"] is not None else record["moment_ps"], names[0]
    if len(names) > 1:
        at_ps = record["second_activated_ps"]
        yield record["second_moment_ps"] if at_ps is None else at_ps, names[1]
    yield record["detected_ps"], "safe stop"


def _changes(seen: NDArray[np.int64], column: int) -> dict[str, NDArray[np.int64]]:
    """Return when a column changed, and its values from then on."""
    at = np.flatnonzero(np.diff(seen[:, column], prepend=seen[0, column] - 1))
    return {"times_ps": seen[at, 0], "values": seen[at, column]}


def _stream(lines: NDArray[np.int64], column: int) -> EdgeStream:
    at = np.flatnonzero(np.diff(lines[:, column])) + 1
    return EdgeStream(lines[at, 0], lines[at, column].astype(np.uint8), int(lines[0, column]))
