"""Figures of the signal path: the open path, its stages, and the peers that do the same job."""

from __future__ import annotations

import dataclasses
import functools
import io
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import open_path_job
import peer_verilator
from figures import Bar, Figure, Setting, Spread, number, skipped
from open_path_job import FREQUENCY_HZ, REAL_TIME_EDGES_S, carry_out, job
from peer_verilator import Build
from peers import PeerAbsent, PeerFailedError, pyvcd, sigrok
from steady_edges import steady_edges

from rtec._jit import new_record
from rtec.axis import _kernels as axis_kernels
from rtec.controller import ReceiverSettings, _kernels as controller_kernels
from rtec.injector import Design, _kernels as injector_kernels
from rtec.injector._state_kernels import INJECTOR
from rtec.machine import OpenPath
from rtec.signal import VcdSignal, VcdWriter

THIS = "python benchmarks/measure.py --only"
_SIMULATE = (
    "rtec simulate --design {} --frequency 500kHz --phase-error 10deg --jitter 5ns "
    "--cycles 5000000 --corrections 200000"
)


def _timed(work: Callable[[], object], rounds: int) -> Spread:
    """Time ``work`` after one run that does not count."""
    work()
    seconds = []
    for _ in range(rounds):
        begun = time.perf_counter()
        work()
        seconds.append(time.perf_counter() - begun)
    return Spread(tuple(seconds))


def _speed(edges: int) -> Callable[[float], str]:
    return lambda s: f"{edges / s / REAL_TIME_EDGES_S:.0f} x"


def open_path(setting: Setting) -> Iterator[Figure]:
    """Measure the open path with each design, in real time at 500 kHz and in edges a second."""
    edges = setting.of(20_000_000, 5_000_000)
    for design in (Design.C, Design.ORIGINAL, Design.A, Design.B):
        path = job(design, edges)
        carry_out(path)
        spread = Spread(tuple(carry_out(path).wall_s for _ in range(setting.rounds)))
        yield Figure(
            what=f"Design {design.value}, 500 kHz",
            measured=f"{spread.text(_speed(edges))} real time, {number(edges / spread.best)} edges/s",
            value=edges / spread.best / REAL_TIME_EDGES_S,
            bar=Bar(value=100.0 if design is Design.ORIGINAL else 150.0, unit="x real time"),
            command=_SIMULATE.format(design.value),
        )


STEP_BARS = {Design.C: 60.0, Design.ORIGINAL: 50.0, Design.A: 50.0, Design.B: 40.0}
"""Times real time that the step functions alone are to reach, with a correction every 8 edges."""


def steps(setting: Setting) -> Iterator[Figure]:
    """Measure the open path without its blocks: every edge through the step functions."""
    edges = setting.of(20_000_000, 2_000_000)
    ways = (("a correction every 100 edges", 100), ("a correction every 8 edges", 8))
    for design in (Design.C, Design.ORIGINAL, Design.A, Design.B):
        for how, spacing in ways:
            path = job(design, edges, spacing_edges=spacing)
            carry_out(path, in_blocks=False)
            spread = Spread(tuple(carry_out(path, in_blocks=False).wall_s for _ in range(setting.rounds)))
            yield Figure(
                what=f"Design {design.value}, {how}",
                measured=f"{spread.text(_speed(edges))} real time, {number(edges / spread.best)} edges/s",
                value=edges / spread.best / REAL_TIME_EDGES_S,
                bar=Bar(value=STEP_BARS[design], unit="x real time"),
                binding=spacing == 8,
                command=f"{THIS} steps",
            )


