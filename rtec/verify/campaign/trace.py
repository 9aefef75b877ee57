"""What there is to see of one job: both sides of a box over time, words, and the moments that matter."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rtec.injector import Totals
from rtec.injector.waves import rows_of_streams, write_waves
from rtec.signal import EdgeStream, VcdSignal
from rtec.verify.campaign.job import Job, JobKind, named_at

_BEFORE, _AFTER = 6, 10
"""Changes of the lines that are shown before and after a moment."""
_MARGIN = 0.08


@dataclass(frozen=True, kw_only=True, eq=False)
class Word:
    """A number or a state beside the lines, over time."""

    scope: str
    name: str
    """``scope``, ``name``: under which the waveform file has it; letters, digits and _."""
    times_ps: NDArray[np.int64]
    values: NDArray[np.int64]
    """``times_ps``, ``values``: from each of these times on, shapes (n,)."""
    texts: dict[int, str] | None = None
    """What values mean; None where they are numbers."""

    @cached_property
    def width(self) -> int:
        """Return the bits that hold every value; as a two's complement where it is a number."""
        most = int(np.abs(self.values).max(initial=1))
        return max((most if self.texts is not None else 2 * most + 1).bit_length(), 1)

    def signal(self) -> tuple[VcdSignal, NDArray[np.int64], NDArray[np.int64]]:
        """Return it as `rtec.injector.waves.write_waves` takes it."""
        values = self.values & ((1 << self.width) - 1)
        first = int(values[0]) if values.size else 0
        return VcdSignal(scope=self.scope, name=self.name, width=self.width, initial=first), self.times_ps, values


@dataclass(frozen=True, kw_only=True, eq=False)
class Trace:
    """What was seen of a job.

    Examples
    --------
    >>> controller = EdgeStream([2_000_000, 3_000_000], [1, 3], initial=0)
    >>> trace = Trace(title="one step", encoder=EdgeStream([], [], 0), controller=controller, until_ps=9_000_000,
    ...               requested=Totals([1_000_000], [1]), completed=Totals([3_000_000], [1]),
    ...               marks=((2_500_000, "fault"),))
    >>> trace.windows_ps
    [(1920000, 3080000)]
    """

    title: str
    encoder: EdgeStream
    """At the box's input, behind the encoder's cable."""
    controller: EdgeStream
    requested: Totals
    completed: Totals
    """``requested``, ``completed``: totals of steps that the box has accepted and inserted."""
    from_ps: int = 0
    until_ps: int
    """``from_ps``, ``until_ps``: what was recorded."""
    marks: tuple[tuple[int, str], ...]
    """Moments with a word or two each: of a fault its first effect, of the machine its stop."""
    words: tuple[Word, ...] = ()
    shown_ps: tuple[int, int] | None = None
    """Begin and end of what a picture shows of the lines; None: some changes around each mark."""

    @property
    def windows_ps(self) -> list[tuple[int, int]]:
        """Return begin and end of the stretches that a picture shows of the lines; those that overlap are one."""
        if self.shown_ps is not None:
            return [self.shown_ps]
        found: list[tuple[int, int]] = []
        for begin_ps, end_ps in sorted(self._around(t_ps) for t_ps, _ in self.marks):
            if found and begin_ps <= found[-1][1]:
                found[-1] = found[-1][0], max(end_ps, found[-1][1])
            else:
                found.append((begin_ps, end_ps))
        return found

    def _around(self, t_ps: int) -> tuple[int, int]:
        """Return a stretch of a few changes around a moment."""
        changes = np.union1d(self.encoder.times_ps, self.controller.times_ps)
        at = int(np.searchsorted(changes, t_ps))
        some = [*changes[max(at - _BEFORE, 0) : at + _AFTER].tolist(), t_ps]
        margin_ps = max(round(_MARGIN * (max(some) - min(some))), 40_000)
        return max(min(some) - margin_ps, self.from_ps), min(max(some) + margin_ps, self.until_ps)

    def write_vcd(self, file: Path) -> None:
        """Write lines, states, counts, totals, words and marks as a waveform file.

        Raises
        ------
        OutputError
            It cannot be written.
        """
        rows = rows_of_streams(self.encoder, self.controller, self.requested, self.completed)
        marks = [
            (VcdSignal(scope="moments", name=_name(word)), np.array([t_ps], np.int64), np.array([1], np.int64))
            for t_ps, word in self.marks
        ]
        initial = self.encoder.initial, self.controller.initial
        beside = [*(word.signal() for word in self.words), *marks]
        write_waves(file, rows, initial=initial, start_ps=self.from_ps, end_ps=self.until_ps, beside=beside)


def trace_of(kind: JobKind, job: Job) -> Trace | None:
    """Return what there is to see of a job, which is carried out again; None where its kind shows nothing."""
    if not kind.trace:
        return None
    found: Trace | None = named_at(kind.trace)(job.parameters, job.seed, job.run)
    return found


def _name(word: str) -> str:
    """Return a word or two as a name of a waveform file."""
    return "".join(sign if sign.isascii() and sign.isalnum() else "_" for sign in word)
