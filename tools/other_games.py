"""Play a second family of games: data that share no code with rtec, to measure how sure a diagnosis may be.

Example::

    python -m tools.other_games --games 400 --resume games.jsonl -o docs/other-games.md
    python -m tools.other_games --games 40 --only "outside at rest" --keep folder
"""

from __future__ import annotations

import argparse
import json
import math
import os
import sys
from collections import Counter, defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from tools.other_worlds import (
    BY_PLACE,
    CAPS,
    CLASHES,
    IN_TIME,
    NEEDS,
    NOISES,
    OF_DRIVES,
    OF_FORCE,
    OF_POSITION,
    OUTSIDE_AT_REST,
    OUTSIDE_IN_MOTION,
    POSITIVE,
    SAME_SIGN,
    Array,
    Plan,
    Rng,
    at_rest,
    between,
    in_motion,
    noise_of,
    rivals,
)

TEMPLATE = Path(__file__).with_name("other_games.md.j2")
ROUND = (
    "known at rest",
    "known log of a deviation",
    "outside at rest",
    "known at rest",
    "known log of a drive",
    "null",
    "known warm",
    "outside in a log",
    "known at rest",
    "outside at rest",
    "known log of a drive",
    "known at rest",
)
"""Groups of the games, in turn."""
Z_SEEN = 12.0
RATIO_SEEN = 0.4
RATIO_MOST = 60.0
Z_APART = 6.0
TOLD = ("NAMED", "LIKELY", "TIED")
WAVES = ("cyclic", "eccentricity", "interpolation")
BINS = (0.0, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.99, 1.0)
RISE = 1.01
OFTEN = ("drift", "warm_up", "warm_up_growth", "lost_counts", "run_offset", "backlash", "scale", "force_offset")
SELDOM = (
    "windup",
    "reversal_spike",
    "hysteresis",
    "interpolation",
    "acceleration_lag",
    "load_friction",
    "refraction",
)
"""Effects that many plans can show, and few: drawn less and more often."""
MAPPED = (*IN_TIME, "inertia", "viscous")
"""Effects that must also differ from a smooth curve along the axis."""
USELESS = ("random_value", "constant_value", "counter_value", "copy_value", "temperature_office_degc")


@dataclass(slots=True, kw_only=True)
class Game:
    """A file and what was planted in it.

    Parameters
    ----------
    group, seed, index
        What sort of game, the seed, and its number among the games of the seed.
    planted
        Effects of the library, each visible.
    outside
        Physics outside the library; empty where there is none.
    text
        The file.
    detail
        Plan, noise and the ratio of each effect's RMS to that of the noise.
    """

    group: str
    seed: int
    index: int
    planted: tuple[str, ...]
    outside: str
    text: str
    detail: dict[str, Any]


# what is drawn


def game_of(seed: int, index: int) -> Game:
    """Return the game of a seed and a number: the same ones give the same bytes."""
    rng = np.random.default_rng([seed, index])
    group = ROUND[index % len(ROUND)]
    while True:
        found = _drawn(rng, group, seed, index)
        if found is not None:
            return found


def _plan(rng: Rng, group: str) -> Plan:
    if group.endswith("log"):
        return in_motion(rng, str(rng.choice(["log", "drive"])))
    if group == "null" and rng.random() < 0.3:
        return in_motion(rng, str(rng.choice(["log", "drive"])))
    if "log of" in group:
        return in_motion(rng, "drive" if "drive" in group else "log")
    if group == "known warm":
        return at_rest(rng, "warm")
    kinds = ("rest", "scan", "dense", "fine", "weather", "fly", "held", "warm")
    shares = [0.34, 0.14, 0.13, 0.08, 0.14, 0.07, 0.1, 0.0]
    if not group.startswith("known"):
        shares = [0.5, 0.15, 0.15, 0.0, 0.05, 0.05, 0.0, 0.1]
    return at_rest(rng, str(rng.choice(kinds, p=shares)))


