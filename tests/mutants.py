"""Print docs/mutants.md: what each mutant of the four designs does wrong, and how `rtec check` finds it.

python -m tests.mutants > docs/mutants.md
"""

from __future__ import annotations

import inspect
import statistics
import sys
from dataclasses import dataclass
from pathlib import Path

import rtec.examples.designs as right_ones
from rtec.conformance.contract import Contract
from rtec.conformance.hunt import Hunted, hunt
from rtec.conformance.python_class import PythonClass
from rtec.conformance.suite import TRIES, check_algorithm
from rtec.conformance.trials import Trials
from rtec.examples import mutants
from rtec.injector import Design

SEEDS = range(5)
FILE = Path(mutants.__file__)
HEAD = """# Twenty mutants

Written by `python -m tests.mutants > docs/mutants.md`. Each mutant is one of the four designs with one fault as an
engineer makes it. All stand in `rtec/examples/mutants.py`, the right ones in `rtec/examples/designs.py`; those pass.

    rtec check rtec/examples/mutants.py:CRawPins --design c

"Found by" names the checks that fail. "Runs" is how many streams the hunt alone, without any of these checks, has
played when it meets the first that breaks the contract, for the seeds 0 to 4; {tries} are allowed, 16 are played at
a time. "At random" is the same hunt with all streams drawn, none guided by the smallest margin. "Shortest" is
the stream of the five hunts with the fewest events, after all that can be cut from it is cut; `--stream` plays it.
"""


@dataclass(frozen=True, slots=True)
class Row:
    """What was seen of a mutant."""

    name: str
    wrong: str
    checks: list[str]
    guided: list[int | None]
    at_random: list[int | None]
    shortest: str
    reason: str


def designs() -> dict[str, Design]:
    """Return the design of each mutant by its name."""
    found = {}
    for name, kind in vars(mutants).items():
        if isinstance(kind, type) and kind.__module__ == mutants.__name__:
            base = next(b for b in kind.__mro__ if b.__module__ == right_ones.__name__)
            found[name] = Design.named(base.__name__.lower())
    return found


def hunted(algorithm: PythonClass, contract: Contract, seed: int, at_random: float, cuts: int = 0) -> Hunted:
    """Hunt alone, the time to settle measured as the suite does."""
    trials = Trials(algorithm, contract)
    trials.measure_settling()
    return hunt(trials, tries=TRIES, seed=seed, at_random=at_random, cuts=cuts)


def seen(name: str, design: Design) -> Row:
    """Hold a mutant to the contract and hunt it."""
    contract = Contract.of(design)
    with PythonClass(FILE, name) as algorithm:
        checks = [check.name for check in check_algorithm(algorithm, contract).checks if check.passed is False]
        guided = [hunted(algorithm, contract, seed, 0.1, cuts=2000) for seed in SEEDS]
        at_random = [hunted(algorithm, contract, seed, 1.0) for seed in SEEDS]
    found = [one.worst for one in guided if one.worst is not None]
    shortest = min(found, key=lambda run: (len(run.case.stream), len(str(run.case.stream))), default=None)
    return Row(
        name=name,
        wrong=(inspect.getdoc(getattr(mutants, name)) or "").splitlines()[0],
        checks=checks,
        guided=[one.made if one.worst else None for one in guided],
        at_random=[one.made if one.worst else None for one in at_random],
        shortest="" if shortest is None else str(shortest.case.stream),
        reason="" if shortest is None else str(shortest.judgement.violation),
    )


def said(made: list[int | None]) -> str:
    """Return numbers of runs in a cell."""
    return ", ".join("none" if one is None else str(one) for one in made)


def average(rows: list[list[int | None]]) -> str:
    """Return median and mean over all hunts, those that found nothing with all their runs."""
    made = [TRIES if one is None else one for row in rows for one in row]
    missed = sum(one is None for row in rows for one in row)
    return f"median {statistics.median(made):g}, mean {statistics.mean(made):.0f} runs, {missed} of {len(made)} miss"


def page(rows: list[Row]) -> str:
    """Return the page."""
    lines = [HEAD.format(tries=TRIES), "| mutant | what is wrong | found by |", "|---|---|---|"]
    lines += [f"| `{row.name}` | {row.wrong} | {', '.join(row.checks)} |" for row in rows]
    lines += [
        "",
        "## The hunt alone",
        "",
        "| mutant | runs | at random | events | shortest |",
        "|---|---|---|---|---|",
    ]
    for row in rows:
        events = len(row.shortest.split()) - 2
        lines.append(f"| `{row.name}` | {said(row.guided)} | {said(row.at_random)} | {events} | `{row.shortest}` |")
    guided, at_random = average([row.guided for row in rows]), average([row.at_random for row in rows])
    lines += [
        "",
        f"Over all hunts, guided: {guided}. At random: {at_random}.",
        "",
        "## What the shortest streams show",
        "",
    ]
    lines += [f"- `{row.name}`: {row.reason}." for row in rows]
    return "\n".join(lines)


def main() -> None:
    """Print the page."""
    rows = []
    for name, design in designs().items():
        sys.stderr.write(f"{name}\n")
        rows.append(seen(name, design))
    sys.stdout.write(page(rows) + "\n")


if __name__ == "__main__":
    main()
