"""Figures of box and PC as live processes, and of the hours under random faults."""

from __future__ import annotations

import time
from collections.abc import Iterator

import live as live_nodes
from figures import Bar, Figure, Setting, number, on_cores
from open_path_job import WrongResultError

from rtec.verify.safety.soak import SoakPlan, run_soak

MS = 10**9


def live(setting: Setting) -> Iterator[Figure]:
    """Measure handshake and cycle of two processes over a line of their own, on both cores.

    Raises
    ------
    WrongResultError
        The counts inserted are not those that the box says it has completed.
    """
    minutes = setting.of(10, 1)
    with on_cores({setting.core, setting.second_core}):
        found = live_nodes.measure(minutes)
    if not found["inserted_right"]:
        raise WrongResultError("the live box has inserted other counts than it says")
    command = f"python benchmarks/live.py --minutes {minutes}"
    beyond_ms, late_ms = float(found["beyond_box_median_ms"]), float(found["turn_lateness"]["p99_ms"])
    yield Figure(
        what=f"Request to completed over a pseudo-terminal, beyond the box's own time, median over {minutes} min",
        measured=f"{number(beyond_ms)} ms; in all {number(found['handshake']['median_ms'])} ms",
        value=beyond_ms,
        bar=Bar(value=live_nodes.BARS["beyond_box_median_ms"], unit="ms", at_most=True),
        command=command,
    )
    yield Figure(
        what="Turns of the PC late on their grid of 10 ms, 99th percentile of the same run",
        measured=f"{number(late_ms)} ms; median {number(found['turn_lateness']['median_ms'])} ms; a core is busy "
        f"{100 * found['box_cpu_share']:.0f} % with the box, {100 * found['pc_cpu_share']:.0f} % with the PC",
        value=late_ms,
        bar=Bar(value=live_nodes.BARS["turn_lateness_p99_ms"], unit="ms", at_most=True),
        command=command,
    )


def soak(setting: Setting) -> Iterator[Figure]:
    """Measure hours of cutting on three axes under random faults, on both cores.

    Raises
    ------
    WrongResultError
        Wrong counts that nobody noticed, or a class of faults that never took effect.
    """
    hours = setting.of(100, 2)
    with on_cores({setting.core, setting.second_core}):
        run_soak(SoakPlan(hours=0.05))
        begun = time.perf_counter()
        found = run_soak(SoakPlan(hours=hours))
        wall_s = time.perf_counter() - begun
    if not found.good:
        raise WrongResultError(f"silent: {found.undetected()}, without effect: {found.missing}")
    yield Figure(
        what=f"{hours} h of cutting on three axes under random faults of every class",
        measured=f"{number(wall_s / 60)} min, {number(found.hours() * 3600 / wall_s)} times real time",
        value=wall_s / 60,
        bar=Bar(value=10.0, unit="min", at_most=True),
        command="python benchmarks/measure.py --only soak",
    )