def _drawn(rng: Rng, group: str, seed: int, index: int) -> Game | None:
    plan = _plan(rng, group)
    sigma = _sigma(rng, plan)
    sort = str(rng.choice(NOISES))
    unit = noise_of(rng, plan, sort)
    chance = [noise_of(rng, plan, sort) for _ in range(16)]
    planted: dict[str, Array] = {}
    outside = ""
    if group.startswith("known"):
        planted = _planted(rng, plan, chance, sigma)
    elif group.startswith("outside"):
        outside, column = _from_outside(rng, plan)
        if column is None:
            return None
        planted = {outside: column}
    if group != "null" and not planted:
        return None
    seen = sum(planted.values(), np.zeros(len(plan.x))) + unit
    if not plan.of_force and rng.random() < 0.6:
        seen = seen + rng.normal() * 20
    seen = seen * sigma
    if plan.twice:
        seen[1::2] = seen[: 2 * (len(seen) // 2) : 2]
    step = 0.0
    if sort == "rounded":
        step = sigma * rng.uniform(0.5, 1.5)
        seen = np.round(seen / step) * step
    wrong = 0
    if not plan.moving and rng.random() < 0.3:
        wrong = int(rng.uniform(0, 0.05) * len(seen))
        rows = rng.choice(len(seen), wrong, replace=False)
        seen[rows] += sigma * rng.uniform(6, 40, wrong) * rng.choice([-1.0, 1.0], wrong)
    return Game(
        group=group,
        seed=seed,
        index=index,
        planted=() if outside else tuple(sorted(planted)),
        outside=outside,
        text=_file(rng, plan, seen, step),
        detail={
            "plan": plan.kind,
            "rotary": plan.rotary,
            "rows": len(seen),
            "runs": int(plan.run[-1]),
            "noise": sort,
            "outliers": wrong,
            "ratio": {name: float(f"{np.std(column):.3g}") for name, column in planted.items()},
            "sigma": float(f"{sigma:.3g}"),
        },
    )


def _sigma(rng: Rng, plan: Plan) -> float:
    """Return the RMS of the noise: um, arcsec, N or A."""
    if plan.of_force:
        return between(rng, 0.003, 0.3)
    if plan.rotary:
        return between(rng, 0.05, 2)
    return 0.003 if plan.kind == "fine" else between(rng, 0.05, 2)


def _planted(rng: Rng, plan: Plan, chance: Sequence[Array], sigma: float) -> dict[str, Array]:
    """Return the contributions of one to four effects that can be seen and told apart, in noise RMS; or none."""
    library = OF_FORCE if plan.of_force else OF_POSITION
    facts, columns = dict(plan.facts), {}
    for name in sorted(
        library, key=lambda name: rng.random() * (1.8 if name in OFTEN else 0.5 if name in SELDOM else 1)
    ):
        plan.facts = dict(facts)
        column = library[name](rng, plan)
        if column is not None and (np.std(column) > 0 or name == "force_offset"):
            columns[name] = (column, dict(plan.facts))
    number = int(rng.integers(1, 5))
    chosen: list[str] = []
    for name in columns:
        if len(chosen) == number or any({name, other} in CLASHES for other in chosen):
            continue
        chosen += [one for one in (NEEDS.get(name), name) if one and one not in chosen]
    if len(chosen) != number:
        return {}
    plan.facts = {key: value for name in chosen for key, value in columns[name][1].items()} | facts
    return _sized(rng, plan, {name: columns[name][0] for name in chosen}, chance, sigma)


def _sized(
    rng: Rng, plan: Plan, columns: dict[str, Array], chance: Sequence[Array], sigma: float
) -> dict[str, Array]:
    found, sign, size = {}, rng.choice([-1.0, 1.0]), len(plan.x)
    factors, near = {}, rivals(plan)
    for name, column in columns.items():
        others = [one for one in columns if one != name]
        basis = np.stack([np.full(size, float(name != "force_offset")), *(columns[one] for one in others)], 1)
        basis = np.hstack([basis, *(shapes for rival, shapes in near.items() if rival.split(" ")[0] in others)])
        own = _less(column, basis)
        if np.linalg.norm(own) < 0.05 * np.linalg.norm(column - (column.mean() if name != "force_offset" else 0)):
            return {}
        error = _error(own, chance)
        unit = float(np.linalg.norm(own)) / math.sqrt(size)
        lowest = max(RATIO_SEEN, Z_SEEN * error / math.sqrt(size)) / unit
        most = min(RATIO_MOST / unit, np.inf if plan.rotary else CAPS.get(name, np.inf) / sigma)
        if lowest > most / 2:
            return {}
        factors[name] = factor = between(rng, lowest, most)
        for rival, shapes in near.items():
            kin = rival.split(" ")[0]
            if kin in columns or (kin.endswith("_map") and name not in MAPPED):
                continue
            if (name == "drift" and kin.startswith("warm_up")) or (kin == "windup" and name != "hysteresis"):
                continue
            apart = _less(column, np.hstack([basis, shapes]))
            if factor * np.linalg.norm(apart) < Z_APART * _error(apart, chance):
                return {}
        found[name] = column * factor
        if name in SAME_SIGN:
            found[name] *= sign
        elif name not in POSITIVE and name != "asymmetric_friction":
            found[name] *= rng.choice([-1.0, 1.0])
    if not plan.moving and factors.get("backlash", math.inf) < 0.3 * factors.get("windup", 0):
        return {}  # a wind-up with an overshoot
    slope = factors.get("viscous", math.inf)
    return {} if factors.get("asymmetric_friction", 0) > 0.9 * slope else found  # friction never drives


def _less(column: Array, basis: Array) -> Array:
    """Return what columns do not explain of another one."""
    scaled = basis / np.maximum(np.linalg.norm(basis, axis=0), 1e-300)
    unit = column / max(float(np.linalg.norm(column)), 1e-300)
    return (unit - scaled @ np.linalg.lstsq(scaled, unit, rcond=1e-9)[0]) * float(np.linalg.norm(column))


def _error(own: Array, chance: Sequence[Array]) -> float:
    """Return the standard deviation that noise gives to what follows a column, as the norm of it in noise RMS."""
    length = float(np.linalg.norm(own))
    return math.sqrt(np.mean([float(own @ one) ** 2 for one in chance])) / length if length else 1.0


def _from_outside(rng: Rng, plan: Plan) -> tuple[str, Array | None]:
    library = OUTSIDE_IN_MOTION if plan.moving else OUTSIDE_AT_REST
    name = str(rng.choice(sorted(library)))
    column = library[name](rng, plan)
    column = column - column.mean()
    along = any(word in name for word in BY_PLACE)
    if not plan.moving and (not plan.returns or (plan.places < 40 if along else plan.run[-1] < 3)):
        return name, None  # time would be a matter of place, or a map could hold it
    if (name in OF_DRIVES and not plan.of_force) or ("backlash" in name and np.ptp(plan.d) < 1):
        return name, None
    if name == "resonance at a feed" and plan.kind != "fly":
        return name, None
    if name == "heat squared" and not plan.heat:
        return name, None
    if len(plan.x) < 30 or np.std(column) < 1e-12 or np.count_nonzero(np.abs(column) > np.std(column) / 4) < 8:
        return name, None
    return name, column / np.std(column) * between(rng, 2, 30)


# the file


def _file(rng: Rng, plan: Plan, seen: Array, step: float) -> str:
    """Return the file in the format of a measurement."""
    columns = {}
    for name, values in plan.columns.items():
        per = {"_ms": 1e3, "_min": 1 / 60, "_h": 1 / 3600}
        scale = next((f for end, f in per.items() if name == f"time{end}"), 1.0)
        columns[name] = values * scale
    length = "deg" if plan.rotary else str(rng.choice(["mm", "mm", "m", "inch"]))
    large = {"mm": 1, "deg": 1, "m": 1000, "inch": 25.4}[length]
    counts = plan.span / between(rng, 4000, 400_000) if plan.moving else 0.0
    place = (np.round(plan.x / counts) * counts if counts else plan.x) / large
    if plan.of_force:
        kind = rng.choice(["torque_nm", "current_a"] if plan.rotary else ["force_n", "current_a"])
        columns[("actual_" if plan.moving or rng.random() < 0.5 else "target_") + length] = place
        columns[str(kind)] = seen
    elif plan.moving or rng.random() < 0.75 or step:
        columns["target_" + length] = place
        small = str(rng.choice(["um", "um", "nm", "mm"])) if not plan.rotary else "arcsec"
        columns[f"deviation_{small}"] = seen / {"um": 1, "nm": 1e-3, "mm": 1e3, "arcsec": 1}[small]
    else:
        columns["target_" + length] = place
        whole = plan.x + seen / (3600 if plan.rotary else 1000)
        columns["actual_" + length] = whole / large
    names = list(rng.permutation(sorted(columns)))
    return written(plan.facts, {name: columns[name] for name in names})


def written(facts: dict[str, str], columns: dict[str, Array]) -> str:
    """Return a file: facts, one line of headings, rows."""
    lines = [f"# {key}: {value}" for key, value in facts.items()]
    lines.append(",".join(columns))
    lines += [",".join(f"{value:.10g}" for value in row) for row in zip(*columns.values(), strict=True)]
    return "\n".join(lines) + "\n"


def with_useless(text: str, seed: int) -> str:
    """Return a file with five more columns that mean nothing."""
    rng = np.random.default_rng([seed, 5])
    lines = text.splitlines()
    head = sum(line.startswith("#") for line in lines)
    names, rows = lines[head].split(","), [line.split(",") for line in lines[head + 1 :]]
    place = [float(row[next(k for k, name in enumerate(names) if name[:6] in ("target", "actual"))]) for row in rows]
    size, spread = len(rows), float(np.ptp(place))
    office = 22 + np.cumsum(rng.normal(0, 0.4 / math.sqrt(size), size))
    more = (
        rng.normal(size=size),
        np.full(size, 7.5),
        np.arange(1, size + 1),
        np.asarray(place) + rng.normal(0, 0.01 * spread, size),
        np.round(office, 2),
    )
    lines[head] = ",".join((*names, *USELESS))
    for k, row in enumerate(rows):
        lines[head + 1 + k] = ",".join((*row, *(f"{column[k]:.8g}" for column in more)))
    return "\n".join(lines) + "\n"


# the answer and its judge


def answer_to(path: Path) -> dict[str, Any]:
    """Return the document of ``rtec diagnose --json`` for a file; a failure is the verdict ``ERROR``."""
    from rtec.dataset.load import load_dataset
    from rtec.inference.diagnose import diagnose
    from rtec.report.diagnosis import diagnosis_document

    try:
        found = diagnosis_document(diagnose(load_dataset(path)))
    except Exception as error:  # whatever fails is an answer that counts as wrong
        return {"verdict": "ERROR", "effects": [], "probability": {}, "steps": [], "error": repr(error)[:300]}
    kept = ("verdict", "effects", "probability", "approximate", "rms_before", "rms_after", "noise_floor", "unit")
    return {key: found[key] for key in kept} | {
        "steps": [{key: one[key] for key in ("effect", "rms_train")} for one in found["steps"]],
        "tied": {one["effect"]: one["tied_with"] for one in found["candidates"] if one["tied_with"]},
    }


def alike(names: Iterable[str]) -> set[str]:
    """Return names as they count: waves of one period are one, an offset is none."""
    return {"wave" if name in WAVES else name for name in names} - {"offset"}


def judged(planted: Sequence[str], outside: str, answer: dict[str, Any]) -> dict[str, Any]:
    """Judge an answer.

    Returns
    -------
    dict
        ``right``; ``wrong``: names that were told and not planted; ``missed``: planted and not accepted; ``rises``:
        accepted steps that raise the RMS of the training data by more than 1 %.
    """
    truth, accepted, told = alike(planted), alike(answer["effects"]), answer["verdict"] in TOLD
    if {"force_map", "gravity", "asymmetric_friction"} & truth:
        accepted, truth = accepted - {"force_offset"}, truth - {"force_offset"}  # their means are one
    wrong, missed = accepted - truth, truth - accepted
    if answer["verdict"] == "TIED":
        ties = [alike((one, *others)) for one, others in answer.get("tied", {}).items()]
        for one in sorted(missed):
            partner = next((w for w in sorted(wrong) if any({one, w} <= tie for tie in ties)), None)
            if partner is not None:
                wrong, missed = wrong - {partner}, missed - {one}
    before = [answer.get("rms_before")] + [one["rms_train"] for one in answer["steps"]]
    rises = sum(new > RISE * old for old, new in pairwise(before) if old and new)
    if answer["verdict"] == "ERROR":
        right = False
    elif truth and not outside:
        right = not wrong and not missed
    else:
        right = not (told and accepted)
    return {
        "right": right and not rises,
        "wrong": sorted(wrong) if told or (truth and not outside) else [],
        "missed": sorted(missed),
        "rises": rises,
    }


def played(game: Game, folder: Path, *, useless: bool = False) -> dict[str, Any]:
    """Write a game into a folder, let rtec answer, and return the record of it."""
    name = f"{game.index:05d}" + "-useless" * useless
    path = folder / f"{name}.csv"
    path.write_text(with_useless(game.text, game.index) if useless else game.text, encoding="utf-8")
    answer = answer_to(path)
    record = {
        "seed": game.seed,
        "index": game.index,
        "useless": useless,
        "group": game.group,
        "planted": list(game.planted),
        "outside": game.outside,
        "detail": game.detail,
        "answer": answer,
    }
    (folder / f"{name}.json").write_text(json.dumps(record, indent=1), encoding="utf-8")
    return record


# the page


def wilson(count: int, of: int) -> tuple[float, float]:
    """Return the 95 % interval of a share (Wilson 1927)."""
    if not of:
        return 0.0, 1.0
    z = 1.959964
    share, more = count / of, z * z / of
    half = z * math.sqrt(share * (1 - share) / of + more / (4 * of))
    return max(0.0, (share + more / 2 - half) / (1 + more)), (share + more / 2 + half) / (1 + more)


def share(count: int, of: int) -> str:
    """Return a count with its share and Wilson's interval."""
    if not of:
        return "-"
    low, high = wilson(count, of)
    return f"{count} ({count / of:.0%}; {low:.0%} to {high:.0%})"


def counts(record: dict[str, Any]) -> bool:
    """Whether a game has one answer only.

    Runs a day apart make an offset of a run of every course in time; reversals at two places make a map of a wind-up
    or a spike, where a pitch map acts as well.
    """
    plan, planted = record["detail"]["plan"], set(record["planted"])
    if record["outside"] and plan == "weather":
        return False
    return plan == "log" or not (planted & {"windup", "reversal_spike"} and "pitch_map" in planted)


def line_of(record: dict[str, Any]) -> str:
    """Return the line of the table in which a record counts."""
    if record["group"] == "known at rest":
        return f"known at rest, {len(record['planted'])} effect" + "s" * (len(record["planted"]) > 1)
    return str(record["group"])


def rows(records: Sequence[dict[str, Any]]) -> list[tuple[object, ...]]:
    """Return a row a group: games, right, with a wrong name, UNKNOWN."""
    groups = defaultdict(list)
    for one in records:
        if not one["useless"]:
            groups[line_of(one)].append(one)
    found = []
    for name in sorted(groups):
        games = groups[name]
        results = [judged(one["planted"], one["outside"], one["answer"]) for one in games]
        unknown = sum(one["answer"]["verdict"] == "UNKNOWN" for one in games)
        found.append(
            (
                name,
                len(games),
                share(sum(one["right"] for one in results), len(games)),
                share(sum(bool(one["wrong"]) for one in results), len(games)),
                f"{unknown / len(games):.0%}",
            )
        )
    return found


def useless_row(records: Sequence[dict[str, Any]]) -> str:
    """Return how often the names are the same with useless columns."""
    plain = {one["index"]: one for one in records if not one["useless"]}
    pairs = [(plain[one["index"]], one) for one in records if one["useless"] and one["index"] in plain]
    same = sum(set(a["answer"]["effects"]) == set(b["answer"]["effects"]) for a, b in pairs)
    return f"{share(same, len(pairs))} of {len(pairs)}"


def calibration(records: Sequence[dict[str, Any]]) -> list[tuple[object, ...]]:
    """Return how many accepted effects of each printed probability were planted."""
    found: dict[int, list[bool]] = defaultdict(list)
    for one in records:
        if one["useless"]:
            continue
        truth = alike(one["planted"])
        for name, probability in one["answer"]["probability"].items():
            if name in one["answer"]["effects"] and name not in ("offset", "force_offset"):
                bin_ = max(k for k in range(len(BINS) - 1) if probability >= BINS[k])
                found[bin_].append(bool(alike([name]) & truth))
    return [
        (f"{BINS[k]:g} to {BINS[k + 1]:g}", len(hits), share(sum(hits), len(hits)))
        for k, hits in sorted(found.items())
    ]


def mistakes(records: Sequence[dict[str, Any]], most: int = 20) -> list[tuple[object, ...]]:
    """Return what was answered wrong most often: what was there, what was said instead, how often, and one game."""
    kinds: dict[tuple[str, str], list[dict[str, Any]]] = defaultdict(list)
    for one in records:
        result = judged(one["planted"], one["outside"], one["answer"])
        if one["useless"] or result["right"]:
            continue
        for name in result["missed"]:
            kinds[name, "missed"].append(one)
        for name in result["wrong"]:
            kinds[one["outside"] or ("known effects" if one["planted"] else "noise"), f"named {name}"].append(one)
        if result["rises"]:
            kinds["any", "a step raises the RMS"].append(one)
    listed = sorted(kinds.items(), key=lambda item: (-len(item[1]), item[0]))[:most]
    return [
        (
            there,
            said,
            len(games),
            ", ".join(
                f"{verdict} {count}" for verdict, count in Counter(one["answer"]["verdict"] for one in games).items()
            ),
            ", ".join(str(one["index"]) for one in games[:3]),
        )
        for (there, said), games in listed
    ]


def page(records: Sequence[dict[str, Any]], games: int, seed: int) -> str:
    """Return the page in Markdown."""
    from rtec.report.rendering import markdown_page

    left_out = sum(not counts(one) for one in records if not one["useless"])
    records = [one for one in records if counts(one)]
    plain = [one for one in records if not one["useless"]]
    return markdown_page(
        TEMPLATE,
        games=games,
        seed=seed,
        left_out=left_out,
        rows=rows(records),
        rises=sum(bool(judged(one["planted"], one["outside"], one["answer"])["rises"]) for one in plain),
        useless=useless_row(records),
        calibration=calibration(records),
        mistakes=mistakes(records),
        z=f"{Z_SEEN:g}",
        ratio=f"{RATIO_SEEN:g}",
        most=f"{RATIO_MOST:g}",
        apart=f"{Z_APART:g}",
        at_rest=", ".join(OUTSIDE_AT_REST),
        in_motion=", ".join(OUTSIDE_IN_MOTION),
        verdicts=", ".join(
            f"{name} {count}" for name, count in sorted(Counter(one["answer"]["verdict"] for one in plain).items())
        ),
    )


def main() -> int:
    """Play, and write the page."""
    parser = argparse.ArgumentParser(description="Play games that share no code with rtec.")
    parser.add_argument("--games", type=int, default=120, help="how many numbers, from 0")
    parser.add_argument("--seed", type=int, default=0, help="of all games")
    parser.add_argument("--only", help="groups whose name holds this")
    parser.add_argument("--keep", type=Path, help="folder for the files, their truth and the answers")
    parser.add_argument("--resume", type=Path, help="file of answers: those in it are not asked again")
    parser.add_argument("-o", "--output", type=Path, help="file to write the page to, instead of stdout")
    given = parser.parse_args()
    records = []
    if given.resume and given.resume.exists():
        kept = map(json.loads, given.resume.read_text(encoding="utf-8").splitlines())
        records = [one for one in kept if one["seed"] == given.seed and one["index"] < given.games]
    done = {(one["index"], one["useless"]) for one in records}
    with TemporaryDirectory() as temporary:
        folder = given.keep or Path(temporary)
        folder.mkdir(parents=True, exist_ok=True)
        for index in range(given.games):
            group = ROUND[index % len(ROUND)]
            if given.only and given.only not in group:
                continue
            for useless in (False, True) if group.startswith("known") and index % 5 == 0 else (False,):
                if (index, useless) in done:
                    continue
                records.append(played(game_of(given.seed, index), folder, useless=useless))
                if given.resume:
                    with given.resume.open("a", encoding="utf-8") as file:
                        file.write(json.dumps(records[-1]) + "\n")
            sys.stderr.write(f"\r{index + 1} of {given.games}")
    text = page(records, given.games, given.seed)
    if given.output is None:
        sys.stdout.write(text)
    else:
        given.output.write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    sys.exit(main())
