"""Play games with effects that somebody wrote, and with curves that are learned where nothing has a name.

Every game is appended to the file of ``--resume`` as it ends: the same command goes on where it was stopped.

Example::

    python -m tools.own_games --games 100 --resume own.jsonl -o docs/own-games.md
    python -m tools.own_games --games 20 --only outside --resume own.jsonl
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

import rtec
from rtec.blind.drawn_plans import drawn_log, drawn_plan
from rtec.blind.game import play
from rtec.blind.noise import Noise
from rtec.blind.outside import KINDS
from rtec.blind.plan import Plan
from rtec.blind.scenario import CONFOUNDED, Scenario
from rtec.jobs import JobPool
from rtec.metrology import Column, Measurement, Reading
from rtec.python.data import Data
from rtec.report.rendering import markdown_page
from tools.other_games import share
from tools.own_physics import LOGS, OVER, OWN, Array, Rng, own_numbers, quantities

TEMPLATE = Path(__file__).with_name("own_games.md.j2")
WORKERS = 2
OWN_SIGMA, OUTSIDE_SIGMA = 4.0, 5.0
CLOSE = 1.15
"""Times the noise of a reading that the error held out of a curve may be."""
TIMES = MappingProxyType({"hidden": 1, "absent": 1, "outside": 2, "null": 10})
"""Lines, and how many games each has for one of ``--games``."""
TOLD = ("NAMED", "LIKELY", "TIED")


def with_added(m: Measurement, added: Array, sigma: float, *, rms_of_all: bool) -> Measurement:
    """Return a measurement with an error whose RMS over the readings is ``sigma``, in the unit of the column."""
    name = "force" if "force" in m.columns else "actual"
    size = float(np.sqrt(np.mean(added**2)) if rms_of_all else np.std(added))
    column = replace(m.columns[name], values=m.columns[name].values + added * (sigma / size))
    return replace(m, columns={**m.columns, name: column})


@dataclass(frozen=True, slots=True)
class OwnGame:
    """One game: its line, its number on the line, and the seed of all games."""

    line: str
    index: int
    seed: int

    def run(self) -> dict[str, Any]:
        """Play it."""
        rng = np.random.default_rng([self.seed, self.index, *self.line.encode()])
        kind, plan, names, noise = self._drawn(rng)
        force = plan.reading is Reading.DRIVE
        strength = OUTSIDE_SIGMA if kind in names else OWN_SIGMA
        scenario = Scenario(names=names, strength_sigma=strength, noise=noise, plan=plan)
        measurement, _ = play(scenario, int(rng.integers(1 << 60)))
        sigma = plan.sigma_n if force else plan.sigma_um * 1e-3
        q = quantities(measurement)
        if kind in ("snap", "dry"):
            name, unit = ("temperature", "degc") if kind == "snap" else ("oil_level", "")
            if unit:
                measurement = replace(measurement, columns={**measurement.columns, name: Column(name, unit, q[name])})
            else:
                measurement = replace(measurement, unknown={**measurement.unknown, name: q[name]})
        if self.line == "hidden":
            own = OWN[kind][0].function
            wanted = [q[name] for name in OWN[kind][0].quantities]
            added = own(*wanted, **own_numbers(kind, q, rng))
            measurement = with_added(measurement, added, OWN_SIGMA * sigma, rms_of_all=force)
        if kind in LOGS:
            added = LOGS[kind].added(q, rng)
            measurement = with_added(measurement, added, OUTSIDE_SIGMA * sigma, rms_of_all=force)
        given = [OWN[kind][0]] if kind in OWN else []
        found = rtec.diagnose(Data(measurement, {}, None), effects=given)
        curve = found.inside.curve
        record = {"line": self.line, "index": self.index, "seed": self.seed, "kind": kind, "plan": plan.name}
        record |= {"library": list(names), "verdict": found.verdict, "effects": list(found.effects)}
        if curve is not None:
            over = {curve.shape.over, curve.shape.across, *(["direction"] if curve.shape.by_direction else [])} - {""}
            size = len(curve.shape.nodes) * max(len(curve.shape.nodes_across), 1)
            record |= {"over": sorted(over), "heldout": float(f"{curve.rms_heldout / sigma:.4g}"), "nodes": size}
            record["beside"] = [name for name in curve.model.names if name != "curve"]
        return record

    def _drawn(self, rng: Rng) -> tuple[str, Plan, tuple[str, ...], Noise]:
        """Return what is hidden, the plan, effects of the library and the noise."""
        if self.line == "null":
            noise = list(Noise)[self.index % len(Noise)]
            return noise.value, drawn_plan(rng, runs=(2 if noise is Noise.BY_PLACE else 1, 5)), (), noise
        if self.line == "outside":
            kind = list(OVER)[self.index % len(OVER)]
            if kind in LOGS:
                return kind, drawn_log(rng, LOGS[kind].reading), (), Noise.WHITE
            fewest, targets = (KINDS[kind].runs, KINDS[kind].targets) if kind in KINDS else (1, 41)
            plan = drawn_plan(rng, targets=(targets, 161), runs=(max(fewest, 2), 5), both=True)
            if kind == "dwell_reversal":
                plan = replace(plan, columns=(*plan.columns, "dwell"))
            return kind, plan, (kind,), Noise.WHITE
        kind = list(OWN)[self.index % len(OWN)]
        if kind == "saturation":
            plan = drawn_log(rng, Reading.DRIVE)
        else:
            plan = drawn_plan(rng, targets=(21, 161), runs=(2, 5), both=True)
            plan = replace(plan, heating=Plan(name="").heating, columns=("direction", "time"))
        names: list[str] = []
        wanted = 2 if self.line == "hidden" or self.index // len(OWN) % 2 else 0
        for name in rng.permutation(OWN[kind][1]).tolist():
            if len(names) < wanted and all(frozenset((name, other)) not in CONFOUNDED for other in names):
                names.append(name)
        return kind, plan, tuple(names), Noise.WHITE


def rows(records: Sequence[dict[str, Any]], line: str) -> list[tuple[object, ...]]:
    """Return the rows of the table of a line: one a kind, and one of all."""
    games: dict[str, list[dict[str, Any]]] = defaultdict(list)
    for one in records:
        if one["line"] == line:
            games[one["kind"]].append(one)
            games["all"].append(one)
    total = games.pop("all", [])
    return [_row(line, kind, games[kind]) for kind in sorted(games)] + [_row(line, "all", total)]


def _row(line: str, kind: str, games: Sequence[dict[str, Any]]) -> tuple[object, ...]:
    many = len(games)
    if line == "hidden":
        right = sum(set(one["effects"]) == {*one["library"], one["kind"]} for one in games)
        wrong = sum(bool(set(one["effects"]) - {*one["library"], one["kind"]}) for one in games)
        own = sum(one["kind"] in one["effects"] for one in games)
        return kind, many, share(right, many), share(own, many), share(wrong, many)
    if line == "absent":
        return kind, many, share(sum(one["kind"] in one["effects"] for one in games), many)
    curves = [one for one in games if "over" in one]
    if line == "null":
        return kind, many, share(len(curves), many), sum(one["verdict"] == "UNKNOWN" for one in games)
    unknown = sum(one["verdict"] == "UNKNOWN" for one in games)
    close = sum(one["heldout"] <= CLOSE for one in curves)
    right = sum(tuple(one["over"]) in OVER[one["kind"]] for one in curves)
    what = " or ".join("*".join(one) for one in OVER.get(kind, ())) or "-"
    return kind, what, many, unknown, len(curves), share(close, len(curves)), share(right, len(curves))


def main() -> int:
    """Play, and write the page."""
    parser = argparse.ArgumentParser(description="Play games with own effects and learned curves.")
    parser.add_argument("--games", type=int, default=100, help="with an own effect")
    parser.add_argument("--seed", type=int, default=0, help="of all games")
    parser.add_argument("--only", action="append", choices=list(TIMES), help="a line; may be given several times")
    parser.add_argument("--workers", type=int, default=WORKERS, help="processes that play at the same time")
    parser.add_argument("--resume", type=Path, help="file of games: those in it are not played again")
    parser.add_argument("-o", "--output", type=Path, help="file to write the page to, instead of stdout")
    given = parser.parse_args()
    wanted = [
        OwnGame(line, index, given.seed) for line in given.only or TIMES for index in range(given.games * TIMES[line])
    ]
    records: list[dict[str, Any]] = []
    if given.resume and given.resume.exists():
        records = [json.loads(line) for line in given.resume.read_text(encoding="utf-8").splitlines()]
    done = {OwnGame(one["line"], one["index"], one["seed"]) for one in records}
    with JobPool(given.workers, processes=True) as pool:
        for one in pool.results([game for game in wanted if game not in done]):
            records.append(one)
            if given.resume:
                with given.resume.open("a", encoding="utf-8") as file:
                    file.write(json.dumps(one) + "\n")
            sys.stderr.write(f"\r{one['line']} {one['index'] + 1} ")
    tables = {line: rows(records, line) for line in TIMES}
    missing = given.games * sum(TIMES.values()) - len(records)
    text = markdown_page(TEMPLATE, games=given.games, seed=given.seed, missing=missing, **tables)
    if given.output is None:
        sys.stdout.write(text)
    else:
        given.output.write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    sys.exit(main())
