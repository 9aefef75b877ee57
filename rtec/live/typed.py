"""Lines typed on standard input, read by a thread of their own so that nothing blocks."""

from __future__ import annotations

import os
import sys
import threading
import time
from collections import deque

READ_BYTES = 4096
MOST_WAITING = 1000
"""Limit of waiting lines; beyond it input is not read until some are taken."""
RETRY_S = 0.5
"""A process in the background of a terminal must not read from it; it tries this often whether it may again."""


def standard_input() -> int | None:
    """Return the file descriptor of standard input; None where there is none."""
    try:
        return None if sys.stdin is None else sys.stdin.fileno()
    except (OSError, ValueError):
        return None


def in_front(terminal: int) -> bool:
    """Return whether the shell has this process in front, not in the background of the terminal."""
    if not hasattr(os, "tcgetpgrp"):
        return True
    try:
        return os.tcgetpgrp(terminal) == os.getpgrp()
    except OSError:
        return True  # a terminal that controls nobody has no background


class TypedLines:
    r"""Lines of a file descriptor as they come, without the blanks around them; empty ones, too.

    Parameters
    ----------
    descriptor
        Where they come from; it is not closed.

    Examples
    --------
    >>> read, write = os.pipe()
    >>> typed = TypedLines(read)
    >>> _ = os.write(write, b"home\nstatus\n"), os.close(write)
    >>> lines = []
    >>> while len(lines) < 2:
    ...     lines += typed.take()
    >>> lines
    ['home', 'status']
    """

    def __init__(self, descriptor: int) -> None:
        self._descriptor = descriptor
        self._lines: deque[str] = deque()
        threading.Thread(target=self._read, name="rtec typed lines", daemon=True).start()

    def take(self, most: int = MOST_WAITING) -> list[str]:
        """Return lines that have come since the last time, ``most`` of them."""
        lines: list[str] = []
        while self._lines and len(lines) < most:
            lines.append(self._lines.popleft())
        return lines

    def _read(self) -> None:
        rest = b""
        try:
            while True:
                in_background = os.isatty(self._descriptor) and not in_front(self._descriptor)
                if in_background or len(self._lines) > MOST_WAITING:
                    time.sleep(RETRY_S)
                    continue
                data = os.read(self._descriptor, READ_BYTES)
                *whole, rest = (rest + data).split(b"\n")
                for line in whole if data else [rest] * bool(rest):
                    self._lines.append(line.decode(errors="replace").strip())
                if not data:
                    return
        except OSError:
            return  # closed, or a terminal that has gone
