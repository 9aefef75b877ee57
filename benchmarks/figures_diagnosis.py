"""Figures of the diagnosis: how long it takes, how its cost grows with rows, and its scan beside refitting."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from children import ChildFailedError, measure, rtec
from diagnosis_job import Scan, agree, by_lmfit, by_lstsq, by_scan, lathe_calibration, scan_job
from figures import Bar, Figure, Setting, Spread, on_cores, skipped
from open_path_job import WrongResultError

from rtec.metrology import write_measurement

DATA = Path(__file__).resolve().parents[2] / "shared" / "data"
THIS = "python benchmarks/measure.py --only scan"
RUNS = 4
NOISE_UM = 1.0
_MUST_FIND = {"backlash_map", "cyclic"}


def diagnosis(setting: Setting) -> Iterator[Figure]:
    """Measure ``rtec diagnose`` with the whole library, on two cores, started as a user starts it."""
    with tempfile.TemporaryDirectory() as name, on_cores({setting.core, setting.second_core}):
        folder = Path(name)
        best = {}
        warm = folder / "warm.csv"
        write_measurement(warm, lathe_calibration(1, NOISE_UM))
        measure([rtec(), "diagnose", str(warm), "--json"], folder)
        for times in (1, 2) if setting.quick else (1, 2, 4):
            runs = RUNS * times
            file = folder / f"lathe_{runs}.csv"
            write_measurement(file, lathe_calibration(runs, NOISE_UM))
            spread, rows = _diagnosed(folder, file, setting.of(3, 1)), runs * 3122
            best[times] = spread.best
            yield Figure(
                what=f"The lathe's calibration with {runs} runs: {rows} rows",
                measured=spread.text(lambda s: f"{s:.1f} s"),
                value=spread.best,
                bar=Bar(value=5.0, unit="s", at_most=True),
                binding=times == 1,
                command=f"rtec diagnose lathe_{runs}.csv",
            )
        most = max(best)
        growth = best[most] / best[1] / most
        yield Figure(
            what=f"Time for {most} times the rows, over {most} times the time: 1 is linear, less is better",
            measured=f"{growth:.2f}",
            value=growth,
            bar=Bar(value=1.1, unit="", at_most=True),
            command="the rows above",
        )
        yield _drive(setting, folder)
        yield _nothing(setting, folder)
        yield from _long_log(setting, folder)


def _diagnosed(folder: Path, file: Path, rounds: int) -> Spread:
    command = [rtec(), "diagnose", str(file), "--json"]
    children = [measure(command, folder) for _ in range(rounds)]
    for child in children:
        found = set(json.loads(child.out)["effects"])
        if not found >= _MUST_FIND:
            raise WrongResultError(f"{file.name}: found {sorted(found)}")
    return Spread(tuple(child.wall_s for child in children))


def _nothing(setting: Setting, folder: Path) -> Figure:
    """Measure the diagnosis of 200 readings that hold nothing but noise: what everybody pays."""
    rng, file = np.random.default_rng(1), folder / "null.csv"
    places = np.linspace(0.0, 300.0, 20) + rng.uniform(-3.0, 3.0, 20)
    readings = [(run, way, x, rng.normal()) for run in range(1, 6) for way in (1, -1) for x in places[::way]]
    lines = [f"{run},{way},{x:.4f},{y:.4f}" for run, way, x, y in readings]
    file.write_text("\n".join(["run,direction,target_mm,deviation_um", *lines, ""]))
    children = [measure([rtec(), "diagnose", str(file), "--json"], folder) for _ in range(setting.of(3, 1))]
    spread = Spread(tuple(child.wall_s for child in children))
    return Figure(
        what="Nothing but noise: 200 rows",
        measured=spread.text(lambda s: f"{s:.2f} s"),
        value=spread.best,
        bar=Bar(value=1.5, unit="s", at_most=True),
        command="rtec diagnose null.csv",
    )


def _long_log(setting: Setting, folder: Path) -> Iterator[Figure]:
    """Measure the diagnosis of a log of a million rows: forth and back at 1 kHz with scale, play and a wave."""
    rows, file = setting.of(1_000_000, 100_000), folder / "log.csv"
    rng, time_s = np.random.default_rng(1), 1e-3 * np.arange(setting.of(1_000_000, 100_000))
    target = 210.0 - np.abs((20.0 * time_s) % 400.0 - 200.0)
    way = np.where((20.0 * time_s) % 400.0 < 200.0, 1.0, -1.0)
    error = 0.02 * target + 4.0 * way + 3.0 * np.sin(2.0 * np.pi * target / 10.0) + rng.normal(0.0, 2.0, rows)
    table = np.column_stack([time_s, target + 1e-3 * error, error])
    np.savetxt(file, table, "%.3f,%.5f,%.4f", header="time_s,actual_mm,deviation_um", comments="")
    child = measure([rtec(), "diagnose", str(file), "--json"], folder)
    for what, value, unit, bar in (
        ("time", child.wall_s, "s", 15.0),
        ("peak memory", child.peak_bytes / 1e6, "MB", 600.0),
    ):
        yield Figure(
            what=f"A log of {rows:_} rows, {what}".replace("_", " "),
            measured=f"{value:.{1 if unit == 's' else 0}f} {unit}",
            value=value,
            bar=Bar(value=bar, unit=unit, at_most=True),
            command="rtec diagnose log.csv",
        )


def _drive(setting: Setting, folder: Path) -> Figure:
    """Measure the diagnosis of a drive's force, 24 841 rows at 1 kHz, where that measurement is there."""
    what, bar = "A drive's force, `emps_train.csv`: 24 841 rows", Bar(value=5.0, unit="s", at_most=True)
    shown = "rtec diagnose emps_train.csv --observe force"
    file = DATA / "emps_train.csv"
    if not file.exists():
        return skipped(what, "no ../shared/data/emps_train.csv", shown, bar)
    try:
        command = [rtec(), "diagnose", str(file), "--observe", "force", "--json"]
        children = [measure(command, folder) for _ in range(setting.of(3, 1))]
    except ChildFailedError as problem:
        return skipped(what, str(problem), shown, bar)
    spread = Spread(tuple(child.wall_s for child in children))
    return Figure(what=what, measured=spread.text(lambda s: f"{s:.1f} s"), value=spread.best, bar=bar, command=shown)


