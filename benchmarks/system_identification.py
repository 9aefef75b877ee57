"""Public measurements on which NARX networks are judged, and how: free run on a part that nothing was chosen by.

The folder lies beside the project, ``../shared/data``; what is not there is skipped.
"""

from __future__ import annotations

import csv
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from rtec.predictors import DynamicModel, Sequences

Floats = npt.NDArray[np.float64]
DATA = Path(__file__).resolve().parents[2] / "shared" / "data"
UNCOUNTED = 50
"""Samples at the start of a free run in which no error counts."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Split:
    """What a network is trained on, and what it is judged by."""

    train: Sequences
    tests: dict[str, Sequences]


def silverbox() -> Split:
    """Return an electronic oscillator with a stiffening spring, in mV.

    Of its multisine three quarters train and the last quarter tests; the arrow goes on to larger amplitudes.
    """
    with np.load(DATA / "sysid" / "silverbox_snls.npz") as file:
        u, y = file["u"], 1e3 * file["y"]

    def part(first: int, end: int) -> Sequences:
        return Sequences(
            inputs=u[first:end, None], output=y[first:end], names=("voltage",), period_s=2.0**14 / 1e7, unit="mV"
        )

    begin, end = 40_650, 127_400
    middle = begin + 3 * (end - begin) // 4
    return Split(
        train=part(begin, middle),
        tests={
            "multisine": part(middle, end),
            "arrow": part(100, 40_575),
            "arrow without extrapolation": part(100, 32_100),
        },
    )


def cascaded_tanks() -> Split:
    """Return two tanks that overflow, in V, with 1024 samples to train and as many to test."""
    with (DATA / "sysid" / "cascaded_tanks.csv").open(encoding="utf-8") as file:
        _, *rows = [row for row in csv.reader(file) if len(row) >= 4]
    numbers = np.array([row[:4] for row in rows], dtype=np.float64)

    def part(first: int) -> Sequences:
        return Sequences(
            inputs=numbers[:, first, None], output=numbers[:, first + 2], names=("pump",), period_s=4.0, unit="V"
        )

    return Split(train=part(0), tests={"validation record": part(1)})


def emps() -> Split:
    """Return the following error of a ball-screw drive in um, by the commanded velocity; its second half tests."""
    lines = (DATA / "emps_train.csv").read_text(encoding="utf-8").splitlines()
    rows = [line.split(",") for line in lines if line[:1].isdigit()]
    time_s, command_mm, actual_mm = np.array(rows, dtype=np.float64).T[:3]
    period_s = float(time_s[1] - time_s[0])
    velocity = np.diff(command_mm, prepend=command_mm[0]) / period_s
    error_um = 1e3 * (command_mm - actual_mm)

    def part(at: slice) -> Sequences:
        return Sequences(inputs=velocity[at, None], output=error_um[at], names=("velocity",), period_s=period_s)

    half = time_s.size // 2
    return Split(train=part(slice(0, half)), tests={"second half": part(slice(half, None))})


SPLITS: dict[str, Callable[[], Split]] = {"Silverbox": silverbox, "Cascaded Tanks": cascaded_tanks, "EMPS": emps}


def rms(model: DynamicModel, data: Sequences) -> float:
    """Return the root mean square error of a free run over one run of data."""
    begin = max(UNCOUNTED, model.lags)
    return float(np.sqrt(np.mean((model.free_run(data) - data.output)[begin:] ** 2)))
