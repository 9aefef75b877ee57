"""What compare, diagnose and add share: their options, and the measurement, model and held-out file behind them."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from rtec.cli._compare_motion import is_motion_model
from rtec.cli._groups import OptionGroup
from rtec.cli._parameters import apart, flag, option, whole
from rtec.errors import ArgumentError
from rtec.units import NUMBER

if TYPE_CHECKING:
    from rtec.dataset.dataset import Dataset
    from rtec.effects import Library
    from rtec.inference.model import Model
    from rtec.metrology import ColumnChoices

_AXIS = "Facts of the axis, where the file does not state them"
_COUNTS = re.compile(rf"{NUMBER}\s*(?:counts?(?:/rev)?)?", re.ASCII)


def _counts_per_rev(said: str) -> str:
    if _COUNTS.fullmatch(said.strip()) is None:
        raise ArgumentError("--counts-per-rev", repr(said[:60]), "a number above 0, such as 8192")
    return said


DATA = typer.Argument(..., help="Measurement: CSV or other text, .xlsx, file of a laser system.", show_default=False)
DATA_FILES = typer.Argument(
    ...,
    metavar="DATA...",
    help="Measurement: CSV or other text, .xlsx, file of a laser system. Several are held against the first.",
    show_default=False,
)
SEED = whole("--seed", "Draws the readings that are looked at of a very long file.", low=0, default=0)
JSON = flag("--json", "One JSON document on stdout, nothing else.")
EFFECTS = option("--effects", "FILE.py", "Effects of your own: functions under @rtec.effect in a Python file.")
SCREW_PITCH = option("--screw-pitch", "'6.35 mm'", "Travel of a turn.", panel=_AXIS)
COUNTS_PER_REV = option("--counts-per-rev", "8192", "Counts of a turn.", panel=_AXIS, read=_counts_per_rev)


@dataclass(frozen=True, slots=True, kw_only=True)
class AxisOptions(OptionGroup):
    """Options that state facts of the axis; they are judged with the measurement, which decides on their unit."""

    PANEL = _AXIS

    screw_pitch: str | None = SCREW_PITCH
    scale_signal_period: str | None = option("--signal-period", "'20 um'", "Signal period of the scale.")
    counts_per_rev: str | None = COUNTS_PER_REV
    reference_temperature: str | None = option(
        "--reference-temperature", "'20 degC'", "At which lengths are nominal."
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class ColumnOptions(OptionGroup):
    """Options that say what is what in a file."""

    PANEL = "How the file is read, where rtec asks or takes a column for the wrong thing"

    maps: list[str] | None = option(
        "--map",
        "'HEADING=MEANING'",
        "What a column is, such as 'nominal=target_mm', 'Dir=direction' or 'note=ignore'; may be repeated.",
    )
    sheet: str | None = option("--sheet", "NAME", "Sheet of a workbook that has several.")
    table: int | None = whole("--table", "Number of the table, where a file or sheet has several.", low=1)
    decimal: str | None = option("--decimal", "MARK", "point or comma, where the numbers do not tell which it is.")
    axis: str | None = option("--axis", "x", "Axis of a log that has columns of several, such as target_x_mm.")

    def choices(self, *, several: bool = False) -> ColumnChoices:
        """Return what they say of a file, or of several that need not all have every column.

        Raises
        ------
        ArgumentError
            One of them is wrong.

        Examples
        --------
        >>> ColumnOptions(maps=["nominal=target_mm"], decimal="comma").choices().decimal
        ','
        """
        from rtec.metrology import column_choices

        choices = column_choices(
            self.maps or (), sheet=self.sheet, table=self.table, decimal=self.decimal, axis=self.axis
        )
        return dataclasses.replace(choices, of_several=several)


@dataclass(frozen=True, slots=True, kw_only=True)
class Inputs:
    """What is to be explained, by what, and what judges it."""

    dataset: Dataset
    model: Model | None
    heldout: Dataset | None
    locked: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class MeasuredOptions(OptionGroup):
    """Options that say what is explained of a measurement, by what, what judges it, and how files are read."""

    model: Path | None = option("--model", "M.toml", "Effects that are known; none without it.")
    heldout: Path | None = option("--heldout", "FILE", "Another measurement to judge on, instead of held-out blocks.")
    lock: bool = flag("--lock", "Reserve 20 % as test set (the last runs, if there are three), and score on it.")
    blocks: str | None = option("--blocks", "COLUMN", "Held out together: rows until this column changes.")
    observe: str | None = option(
        "--observe", "QUANTITY", "What is explained: deviation without it; force, current, ..."
    )
    effects: Path | None = EFFECTS
    axis: AxisOptions = AxisOptions()
    columns: ColumnOptions = ColumnOptions()

    def read(self, data: Path, *, several: bool = False) -> Inputs:
        """Read measurement, model and held-out measurement; ``several`` measurements need not have every column.

        Raises
        ------
        RtecError
            A file that cannot be read or does not fit the others, or an option that is wrong.
        """
        from rtec.dataset.load import load_dataset
        from rtec.dataset.many_rows import locked
        from rtec.effects.own_file import library_of_file
        from rtec.inference.compare import check_model
        from rtec.inference.model_file import read_model, read_observe

        model, heldout, choices = self.model, self.heldout, self.columns.choices(several=several)
        said_of_it = {**dataclasses.asdict(self.axis), "blocks": self.blocks}
        facts = {fact: said for fact, said in said_of_it.items() if said is not None}
        if self.lock and heldout is not None:
            raise apart("--lock", "--heldout", "either judges instead of blocks")
        if heldout is not None and data.exists() and heldout.exists() and data.samefile(heldout):
            allowed = "another one; --lock holds back a part of a single one"
            raise ArgumentError("--heldout", heldout, allowed, problem="is the measurement itself")
        if heldout is not None:
            choices = dataclasses.replace(choices, of_several=True)
        library = library_of_file(self.effects)
        if model is not None and is_motion_model(model):
            return self._left_by_motion(data, model, choices, facts, library)
        wanted = self.observe if self.observe is not None or model is None else read_observe(model)
        with _naming("--observe", "--observe" if self.observe is not None else f"{model}: observe"):
            dataset = load_dataset(data, observe=wanted, facts=facts, choices=choices, library=library)
        with _naming("--observe", f"{heldout}: column"):
            other = None
            if heldout is not None:
                other = load_dataset(heldout, like=dataset, facts=facts, choices=choices, library=library)
        known = None if model is None else read_model(model, dataset.units, library)
        if known is not None:
            for measured in (dataset,) if other is None else (dataset, other):
                check_model(known, measured)
        if self.lock:
            dataset, other = locked(dataset)
        return Inputs(dataset=dataset, model=known, heldout=other, locked=self.lock)

    def refuse_beside(self, what: str, logs: Sequence[Path], output: Path | None) -> None:
        """Refuse several logs, and options that mean nothing, beside what takes one log."""
        if len(logs) > 1:
            raise ArgumentError("DATA", f"{len(logs)} logs", f"one log with {what}")
        said = {"-o": output, "--heldout": self.heldout, "--lock": self.lock, "--observe": self.observe}
        for name, value in (said | {"--blocks": self.blocks, "--effects": self.effects}).items():
            if value not in (None, False):
                raise apart(name, what)

    def _left_by_motion(
        self, data: Path, model: Path, choices: ColumnChoices, facts: dict[str, str], library: Library
    ) -> Inputs:
        """Return what a model of motion leaves of a log as what is to be explained."""
        from rtec.dataset.many_rows import locked
        from rtec.dataset.motion_residual import residual_dataset
        from rtec.predictors.motion_file import read_motion

        if self.observe is not None:
            raise apart("--observe", "a model of motion", "what it leaves is explained")
        known = read_motion(model)
        dataset = residual_dataset(known, data, facts=facts, choices=choices, library=library)
        other = None
        if self.heldout is not None:
            other = residual_dataset(known, self.heldout, facts=facts, choices=choices, library=library, like=dataset)
        elif self.lock:
            dataset, other = locked(dataset)
        return Inputs(dataset=dataset, model=None, heldout=other, locked=self.lock)


@contextmanager
def _naming(name: str, as_said: str) -> Iterator[None]:
    """Name what is refused under ``name`` as what the user said it with."""
    try:
        yield
    except ArgumentError as error:
        raise error.of(as_said if error.name == name else error.name) from error
