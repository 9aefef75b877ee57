"""Simulations as programs that are asked on one pipe and answer on another."""

from __future__ import annotations

import os
import select
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
        self.code: int | None = None
        """Its exit code; None as long as it runs, and where it had to be ended."""
        self.running = True

    @property
    def said(self) -> str:
        """Return what it has printed."""
        with self._said.open("rb") as file:
            file.seek(max(self._said.stat().st_size - 1_000_000, 0))
            return file.read().decode("utf-8", "replace")

    def answer_to(
        self, question: bytes, *, is_whole: Callable[[bytearray], bool], silent_s: float, most_bytes: int
    ) -> bytes:
        """Put a question; return the answer, or as much of it as came before the program ended.

        Parameters
        ----------
        question
            What goes to its standard input.
        is_whole
            Whether an answer is whole; a program that ends has answered, too.
        silent_s
            A program that is silent for so long is told to end, and a second later ended.
        most_bytes
            So is one that answers more.
        """
        answer, unsent = bytearray(), memoryview(question)
        since, told_to_end = time.monotonic(), False
        while not is_whole(answer):
            sending = [self._in] if unsent else []
            readable, writable, _ = select.select([self._out], sending, [], _LOOK_S)
            if writable:
                unsent = self._rest_of(unsent)
            if readable:
                part = os.read(self._out, 1 << 20)
                if not part:
                    self._leave(told_to_end)
                    break
                answer += part
                since = since if told_to_end else time.monotonic()
            waited_s = time.monotonic() - since
            if told_to_end:
                if waited_s > _GRACE_S:
                    self.kill()
            elif waited_s > silent_s or len(answer) > most_bytes or self._said.stat().st_size > _MOST_SAID:
                since, told_to_end = time.monotonic(), True
                signal_group(self._process, signal.SIGTERM)
        return bytes(answer)

    def kill(self) -> None:
        """End it and all that it has begun, at once; whoever waits for its answer sees that."""
        signal_group(self._process, signal.SIGKILL)

    def end(self) -> None:
        """End it and all that it has begun, and leave its pipes."""
        self.kill()
        self._process.wait()
        if self.running:
            self.running = False
            self._in.close()
            os.close(self._out)

    def _rest_of(self, question: memoryview) -> memoryview:
        """Send as much of a question as the program takes in; return the rest."""
        try:
            return question[os.write(self._in.fileno(), question[:65536]) :]
        except BlockingIOError:
            return question
        except OSError:  # it has ended, which its answer will show
            return question[:0]

    def _leave(self, told_to_end: bool) -> None:
        """Note how it has ended."""
        with suppress(subprocess.TimeoutExpired):
            code = self._process.wait(_GRACE_S)
            self.code = None if told_to_end else code
        self.end()


def signal_group(process: subprocess.Popen[bytes], number: signal.Signals) -> None:
    """Send a signal to a program and to all that it has begun in its group."""
    with suppress(ProcessLookupError, PermissionError):
        os.killpg(process.pid, number)
