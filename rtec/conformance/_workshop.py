"""A temporary folder and the programs that run in it; neither outlives the work, whatever ends it."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import tempfile
import threading
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from types import FrameType

from rtec.conformance._programs import Program, signal_group
from rtec.errors import OutputError, RtecError

_MOST_AT_ONCE = 1000
_ROOM = 65_536
_GRACE_S = 1.0
"""How long a program that was told to end may still write what it knows."""


class Workshop:
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
        """Begin a program that answers on a pipe; it ends with this workshop at the latest.

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


def _by_path(command: Sequence[str]) -> list[str]:
    """Return a command with its program's full path: a name alone might be found in the folder that it runs in."""
    program, *words = command
    return [shutil.which(program) or program, *words]


def _leave(_number: int, _frame: FrameType | None) -> None:
    signal.signal(signal.SIGTERM, signal.SIG_IGN)  # clearing away is not broken off by a second one
    raise SystemExit(128 + signal.SIGTERM)
