"""Programs beside this one, each with all that it begins in a group of processes, which ends as a whole."""

from __future__ import annotations

import os
import signal
import subprocess
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import IO, Any

from rtec.errors import RtecError


def run_group(command: Sequence[str], *, folder: Path, within_s: float) -> tuple[int, str]:
    """Run a program in a folder of its own and return its exit code and the first megabyte of what it said.

    Raises
    ------
    RtecError
        It takes longer than ``within_s`` seconds.
    """
    with (folder / "said").open("w+b") as said:
        # what a compiler leaves when it is ended goes with the folder, too
        environment = os.environ | {"TMPDIR": str(folder)}
        process = begin_group(command, folder=folder, stdout=said, stderr=said, environment=environment)
        try:
            code = process.wait(within_s)
        except subprocess.TimeoutExpired:
            allowed = "give it less to build, or look for endless loops"
            raise RtecError(f"{command[0]}: no end after {within_s:g} s; {allowed}") from None
        finally:
            end_group(process)
        said.seek(0)
        return code, said.read(1_000_000).decode("utf-8", "replace")


def begin_group(
    command: Sequence[str],
    *,
    stdin: int = subprocess.DEVNULL,
    stdout: IO[Any] | int,
    stderr: IO[Any] | None = None,
    folder: Path | None = None,
    environment: Mapping[str, str] | None = None,
    descriptors: Sequence[int] = (),
) -> subprocess.Popen[bytes]:
    """Begin a program with some open files; Ctrl-C is its parent's, which ends it."""
    return subprocess.Popen(  # noqa: S603 - without a shell, and what the user asked to run
        command, stdin=stdin, stdout=stdout, stderr=stderr, cwd=folder, env=environment, pass_fds=descriptors,
        start_new_session=True, bufsize=0,
    )  # fmt: skip


def signal_group(process: subprocess.Popen[bytes], number: signal.Signals) -> None:
    """Send a signal to a program and to all that it has begun in its group."""
    with suppress(ProcessLookupError, PermissionError):
        os.killpg(process.pid, number)


def end_group(process: subprocess.Popen[bytes]) -> None:
    """End a program and all that it has begun, at once, and close its pipes."""
    with process:
        signal_group(process, signal.SIGKILL)
