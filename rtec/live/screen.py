"""The near side of the view: starts the process that draws, tells it what to draw, takes what is typed."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Mapping
from typing import Any

from rtec.live.typed import in_front, standard_input

SHOW_S = 0.125
"""The view changes eight times a second."""
CLOSE_S = 2.0


def can_show() -> bool:
    """Return whether there is a terminal to draw on, and this process is in front of it."""
    if sys.platform == "win32" or not sys.stdout.isatty() or os.environ.get("TERM", "dumb") == "dumb":
        return False
    return in_front(sys.stdout.fileno())


class Screen:
    """The view, drawn by a process of its own.

    Parameters
    ----------
    takes_keys
        Whether orders can be typed.
    """

    def __init__(self, *, takes_keys: bool) -> None:
        # another number than 0, which is the pipe's in the new process
        given = standard_input() if takes_keys else None
        keyboard = os.dup(given) if given is not None and os.isatty(given) else -1
        read, write = os.pipe()
        passed = (write,) if keyboard < 0 else (write, keyboard)
        self._process = subprocess.Popen(  # noqa: S603 - our own module
            [sys.executable, "-m", "rtec.live.screen_process", str(keyboard), str(write)],
            stdin=subprocess.PIPE,
            pass_fds=passed,
        )
        os.close(write)
        if keyboard >= 0:
            os.close(keyboard)
        self.has_keys = keyboard >= 0
        """Whether orders are typed in the view; else they come from standard input."""
        self.typed_from = read if self.has_keys else given
        """File descriptor from which typed lines come; None where there is none."""
        assert self._process.stdin is not None  # noqa: S101 - it was asked for above
        self._to = self._process.stdin.fileno()
        os.set_blocking(self._to, False)
        self._pending = b""
        self._due_s = 0.0
        self.gone = False
        """Whether the process that draws has ended."""

    def wants(self, at_s: float) -> bool:
        """Return whether it is time to show something."""
        return not self.gone and at_s >= self._due_s

    def show(self, at_s: float, document: Mapping[str, Any]) -> None:
        """Draw a document, unless the terminal is too slow for it."""
        self._due_s = at_s + SHOW_S
        if not self._pending:
            self._pending = json.dumps(document).encode() + b"\n"
        try:
            written = os.write(self._to, self._pending)
            self._pending = self._pending[written:]
        except BlockingIOError:
            pass
        except OSError:
            self.gone = True

    def close(self) -> None:
        """Leave the last picture where it is, and give the terminal back."""
        assert self._process.stdin is not None  # noqa: S101 - it was asked for above
        try:
            os.set_blocking(self._to, True)
            if self._pending:
                os.write(self._to, self._pending)
            self._process.stdin.close()
        except OSError:
            self.gone = True
        try:
            self._process.wait(CLOSE_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
