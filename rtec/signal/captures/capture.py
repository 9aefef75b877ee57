"""The face of the readers: a file of any known format becomes two lines in time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rtec.errors import ArgumentError, FileFormatError
from rtec.signal._kernels import ILLEGAL
from rtec.signal.captures import _saleae, _sigrok, _vcd
from rtec.signal.gray import count_deltas
from rtec.signal.stream import EdgeStream
from rtec.units import LONGEST_RUN_PS

_READERS: dict[str, Callable[[Path, _saleae.Pick], tuple[NDArray[np.int64], NDArray[np.uint8]]]] = {
    ".csv": _saleae.read,
    ".sr": _sigrok.read,
    ".vcd": _vcd.read,
}
ENDINGS = tuple(_READERS)
"""Endings of the files that can be read."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Capture:
    """Two lines from the first sample of a file to its last."""

    path: Path
    """The file."""
    edges: EdgeStream
    """Its edges; time 0 is the first sample."""
    end_ps: int
    """Time of the last sample, after every edge."""

    def __post_init__(self) -> None:
        if not len(self.edges):
            raise FileFormatError(self.path, None, "neither A nor B changes", "a capture of a moving encoder")
        if self.end_ps > LONGEST_RUN_PS:
            raise FileFormatError(self.path, None, "longer than 50 days", "a shorter capture")

    @property
    def moves(self) -> NDArray[np.int64]:
        """Return the counts of the edges, +1 or -1, int64 of shape (n,).

        Raises
        ------
        FileFormatError
            A and B change in the same sample: the direction is lost there.
        """
        deltas = count_deltas(self.edges.levels, self.edges.initial).astype(np.int64)
        illegal = np.flatnonzero(deltas == ILLEGAL)
        if illegal.size:
            at_s = int(self.edges.times_ps[illegal[0]]) / 1e12
            problem = f"A and B change at once {illegal.size} times, first {at_s:.9g} s after the begin"
            raise FileFormatError(
                self.path, None, problem, "a capture in which each edge is of one line; sample faster"
            )
        return deltas


def read_capture(path: str | Path, a: str | None = None, b: str | None = None) -> Capture:
    r"""Read a Saleae CSV, a sigrok session (.sr) or a VCD.

    Parameters
    ----------
    path
        Its ending says the format.
    a, b
        Names of the channels, in any case of letters; ``A`` and ``B`` if not said. A channel of a VCD may be named
        with its scope, as in ``encoder.a``.

    Raises
    ------
    ArgumentError
        A channel that the file does not have.
    FileFormatError
        A file that cannot be read, or in which nothing happens.

    Examples
    --------
    >>> import tempfile
    >>> file = Path(tempfile.mkdtemp()) / "scope.csv"
    >>> _ = file.write_text("Time [s],A,B\n-0.000001,0,0\n0,1,0\n0.000002,1,1\n0.000003,1,1\n")
    >>> capture = read_capture(file)
    >>> capture.edges.times_ps.tolist(), capture.edges.counts().net, capture.end_ps
    ([1000000, 3000000], 2, 4000000)
    """
    file = Path(path)
    reader = _READERS.get(file.suffix.lower())
    if reader is None:
        raise FileFormatError(path, None, "not a capture by its ending", ", ".join(ENDINGS))
    times_ps, codes = reader(file, partial(_channels, a, b))
    if np.any(np.diff(times_ps) < 0):
        at = int(np.argmax(np.diff(times_ps) < 0)) + 2
        raise FileFormatError(path, None, f"time goes back in row {at}", "times that do not fall")
    # of rows at one time the last one holds
    last = np.append(times_ps[1:] != times_ps[:-1], True)
    times_ps, codes = times_ps[last], codes[last]
    changed = np.flatnonzero(codes[1:] != codes[:-1]) + 1
    edges = EdgeStream(times_ps[changed] - times_ps[0], codes[changed], int(codes[0]))
    end_ps = int(times_ps[-1] - times_ps[0])
    return Capture(path=file, edges=edges, end_ps=max(end_ps, edges.times_ps[-1] + 1 if len(edges) else 0))


def _channels(a: str | None, b: str | None, names: Sequence[str]) -> tuple[int, int]:
    """Return which of the names are meant."""
    found = _channel("--a", a or "A", names), _channel("--b", b or "B", names)
    if found[0] == found[1]:
        raise ArgumentError("--b", repr(b), "a channel other than that of A")
    return found


def _channel(option: str, wanted: str, names: Sequence[str]) -> int:
    word = wanted.strip().casefold()
    exact = [i for i, name in enumerate(names) if name.casefold() == word]
    found = exact or [i for i, name in enumerate(names) if name.casefold().rpartition(".")[2] == word]
    if len(found) == 1:
        return found[0]
    problem = "is the name of several channels" if found else "is not a channel of the capture"
    known = [names[i] for i in found] or list(names)
    listed = ", ".join(known[:12]) + (" ..." if len(known) > 12 else "")
    raise ArgumentError(option, repr(wanted[:40]), f"one of: {listed[:400]}", problem=problem)
