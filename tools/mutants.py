"""Print docs/mutants.md: what each mutant of the four designs does wrong, and how `rtec check` finds it.

python -m tools.mutants > docs/mutants.md
"""

from __future__ import annotations

import inspect
import statistics
import sys
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

import rtec.examples.designs as right_ones
from rtec.examples import late_mutants, mutants
from rtec.injector import Design
from rtec.report.rendering import markdown_page
from rtec.verify.contract.contract import Contract
from rtec.verify.contract.hunt import hunt
from rtec.verify.contract.python_class import PythonClass
from rtec.verify.contract.suite import TRIES, check_algorithm
from rtec.verify.contract.trials import Run, Trials
from tools import code_mutants, firmware_mutants
from tools.code_mutants import CodeMutant

SEEDS = range(5)
FILE = Path(mutants.__file__)
CODE_KINDS = "commands", "tests", "another outcome", "equivalent", "blind"
FIRMWARE_KINDS = "start", "box", "insertions", "equivalent", "within the contract", "blind spot"
BOX_CHECKS = "window", "disbelief", "large correction", "switch", "probing", "position", "words", "reset"
TEMPLATE = Path(__file__).with_name("mutants.md.j2")


@dataclass(frozen=True, slots=True)
class Row:
    """What was seen of a mutant."""

    name: str
    made: list[int | None]
    shortest: str


def designs_of(module: ModuleType) -> dict[str, Design]:
    """Return the design of each mutant in a module by its name."""
    found = {}
    for name, kind in vars(module).items():
        if isinstance(kind, type) and kind.__module__ == module.__name__ and not name.startswith("_"):
            base = next(b for b in kind.__mro__ if b.__module__ == right_ones.__name__)
            found[name] = Design.named(base.__name__.lower())
    return found


def hunted(algorithm: PythonClass, contract: Contract, seed: int) -> tuple[Run | None, int]:
    """Hunt alone, the time to settle measured as the suite does."""
    trials = Trials(algorithm, contract)
    trials.measure_settling()
    return hunt(trials, tries=TRIES, seed=seed)


def checked(module: ModuleType, name: str, design: Design) -> tuple[str, str, str]:
    """Hold a mutant to the contract; return a row of the page: its name, what is wrong, and which checks find it."""
    wrong = (inspect.getdoc(getattr(module, name)) or "").splitlines()[0]
    with PythonClass(Path(str(module.__file__)), name) as algorithm:
        verdict = check_algorithm(algorithm, Contract.of(design))
    return f"`{name}`", wrong, ", ".join(check.name for check in verdict.checks if check.passed is False)


def seen(name: str, design: Design) -> Row:
    """Hunt a mutant."""
    contract = Contract.of(design)
    with PythonClass(FILE, name) as algorithm:
        hunts = [hunted(algorithm, contract, seed) for seed in SEEDS]
    found = [worst for worst, _ in hunts if worst is not None]
    shortest = min(found, key=lambda run: (len(run.case.stream), len(str(run.case.stream))), default=None)
    return Row(
        name=name,
        made=[made if worst else None for worst, made in hunts],
        shortest="" if shortest is None else str(shortest.case.stream),
    )


def said(made: list[int | None]) -> str:
    """Return numbers of runs in a cell."""
    return ", ".join("none" if one is None else str(one) for one in made)


def average(rows: list[list[int | None]]) -> str:
    """Return median and mean over all hunts, those that found nothing with all their runs."""
    made = [TRIES if one is None else one for row in rows for one in row]
    missed = sum(one is None for row in rows for one in row)
    return f"median {statistics.median(made):g}, mean {statistics.mean(made):.0f} runs, {missed} of {len(made)} miss"


def code_cells(found: dict[int, str]) -> dict[str, object]:
    """Return what the page says of decoder, windows and PC; ``found``: what found each mutant, by its number."""
    table = code_mutants.table()
    counts, places = [], []
    for place in dict.fromkeys(mutant.place for mutant in table):
        own = [mutant for mutant in table if mutant.place == place]
        kinds = Counter(_kind(mutant, found[mutant.number]) for mutant in own)
        counts.append((place, len(own), *(kinds[kind] for kind in CODE_KINDS)))
        rows = [(f"`{one.function}`", one.wrong, _finder(one, found[one.number])) for one in own]
        places.append((place, rows))
    return {"code_counts": counts, "code": places}


def _kind(mutant: CodeMutant, finder: str) -> str:
    if finder:
        return next((kind for kind in ("tests", "another outcome") if finder.startswith(kind)), "commands")
    return "equivalent" if mutant.equivalent else "blind"


def _finder(mutant: CodeMutant, finder: str) -> str:
    if finder:
        return finder
    said = mutant.equivalent or mutant.blind
    if not said:
        raise ValueError(f"nothing finds {mutant.function}: {mutant.wrong} Say in code_mutants.toml why")
    return f"{'equivalent' if mutant.equivalent else '**blind spot**'}: {said}"


def firmware_cells(found: dict[str, str]) -> dict[str, object]:
    """Return what the page says of the firmware; ``found``: what found each mutant, by its name."""
    mutants, notes = firmware_mutants.drawn(), firmware_mutants.notes()
    counts = []
    for rule in dict.fromkeys(mutant.rule for mutant in mutants):
        own = [mutant for mutant in mutants if mutant.rule == rule]
        kinds = Counter(_firmware_kind(found[one.name]) or notes[one.name][0] for one in own)
        counts.append((rule, len(own), *(kinds[kind] for kind in FIRMWARE_KINDS)))
    survivors = [mutant.name for mutant in mutants if not found[mutant.name]]
    return {
        "all_firmware": sum(len(firmware_mutants.all_mutants(design)) for design in Design),
        "firmware": mutants,
        "firmware_counts": [*counts, ("all", *(sum(column) for column in list(zip(*counts, strict=True))[1:]))],
        "survivors": [(f"`{name}`", *notes[name]) for name in survivors],
    }


def _firmware_kind(finder: str) -> str:
    if finder in ("starts", "answers", "home"):
        return "start"
    return "box" if finder in BOX_CHECKS else "insertions" if finder else ""


def page(
    rows: list[Row],
    checks: list[tuple[str, str, str]],
    late: list[tuple[str, str, str]],
    found: dict[int, str],
    found_in_firmware: dict[str, str],
) -> str:
    """Return the page."""
    return markdown_page(
        TEMPLATE,
        **code_cells(found),
        **firmware_cells(found_in_firmware),
        tries=TRIES,
        checks=checks,
        late=late,
        hunts=[
            (
                f"`{row.name}`",
                said(row.made),
                len(row.shortest.split()) - 2,
                f"`{row.shortest}`",
            )
            for row in rows
        ],
        average=average([row.made for row in rows]),
    )


def main() -> None:
    """Print the page."""
    rows = [seen(name, design) for name, design in designs_of(mutants).items()]
    checks, late = (
        [checked(module, name, design) for name, design in designs_of(module).items()]
        for module in (mutants, late_mutants)
    )
    found = {mutant.number: finder for mutant, finder in code_mutants.played(["decoder", "windows", "PC"])}
    in_firmware = {mutant.name: firmware_mutants.found_by(mutant) for mutant in firmware_mutants.drawn()}
    sys.stdout.write(page(rows, checks, late, found, in_firmware))


if __name__ == "__main__":
    main()