def scan(setting: Setting) -> Iterator[Figure]:
    """Measure one scan of the whole library beside two loops that fit every candidate of the same grid."""
    job = scan_job(RUNS if not setting.quick else 1)
    by_scan(*job)
    ours, plain, refit = [], [], []
    for _ in range(setting.of(3, 1)):
        ours.append(by_scan(*job))
        plain.append(by_lstsq(*job))
        refit.append(by_lmfit(*job))
    for peer in (*plain, *refit):
        if not agree(ours[0], peer):
            raise WrongResultError(f"the scans differ: {ours[0].falls} and {peer.falls}")
    best = min(one.seconds for one in ours)
    grid = f"{ours[0].candidates} candidates on {job[0].rows} rows"
    yield Figure(
        what=f"The scan of the whole library: {grid}",
        measured=_spread(ours).text(lambda s: f"{s:.2f} s"),
        value=best,
        command=THIS,
    )
    for name, peers, bar in (
        ("`numpy.linalg.lstsq` for each candidate", plain, 3.0),
        ("a refit by lmfit with the analytic Jacobian for each", refit, 20.0),
    ):
        took = _spread(peers)
        yield Figure(
            what=f"... beside {name}",
            measured=f"{took.best / best:.0f} times as fast ({took.text(lambda s: f'{s:.1f} s')})",
            value=took.best / best,
            bar=Bar(value=bar, unit="times"),
            command=THIS,
        )


def _spread(scans: list[Scan]) -> Spread:
    return Spread(tuple(one.seconds for one in scans))
