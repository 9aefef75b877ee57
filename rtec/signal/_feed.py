"""A stream that comes in pieces, handed on up to any time, holding one piece at most."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Generic, TypeVar

import numpy as np

from rtec.errors import ArgumentError
from rtec.signal import _checks
from rtec.signal._kernels import NEVER
from rtec.signal.line import LevelStream
from rtec.signal.stream import EdgeStream

S = TypeVar("S", LevelStream, EdgeStream)


class Feed(Generic[S]):
    """One of several streams that advance together.

    Parameters
    ----------
    name
        Name of the stream, for error messages.
    chunks
        Pieces that follow one another, at least one.
    """

    def __init__(self, name: str, chunks: Iterable[S]) -> None:
        self._name = name
        self._pieces: Iterator[tuple[int, S]] = enumerate(chunks)
        first = next(self._pieces, None)
        if first is None:
            raise ArgumentError(name, "an empty sequence", "at least one stream")
        self._piece: S = first[1]
        self._used = 0
        self._last_ps: int | None = None
        self.done = False
        self._refill()

    @property
    def level(self) -> int:
        """The level after everything taken so far."""
        return self._piece.part(self._used, self._used).initial

    @property
    def known_before_ps(self) -> int:
        """The time before which every edge is at hand."""
        return NEVER if self.done else int(self._piece.times_ps[-1]) + 1

    def take(self, before_ps: int) -> S:
        """Return the edges earlier than ``before_ps`` that have not been taken; no later than ``known_before_ps``."""
        first = self._used
        self._used = max(first, int(np.searchsorted(self._piece.times_ps, before_ps)))
        part = self._piece.part(first, self._used)
        self._refill()
        return part

    def _refill(self) -> None:
        while not self.done and self._used == len(self._piece):
            if len(self._piece):
                self._last_ps = int(self._piece.times_ps[-1])
            index, piece = next(self._pieces, (0, None))
            if piece is None:
                self.done = True
                return
            if not isinstance(piece, type(self._piece)):
                kind = type(self._piece).__name__
                raise ArgumentError(f"{self._name}[{index}]", type(piece).__name__, f"{kind} as the chunks before it")
            _checks.continues(f"{self._name}[{index}]", piece, self._last_ps, self._piece.final)
            self._piece, self._used = piece, 0
