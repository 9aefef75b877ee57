"""The near side of the view: starts the process that draws, tells it what to draw, takes what is typed."""

from __future__ import annotations

import os
import select
import subprocess
import sys
import time
from collections.abc import Mapping
from typing import Any, TextIO

from rtec.live.incoming import document_line, say_line
from rtec.live.typed import in_front, standard_input

SHOW_S = 0.125
"""The view changes eight times a second."""
CLOSE_S = 2.0
MOST_PENDING_BYTES = 1 << 20
"""What waits for a terminal that takes nothing; more is let go."""


def can_show(stream: TextIO) -> bool:
    """Return whether a stream is a terminal to draw on, and this process is in front of it."""
    if sys.platform == "win32" or not stream.isatty() or os.environ.get("TERM", "dumb") == "dumb":
        return False
    return in_front(stream.fileno())


def can_type() -> bool:
    """Return whether standard input is a keyboard."""
    given = standard_input()
    return given is not None and os.isatty(given)


class Screen:
    """The view, drawn by a process of its own.

    Parameters
    ----------
    stream
        The terminal, as of `can_show`.
    draws
        Whether documents are drawn; else there is a prompt only.
    has_prompt
        Whether there is a prompt to type in, as of `can_type`.
    """

    def __init__(self, stream: TextIO, *, draws: bool, has_prompt: bool) -> None:
        self.draws, self.has_prompt = draws, has_prompt
        # another number than 0, which is the pipe's in the new process
        keyboard = os.dup(sys.stdin.fileno()) if has_prompt else -1
        self.typed_from, write = os.pipe()
        """File descriptor from which typed lines come."""
        passed = (write,) if keyboard < 0 else (write, keyboard)
        self._process = subprocess.Popen(  # noqa: S603 - our own module
            [sys.executable, "-m", "rtec.live.screen_process", str(keyboard), str(write), str(os.getpid())],
            stdin=subprocess.PIPE,
            stdout=stream.fileno(),
            pass_fds=passed,
        )
        for descriptor in passed:
            os.close(descriptor)
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
            self._pending = document_line(document)
        self.catch_up()

    def say(self, text: str) -> None:
        """Tell a line, which stays."""
        if len(self._pending) < MOST_PENDING_BYTES:
            self._pending += say_line(text)
        self.catch_up()

    def catch_up(self) -> None:
        """Hand on what still waits."""
        try:
            while self._pending:
                written = os.write(self._to, self._pending)
                self._pending = self._pending[written:]
        except BlockingIOError:
            pass
        except OSError:
            self.gone = True

    def close(self) -> None:
        """Leave the last picture where it is, and give the terminal back."""
        assert self._process.stdin is not None  # noqa: S101 - it was asked for above
        until_s = time.monotonic() + CLOSE_S
        self.catch_up()
        while self._pending and not self.gone and time.monotonic() < until_s:
            select.select([], [self._to], [], CLOSE_S)
            self.catch_up()
        self._process.stdin.close()
        try:
            self._process.wait(CLOSE_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
