"""A temporary folder and the programs that run in it; neither outlives the work, whatever ends it.

They are compilers, and simulations that are asked on one pipe and answer on another.
"""

from __future__ import annotations

import os
import select
import shutil
import signal
import subprocess
import tempfile
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from io import FileIO
from pathlib import Path
from types import FrameType
from typing import cast

from rtec.errors import OutputError, RtecError

_MOST_AT_ONCE = 1000
_ROOM = 65_536
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


class BuildSandbox:
    """A temporary folder, open until `close`.

    A program in it is the leader of a group of processes, which ends as a whole: on Ctrl-C, on any other error, on
    SIGTERM. SIGTERM becomes an ordinary exit with its code 143 as long as the folder is open, so that all is cleared
    away; where the caller has a handler of its own, or works in another thread, that is the caller's affair.
    """

    def __init__(self) -> None:
        self._before: signal.Handlers | None = None
        if threading.current_thread() is threading.main_thread():
            before = signal.getsignal(signal.SIGTERM)
            if before is signal.SIG_DFL:
                signal.signal(signal.SIGTERM, _leave)
                self._before = signal.SIG_DFL
        self._programs: list[Program] = []
        self._begun = 0
        try:
            self.folder = Path(tempfile.mkdtemp(prefix="rtec-"))
        except OSError as error:
            said = error.strerror or str(error)
            raise OutputError(f"no temporary folder: {said}; TMPDIR names one that can be written to") from error

    def close(self) -> None:
        """End what runs and remove the folder."""
        for program in self._programs:
            program.end()
        shutil.rmtree(self.folder, ignore_errors=True)
        if self._before is not None and signal.getsignal(signal.SIGTERM) is _leave:
            signal.signal(signal.SIGTERM, self._before)
        self._before = None

    def run(self, command: Sequence[str], *, within_s: float, folder: Path | None = None) -> tuple[int, str]:
        """Run a program and return its exit code and all that it said.

        Raises
        ------
        RtecError
            It took longer than ``within_s`` seconds, or the disk is full, which a compiler need not say.
        """
        said = self.folder / "said"
        code = self._run(command, said, folder, within_s)
        if code is None:
            name = Path(command[0]).name
            raise RtecError(f"{name}: no end after {within_s:g} s; give it less to build, or look for endless loops")
        probe = self.folder / "room"
        try:
            probe.write_bytes(bytes(_ROOM))
        except OSError as error:
            reason = error.strerror or str(error)
            raise OutputError(f"{self.folder}: {reason}; TMPDIR names a folder with more room") from error
        finally:
            probe.unlink(missing_ok=True)
        with said.open("rb") as file:
            return code, file.read(1_000_000).decode("utf-8", "replace")

    def begin(self, command: Callable[[int], Sequence[str]], *, folder: Path) -> Program:
        """Begin a program that answers on a pipe; it ends with this sandbox at the latest.

        Parameters
        ----------
        command
            As for `Program`.
        folder
            In which it runs.
        """
        self._programs = [program for program in self._programs if program.running]
        self._begun += 1
        said = self.folder / f"said-{self._begun % _MOST_AT_ONCE}"
        program = Program(lambda out: _by_path(command(out)), said=said, folder=folder)
        self._programs.append(program)
        return program

    def _run(self, command: Sequence[str], said: Path, folder: Path | None, within_s: float) -> int | None:
        with said.open("wb") as file:
            process = subprocess.Popen(  # noqa: S603 - a simulator, by its full path, without a shell
                _by_path(command),
                stdin=subprocess.DEVNULL,
                stdout=file,
                stderr=file,
                cwd=folder,
                env=os.environ | {"TMPDIR": str(self.folder)},  # what a compiler leaves when it is ended goes, too
                start_new_session=True,
            )
        try:
            with suppress(subprocess.TimeoutExpired):
                return process.wait(within_s)
            signal_group(process, signal.SIGTERM)
            with suppress(subprocess.TimeoutExpired):
                process.wait(_GRACE_S)
            return None
        finally:
            signal_group(process, signal.SIGKILL)
            process.wait()


def signal_group(process: subprocess.Popen[bytes], number: signal.Signals) -> None:
    """Send a signal to a program and to all that it has begun in its group."""
    with suppress(ProcessLookupError, PermissionError):
        os.killpg(process.pid, number)


def _by_path(command: Sequence[str]) -> list[str]:
    """Return a command with its program's full path: a name alone might be found in the folder that it runs in."""
    program, *words = command
    return [shutil.which(program) or program, *words]


def _leave(_number: int, _frame: FrameType | None) -> None:
    signal.signal(signal.SIGTERM, signal.SIG_IGN)  # clearing away is not broken off by a second one
    raise SystemExit(128 + signal.SIGTERM)
