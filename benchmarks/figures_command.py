"""Figures of the command line, each command started as a user starts it."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Iterator
from pathlib import Path

from children import Child, ChildFailedError, measure, rtec
from figures import Bar, Figure, Setting, Spread, on_cores, skipped
from figures_house import additions_s

_HOUR_EDGES = 7_200_000_000
_JOB = ("simulate", "--design", "c", "--frequency", "500kHz", "--phase-error", "10deg", "--jitter", "5ns")
_SMALL = (*_JOB, "--cycles", "100000", "--corrections", "4000")
_SAYS_SO = "compiling"


def memory(setting: Setting) -> Iterator[Figure]:
    """Measure the peak memory of ``rtec simulate`` for runs of different lengths."""
    bar = Bar(value=500.0, unit="MB", at_most=True)
    lengths = [10_000_000, 100_000_000, 1_000_000_000] + ([] if setting.quick else [_HOUR_EDGES])
    with tempfile.TemporaryDirectory() as name:
        measure([rtec(), *_SMALL], Path(name))
        for edges in lengths:
            words = (*_JOB, "--cycles", str(edges // 4), "--corrections", str(edges // 100))
            child = measure([rtec(), *words, "--json"], Path(name))
            counts = json.loads(child.out)["controller_counts"]
            if counts != _wrapped(edges + edges // 100 * 2):
                raise ChildFailedError(f"{counts} counts after {edges} edges")
            hour = ", an hour at 500 kHz" if edges == _HOUR_EDGES else ""
            yield Figure(
                what=f"Peak memory of {edges:_} edges{hour}".replace("_", " "),
                measured=f"{child.peak_bytes / 1e6:.0f} MB, {child.wall_s:.1f} s",
                value=child.peak_bytes / 1e6,
                bar=bar,
                command=" ".join(("rtec", *words)),
            )


def _wrapped(count: int) -> int:
    """Return what a counter of 32 bits shows."""
    return (count + 2**31) % 2**32 - 2**31


def start_up(setting: Setting) -> Iterator[Figure]:
    """Measure the processor time of commands whose code is compiled and in the system's file cache."""
    for words, bar, rounds in ((("--help",), 0.2, 15), (_SMALL, 0.8, 15), (("run",), 9.0, 3)):
        with tempfile.TemporaryDirectory() as name:
            measure([rtec(), *words], Path(name))
            children = [measure([rtec(), *words], Path(name)) for _ in range(setting.of(rounds, 3))]
        yield _in_loops(f"`rtec {words[0]}`, warm", children, bar, " ".join(("rtec", *words)))


def _in_loops(what: str, children: list[Child], bar: float, command: str) -> Figure:
    loop_s = min(additions_s() for _ in range(3))
    cpu_s, wall_s = (min(getattr(child, name) for child in children) for name in ("cpu_s", "wall_s"))
    return Figure(
        what=what,
        measured=f"{cpu_s / loop_s:.2g} loops: {cpu_s:.2f} s of processor time, {wall_s:.2f} s by the clock",
        value=cpu_s / loop_s,
        bar=Bar(value=bar, unit="loops", at_most=True),
        command=command,
    )


def first_run(setting: Setting) -> Iterator[Figure]:
    """Measure the first run ever, which compiles, from an empty folder for machine code."""
    both = {setting.core, setting.second_core}
    box = ("box", "--timing", "firmware", "--duration", "1s", "--json")
    for words, bar in ((_SMALL, 8.0), (("run",), 40.0), (box, 45.0))[: setting.of(3, 1)]:
        command = " ".join(("NUMBA_CACHE_DIR=$(mktemp -d) rtec", *words))
        with tempfile.TemporaryDirectory() as name, tempfile.TemporaryDirectory() as cache, on_cores(both):
            child = measure([rtec(), *words], Path(name), NUMBA_CACHE_DIR=cache)
        if _SAYS_SO not in child.err:
            raise ChildFailedError(f"rtec {words[0]} compiled without saying so: {child.err[:200]!r}")
        yield _in_loops(f"First ever `rtec {words[0]}`, compiling, and saying so", [child], bar, command)


def _duration(what: str, children: list[Child], bar_s: float, command: str) -> Figure:
    wall = Spread(tuple(child.wall_s for child in children))
    cpu_s = min(child.cpu_s for child in children)
    median = f", median {wall.median:.2f} s" if len(children) > 1 else ""
    return Figure(
        what=what,
        measured=f"{wall.best:.2f} s (its processor time {cpu_s:.2f} s{median})",
        value=wall.best,
        bar=Bar(value=bar_s, unit="s", at_most=True),
        command=command,
    )


def run(setting: Setting) -> Iterator[Figure]:
    """Measure ``rtec run`` with everything, on two cores, with compiled code cached."""
    what, bar = "`rtec run` with everything, on two cores", Bar(value=60.0, unit="s", at_most=True)
    with tempfile.TemporaryDirectory() as name, on_cores({setting.core, setting.second_core}):
        try:
            measure([rtec(), "run"], Path(name))
            children = [measure([rtec(), "run"], Path(name)) for _ in range(setting.of(3, 1))]
        except ChildFailedError as problem:
            yield skipped(what, str(problem), "rtec run", bar)
            return
    yield _duration(what, children, bar.value, "rtec run")
