"""What so many hours of cutting with random faults would take on a cluster, from pieces measured here.

python -m benchmarks.billion_hours
python -m benchmarks.billion_hours --hours 3e7 --price 0.02

Nothing of that size is run. Episodes of the plan ``soak`` are, and empty jobs; the rest is multiplied.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import tempfile
import time
from dataclasses import dataclass, replace
from pathlib import Path

from benchmarks.campaigns import plan_of, resident_mb
from rtec.rates import never_seen
from rtec.verify.campaign.executors import Processes, Serial
from rtec.verify.campaign.plan import Plan, read_plan
from rtec.verify.campaign.run import addresses_of, run_campaign
from rtec.verify.campaign.store import Store

S_PER_H, S_PER_D, H_PER_YEAR = 3600.0, 86400.0, 8766.0
STORE_JOBS = 1_000_000
"""Of one coordinator with a store of its own; with more, its list of addresses leaves no room for other work."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Pieces:
    """What was measured."""

    episode_h: float
    """Hours of cutting that an episode comes to, on average: a safe stop ends it."""
    episode_cpu_s: float
    record_bytes: float
    """Of the store, for one episode."""
    job_cpu_s: float
    """Of the coordinator, for one job."""
    job_bytes: float
    """Of its memory, for one job."""


def soak_of(runs: int) -> Plan:
    """Return the plan ``soak`` with so many episodes of each design, without B, which is run a tenth as often."""
    return replace(read_plan("soak").only(["original", "a", "c"]), runs=runs)


def measured(episodes: int, jobs: int) -> Pieces:
    """Run episodes and empty jobs here, one after the other; processor time, so that other programs do not count."""
    run_campaign(soak_of(1), Store(":memory:"), Serial())  # machine code is made once a host
    with tempfile.TemporaryDirectory() as folder:
        soak, file = soak_of(max(episodes // 3, 1)), Path(folder) / "soak.db"
        with Store(file) as store:
            begun = time.process_time()
            run_campaign(soak, store, Serial())
            episodes_cpu_s = time.process_time() - begun
            records = list(store.records(addresses_of(soak)))
        run_s = sum(float(one.record["run_s"] or 0.0) for one in records)
        record_bytes = sum(len(json.dumps(one.record)) + len(json.dumps(one.job.parameters)) for one in records)
        before, empty = resident_mb(), plan_of(jobs // 4)
        with Store(Path(folder) / "empty.db") as store:
            begun = time.process_time()  # of this process: that of the workers is not in it
            run_campaign(empty, store, Processes(2))
            job_cpu_s = (time.process_time() - begun) / jobs
        return Pieces(
            episode_h=run_s / S_PER_H / len(records),
            episode_cpu_s=episodes_cpu_s / len(records),
            record_bytes=max(record_bytes, file.stat().st_size) / len(records),
            job_cpu_s=job_cpu_s,
            job_bytes=(resident_mb() - before) * 1e6 / jobs,
        )


def lines(pieces: Pieces, hours: float, price: float, cores: int) -> list[str]:
    """Return what is measured, what follows, and what limits it."""
    jobs = hours / pieces.episode_h
    core_h = jobs * pieces.episode_cpu_s / S_PER_H
    fed = pieces.episode_cpu_s / pieces.job_cpu_s
    one_d, memory_gb = jobs * pieces.job_cpu_s / S_PER_D, jobs * pieces.job_bytes / 1e9
    return [
        f"measured: an episode is {pieces.episode_h * 60:.2f} min of cutting, {pieces.episode_cpu_s:.3f} s of work",
        f"so a core hour gives {hours / core_h:.0f} hours of cutting",
        f"measured: a record takes {pieces.record_bytes:.0f} bytes",
        f"measured: the coordinator takes {pieces.job_cpu_s * 1e3:.2f} ms and {pieces.job_bytes:.0f} bytes a job",
        f"{hours:.0e} hours: {jobs:.2g} episodes, {core_h:.2g} core hours, {core_h / H_PER_YEAR:.0f} core years",
        f"cost: {core_h * price:.2g} USD at {price:g} USD a core hour",
        f"time on {cores} cores: {core_h / cores / 24:.0f} days",
        f"a coordinator feeds {fed:.0f} cores: {cores} cores need {math.ceil(cores / fed)}",
        f"one coordinator alone: {one_d:.0f} days, {memory_gb:.0f} GB of memory for the list of its jobs",
        f"in parts of {STORE_JOBS:.0e} jobs: {math.ceil(jobs / STORE_JOBS)} stores, each with a seed of its own, "
        f"{STORE_JOBS * pieces.record_bytes / 1e9:.1f} GB each, {jobs * pieces.record_bytes / 1e12:.1f} TB together",
        f"none undetected in {hours:.0e} hours: less than {never_seen(round(hours)):.1e} an hour at 95 % confidence",
    ]


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--hours", type=float, default=1e9)
    parser.add_argument("--price", type=float, default=0.04, help="USD for an hour of a core; an assumption")
    parser.add_argument("--cores", type=int, default=1000)
    parser.add_argument("--episodes", type=int, default=300, help="that are run here")
    parser.add_argument("--jobs", type=int, default=40_000, help="empty ones, that are run here")
    given = parser.parse_args()
    pieces = measured(given.episodes, given.jobs)
    for line in lines(pieces, given.hours, given.price, given.cores):
        sys.stdout.write(f"{line}\n")


if __name__ == "__main__":
    main()
