"""What a trained predictor in C costs in the loop of a controller, on this host."""

from __future__ import annotations

import itertools
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from children import ChildFailedError, measure
from figures import Figure, Setting, Spread, skipped

from rtec.predictors import FORWARD, REVERSE, BidirectionalTable, LatheNetwork, Predictor
from rtec.predictors.layered import LayeredNetwork, TrainedNetworks
from rtec.predictors.predictor_file import KnownPredictor
from rtec.study.c_source import Precision, predictor_lines

_COMMAND = "python benchmarks/measure.py --only c-source"
_CYCLE_NS = 10e6
_LOW_MM, _HIGH_MM, _PITCH_MM = 0.0, 1016.0, 6.35
_ALL = ("position", "direction", "turn")

_LOOP = """
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
#include "corr.c"

/* what the control shares with the program; volatile, so that each cycle reads and writes it */
static volatile long axis_counts;
static volatile double compensation_mm;

int main(int argc, char **argv)
{
    const long cycles = argc > 1 ? atol(argv[1]) : 0, last = 1016000;
    long before = 0, counts, k;
    int direction = 1;
    clock_t begun;
    for (k = 0; k <= 16; ++k)
        printf("%.17g %.17g\\n", (double)corr_error_mm(63.5 * k + 0.3, 1), (double)corr_error_mm(63.5 * k + 0.3, -1));
    begun = clock();
    for (k = 0; k < cycles; ++k) {
        const long place = k * 137 % (2 * last);
        axis_counts = place < last ? place : 2 * last - place;               /* the axis, there and back */
        counts = axis_counts;                                                /* 1: where it is */
        if (counts != before) direction = counts > before ? 1 : -1;          /* 2: which way it went */
        before = counts;                                                     /* 3: kept for the next cycle */
        /* scaled, computed and returned: 4, 5, 6; there is no wait for the timing mark, 7 */
        compensation_mm = -(double)corr_error_mm((REAL)counts * STEP, direction);
    }
    printf("%.6g\\n", 1e9 * (double)(clock() - begun) / CLOCKS_PER_SEC / (double)(cycles ? cycles : 1));
    return 0;
}
"""
"""The seven steps of a cycle, thesis 4.4.3."""


def c_source(setting: Setting) -> Iterator[Figure]:
    """Measure a cycle of the thesis's loop with the designs of network and with a table, in both precisions."""
    for name, predictor in _predictors().items():
        what = f"One cycle with {name}"
        if shutil.which("cc") is None:
            yield skipped(what, "no C compiler", _COMMAND)
            continue
        cycle = {precision: _cycle_ns(predictor, precision, setting) for precision in Precision}
        double, single = cycle[Precision.DOUBLE], cycle[Precision.SINGLE]
        share = 100.0 * double.best / _CYCLE_NS
        yield Figure(
            what=what,
            measured=f"{double.text(_in_ns)}, {share:.2g} % of 10 ms; in single precision {single.text(_in_ns)}",
            value=double.best,
            command=_COMMAND,
        )


def _in_ns(value: float) -> str:
    return f"{value:.3g} ns"


def _predictors() -> dict[str, Predictor]:
    """Return the designs of chapter 4 of the thesis with drawn weights, and a table of the lathe's axis."""
    long_range, cyclic = _network(("position", "direction"), (30,)), _network(("turn", "direction"), (8,))
    return {
        "40 neurons": _networks(_network(_ALL, (40,))),
        "30-10": _networks(_network(_ALL, (30, 10))),
        "30 + 8": _networks(long_range, cyclic),
        "a table of 41 points each way": BidirectionalTable.sampled_from(
            LatheNetwork(), np.linspace(_LOW_MM, _HIGH_MM, 41)
        ),
    }


def _networks(*parts: LayeredNetwork) -> TrainedNetworks:
    return TrainedNetworks(networks=parts, range_mm=(_LOW_MM, _HIGH_MM), pitch_mm=_PITCH_MM)


def _network(inputs: tuple[str, ...], hidden: tuple[int, ...]) -> LayeredNetwork:
    draw = np.random.default_rng(4)
    half = {"position": _HIGH_MM / 2.0, "direction": 0.5, "turn": _PITCH_MM / 2.0}
    halves = np.array([half[name] for name in inputs])
    layers = itertools.pairwise((len(inputs), *hidden, 1))
    weights = np.concatenate([draw.normal(0.0, 1.0, (before + 1) * after) for before, after in layers])
    return LayeredNetwork(
        inputs=inputs, middle=halves, half=halves, hidden=hidden, weights=weights, bias_mm=0.0, factor_mm=0.01
    )


def _cycle_ns(predictor: Predictor, precision: Precision, setting: Setting) -> Spread:
    """Return nanoseconds of processor time a cycle, after what it computes has been compared with the predictor."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        known = KnownPredictor(predictor=predictor, name="a predictor")
        lines = predictor_lines(known, "corr", held_mm=(_LOW_MM, _HIGH_MM), precision=precision)
        (folder / "corr.c").write_text("\n".join(lines) + "\n")
        loop = _LOOP.replace("REAL", precision.code("double")).replace("STEP", precision.code("0.001"))
        (folder / "loop.c").write_text(loop)
        measure(["cc", "-std=c99", "-O2", "loop.c", "-o", "loop", "-lm"], folder)
        found = []
        for _ in range(setting.rounds + 1):
            *said, ns = measure([str(folder / "loop"), str(setting.of(1_000_000, 100_000))], folder).out.splitlines()
            _compare(predictor, [line.split() for line in said], 1e-12 if precision is Precision.DOUBLE else 1e-6)
            found.append(float(ns))
        return Spread(tuple(found[1:]))


def _compare(predictor: Predictor, said: list[list[str]], within_mm: float) -> None:
    x = 63.5 * np.arange(17) + 0.3
    expected = np.stack([predictor.error_mm(x, way) for way in (FORWARD, REVERSE)], axis=1)
    off = float(np.abs(np.array(said, dtype=np.float64) - expected).max())
    if not off <= within_mm:
        raise ChildFailedError(f"the C differs from the predictor by {off:g} mm")
