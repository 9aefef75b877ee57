"""Streams at 500 kHz that have nothing to do with each other, on several cores: in threads and in processes.

python -m benchmarks.independent_streams

One core, threads and processes take turns, so that what else the machine does falls on all of them. The cores that a
turn got are its processor time over its time on the clock: where they are fewer than asked for, others had the rest,
or a core waited for the other at the end of the turn, which counts the less the longer the turn is.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Callable
from concurrent.futures import Executor, ProcessPoolExecutor, ThreadPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from statistics import median

from benchmarks.open_path_job import FREQUENCY_HZ, carry_out, job
from rtec.injector import Design
from rtec.jobs import cores

EDGES = 5_000_000
"""Of a stream: about 5 ms of work, so that starting it hardly counts."""
BAR = 1.9


def stream(design: str) -> float:
    """Run a stream and make sure that its counts are right; return the processor time of this thread, in seconds."""
    begun = time.thread_time()
    carry_out(job(Design.named(design), EDGES))
    return time.thread_time() - begun


@dataclass(frozen=True, slots=True)
class Turn:
    """How fast streams ran, and on how many cores."""

    times_real: float
    cores: float


def turn(run: Callable[[list[str]], list[float]], streams: int, design: str) -> Turn:
    """Run so many streams."""
    begun = time.perf_counter()
    busy_s = run([design] * streams)
    wall_s = time.perf_counter() - begun
    return Turn(streams * EDGES / 4.0 / FREQUENCY_HZ / wall_s, sum(busy_s) / wall_s)


def over(pool: Executor) -> Callable[[list[str]], list[float]]:
    """Return how a pool runs streams, one after the other on each core."""
    return lambda designs: list(pool.map(stream, designs))


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--design", default="c", choices=[design.value for design in Design])
    parser.add_argument("--streams", type=int, default=64, help="of each turn")
    parser.add_argument("--rounds", type=int, default=30)
    parser.add_argument("--workers", type=int, default=cores())
    given = parser.parse_args()
    with (
        ThreadPoolExecutor(given.workers) as threads,
        ProcessPoolExecutor(given.workers, mp_context=get_context("spawn")) as processes,
    ):
        ways = {
            "one core": lambda designs: [stream(design) for design in designs],
            "threads": over(threads),
            "processes": over(processes),
        }
        for run in ways.values():
            turn(run, 8 * given.workers, given.design)  # machine code is loaded, and processes are there
        turns: dict[str, list[Turn]] = {name: [] for name in ways}
        for _ in range(given.rounds):
            for name, run in ways.items():
                turns[name].append(turn(run, given.streams, given.design))
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else float("nan")
    write = sys.stdout.write
    write(
        f"{given.streams} streams of {EDGES} edges, design {given.design}, {given.rounds} rounds, load {load:.1f}\n"
    )
    alone = max(each.times_real for each in turns["one core"])
    for name, found in turns.items():
        best = max(found, key=lambda each: each.times_real)
        ratio = median(a.times_real / b.times_real for a, b in zip(found, turns["one core"], strict=True))
        got = median(each.cores for each in found)
        per_core = median(each.times_real / each.cores for each in found)
        write(
            f"{name}: {median(each.times_real for each in found):.0f} x real time, {ratio:.2f} x one core in turns\n"
        )
        write(f"    on {got:.2f} cores: {per_core:.0f} x real time for a whole one\n")
        write(f"    best turn: {best.times_real:.0f} x, {best.times_real / alone:.2f} x the best of one core\n")
    write(f"bar: {BAR:g} x one core on two\n")


if __name__ == "__main__":
    main()
