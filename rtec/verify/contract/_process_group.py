"""Programs beside this one, each with all that it begins in a group of processes, which ends as a whole."""

from __future__ import annotations

import os
import signal
import subprocess
from collections.abc import Sequence
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
        process = begin_group(command, cwd=folder, stdout=said, stderr=said, env=os.environ | {"TMPDIR": str(folder)})
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
    command: Sequence[str], *, stdin: int = subprocess.DEVNULL, stdout: IO[Any] | int, **more: Any
) -> subprocess.Popen[bytes]:
    """Begin a program; Ctrl-C is its parent's, which ends it."""
    more |= {"stdin": stdin, "stdout": stdout, "start_new_session": True, "bufsize": 0}
    return subprocess.Popen(command, **more)  # noqa: S603 - without a shell, and what the user asked to run


def signal_group(process: subprocess.Popen[bytes], number: signal.Signals) -> None:
    """Send a signal to a program and to all that it has begun in its group."""
    with suppress(ProcessLookupError, PermissionError):
        os.killpg(process.pid, number)


def end_group(process: subprocess.Popen[bytes]) -> None:
    """End a program and all that it has begun, at once, and close its pipes."""
    with process:
        signal_group(process, signal.SIGKILL)
