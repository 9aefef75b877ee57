"""Waveform files in VCD, the format that GTKWave, PulseView and every logic simulator read.

References
----------
IEEE Std 1364-2005, section 18 (four-state value change dump).
"""

from __future__ import annotations

import enum
import re
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from itertools import count, groupby, product
from pathlib import Path
from string import ascii_letters
from types import TracebackType
from typing import BinaryIO

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rtec.errors import ArgumentError, RtecError, unknown
from rtec.io import WholeFile
from rtec.signal import _checks
from rtec.signal._vcd_kernels import DIGITS, format_changes

TIMESCALES_PS = {
    f"{number} {unit}": number * 1000**power
    for power, unit in enumerate(("ps", "ns", "us", "ms", "s"))
    for number in (1, 10, 100)
    if not (unit == "s" and number > 1)
}
"""Picoseconds in one unit of each timescale that a file can have, finest first."""


def coarsest_timescale(times_ps: ArrayLike) -> str:
    """Return the coarsest timescale that holds every one of some times exactly, whole ps, shape (n,).

    Examples
    --------
    >>> coarsest_timescale([2_000_000, 3_500_000, 10_000_000])
    '100 ns'
    """
    common = int(np.gcd.reduce(np.asarray(times_ps, np.int64), initial=0))
    return next(text for text in reversed(TIMESCALES_PS) if common % TIMESCALES_PS[text] == 0)


WIDEST = 62
_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_$]{0,254}")
_CHUNK_CHANGES = 1 << 18


class VcdPhaseError(RtecError):
    """A call that does not belong to the writer's present phase."""


class Phase(enum.Enum):
    """What a writer has done: the phases follow one another and none comes back."""

    NEW = "not entered"
    CHANGES = "taking changes"
    FINISHED = "finished"
    CLOSED = "closed"


@dataclass(frozen=True, slots=True, kw_only=True)
class VcdSignal:
    """A signal of a waveform file.

    Parameters
    ----------
    scope
        The group under which viewers show it.
    name
        Its name in the group; letters, digits, ``_`` and ``$``, no digit first.
    width
        Number of bits, 1..62. More than one are written as wires ``name[1]``, ``name[0]``, which GTKWave joins to one
        signal: readers that know single bits only, such as libsigrok up to 0.5.2, read them too.
    initial
        Value at the start of the file.
    also
        A second name for the same bit in the group, or none. It is declared as an integer, which libsigrok up to
        0.5.2 leaves out: that one shows names without their groups, and each bit under one of them.

    Examples
    --------
    >>> VcdSignal(scope="encoder", name="A", initial=1).width
    1
    >>> VcdSignal(scope="encoder", name="state", width=3).wires
    ('state[2]', 'state[1]', 'state[0]')
    """

    scope: str
    name: str
    width: int = 1
    initial: int = 0
    also: str = ""

    def __post_init__(self) -> None:
        for key, text in (("scope", self.scope), ("name", self.name), ("also", self.also or self.name)):
            if not isinstance(text, str) or _NAME.fullmatch(text) is None:
                raise ArgumentError(key, repr(text)[:80], "letters, digits, _ and $, at most 255, no digit first")
        width = _checks.whole_number("width", self.width, f"a whole number from 1 to {WIDEST}")
        if not 1 <= width <= WIDEST:
            raise ArgumentError("width", width, f"a whole number from 1 to {WIDEST}")
        _checks.code("initial", self.initial, 2**width - 1)

    @property
    def wires(self) -> tuple[str, ...]:
        """Return the names of its bits, the highest first."""
        return tuple(f"{self.name}[{bit}]" for bit in reversed(range(self.width))) if self.width > 1 else (self.name,)


