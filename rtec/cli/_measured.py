"""What compare, diagnose and add share: their options, and the measurement, model and held-out file behind them."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rtec.cli._parameters import apart, flag, option, whole
from rtec.errors import ArgumentError
from rtec.units import NUMBER

if TYPE_CHECKING:
    from rtec.dataset.dataset import Dataset
    from rtec.inference.model import Model
    from rtec.metrology import ColumnChoices

_COUNTS = re.compile(rf"{NUMBER}\s*(?:counts?(?:/rev)?)?", re.ASCII)
_FACTS = ("screw_pitch", "scale_signal_period", "counts_per_rev", "reference_temperature")
"""Options that state a fact of the axis; they are judged with the measurement, which decides on their unit."""
_AXIS = "Facts of the axis, where the file does not state them"
_READ = "How the file is read, where rtec asks or takes a column for the wrong thing"


def _counts_per_rev(said: str) -> str:
    if _COUNTS.fullmatch(said.strip()) is None:
        raise ArgumentError("--counts-per-rev", repr(said[:60]), "a number above 0, such as 8192")
    return said


Data = Annotated[
    Path, typer.Argument(help="Measurement: CSV or other text, .xlsx, file of a laser system.", show_default=False)
]
DataFiles = Annotated[
    list[Path],
    typer.Argument(
        metavar="DATA...",
        help="Measurement: CSV or other text, .xlsx, file of a laser system. Several are held against the first.",
        show_default=False,
    ),
]
ModelFile = Annotated[Path | None, option("--model", "M.toml", "Effects that are known; none without it.")]
HeldOut = Annotated[
    Path | None, option("--heldout", "FILE", "Another measurement to judge on, instead of held-out blocks.")
]
Lock = Annotated[
    bool, flag("--lock", "Reserve 20 % as test set (the last runs, if there are three), and score on it.")
]
Observe = Annotated[
    str | None, option("--observe", "QUANTITY", "What is explained: deviation without it; force, current, ...")
]
ScrewPitch = Annotated[str | None, option("--screw-pitch", "'6.35 mm'", "Travel of a turn.", panel=_AXIS)]
SignalPeriod = Annotated[str | None, option("--signal-period", "'20 um'", "Signal period of the scale.", panel=_AXIS)]
CountsPerRev = Annotated[
    str | None, option("--counts-per-rev", "8192", "Counts of a turn.", panel=_AXIS, read=_counts_per_rev)
]
ReferenceTemperature = Annotated[
    str | None, option("--reference-temperature", "'20 degC'", "At which lengths are nominal.", panel=_AXIS)
]
Maps = Annotated[
    list[str] | None,
    option(
        "--map",
        "'HEADING=MEANING'",
        "What a column is, such as 'nominal=target_mm', 'Dir=direction' or 'note=ignore'; may be repeated.",
        panel=_READ,
    ),
]
Sheet = Annotated[str | None, option("--sheet", "NAME", "Sheet of a workbook that has several.", panel=_READ)]
TableNumber = Annotated[
    int | None, whole("--table", "Number of the table, where a file or sheet has several.", low=1, panel=_READ)
]
Decimal = Annotated[
    str | None, option("--decimal", "MARK", "point or comma, where the numbers do not tell which it is.", panel=_READ)
]
Seed = Annotated[int, whole("--seed", "Draws the readings that are looked at of a very long file.", low=0)]
Json = Annotated[bool, flag("--json", "One JSON document on stdout, nothing else.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class Inputs:
    """What is to be explained, by what, and what judges it."""

    dataset: Dataset
    model: Model | None
    heldout: Dataset | None
    locked: bool


def how(context: typer.Context, *, several: bool = False) -> dict[str, Any]:
    """Return how the options of a verb say that measurements are read, as `read_inputs` takes it.

    Parameters
    ----------
    context
        Of the verb; an option that it does not have says nothing.
    several
        Whether several measurements are read, that need not all have every column.
    """
    given = context.params
    return {
        "model": given.get("model"),
        "heldout": given.get("heldout"),
        "lock": given.get("lock", False),
        "observe": given.get("observe"),
        "facts": {fact: given[fact] for fact in _FACTS if given.get(fact) is not None},
        "choices": choices_of(given["maps"], given["sheet"], given["table"], given["decimal"], several=several),
    }


def choices_of(
    maps: list[str] | None, sheet: str | None, table: int | None, decimal: str | None, *, several: bool = False
) -> ColumnChoices:
    """Return what options say of the columns of a file, or of several that need not all have every column.

    Raises
    ------
    ArgumentError
        One of them is wrong.

    Examples
    --------
    >>> choices_of(["nominal=target_mm"], None, None, "comma").decimal
    ','
    """
    from rtec.metrology import column_choices

    choices = column_choices(maps or (), sheet=sheet, table=table, decimal=decimal)
    return dataclasses.replace(choices, of_several=several)


def read_inputs(
    data: Path,
    *,
    model: Path | None,
    heldout: Path | None,
    lock: bool,
    observe: str | None,
    facts: Mapping[str, str],
    choices: ColumnChoices,
) -> Inputs:
    """Read measurement, model and held-out measurement, which must belong to each other.

    Parameters
    ----------
    data, model, heldout
        Files.
    lock
        Whether a part of the measurement is locked away from everything that is fitted or chosen.
    observe
        Quantity to be explained; that of the model without it.
    facts
        Of the axis, from options.
    choices
        What the user says of the columns.

    Raises
    ------
    RtecError
        A file that cannot be read or does not fit the others, or an option that is wrong.
    """
    from rtec.dataset.load import load_dataset
    from rtec.dataset.lock import locked
    from rtec.inference.compare import check_model
    from rtec.inference.model_file import read_model, read_observe

    if lock and heldout is not None:
        raise apart("--lock", "--heldout", "either judges instead of blocks")
    if heldout is not None and data.exists() and heldout.exists() and data.samefile(heldout):
        allowed = "another one; --lock holds back a part of a single one"
        raise ArgumentError("--heldout", heldout, allowed, problem="is the measurement itself")
    if heldout is not None:
        choices = dataclasses.replace(choices, of_several=True)
    wanted = observe if observe is not None or model is None else read_observe(model)
    with _naming("--observe", "--observe" if observe is not None else f"{model}: observe"):
        dataset = load_dataset(data, observe=wanted, facts=facts, choices=choices)
    with _naming("--observe", f"{heldout}: column"):
        other = None if heldout is None else load_dataset(heldout, like=dataset, facts=facts, choices=choices)
    known = None if model is None else read_model(model, dataset.units)
    if known is not None:
        for measured in (dataset,) if other is None else (dataset, other):
            check_model(known, measured)
    if lock:
        dataset, other = locked(dataset)
    return Inputs(dataset=dataset, model=known, heldout=other, locked=lock)


@contextmanager
def _naming(name: str, as_said: str) -> Iterator[None]:
    """Name what is refused under ``name`` as what the user said it with."""
    try:
        yield
    except ArgumentError as error:
        raise error.of(as_said if error.name == name else error.name) from error