def verilator(setting: Setting) -> Iterator[Figure]:
    """Measure design C beside Verilator on the same job, by turns, both in processor time."""
    bar, command = Bar(value=110.0, unit="x Verilator"), f"{THIS} verilator"
    ours, theirs = setting.of(100_000_000, 20_000_000), setting.of(1_000_000, 300_000)
    ways: dict[str, Callable[[], float]] = {
        "rtec": functools.partial(_processor_time, job(Design.C, ours)),
        "steps": functools.partial(_processor_time, job(Design.C, ours // 4), in_blocks=False),
    }
    with tempfile.TemporaryDirectory() as folder:
        try:
            for build in Build:
                (Path(folder) / build).mkdir()
                bench = peer_verilator.build(Path(folder) / build, build)
                ways[build] = functools.partial(_verilated, bench, theirs)
            name = " ".join(peer_verilator.version().split()[:2])
        except (PeerAbsent, PeerFailedError) as problem:
            yield skipped("Verilator", str(problem), command, bar)
            return
        per_edge = _by_turns(ways, setting.of(7, 3))
    for build in Build:
        peer = per_edge[build]
        yield _ratio(f"{name}, build {build}", per_edge["rtec"], peer, bar)
    for build in Build:
        peer = per_edge[build]
        figure = _ratio(f"Step functions alone, build {build}", per_edge["steps"], peer, bar)
        yield dataclasses.replace(figure, binding=False)


def _verilated(bench: Path, edges: int) -> float:
    return float(peer_verilator.run(bench, edges)["cpu_s"]) / edges


def _processor_time(path: OpenPath, *, in_blocks: bool = True) -> float:
    """Return the seconds of processor time an edge that a run takes."""
    begun = time.process_time()
    carry_out(path, in_blocks=in_blocks)
    return (time.process_time() - begun) / (4 * path.cycles)


def _by_turns(ways: dict[str, Callable[[], float]], rounds: int) -> dict[str, Spread]:
    """Let ours run before each of the others, round by round, so that a disturbance meets all of them."""
    seconds: dict[str, list[float]] = {name: [] for name in ways}
    for work in ways.values():
        work()
    for _ in range(rounds):
        for name in list(ways)[1:]:
            seconds["rtec"].append(ways["rtec"]())
            seconds[name].append(ways[name]())
    return {name: Spread(tuple(each)) for name, each in seconds.items()}


def _ratio(what: str, ours: Spread, theirs: Spread, bar: Bar) -> Figure:
    return Figure(
        what=what,
        measured=(
            f"{theirs.best / ours.best:.0f} x (medians {theirs.median / ours.median:.0f} x): "
            f"{number(1 / ours.best)} against {number(1 / theirs.best)} edges/s"
        ),
        value=theirs.best / ours.best,
        bar=bar,
        command=f"{THIS} verilator",
    )


def made_edges(edges: int) -> tuple[Any, Any]:
    """Return times and levels of the job's encoder."""
    state = new_record(axis_kernels.ENCODER)
    open_path_job.encoder().fill_steady(state, FREQUENCY_HZ, 1)
    axis_kernels.reset_at(state, 0.0)
    times, levels = np.empty(edges + 3, np.int64), np.empty(edges + 3, np.uint8)
    used = steady_edges(state, times, levels)
    return times[:used], levels[:used]


STAGES = ("encoder", *(f"box, design {design.value}" for design in Design), "receiver")


def stage_works(edges: int) -> dict[str, Callable[[], object]]:
    """Return each stage alone over arrays of the job's edges; the box owes nothing."""
    times, levels = made_edges(edges)
    room = np.empty(6 * times.size + 16, np.int64), np.empty(6 * times.size + 16, np.uint8)
    made = np.empty(edges + 3, np.int64), np.empty(edges + 3, np.uint8)

    def encode() -> None:
        state = new_record(axis_kernels.ENCODER)
        open_path_job.encoder().fill_steady(state, FREQUENCY_HZ, 1)
        axis_kernels.reset_at(state, 0.0)
        steady_edges(state, *made)

    def inject(design: Design) -> Callable[[], None]:
        def work() -> None:
            state = new_record(INJECTOR)
            open_path_job.box(design).fill(state)
            injector_kernels.reset(state, 0)
            injector_kernels.inject(state, times, levels, -1, int(times[-1]) + 1, *room)

        return work

    def receive() -> None:
        state = new_record(controller_kernels.RECEIVER)
        ReceiverSettings().fill(state)
        controller_kernels.reset(state, 0)
        controller_kernels.receive(state, times, levels)
        controller_kernels.settle(state, int(times[-1]) + 1_000_000)
        if state.count != times.size:
            raise open_path_job.WrongResultError(f"receiver: {state.count} counts of {times.size}")

    return dict(zip(STAGES, (encode, *map(inject, Design), receive), strict=True))


def stages(setting: Setting) -> Iterator[Figure]:
    """Measure each stage alone, then all of them in one loop, per edge."""
    edges = setting.of(4_000_000, 1_000_000)
    for name, work in stage_works(edges).items():
        spread = _timed(work, setting.rounds)
        yield Figure(
            what=f"Alone: {name}",
            measured=f"{spread.text(lambda s: f'{s / edges * 1e9:.2f}')} ns/edge",
            value=spread.best,
            command=f"{THIS} stages",
        )
    for what, in_blocks in (("step functions", False), ("blocks", True)):
        path = job(Design.C, 5 * edges)
        spread = Spread(tuple(carry_out(path, in_blocks=in_blocks).wall_s for _ in range(setting.rounds)))
        yield Figure(
            what=f"All stages in one loop, design C, {what}",
            measured=f"{spread.text(lambda s: f'{s / edges / 5 * 1e9:.2f}')} ns/edge",
            value=spread.best,
            command=f"{THIS} stages",
        )


def receiver_and_sigrok(setting: Setting) -> Iterator[Figure]:
    """Measure decoding alone beside sigrok's decoder of Gray code."""
    edges = setting.of(4_000_000, 1_000_000)
    what, command = "Decoding alone beside sigrok's graycode", f"{THIS} sigrok"
    ours = _timed(stage_works(edges)["receiver"], setting.rounds)
    try:
        with tempfile.TemporaryDirectory() as folder:
            runs = [sigrok.decode(setting.of(200_000, 50_000), Path(folder)) for _ in range(3)]
    except (PeerAbsent, PeerFailedError) as problem:
        yield skipped(what, str(problem), command)
        return
    theirs = max(run["edges_per_s"] for run in runs)
    yield Figure(
        what=what,
        measured=f"{edges / ours.best / theirs:.0f} x: {number(edges / ours.best)} against {number(theirs)} edges/s",
        value=edges / ours.best / theirs,
        command=command,
    )


def write_changes(edges: int) -> Callable[[], int]:
    """Return the writing of a VCD of ``edges`` changes of A and B into memory; it returns the file's length."""
    times, levels = made_edges(edges)
    lines = np.where((levels ^ np.roll(levels, 1)) & 1, 0, 1)
    lines[0] = 0 if levels[0] & 1 else 1
    values = levels >> lines & 1

    def write() -> int:
        file = io.BytesIO()
        signals = [VcdSignal(scope="encoder", name=name) for name in "AB"]
        with VcdWriter(file, signals=signals) as writer:
            writer.write(times, lines, values)
            writer.finish(int(times[-1]))
        return file.tell()

    return write


def vcd(setting: Setting) -> Iterator[Figure]:
    """Measure the writing of a VCD file beside pyvcd's."""
    edges = setting.of(2_000_000, 200_000)
    ours = _timed(write_changes(edges), setting.rounds)
    what, command = "Writing VCD beside pyvcd", f"{THIS} vcd"
    try:
        small = setting.of(200_000, 50_000)
        times, levels = made_edges(small)
        theirs = _timed(lambda: pyvcd.write(times, levels), 3)
    except PeerAbsent as problem:
        measured = f"{number(edges / ours.best)} changes/s; {problem}"
        yield Figure(what=what, measured=measured, value=edges / ours.best, command=command)
        return
    ratio = (edges / ours.best) / (small / theirs.best)
    yield Figure(
        what=what,
        measured=f"{ratio:.0f} x: {number(edges / ours.best)} against {number(small / theirs.best)} changes/s",
        value=ratio,
        command=command,
    )
