"""Handshake and cycle of a live box and PC: two processes, slcan over a pseudo-terminal line.

    python benchmarks/live.py --minutes 10

prints one JSON document. ``handshake`` is the time from a request to the frame that says it is completed, as the PC
sees it; ``box`` the part of it between the request's arrival at the box and that frame's departure, by the box's log;
``beyond_box`` the difference of their medians. ``turn_lateness`` is how late the PC's turns are on their 10 ms grid.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from rtec.link._frame_kernels import CORRECTIONS_COMPLETED, REQUEST_TOTAL, field
from rtec.link.logs import read_log
from rtec.live.figures import spread_ms

REQUEST, CORRECTIONS = 0x201, 0x281
PS_PER_MS = 10**9
BARS = {"beyond_box_median_ms": 5.0, "turn_lateness_p99_ms": 2.0}


def own_times_ms(log: Path) -> list[float]:
    """Return how long the box took for each new total, from its log."""
    times: list[float] = []
    wanted, since_ps = 0, None
    for logged in read_log(log):
        if logged.frame.identifier == REQUEST:
            total = field(logged.frame.payload, *REQUEST_TOTAL)
            if total != wanted:
                wanted, since_ps = total, logged.time_ps
        elif logged.frame.identifier == CORRECTIONS and since_ps is not None:
            if field(logged.frame.payload, *CORRECTIONS_COMPLETED) == wanted:
                times.append((logged.time_ps - since_ps) / PS_PER_MS)
                since_ps = None
    return times


def measure(minutes: float) -> dict[str, object]:
    """Run box and PC for so long; return the figures."""
    rtec = [sys.executable, "-m", "rtec"]
    line = ["--channel", f"bench-{os.getpid()}", "--json", "--watchdog", "60ms"]
    # the code that numba makes is there before anything counts
    subprocess.run(
        [*rtec, "box", *line, "--duration", "100ms"], check=True, capture_output=True, stdin=subprocess.DEVNULL
    )
    with tempfile.TemporaryDirectory() as folder:
        log, report = Path(folder) / "box.log", Path(folder) / "box.json"
        with report.open("wb") as to:
            box = subprocess.Popen(
                [*rtec, "box", *line, "--log", str(log)],
                stdin=subprocess.DEVNULL, stdout=to, stderr=subprocess.PIPE,
            )  # fmt: skip
        assert box.stderr is not None
        while b"not homed" not in box.stderr.readline():
            pass
        begun_s = time.monotonic()
        pc = subprocess.Popen(
            [*rtec, "pc", *line, "--duration", f"{minutes * 60.0:g}s"],
            stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        assert pc.stdout is not None
        said = pc.stdout.read()
        _, _, of_pc = os.wait4(pc.pid, 0)
        wall_s = time.monotonic() - begun_s
        box.terminate()
        _, _, of_box = os.wait4(box.pid, 0)
        found = json.loads(said)
        if found["ended"] != "duration":
            raise SystemExit(f"the PC ended: {found['text']}")
        own = own_times_ms(log)
        boxes = json.loads(report.read_text())
    of_own = spread_ms(own, per_ms=1.0)
    beyond = float(found["handshake"]["median_ms"] or np.nan) - float(of_own["median_ms"] or np.nan)
    late = float(found["turn_lateness"]["p99_ms"])
    return {
        "minutes": round(found["run_s"] / 60.0, 3),
        "ended": found["ended"],
        "machine": f"{platform.machine()}, {os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}",
        "handshake": found["handshake"],
        "box": of_own,
        "beyond_box_median_ms": round(beyond, 3),
        "turn_lateness": found["turn_lateness"],
        "box_cpu_share": round((of_box.ru_utime + of_box.ru_stime) / wall_s, 3),
        "pc_cpu_share": round((of_pc.ru_utime + of_pc.ru_stime) / wall_s, 3),
        "box_stalls": boxes["stalls"],
        "inserted_right": boxes["axes"][0]["inserted_counts"]
        == boxes["axes"][0]["completed"] * boxes["axes"][0]["step_counts"],
        "bars": BARS,
        "good": beyond < BARS["beyond_box_median_ms"] and late < BARS["turn_lateness_p99_ms"],
    }


def main() -> int:
    """Measure and print."""
    words = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    words.add_argument("--minutes", type=float, default=10.0)
    figures = measure(words.parse_args().minutes)
    print(json.dumps(figures, indent=2))  # noqa: T201 - its only output
    return 0 if figures["good"] else 1


if __name__ == "__main__":
    sys.exit(main())
