"""What a campaign costs beside its jobs: time a job in batches, memory and disk of a hundred thousand, two workers.

python -m benchmarks.campaigns
"""

from __future__ import annotations

import argparse
import resource
import sys
import tempfile
import time
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from rtec.verify.campaign.executors import Executor, Processes, Serial
from rtec.verify.campaign.job import PASSED, Choice, JobKind, Number
from rtec.verify.campaign.plan import Plan
from rtec.verify.campaign.run import run_campaign
from rtec.verify.campaign.store import Store

WAIT_S = 0.05
"""Of a job whose efficiency is measured: the least that the overhead is meant for."""


def wait(parameters: Mapping[str, float], seed: int, run: int) -> dict[str, object]:
    """Do nothing for so long, and return a record as long as that of a trial of ``rtec safety``."""
    time.sleep(parameters["wait_s"])
    numbers = {f"figure_{k}": run / (k + 3) for k in range(8)}
    return {"result": PASSED, "outcome": "tolerated", "reason": "box: watchdog timeout", **numbers}


KIND = JobKind(
    does="A job waits.",
    function="benchmarks.campaigns:wait",
    parameters=(
        Choice(name="design", words=("original", "a", "b", "c")),
        Number(name="wait_s", unit="s", low=0.0, high=10.0, default=0.0),
    ),
    by=("design",),
)


def plan_of(runs: int, wait_s: float = 0.0) -> Plan:
    """Return a plan of so many runs for each of four designs."""
    grid = {"design": ("original", "a", "b", "c"), "wait_s": (wait_s,)}
    return Plan(
        name="waiting", about="", kind=KIND, seed=1, runs=runs, by=("design",), grid=grid, drawn={}, conditions=()
    )  # fmt: skip


def took(plan: Plan, executor: Executor, file: Path | str = ":memory:") -> float:
    """Return how long a plan takes, in seconds."""
    begun = time.perf_counter()
    with Store(file) as store:
        run_campaign(plan, store, executor)
    return time.perf_counter() - begun


def resident_mb() -> float:
    """Return the largest memory that this process has had, in MB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--jobs", type=int, default=100_000)
    jobs = parser.parse_args().jobs
    before = resident_mb()
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "store.db"
        here_s = took(plan_of(jobs // 4), Serial(), file)
        size_mb = file.stat().st_size / 1e6
        again_s = took(plan_of(jobs // 4), Serial(), file)
    most = resident_mb()
    say(f"{jobs} empty jobs, planned, run here and stored: {here_s:.1f} s, {here_s / jobs * 1e3:.3f} ms a job")
    say(f"memory: {most:.0f} MB, {most - before:.0f} MB of them by the campaign; disk: {size_mb:.0f} MB")
    say(f"the same command again, all of it stored: {again_s:.1f} s")
    processes_s = took(plan_of(jobs // 4), Processes(2))
    say(f"{jobs} empty jobs in two processes: {processes_s:.1f} s, {processes_s / jobs * 1e3:.3f} ms a job")
    waiting = plan_of(150, WAIT_S)
    begun_s = {workers: took(replace(waiting, runs=workers), Processes(workers)) for workers in (1, 2)}
    one_s, two_s = (took(waiting, Processes(workers)) - begun_s[workers] for workers in (1, 2))
    one, two = (WAIT_S * 4 * (150 - workers) / workers for workers in (1, 2))
    say(f"600 jobs that wait for 50 ms, start-up taken off: one worker {one_s:.1f} s, two {two_s:.1f} s")
    say(f"efficiency: {one / one_s:.1%} with one worker, {two / two_s:.1%} with two")


def say(line: str) -> None:
    """Print a line."""
    sys.stdout.write(f"{line}\n")


if __name__ == "__main__":
    main()
