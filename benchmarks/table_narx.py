"""How often a trained NARX network holds over 80 000 steps, by how it was trained, on logs of the emulated drives.

Example::

    python benchmarks/table_narx.py
    python benchmarks/table_narx.py --starts 20 --train 40000 -o docs/predictors.md
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
from figures_narx import BALL_SCREW, LINEAR_MOTOR
from into_page import print_or_write
from scipy.stats import beta, binom
from system_identification import DATA, SPLITS, rms

from rtec.axis.plants import BallScrew, LinearMotor, run_drive
from rtec.predictors import NarxShape, Sequences, stability
from rtec.predictors.fitting.narx import NarxEffort, NarxFit, Stages, fit_narx
from rtec.toolpath import random_path
from rtec.toolpath.contouring import DRIVES
from rtec.toolpath.feed import plan_feed

Floats = npt.NDArray[np.float64]
STEPS = 80_000
"""Of the free run that judges, behind what trains."""
NOISE_UM = 0.1
"""White, on what the scale reads."""
PATH_SEED = 1


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """A drive with the network that its paper trained."""

    drive: str
    network: NarxShape
    points: int
    """Of the random path: enough for the steps."""
    turn_mm: float
    """Lead of the screw, or pitch of the magnets."""


CASES = (
    Case(drive="ball-screw", network=BALL_SCREW, points=110, turn_mm=BallScrew().lead_mm),
    Case(drive="linear-motor", network=LINEAR_MOTOR, points=190, turn_mm=LinearMotor().cogging_period_mm),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Way:
    """A way to train."""

    name: str
    stages: Stages
    horizons: tuple[int, ...] = ()
    linear: bool = False


WAYS = (
    Way(name="series-parallel only", stages=Stages.OPEN),
    Way(name="parallel only", stages=Stages.CLOSED),
    Way(name="two stages", stages=Stages.BOTH),
    Way(name="two stages, growing horizons, direct terms", stages=Stages.BOTH, horizons=(20, 200), linear=True),
)


def log(case: Case, train: int) -> tuple[Sequences, Sequences, Floats]:
    """Return the following error of the x axis along a random path by its commanded velocity: to train, to judge.

    The third is the commanded position, in mm, where it is judged.
    """
    kind = DRIVES[case.drive]
    plan = plan_feed(random_path(PATH_SEED, points=case.points), kind.limits)
    time_s = np.arange(0.0, plan.time_s, kind.period_s)
    if time_s.size < train + STEPS:
        raise SystemExit(f"{case.drive}: the path has {time_s.size} samples, {train + STEPS} are needed")
    position, (velocity, acceleration, _) = plan.positions(time_s), plan.axis_motion(time_s)
    run = run_drive(kind.make(), time_s, position[:, 0], velocity[:, 0], acceleration[:, 0])
    noise = NOISE_UM * np.random.default_rng(PATH_SEED).normal(size=time_s.size)
    data = Sequences(
        inputs=velocity[:, :1],
        output=1e3 * run.following_mm + noise,
        names=("velocity",),
        period_s=kind.period_s,
    )
    return data.part(0, train), data.part(len(data) - STEPS, len(data)), position[-STEPS:, 0]


def trained(case: Case, way: Way, data: Sequences, seed: int) -> NarxFit:
    """Return one start."""
    shape = case.network
    return fit_narx(
        data,
        neurons=shape.neurons,
        input_delays=shape.input_delays,
        feedback_delays=shape.feedback_delays,
        linear=way.linear,
        starts=1,
        seed=seed,
        stages=way.stages,
        effort=NarxEffort(open_epochs=100, closed_epochs=200, horizons=way.horizons),
    )


def periodic(case: Case, train: int) -> str:
    """Return how much of what a network leaves repeats with the turn of the screw or the pitch of the magnets."""
    data, test, position = log(case, train)
    fit = trained(case, WAYS[-1], data, 0)
    left = (test.output - fit.narx.free_run(test))[fit.narx.lags :]
    turns = position[fit.narx.lags :] / case.turn_mm
    waves = [wave(2.0 * np.pi * harmonic * turns) for harmonic in (1, 2) for wave in (np.sin, np.cos)]
    # the answer to a wave depends on the speed: columns times low powers of it, and of its sign
    speed = test.inputs[fit.narx.lags :, 0] / np.abs(test.inputs).max()
    factors = [np.sign(speed) ** sign * np.abs(speed) ** power for sign in (0, 1) for power in range(5)]
    columns = np.stack([wave * factor for wave in waves for factor in factors], axis=1)
    found = columns @ np.linalg.lstsq(columns, left, rcond=None)[0]
    share = 100.0 * float(found @ found) / float(left @ left)
    return (
        f"Of the mean square that a start of the last row leaves on the {case.drive}, {share:.0f} % repeats every "
        f"{case.turn_mm:g} mm.  "
    )


def rows(case: Case, starts: int, train: int) -> Iterator[tuple[str, ...]]:
    """Yield what each way of training gives."""
    data, test, _ = log(case, train)
    size = f"{float(np.std(test.output)):.0f}"
    for way in WAYS:
        errors, stable = [], 0
        for seed in range(starts):
            fit = trained(case, way, data, seed)
            errors.append(rms(fit.narx, test))
            stable += stability(fit.narx, test).stable
        low, high = _share(stable, starts)
        middle, (least, most) = float(np.median(errors)), _of_median(np.array(errors))
        sys.stderr.write(f"{case.drive}, {way.name}: {stable} of {starts}, {middle:.3g} um\n")
        yield (
            f"{case.drive}, {size} µm",
            way.name,
            f"{stable} of {starts} ({low:.0f} to {high:.0f} %)",
            f"{middle:.3g} ({least:.3g} to {most:.3g})",
            f"{min(errors):.3g}, {max(errors):.3g}",
        )


def _share(found: int, of: int) -> tuple[float, float]:
    """Return the 95 % interval of a share in percent (Clopper and Pearson 1934)."""
    low = 0.0 if found == 0 else float(beta.ppf(0.025, found, of - found + 1))
    high = 1.0 if found == of else float(beta.ppf(0.975, found + 1, of - found))
    return 100.0 * low, 100.0 * high


def _of_median(values: Floats) -> tuple[float, float]:
    """Return the interval of a median by order statistics, 95 % or as near as so few values allow."""
    place = max(int(binom.ppf(0.025, values.size, 0.5)) - 1, 0)
    ordered = np.sort(np.where(np.isfinite(values), values, np.inf))
    return float(ordered[place]), float(ordered[-1 - place])


def direct_terms() -> Iterator[str]:
    """Yield what direct terms do to the free run over the validation part of the training data alone."""
    if not DATA.is_dir():
        return
    yield from (
        "Free run over the validation part of the training data, 8 neurons, 4 delays each, best of five starts;",
        "median of some seeds, lowest and highest:",
        "",
        "| data | with direct terms | without |",
        "|---|---|---|",
    )
    for (name, split), seeds in zip(SPLITS.items(), (2, 10, 3), strict=True):
        data, cells = split().train, []
        for linear in (True, False):
            found = [fit_narx(data, linear=linear, seed=seed).start.rms_validation for seed in range(seeds)]
            cells.append(f"{np.median(found):.3g} ({min(found):.3g} to {max(found):.3g})")
        unit = data.unit.replace("um", "µm")
        yield f"| {name}, {unit}, {seeds} seeds | {' | '.join(cells)} |"
    yield ""


def tables(starts: int, train: int) -> str:
    """Return the tables as Markdown."""
    lines = [
        f"{train} samples train, {STEPS} others judge, {starts} starts a row; errors in µm RMS, with 95 % intervals:",
        "",
        "| drive, its following error | training | holds | median error | best, worst |",
        "|---|---|---|---|---|",
    ]
    for case in CASES:
        lines += [f"| {' | '.join(row)} |" for row in rows(case, starts, train)]
    lines += ["", *(periodic(case, train) for case in CASES)]
    return "\n".join([*lines, "", *direct_terms(), ""])


def main() -> None:
    """Train and print."""
    parser = argparse.ArgumentParser(description="Compare ways to train NARX networks on the emulated drives.")
    parser.add_argument("--starts", type=int, default=20)
    parser.add_argument("--train", type=int, default=20_000, help="samples to train on")
    parser.add_argument("-o", "--output", type=Path, help="page whose tables are replaced")
    given = parser.parse_args()
    print_or_write(parser, given.output, "table_narx", lambda: tables(given.starts, given.train))


if __name__ == "__main__":
    main()
