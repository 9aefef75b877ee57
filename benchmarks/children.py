"""Programs run as a user runs them, with their time and their memory."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

# What is measured comes from a small parent: on Linux a child's peak memory is never below its parent's at the fork.
_LAUNCHER = """
import json, os, sys, time
out, err = (os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC) for path in sys.argv[1:3])
begun = time.perf_counter()
actions = [(os.POSIX_SPAWN_DUP2, out, 1), (os.POSIX_SPAWN_DUP2, err, 2)]
pid = os.posix_spawnp(sys.argv[3], sys.argv[3:], os.environ, file_actions=actions)
_, status, used = os.wait4(pid, 0)
wall = time.perf_counter() - begun
unit = 1 if sys.platform == "darwin" else 1024
print(json.dumps([os.waitstatus_to_exitcode(status), wall, used.ru_utime + used.ru_stime, used.ru_maxrss * unit]))
"""
_TIMEOUT_S = 3600


class ChildFailedError(Exception):
    """A command that should have worked ended with another exit code; the message holds what it said."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Child:
    """What a command said and took."""

    exit_code: int
    wall_s: float
    cpu_s: float
    """Of the command itself, whatever else the machine did meanwhile."""
    peak_bytes: int
    out: str
    err: str


def rtec() -> str:
    """Return the path of the ``rtec`` that belongs to this Python."""
    beside = Path(sys.executable).parent / "rtec"
    return str(beside) if beside.exists() else "rtec"


def measure(command: list[str], folder: Path, *, exit_code: int = 0, **environment: str) -> Child:
    """Run a command to its end in ``folder``, an existing one, and return what it took.

    Raises
    ------
    ChildFailedError
        Where its exit code is not ``exit_code``.
    """
    out, err = folder / "stdout.txt", folder / "stderr.txt"
    done = subprocess.run(
        [sys.executable, "-I", "-S", "-c", _LAUNCHER, str(out), str(err), *command],
        capture_output=True, text=True, check=True, cwd=folder, timeout=_TIMEOUT_S, env=os.environ | environment,
    )  # fmt: skip
    code, wall_s, cpu_s, peak_bytes = json.loads(done.stdout)
    child = Child(
        exit_code=code, wall_s=wall_s, cpu_s=cpu_s, peak_bytes=peak_bytes, out=out.read_text(), err=err.read_text()
    )
    if code != exit_code:
        said = (child.err or child.out).strip()[-300:]
        raise ChildFailedError(f"{Path(command[0]).name} {command[1]} ended with exit code {code}: {said}")
    return child
