"""The open path in Verilator: RTL of design C and an x4 decoder on a 50 MHz clock, driven at 500 kHz.

The job is that of ``rtec simulate --design c --frequency 500kHz --phase-error 10deg --jitter 5ns`` with a correction
every 100 edges. What the peer is given, so that the comparison is fair to it:

- the stimulus is made before the clock starts to count, `wall_s` holds the simulation alone;
- no tracing, no assertions, two-state values, and no combinational path from an input to logic that Verilator would
  have to settle apart from the clock at every evaluation;
- two evaluations a clock, one for each level, the least that Verilator's documented interface needs;
- one thread: a design this small only loses by more.

How the C++ is compiled matters more than all of these, so it is a choice, see `Build`.

Example::

    python benchmarks/peer_verilator.py --edges 2000000
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from enum import StrEnum
from pathlib import Path
from typing import Any

from peers import PeerAbsent, PeerFailedError, program

__all__ = ["Build", "PeerAbsent", "PeerFailedError", "build", "run", "version"]

_SOURCES = Path(__file__).resolve().parent / "peers"
_RTL = ("top.sv", "design_c.sv", "quad_decoder.sv")
_VERILATE = (
    *("--cc", "--exe", "--build", "-O3", "--x-assign", "fast", "--x-initial", "fast", "--noassert"),
    *("--threads", "1", "-Wall", "--top-module", "top", "-CFLAGS", "-std=c++17"),
)
_PROFILE_EDGES = 1_000_000
_PROFILE_SEED = 2  # another jitter than that of the runs
_TIMEOUT_S = 600


class Build(StrEnum):
    """How the generated C++ is compiled.

    PLAIN is what most users type, ``-CFLAGS -O3``: Verilator's makefile puts its own ``-Os`` after it, so that the
    model is compiled for size. TUNED sets the makefile's ``OPT_FAST`` to ``-O3`` and optimises across files.
    PROFILED adds a first run from which the compiler learns (profile-guided optimisation, two builds).
    """

    PLAIN = "plain"
    TUNED = "tuned"
    PROFILED = "profiled"


def build(folder: Path, how: Build = Build.PROFILED) -> Path:
    """Build the peer in ``folder``, an existing one, and return its program.

    Raises
    ------
    PeerAbsent
        Where Verilator or make is not on PATH.
    PeerFailedError
        Where the build fails.
    """
    verilator = program("verilator", "verilator")
    program("make", "make")
    flags = _compiler_flags(how)
    if how is not Build.PROFILED:
        return _build(verilator, folder / "model", flags)
    profile = (folder / "profile").resolve()
    learn = _build(verilator, folder / "learn", [*flags, f"-fprofile-generate={profile}"])
    _output([str(learn), str(_PROFILE_EDGES), str(_PROFILE_SEED), "+"])
    # gcc names a profile after the object's folder, so the second build takes the place of the first
    (folder / "learn").rename(folder / "learned")
    return _build(verilator, folder / "learn", [*flags, f"-fprofile-use={profile}"])


def run(bench: Path, edges: int, *, seed: int = 1, direction: str = "+", spacing_edges: int = 100) -> dict[str, Any]:
    """Run a program that `build` made, and return its figures.

    Parameters
    ----------
    bench
        The program.
    edges
        True edges of the encoder, 1 or more.
    seed
        Seed of the jitter.
    direction
        ``+`` or ``-``, the sign of the corrections.
    spacing_edges
        Edges from one correction to the next, 2 or more. At 100 each of them meets the same state, at 99 or 101 they
        go through all four.

    Returns
    -------
    dict
        ``edges``, ``encoder_counts``, ``controller_counts``, ``corrections``, ``corrections_requested``, ``illegal``,
        ``gated``, ``audit``, ``wall_s`` and ``cpu_s`` (processor time), both of the simulation loop only, and
        ``edges_per_s``.

    Raises
    ------
    PeerFailedError
        Where the counts are wrong, or a transition was illegal.
    """
    figures: dict[str, Any] = json.loads(_output([str(bench), str(edges), str(seed), direction, str(spacing_edges)]))
    return figures


def version() -> str:
    """Return what Verilator calls itself; `PeerAbsent` where it is not on PATH."""
    return _output([program("verilator", "verilator"), "--version"]).strip()


def _compiler_flags(build: Build) -> list[str]:
    return ["-O3"] if build is Build.PLAIN else ["-O3", "-flto"]


def _build(verilator: str, model: Path, flags: list[str]) -> Path:
    """Verilate and compile into the folder ``model``; return the program."""
    command = [verilator, *_VERILATE, "--Mdir", str(model)]
    command += ["-CFLAGS", " ".join(flags)]
    if flags != _compiler_flags(Build.PLAIN):
        command += ["-LDFLAGS", " ".join(flags), "-MAKEFLAGS", "OPT_FAST=-O3 OPT_SLOW=-O3 OPT_GLOBAL=-O3"]
    _output([*command, *(str(_SOURCES / name) for name in _RTL), str(_SOURCES / "bench.cpp")])
    return model / "Vtop"


def _output(command: list[str]) -> str:
    """Run a command and return what it prints; a failure or a hang is a `PeerFailedError`."""
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=_TIMEOUT_S, check=False)
    except subprocess.TimeoutExpired as late:
        raise PeerFailedError(f"{Path(command[0]).name} took longer than {_TIMEOUT_S} s") from late
    if done.returncode != 0:
        end = (done.stdout + done.stderr)[-2000:]
        raise PeerFailedError(f"{Path(command[0]).name} ended with exit code {done.returncode}:\n{end}")
    return done.stdout


def main() -> int:
    """Build and run the peer in a temporary folder and print its figures as one line of JSON."""
    parser = argparse.ArgumentParser(description="Time design C and an x4 decoder in Verilator.")
    parser.add_argument("--edges", type=int, default=2_000_000, help="true edges of the encoder")
    parser.add_argument("--build", type=Build, choices=list(Build), default=Build.PROFILED, help="how to compile")
    parser.add_argument("--seed", type=int, default=1, help="seed of the jitter")
    parser.add_argument("--direction", choices=["+", "-"], default="+", help="sign of the corrections")
    parser.add_argument("--spacing", type=int, default=100, help="edges from one correction to the next")
    given = parser.parse_args()
    try:
        with tempfile.TemporaryDirectory() as folder:
            figures = run(
                build(Path(folder), given.build),
                given.edges,
                seed=given.seed,
                direction=given.direction,
                spacing_edges=given.spacing,
            )
            figures |= {"build": str(given.build), "verilator": version()}
    except (PeerAbsent, PeerFailedError) as problem:
        sys.stderr.write(f"{problem}\n")
        return 1
    sys.stdout.write(json.dumps(figures) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
