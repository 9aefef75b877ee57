"""How fast feed drives, feed plans and points of a path are, and what `rtec contour` has to compile."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from children import measure, rtec
from contour_insertions import ERROR, box_of
from figures import Bar, Figure, Setting, Spread
from scipy.interpolate import BSpline

from rtec.axis.plants import run_drive
from rtec.injector import Design, Processor
from rtec.toolpath import butterfly, circle, random_path
from rtec.toolpath.contour_run import DRIVES
from rtec.toolpath.contouring import run_contour
from rtec.toolpath.feed import plan_feed
from rtec.toolpath.pulses import Pulses

_COMMAND = "python benchmarks/measure.py --only contour"
_WORDS = ("contour", "--path", "butterfly", "--drive", "linear-motor", "--json")
_BOXED = ("--count", "2um", "--design", "c")
_POINTS = 1_000_000


def contour(setting: Setting) -> Iterator[Figure]:
    """Measure drives, plans, points and the first run."""
    rounds = setting.of(5, 2)
    seconds = np.arange(0.0, setting.of(10, 2), 0.25e-3)
    command = 100.0 * (1.0 - np.cos(2.0 * np.pi * seconds)), 200.0 * np.pi * np.sin(2.0 * np.pi * seconds)
    for name, kind in DRIVES.items():
        place, speed = (part if name == "linear-motor" else 0.3 * part for part in command)
        rate = float(seconds[-1]) / _best(lambda k=kind, p=place, s=speed: run_drive(k.make(), seconds, p, s), rounds)
        yield Figure(
            what=f"{name} at 0.25 ms, elasticity and friction, both runs of its proof",
            measured=f"{rate:.0f} x real time", value=rate, bar=Bar(value=100.0, unit="x real time"),
            command=_COMMAND,
        )  # fmt: skip
    paths = {"butterfly": butterfly(), "random path": random_path(1)}
    limits = DRIVES["linear-motor"].limits
    for name, path in paths.items():
        lasts = _best(lambda p=path: plan_feed(p, limits), rounds)
        yield Figure(
            what=f"The feed along the {name} ({path.length_mm / 1e3:.1f} m), limits of the linear motor",
            measured=f"{lasts:.2f} s", value=lasts, bar=Bar(value=1.0, unit="s", at_most=True), command=_COMMAND,
        )  # fmt: skip
    curve = random_path(1).curve
    u = np.linspace(curve.breaks[0], curve.breaks[-1], _POINTS)
    spline = BSpline(curve.knots, curve.control_points_mm, curve.degree)
    ours = _best(lambda: curve.curvature(u), rounds)
    theirs = _best(lambda: [spline(u, nu=order) for order in range(3)], rounds)
    yield Figure(
        what="A million points of a NURBS with curvature, beside scipy's BSpline with two derivatives",
        measured=f"{1e3 * ours:.0f} ms, {1e3 * theirs:.0f} ms: {theirs / ours:.1f} x",
        value=theirs / ours, bar=Bar(value=3.0, unit="x scipy"), command=_COMMAND,
    )  # fmt: skip
    for name, drive in (("butterfly", "linear-motor"), ("random path", "ball-screw")):
        run = run_contour(paths[name], drive)
        found = max(axis.integration_error_nm for axis in run.axes.values())
        most = max(run.shares.values())
        yield Figure(
            what=f"{name} on {drive}: bound of the integration error that the drives state",
            measured=f"{found:.2g} nm", value=found, bar=Bar(value=1.0, unit="nm", at_most=True), command=_COMMAND,
        )  # fmt: skip
        yield Figure(
            what=f"{name} on {drive}: largest share of a limit that is used, by the audit",
            measured=f"{most:.7f}", value=most, bar=Bar(value=1.0 + 1e-6, unit="of it", at_most=True),
            command=_COMMAND,
        )  # fmt: skip
    boxed = Pulses(count_mm=2e-3, injector=box_of(Design.C, Processor.FAST), errors=dict.fromkeys("xy", ERROR))
    lasts = _best(lambda: run_contour(circle(), "linear-motor", pulses=boxed), rounds)
    counts = sum(abs(loop.ticks) for loop in run_contour(circle(), "linear-motor", pulses=boxed).loops.values())
    yield Figure(
        what="The circle on linear motors, both axes over pulses of 2 µm with boxes of design C",
        measured=f"{lasts:.2f} s, {counts} control periods", value=lasts, command=_COMMAND,
    )  # fmt: skip
    folder = Path(tempfile.gettempdir())
    for name, words in (("rtec contour", _WORDS), ("rtec contour --count 2um --design c", (*_WORDS, *_BOXED))):
        with tempfile.TemporaryDirectory() as cache:
            cold, warm = (measure([rtec(), *words], folder, NUMBA_CACHE_DIR=cache).cpu_s for _ in range(2))
        yield Figure(
            what=f"What `{name}` compiles at its first run, processor time",
            measured=f"{cold - warm:.1f} s ({cold:.1f} s less {warm:.1f} s warm)", value=cold - warm,
            bar=Bar(value=15.0, unit="s", at_most=True), command=_COMMAND,
        )  # fmt: skip


def _best(work: Callable[[], object], rounds: int) -> float:
    """Return the least processor time of a few rounds after one that does not count, in s."""
    work()
    taken = []
    for _ in range(rounds):
        begin = time.process_time()
        work()
        taken.append(time.process_time() - begin)
    return Spread(tuple(taken)).best
