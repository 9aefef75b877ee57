"""Ctrl-C and SIGTERM as a wish to stop, looked at between two steps."""

from __future__ import annotations

import signal
from types import FrameType
from typing import Any, Self


class StopWish:
    """While it is entered, Ctrl-C and SIGTERM end nothing at once; a second Ctrl-C does.

    Examples
    --------
    >>> with StopWish() as stop:
    ...     signal.raise_signal(signal.SIGTERM)
    ...     stop.why
    'SIGTERM'
    """

    def __init__(self) -> None:
        self.why: str | None = None
        """Name of the signal that requested it; None without one."""
        self._before: dict[signal.Signals, Any] = {}

    def __enter__(self) -> Self:
        for number in (signal.SIGINT, signal.SIGTERM):
            self._before[number] = signal.signal(number, self._wish)
        return self

    def __exit__(self, *_: object) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def _wish(self, number: int, frame: FrameType | None) -> None:
        if self.why is not None and number == signal.SIGINT:
            raise KeyboardInterrupt
        self.why = "Ctrl-C" if number == signal.SIGINT else signal.Signals(number).name
