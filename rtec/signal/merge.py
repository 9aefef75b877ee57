"""Gates in time: two lines merged into one, exactly, whole or streaming."""

from __future__ import annotations

import enum
from collections.abc import Iterable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from rtec.errors import ArgumentError
from rtec.signal import _checks, _kernels
from rtec.signal._feed import Feed
from rtec.signal.line import LevelStream


class Gate(enum.Enum):
    """A gate of two inputs; its value is the output for (a, b) = (0, 0), (1, 0), (0, 1), (1, 1)."""

    OR = (0, 1, 1, 1)
    AND = (0, 0, 0, 1)
    XOR = (0, 1, 1, 0)


def merge_lines(gate: Gate | Sequence[int], a: LevelStream, b: LevelStream) -> LevelStream:
    """Return the output of a gate without delay.

    Parameters
    ----------
    gate
        A :class:`Gate`, or any other truth table: four outputs at index ``a + 2 * b``.
    a, b
        The inputs.

    Returns
    -------
    LevelStream
        The output. Inputs that change at one time give one change or none, never a pulse of no width.

    Raises
    ------
    ArgumentError
        A truth table that is not four zeros and ones.

    Notes
    -----
    Linear in the number of toggles.

    Examples
    --------
    The second pulse begins as the first one ends, so the output stays high:

    >>> merge_lines(Gate.OR, LevelStream([10, 20], 0), LevelStream([20, 30], 0)).times_ps.tolist()
    [10, 30]
    """
    return LevelStream.concatenate(merge_chunks(gate, [a], [b]))


def merge_chunks(
    gate: Gate | Sequence[int], a_chunks: Iterable[LevelStream], b_chunks: Iterable[LevelStream]
) -> Iterator[LevelStream]:
    """Merge two lines that come in pieces, holding no more than one piece of each.

    Parameters
    ----------
    gate
        As in :func:`merge_lines`.
    a_chunks, b_chunks
        Pieces that follow one another; they need not be cut at the same times.

    Yields
    ------
    LevelStream
        Pieces of the output, at least one; joined they are what :func:`merge_lines` gives.

    Raises
    ------
    ArgumentError
        A truth table that is not four zeros and ones, an input without a piece, or a piece that does not continue
        the one before it.

    Examples
    --------
    >>> a, b = LevelStream([10, 20], 0), LevelStream([15, 30], 0)
    >>> pieces = list(merge_chunks(Gate.XOR, a.chunks(1), b.chunks(1)))
    >>> LevelStream.concatenate(pieces).times_ps.tolist()
    [10, 15, 20, 30]
    """
    table = _checks.codes("gate", gate.value if isinstance(gate, Gate) else gate, 1)
    if table.size != 4:
        raise ArgumentError("gate", f"a table of {table.size} outputs", "four outputs, at index a + 2 * b")
    return _merge_feeds(table, Feed("a_chunks", a_chunks), Feed("b_chunks", b_chunks))


def _merge_feeds(table: NDArray[np.uint8], a: Feed[LevelStream], b: Feed[LevelStream]) -> Iterator[LevelStream]:
    level = int(table[a.level + 2 * b.level])
    yielded = 0
    while not (a.done and b.done):
        before = min(a.known_before_ps, b.known_before_ps)
        part_a, part_b = a.take(before), b.take(before)
        times = np.empty(len(part_a) + len(part_b), dtype=np.int64)
        levels = np.empty(times.size, dtype=np.uint8)
        _, _, n, _, _, final = _kernels.merge(
            part_a.times_ps, part_b.times_ps, before, part_a.initial, part_b.initial, level, table, times, levels
        )
        if n:
            yield LevelStream(times[:n], level)
            yielded += 1
        level = final
    if not yielded:
        yield LevelStream([], level)
