"""Simulations as programs that are asked on one pipe and answer on another, several at the same time."""

from __future__ import annotations

import os
import selectors
import signal
import subprocess
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from io import FileIO
from pathlib import Path
from typing import cast

_LOOK_S = 0.1
_GRACE_S = 1.0
"""How long a program that was told to end may still write what it knows."""
_MOST_SAID = 50_000_000
"""Bytes of ``$display`` and the like."""


class Program:
    """A running program; whoever begins it ends it.

    It is the leader of a group of processes, which ends as a whole.

    Parameters
    ----------
    command
        Given the number of the file to answer to, the program by its full path and its arguments.
    said
        File for what it prints.
    folder
        In which it runs.
    """

    def __init__(self, command: Callable[[int], Sequence[str]], *, said: Path, folder: Path) -> None:
        self._out, its = os.pipe()
        self._said = said
        try:
            with said.open("wb") as file:
                self._process = subprocess.Popen(  # noqa: S603 - a simulator, without a shell
                    command(its), stdin=subprocess.PIPE, stdout=file, stderr=file, cwd=folder, pass_fds=(its,),
                    start_new_session=True, bufsize=0,
                )  # fmt: skip
        except BaseException:
            os.close(self._out)
            raise
        finally:
            os.close(its)
        self._in = cast("FileIO", self._process.stdin)
        os.set_blocking(self._in.fileno(), False)
        self._question = memoryview(b"")
        self._since, self._told_to_end = 0.0, False
        self.answer = bytearray()
        """What it has answered to the last question, as far as it came."""
        self.code: int | None = None
        """Its exit code; None as long as it runs, and where it had to be ended."""
        self.running = True

    @property
    def said(self) -> str:
        """Return what it has printed."""
        with self._said.open("rb") as file:
            file.seek(max(self._said.stat().st_size - 1_000_000, 0))
            return file.read().decode("utf-8", "replace")

    def ask(self, question: bytes) -> None:
        """Put a question, which `hear` sends."""
        self._question, self.answer, self._since = memoryview(question), bytearray(), time.monotonic()

    def end(self) -> None:
        """End it and all that it has begun."""
        signal_group(self._process, signal.SIGKILL)
        self._process.wait()
        if self.running:
            self.running = False
            self._in.close()
            os.close(self._out)

    # --- the steps of `hear` ---
    def register(self, selector: selectors.BaseSelector) -> None:
        """Wait for what it has to say and, where it is asked, until it takes that in."""
        selector.register(self._out, selectors.EVENT_READ, self)
        if self._question:
            selector.register(self._in, selectors.EVENT_WRITE, self)

    def send(self, selector: selectors.BaseSelector) -> None:
        """Send as much of its question as it takes in."""
        try:
            self._question = self._question[os.write(self._in.fileno(), self._question[:65536]) :]
        except BlockingIOError:
            return
        except OSError:  # it has ended, which its answer will show
            self._question = memoryview(b"")
        if not self._question:
            selector.unregister(self._in)

    def receive(self, selector: selectors.BaseSelector) -> None:
        """Take what it answers; nothing means that it has ended."""
        part = os.read(self._out, 1 << 20)
        self.answer += part
        if not self._told_to_end:
            self._since = time.monotonic()
        if not part:
            self.leave(selector)
            code = None
            with suppress(subprocess.TimeoutExpired):
                code = self._process.wait(_GRACE_S)
            self.code = None if self._told_to_end else code
            self.end()

    def leave(self, selector: selectors.BaseSelector) -> None:
        """Wait no more."""
        for file in (self._out, self._in):
            if file in selector.get_map():
                selector.unregister(file)

    def look_after(self, silent_s: float, most_bytes: int) -> None:
        """Tell it to end where it is silent for too long, or answers without end; then end it."""
        waited_s = time.monotonic() - self._since
        if self._told_to_end:
            if waited_s > _GRACE_S:
                signal_group(self._process, signal.SIGKILL)
        elif waited_s > silent_s or len(self.answer) > most_bytes or self._said.stat().st_size > _MOST_SAID:
            self._told_to_end, self._since = True, time.monotonic()
            signal_group(self._process, signal.SIGTERM)


def hear(
    programs: Sequence[Program],
    *,
    is_whole: Callable[[bytearray], bool],
    silent_s: float,
    most_bytes: int,
) -> None:
    """Send each program its question and wait until each has answered or ended.

    Parameters
    ----------
    programs
        Each was asked something (`Program.ask`).
    is_whole
        Whether an answer is whole; a program that ends has answered, too.
    silent_s
        A program that is silent for so long is ended.
    most_bytes
        A program that answers more is ended.
    """
    with selectors.DefaultSelector() as selector:
        for program in programs:
            program.register(selector)
        busy = list(programs)
        while busy:
            for key, events in selector.select(_LOOK_S):
                heard: Program = key.data
                if heard.running and events & selectors.EVENT_WRITE:
                    heard.send(selector)
                elif heard.running:
                    heard.receive(selector)
            for program in busy:
                if program.running and is_whole(program.answer):
                    program.leave(selector)
                elif program.running:
                    program.look_after(silent_s, most_bytes)
            busy = [program for program in busy if program.running and not is_whole(program.answer)]


def signal_group(process: subprocess.Popen[bytes], number: signal.Signals) -> None:
    """Send a signal to a program and to all that it has begun in its group."""
    with suppress(ProcessLookupError, PermissionError):
        os.killpg(process.pid, number)
