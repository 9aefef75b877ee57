"""Diagnose real measurements as a user would, and print docs/real-data.md: steps, held-out error, preprocessing.

Example::

    python -m tools.real_data -o docs/real-data.md
    python -m tools.real_data --only stage_x --only worm_drive

The measurements are not part of the project; they are looked for in ``../shared/data`` beside it (``--data`` names
another folder). Those that are not there are left out. The lathe's curve is the project's own.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.diagnosis_job import lathe_calibration
from rtec.dataset.dataset import Dataset
from rtec.dataset.load import load_dataset
from rtec.effects import Floats
from rtec.inference.compare import compare
from rtec.inference.diagnose import diagnose
from rtec.inference.fit import residual_of, values_of
from rtec.inference.model import Model
from rtec.inference.model_file import read_model
from rtec.inference.results import Diagnosis, Value
from rtec.metrology import write_measurement
from rtec.readable import quantity_text
from rtec.report.rendering import markdown_page

DATA = Path(__file__).resolve().parents[2] / "shared" / "data"
LATHE_NOISE_UM = 1.0
LATHE_RUNS = 4
_SHOWN = 4
EMPS_START = 'observe = "force"\n[[effect]]\nname = "inertia"\n[[effect]]\nname = "viscous"\n'
EMPS_FOUR = EMPS_START + '[[effect]]\nname = "coulomb"\n[[effect]]\nname = "force_offset"\n'


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """One measurement and what it is judged on.

    Parameters
    ----------
    name
        Of the row.
    needs
        Files of the data folder without which there is no row.
    bar
        Largest held-out RMS, in the unit shown, to as many digits as it has; None where it is only recorded.
    prepare
        Writes what is needed into a folder, from the data folder; returns measurement, held-out file and model file.
    observe
        What is explained; None for what the file suggests.
    search
        False: the model of the file is fitted and judged, nothing is searched for.
    command
        What a user types.
    """

    name: str
    needs: tuple[str, ...]
    bar: str | None
    prepare: Callable[[Path, Path], tuple[Path, Path | None, Path | None]]
    command: str
    observe: str | None = None
    search: bool = True


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """What came out of a case; errors in ``unit``."""

    case: Case
    unit: str
    before: float
    """Held-out RMS of the model that the search starts from."""
    steps: tuple[tuple[str, float, float], ...]
    """Effect, RMS in training and held out after it."""
    heldout: float
    heldout_by: str
    floor: float | None
    verdict: str
    found: tuple[tuple[str, tuple[Value, ...]], ...]
    """The effects of the final model with their numbers."""
    notes: tuple[str, ...]

    @property
    def met(self) -> bool | None:
        """Whether the bar is met; None without one."""
        if self.case.bar is None:
            return None
        digits = len(self.case.bar.partition(".")[2])
        return round(self.heldout, digits) <= float(self.case.bar)


def _lathe(_: Path, work: Path) -> tuple[Path, Path | None, Path | None]:
    data, curve = work / "lathe.csv", work / "curve.csv"
    write_measurement(data, lathe_calibration(LATHE_RUNS, LATHE_NOISE_UM))
    write_measurement(curve, lathe_calibration(1, 0.0))
    return data, curve, None


def _files(
    data: str, heldout: str | None = None, model: str | None = None
) -> Callable[[Path, Path], tuple[Path, Path | None, Path | None]]:
    def prepare(folder: Path, work: Path) -> tuple[Path, Path | None, Path | None]:
        start = None
        if model is not None:
            start = work / "start.toml"
            start.write_text(model)
        return folder / data, None if heldout is None else folder / heldout, start

    return prepare


def _runs_apart(name: str) -> Callable[[Path, Path], tuple[Path, Path | None, Path | None]]:
    """Return what writes runs 1 to 3 of a stage and runs 4 and 5 into a file each."""

    def prepare(folder: Path, work: Path) -> tuple[Path, Path | None, Path | None]:
        lines = (folder / f"{name}.csv").read_text().splitlines()
        first, last = work / f"{name}_1-3.csv", work / f"{name}_4-5.csv"
        for file, left_out in ((first, "45"), (last, "123")):
            file.write_text("".join(f"{line}\n" for line in lines if line[:1] not in left_out))
        return first, last, None

    return prepare


def _stages() -> Iterator[Case]:
    for name, bar in (("stage_x", "4.3"), ("stage_y", "4.9"), ("stage_z", "1.1")):
        yield Case(
            name=f"{name}, runs 1-3, judged on runs 4-5",
            needs=(f"{name}.csv",),
            bar=bar,
            prepare=_runs_apart(name),
            command=f"rtec diagnose {name}_1-3.csv --heldout {name}_4-5.csv",
        )
        yield Case(
            name=f"{name}, all runs",
            needs=(f"{name}.csv",),
            bar=None,
            prepare=_files(f"{name}.csv"),
            command=f"rtec diagnose {name}.csv",
        )


CASES = (
    Case(
        name="lathe, judged on the noise-free curve",
        needs=(),
        bar="1.7",
        prepare=_lathe,
        command="rtec diagnose lathe.csv --heldout curve.csv",
    ),
    Case(
        name="emps_train, judged on emps_pulses",
        needs=("emps_train.csv", "emps_pulses.csv"),
        bar="3.11",
        prepare=_files("emps_train.csv", "emps_pulses.csv", EMPS_START),
        observe="force",
        command="rtec diagnose emps_train.csv --observe force --model start.toml --heldout emps_pulses.csv",
    ),
    Case(
        name="emps_train, with coulomb and force_offset only",
        needs=("emps_train.csv", "emps_pulses.csv"),
        bar="3.47",
        prepare=_files("emps_train.csv", "emps_pulses.csv", EMPS_FOUR),
        observe="force",
        search=False,
        command="rtec compare emps_train.csv --observe force --model four.toml --heldout emps_pulses.csv",
    ),
    Case(
        name="worm_drive",
        needs=("worm_drive.csv",),
        bar="0.66",
        prepare=_files("worm_drive.csv"),
        command="rtec diagnose worm_drive.csv",
    ),
    Case(
        name="motor_run_slow2_nocomp_0, judged on the next run",
        needs=("motor_run_slow2_nocomp_0.csv", "motor_run_slow2_nocomp_1.csv"),
        bar="0.126",
        prepare=_files("motor_run_slow2_nocomp_0.csv", "motor_run_slow2_nocomp_1.csv"),
        observe="current",
        command=(
            "rtec diagnose motor_run_slow2_nocomp_0.csv --observe current --heldout motor_run_slow2_nocomp_1.csv"
        ),
    ),
    Case(
        name="motor_hold_b_16, judged on motor_hold_d_16",
        needs=("motor_hold_b_16.csv", "motor_hold_d_16.csv"),
        bar="0.135",
        prepare=_files("motor_hold_b_16.csv", "motor_hold_d_16.csv"),
        observe="current",
        command="rtec diagnose motor_hold_b_16.csv --observe current --heldout motor_hold_d_16.csv",
    ),
    *_stages(),
)


def available(case: Case, folder: Path) -> bool:
    """Return whether the files of a case are there."""
    return all((folder / name).exists() for name in case.needs)


def diagnosed(case: Case, folder: Path) -> Row:
    """Return what comes out of a case."""
    with tempfile.TemporaryDirectory() as name:
        data, other, start = case.prepare(folder, Path(name))
        folders = {f"{data.parent}/", *(() if other is None else (f"{other.parent}/",))}
        dataset = load_dataset(data, observe=case.observe)
        heldout = None if other is None else load_dataset(other, like=dataset)
        model = None if start is None else read_model(start, dataset.units)
    if not case.search:
        return _compared(case, dataset, model, heldout, folders)
    found = diagnose(dataset, model, heldout)
    unit, factor = dataset.units.shown
    judged = dataset if heldout is None else heldout
    return Row(
        case=case,
        unit=unit,
        before=factor * _rms(residual_of(judged, found.start)),
        steps=tuple((step.effect, factor * step.rms_train, factor * step.rms_heldout) for step in found.steps),
        heldout=factor * found.rms_heldout,
        heldout_by=_judged_on(found),
        floor=None if found.noise.floor is None else factor * found.noise.floor,
        verdict=_verdict(found),
        found=_numbers(found.model),
        notes=_notes(dataset, heldout, folders),
    )


def _compared(case: Case, dataset: Dataset, model: Model | None, heldout: Dataset | None, folders: set[str]) -> Row:
    found = compare(dataset, model, heldout)
    unit, factor = dataset.units.shown
    names = " + ".join(term.name for term in found.model.terms)
    judged = dataset if heldout is None else heldout
    return Row(
        case=case,
        unit=unit,
        before=factor * _rms(judged.observed),
        steps=((names, factor * found.rms, factor * found.rms_heldout),),
        heldout=factor * found.rms_heldout,
        heldout_by="the other file",
        floor=None,
        verdict="",
        found=_numbers(found.model),
        notes=_notes(dataset, heldout, folders),
    )


def _numbers(model: Model) -> tuple[tuple[str, tuple[Value, ...]], ...]:
    return tuple((term.name, values_of(term, model)) for term in model.terms)


def _judged_on(found: Diagnosis) -> str:
    if found.heldout is not None:
        return "the other file"
    return f"{found.heldout_by} by {found.heldout_by}"


def _verdict(found: Diagnosis) -> str:
    tied = [f"{c.effect} with {', '.join(c.tied_with)}" for c in found.candidates if c.accepted and c.tied_with]
    return found.verdict.value + (f" ({'; '.join(tied)})" if tied else "")


def _notes(dataset: Dataset, heldout: Dataset | None, folders: set[str]) -> tuple[str, ...]:
    """Return what was done to the files, without the folders that they happened to be in."""
    notes = dict.fromkeys(dataset.notes)
    own = [note for note in (() if heldout is None else heldout.notes) if note not in notes]
    texts = [*notes, *(f"held-out file: {note}" for note in own)]
    for folder in folders:
        texts = [text.replace(folder, "") for text in texts]
    return tuple(texts)


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(values**2)))


TEMPLATE = Path(__file__).with_name("real_data.md.j2")


def page(rows: list[Row]) -> str:
    """Return the page as Markdown."""
    notes: dict[str, dict[str, None]] = {}
    for row in rows:
        for note in row.notes:
            of_file = notes.setdefault(note, {})
            of_file[row.case.command.split()[2].removesuffix(".csv")] = None
    return markdown_page(
        TEMPLATE,
        noise=LATHE_NOISE_UM,
        summary=[_summary(row) for row in rows],
        cases=[_section(row) for row in rows],
        notes=[(note, ", ".join(files)) for note, files in notes.items()],
    )


def _number(value: float) -> str:
    return f"{value:.3g}"


def _summary(row: Row) -> tuple[str, ...]:
    bar = "" if row.case.bar is None else f"≤ {row.case.bar}"
    met = {None: "recorded", True: "met", False: "missed"}[row.met]
    effects = ", ".join(effect for effect, _, _ in row.steps) or "none"
    return (
        row.case.name,
        f"{_number(row.before)} {row.unit}",
        f"{_number(row.heldout)} {row.unit}",
        bar,
        met,
        row.heldout_by,
        row.verdict,
        effects,
    )


def _values(values: tuple[Value, ...]) -> str:
    """Return the first numbers of an effect."""
    texts = []
    for value in values[:_SHOWN]:
        is_text = isinstance(value.value, str)
        text = value.value if is_text else quantity_text(float(value.value), value.unit, value.error)
        texts.append(f"{value.name} {text}")
    return ", ".join(texts) + (" ..." if len(values) > _SHOWN else "")


def _section(row: Row) -> dict[str, object]:
    """Return title, command and steps of a row, each step with the numbers of its effect."""
    left = list(row.found)

    def found(step: str) -> str:
        texts = []
        for name in step.split(" + "):
            term = next((term for term in left if term[0] == name), None)
            if term is not None:
                left.remove(term)
                texts.append(_values(term[1]))
        return "; ".join(texts)

    steps = [(step, _number(train), _number(held), found(step)) for step, train, held in row.steps]
    given = "; ".join(_values(values) for _, values in left)
    floor = "" if row.floor is None else f", noise floor from repeats {_number(row.floor)} {row.unit}"
    return {
        "title": row.case.name[:1].upper() + row.case.name[1:],
        "command": row.case.command,
        "floor": floor,
        "unit": row.unit,
        "steps": [("start", "", _number(row.before), given), *steps],
    }


def main() -> int:
    """Diagnose what is there, and write the page; the exit code is 1 where a bar is missed."""
    parser = argparse.ArgumentParser(description="Regenerate docs/real-data.md.")
    parser.add_argument("--data", type=Path, default=DATA, help="folder of the measurements")
    parser.add_argument("--only", action="append", help="rows whose name begins so; may be given several times")
    parser.add_argument("-o", "--output", type=Path, help="file to write the page to, instead of stdout")
    given = parser.parse_args()
    rows = []
    for case in CASES:
        if given.only is not None and not case.name.startswith(tuple(given.only)):
            continue
        if not available(case, given.data):
            sys.stderr.write(f"left out, no data: {case.name}\n")
            continue
        row = diagnosed(case, given.data)
        sys.stderr.write(f"{_number(row.heldout):>8} {row.unit:6} {row.verdict:12} {case.name}\n")
        rows.append(row)
    if given.output is None:
        sys.stdout.write(page(rows))
    else:
        given.output.write_text(page(rows))
    return 0 if all(row.met is not False for row in rows) else 1


if __name__ == "__main__":
    sys.exit(main())
