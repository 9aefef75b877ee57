"""Decoding alone, by sigrok-cli's ``graycode`` decoder, on a capture of the same encoder as the other peers.

Example (from ``benchmarks``)::

    python -m peers.sigrok --edges 100000
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from peers import PeerAbsent, PeerFailedError, program

_CLOCK_NS = 20.0
_EDGE_NS = 500.0
_PHASE_ERROR_NS = 10.0 / 360.0 * 4.0 * _EDGE_NS
_JITTER_NS = 5.0
_LEVELS = np.array([0b00, 0b01, 0b11, 0b10], dtype=np.uint8)  # bit 0 is A, bit 1 is B, A leads
_TIMEOUT_S = 600


def decode(edges: int, folder: Path, *, seed: int = 1) -> dict[str, Any]:
    """Write a capture of ``edges`` edges at 500 kHz into ``folder``, decode it and return the figures.

    Parameters
    ----------
    edges
        Edges to decode, 1 or more; the capture holds one more, since the decoder reports a count when it changes.
    folder
        An existing folder for the capture and the decoder's output.
    seed
        Seed of the jitter.

    Returns
    -------
    dict
        ``edges``, ``controller_counts``, ``wall_s`` (the whole program: start, reading and decoding),
        ``edges_per_s``, ``sigrok``.

    Raises
    ------
    PeerAbsent
        Where sigrok-cli is not on PATH.
    PeerFailedError
        Where it counts wrongly. Its exit code says nothing: libsigrokdecode 0.5 with Python 3.11 aborts while it
        closes down, after the last count, once a long capture has used up the references to a constant.
    """
    sigrok = program("sigrok-cli", "sigrok-cli")
    capture, counts = folder / "capture.bin", folder / "counts.txt"
    _samples(edges + 1, seed).tofile(capture)
    source = f"binary:numchannels=2:samplerate={1e9 / _CLOCK_NS:.0f}"
    command = [sigrok, "-i", str(capture), "-I", source, "-P", "graycode:d0=0:d1=1:avg_period=0"]
    start = time.perf_counter()
    with counts.open("w") as out:
        try:
            done = subprocess.run(
                [*command, "-A", "graycode=count"],
                stdout=out, stderr=subprocess.PIPE, text=True, timeout=_TIMEOUT_S, check=False,
            )  # fmt: skip
        except subprocess.TimeoutExpired as late:
            raise PeerFailedError(f"sigrok-cli took longer than {_TIMEOUT_S} s") from late
    wall_s = time.perf_counter() - start
    lines = counts.read_text().split("\n")
    counted = lines[-2].split()[-1] if len(lines) > 1 else "nothing"
    if counted != str(edges):
        raise PeerFailedError(f"sigrok-cli counted {counted}, not {edges}: {done.stderr[-2000:]}")
    version = subprocess.run([sigrok, "--version"], capture_output=True, text=True, check=True).stdout
    return {
        "edges": edges,
        "controller_counts": int(counted),
        "wall_s": wall_s,
        "edges_per_s": edges / wall_s,
        "sigrok": version.split("\n", 1)[0],
    }


def _samples(edges: int, seed: int) -> np.ndarray[tuple[int], np.dtype[np.uint8]]:
    """Return one byte a clock for an encoder moving forward, with the phase error and the jitter of the bench."""
    index = np.arange(edges + 1)
    uniform = np.random.default_rng(seed).random((2, edges + 1))
    time_ns = index * _EDGE_NS + (index % 2 == 0) * _PHASE_ERROR_NS + _JITTER_NS * (uniform[0] - uniform[1])
    clock = np.rint((time_ns + _EDGE_NS) / _CLOCK_NS).astype(np.int64)
    # level 0 until the first edge, then each level until the next edge
    return np.repeat(_LEVELS[index % 4], np.diff(clock, prepend=0))


def main() -> int:
    """Decode in a temporary folder and print the figures as one line of JSON."""
    parser = argparse.ArgumentParser(description="Time sigrok-cli's graycode decoder.")
    parser.add_argument("--edges", type=int, default=100_000, help="edges to decode")
    given = parser.parse_args()
    try:
        with tempfile.TemporaryDirectory() as folder:
            figures = decode(given.edges, Path(folder))
    except (PeerAbsent, PeerFailedError) as problem:
        sys.stderr.write(f"{problem}\n")
        return 1
    sys.stdout.write(json.dumps(figures) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