class VcdWriter:
    """A waveform file being written.

    The life of a writer: ``with`` writes the header; :meth:`write` takes changes, as often as wanted, in order of
    time; :meth:`finish` writes the closing time; the end of the ``with`` block moves the file to its place. After an
    error or Ctrl-C no file is left. The same input gives the same bytes: the file holds no date.

    Parameters
    ----------
    target
        Path of the file, or a binary file object, which stays open and keeps what an error leaves in it.
    signals
        The signals; :meth:`write` names them by their index.
    timescale
        Unit of the times in the file, a key of ``TIMESCALES_PS``. Viewers that sample (PulseView) are the faster the
        coarser it is; see :func:`coarsest_timescale`.
    start_ps
        Time of the initial values.

    Raises
    ------
    ArgumentError
        No signal, two of one name, an unknown timescale, a start that is negative or no multiple of the timescale.
    OutputError
        The file cannot be written.
    VcdPhaseError
        A call out of order.

    Examples
    --------
    >>> import io
    >>> file = io.BytesIO()
    >>> with VcdWriter(file, signals=[VcdSignal(scope="encoder", name="A")], timescale="1 us") as writer:
    ...     writer.write([2_000_000, 4_000_000], [0, 0], [1, 0])
    ...     writer.finish(5_000_000)
    >>> file.getvalue().decode().split("$end")[-1].split()
    ['#2', '1a', '#4', '0a', '#5']
    """

    def __init__(
        self,
        target: str | Path | BinaryIO,
        *,
        signals: Sequence[VcdSignal],
        timescale: str = "1 ps",
        start_ps: int = 0,
    ) -> None:
        if timescale not in TIMESCALES_PS:
            raise unknown("timescale", timescale, TIMESCALES_PS, noun="timescale")
        if not signals:
            raise ArgumentError("signals", "an empty sequence", "at least one signal")
        known: set[str] = set()
        for index, signal in enumerate(signals):
            for name in filter(None, (signal.name, signal.also)):
                if (full := f"{signal.scope}.{name}") in known:
                    raise ArgumentError(f"signals[{index}]", full, "each name once")
                known.add(full)
        self._signals = tuple(signals)
        self._timescale = timescale
        self._start_ps = _checks.time_ps("start_ps", start_ps)
        if self._start_ps < 0:
            raise ArgumentError("start_ps", f"{start_ps} ps", "a time not below 0", "shift the streams")
        self._last_tick = int(self._ticks("start_ps", np.array([self._start_ps]))[0])
        # low bits change most often, so they get the short codes
        wires = [(bit, index) for index, signal in enumerate(signals) for bit in range(signal.width)]
        self._codes = dict(zip(sorted(wires), _codes(), strict=False))
        self._first_wire = np.cumsum([0, *(signal.width for signal in signals[:-1])])
        self._names = np.zeros((len(wires), 4), dtype=np.uint8)  # each is ended by a zero
        for row, wire in enumerate(wires):
            code = self._codes[wire].encode()
            self._names[row, : len(code)] = list(code)
        self._values = np.array([signal.initial for signal in signals], dtype=np.int64)
        self._widths = np.array([signal.width for signal in signals], dtype=np.int64)
        self._phase = Phase.NEW
        self._output: AbstractContextManager[WholeFile | BinaryIO] = (
            WholeFile(target) if isinstance(target, str | Path) else nullcontext(target)
        )

    @property
    def phase(self) -> Phase:
        """What the writer has done so far."""
        return self._phase

    def __enter__(self) -> VcdWriter:
        self._expect(Phase.NEW, "with", "make a new writer for each file")
        self._file = self._output.__enter__()
        self._phase = Phase.CHANGES
        try:
            self._file.write(self._header().encode("ascii"))
        except BaseException as error:
            self._phase = Phase.CLOSED
            self._output.__exit__(type(error), error, None)
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self._phase = Phase.CLOSED
        self._output.__exit__(kind, error, traceback)

    def write(self, times_ps: ArrayLike, signals: ArrayLike, values: ArrayLike) -> None:
        """Write changes.

        Parameters
        ----------
        times_ps
            Times in ps, not decreasing, not before those written so far, multiples of the timescale; shape (n,).
        signals
            Index of the signal that changes, shape (n,).
        values
            Its new value, within its width, shape (n,).

        Raises
        ------
        ArgumentError
            A value outside these bounds, named with its index.
        OutputError
            The file cannot be written.
        VcdPhaseError
            Outside the ``with`` block or after :meth:`finish`.
        """
        self._expect(Phase.CHANGES, "write", "write inside the with block and before finish")
        times = _checks.whole_numbers("times_ps", times_ps, "whole picoseconds")
        which = _checks.whole_numbers("signals", signals, "indices of signals")
        new = _checks.whole_numbers("values", values, "whole numbers")
        if not times.size == which.size == new.size:
            raise ArgumentError("values", f"{times.size}, {which.size} and {new.size} items", "arrays of one length")
        if not times.size:
            return
        _refuse("signals", which, (which < 0) | (which >= len(self._signals)), f"0..{len(self._signals) - 1}")
        highest = (1 << self._widths[which]) - 1
        _refuse("values", new, (new < 0) | (new > highest), "values within the signal's width")
        ticks = self._ticks("times_ps", times)
        last_ps = self._last_tick * TIMESCALES_PS[self._timescale]
        late = np.concatenate([ticks[:1] < self._last_tick, ticks[1:] < ticks[:-1]])
        _refuse("times_ps", times, late, f"times that do not decrease and are not before {last_ps} ps")
        for first in range(0, ticks.size, _CHUNK_CHANGES):
            part = slice(first, first + _CHUNK_CHANGES)
            self._format(ticks[part], which[part].astype(np.int64), new[part].astype(np.int64))

    def finish(self, end_ps: int) -> None:
        """Write the closing time, so that viewers show the last values up to it.

        Raises
        ------
        ArgumentError
            A time before the last change, or no multiple of the timescale.
        """
        self._expect(Phase.CHANGES, "finish", "finish once, inside the with block")
        end = _checks.time_ps("end_ps", end_ps)
        tick = int(self._ticks("end_ps", np.array([end]))[0])
        if tick < self._last_tick:
            last_ps = self._last_tick * TIMESCALES_PS[self._timescale]
            raise ArgumentError("end_ps", f"{end} ps", f"a time not before the last change at {last_ps} ps")
        if tick > self._last_tick:
            self._file.write(f"#{tick}\n".encode("ascii"))
        self._phase = Phase.FINISHED

    def _format(self, ticks: NDArray[np.int64], which: NDArray[np.int64], values: NDArray[np.int64]) -> None:
        longest = DIGITS + 2 + int(self._widths.max()) * (self._names.shape[1] + 1)
        out = np.empty(ticks.size * longest, dtype=np.uint8)
        size = format_changes(
            ticks, which, values, self._widths, self._first_wire, self._names, self._values, self._last_tick, out
        )
        self._file.write(out[:size].data)
        self._last_tick = int(ticks[-1])

    def _ticks(self, name: str, times_ps: NDArray[np.signedinteger | np.unsignedinteger]) -> NDArray[np.int64]:
        unit = TIMESCALES_PS[self._timescale]
        bound = 2**62
        _refuse(name, times_ps, (times_ps < 0) | (times_ps > bound), f"times 0..{bound} ps")
        times = times_ps.astype(np.int64, copy=False)
        ticks: NDArray[np.int64] = times // unit
        allowed = f"multiples of the timescale {self._timescale}"
        _refuse(name, times_ps, ticks * unit != times, allowed, "choose a finer timescale")
        return ticks

    def _header(self) -> str:
        lines = ["$version rtec $end", f"$timescale {self._timescale} $end"]
        for scope, coded in groupby(self._coded(), key=lambda pair: pair[0].scope):
            lines.append(f"$scope module {scope} $end")
            for signal, codes in coded:
                lines += [f"$var wire 1 {code} {wire} $end" for code, wire in zip(codes, signal.wires, strict=True)]
                lines += [f"$var integer 1 {codes[0]} {signal.also} $end"] if signal.also else []
            lines.append("$upscope $end")
        lines += ["$enddefinitions $end", f"#{self._last_tick}", "$dumpvars"]
        for signal, codes in self._coded():
            lines += [f"{bit}{code}" for bit, code in zip(f"{signal.initial:0{signal.width}b}", codes, strict=True)]
        return "\n".join([*lines, "$end", ""])

    def _coded(self) -> Iterator[tuple[VcdSignal, list[str]]]:
        """Yield each signal with the codes of its bits, the highest first."""
        for index, signal in enumerate(self._signals):
            yield signal, [self._codes[bit, index] for bit in reversed(range(signal.width))]

    def _expect(self, phase: Phase, call: str, hint: str) -> None:
        if self._phase is not phase:
            raise VcdPhaseError(f"{call}: not allowed while the VCD writer is {self._phase.value}; {hint}")


def _codes() -> Iterator[str]:
    """Yield codes of one letter, then of two, and so on."""
    for length in count(1):
        yield from ("".join(code) for code in product(ascii_letters, repeat=length))


def _refuse(
    name: str,
    values: NDArray[np.signedinteger | np.unsignedinteger],
    wrong: NDArray[np.bool_],
    allowed: str,
    hint: str = "",
) -> None:
    """Raise an error that names the first wrong value."""
    if wrong.any():
        index = int(np.argmax(wrong))
        raise ArgumentError(f"{name}[{index}]" if values.size > 1 else name, values[index], allowed, hint)
