"""What compare, diagnose and add share: their options, and the measurement, model and held-out file behind them."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rtec.cli._arguments import option, whole_option
from rtec.errors import ArgumentError
from rtec.units import NUMBER

if TYPE_CHECKING:
    from rtec.dataset.dataset import Dataset
    from rtec.inference.model import Model
    from rtec.metrology import ColumnChoices

_FACTS = {
    "screw_pitch": "--screw-pitch",
    "scale_signal_period": "--signal-period",
    "counts_per_rev": "--counts-per-rev",
    "reference_temperature": "--reference-temperature",
}
"""The option behind each fact of an axis."""
_COUNTS = re.compile(rf"{NUMBER}\s*(?:counts?(?:/rev)?)?", re.ASCII)
_AXIS = "Facts of the axis, where the file does not state them"
_READ = "How the file is read, where rtec asks or takes a column for the wrong thing"

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
ModelFile = Annotated[
    Path | None, option("--model", metavar="M.toml", help="Effects that are known; none without it.")
]
HeldOut = Annotated[
    Path | None,
    option("--heldout", metavar="FILE", help="Another measurement to judge on, instead of held-out blocks."),
]
Lock = Annotated[
    bool,
    typer.Option("--lock", help="Lock a fifth away (the last runs, if there are three), and score on it."),
]
Observe = Annotated[
    str | None,
    option("--observe", metavar="QUANTITY", help="What is explained: deviation without it; force, current, ..."),
]
ScrewPitch = Annotated[str | None, option(metavar="'6.35 mm'", help="Travel of a turn.", rich_help_panel=_AXIS)]
SignalPeriod = Annotated[
    str | None, option(metavar="'20 um'", help="Signal period of the scale.", rich_help_panel=_AXIS)
]
CountsPerRev = Annotated[str | None, option(metavar="8192", help="Counts of a turn.", rich_help_panel=_AXIS)]
ReferenceTemperature = Annotated[
    str | None, option(metavar="'20 degC'", help="At which lengths are nominal.", rich_help_panel=_AXIS)
]
Maps = Annotated[
    list[str] | None,
    typer.Option(
        "--map",
        metavar="'HEADING=MEANING'",
        help="What a column is, such as 'nominal=target_mm', 'Dir=direction' or 'note=ignore'; may be repeated.",
        rich_help_panel=_READ,
    ),
]
Sheet = Annotated[
    str | None, option(metavar="NAME", help="Sheet of a workbook that has several.", rich_help_panel=_READ)
]
TableNumber = Annotated[
    int | None,
    whole_option(
        "--table", low=1, help="Number of the table, where a file or sheet has several.", rich_help_panel=_READ
    ),
]
Decimal = Annotated[
    str | None,
    option(metavar="MARK", help="point or comma, where the numbers do not tell which it is.", rich_help_panel=_READ),
]
Seed = Annotated[int, whole_option(low=0, help="Draws the readings that are looked at of a very long file.")]
Json = Annotated[bool, typer.Option("--json", help="One JSON document on stdout, nothing else.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class Inputs:
    """What is to be explained, by what, and what judges it."""

    dataset: Dataset
    model: Model | None
    heldout: Dataset | None
    locked: bool


def facts_of(
    screw_pitch: str | None, signal_period: str | None, counts_per_rev: str | None, reference_temperature: str | None
) -> dict[str, str]:
    """Return the facts that options state.

    Raises
    ------
    ArgumentError
        No number of counts; the others are judged with the measurement, which decides on their unit.

    Examples
    --------
    >>> facts_of("6.35 mm", None, None, None)
    {'screw_pitch': '6.35 mm'}
    """
    if counts_per_rev is not None and _COUNTS.fullmatch(counts_per_rev.strip()) is None:
        raise ArgumentError("--counts-per-rev", repr(counts_per_rev[:60]), "a number above 0, such as 8192")
    given = (screw_pitch, signal_period, counts_per_rev, reference_temperature)
    return {fact: text for fact, text in zip(_FACTS, given, strict=True) if text is not None}


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
        raise ArgumentError("--lock", "given beside --heldout", "one of the two", "either judges instead of blocks")
    if heldout is not None and data.exists() and heldout.exists() and data.samefile(heldout):
        raise ArgumentError("--heldout", heldout, "another measurement", "--lock holds back a part of a single one")
    if heldout is not None:
        choices = dataclasses.replace(choices, of_several=True)
    wanted = observe if observe is not None or model is None else read_observe(model)
    with _named_as_options("--observe" if observe is not None else f"{model}: observe"):
        dataset = load_dataset(data, observe=wanted, facts=facts, choices=choices)
    with _named_as_options(f"{heldout}: column"):
        other = None if heldout is None else load_dataset(heldout, like=dataset, facts=facts, choices=choices)
    known = None if model is None else read_model(model, dataset.units)
    if known is not None:
        for measured in (dataset,) if other is None else (dataset, other):
            check_model(known, measured)
    if lock:
        dataset, other = locked(dataset)
    return Inputs(dataset=dataset, model=known, heldout=other, locked=lock)


@contextmanager
def _named_as_options(observe: str) -> Iterator[None]:
    """Name a refused fact as the option that the user wrote, and a refused quantity as what asked for it."""
    try:
        yield
    except ArgumentError as error:
        name = {**_FACTS, "--observe": observe}.get(error.name, error.name)
        raise ArgumentError(name, error.value, error.allowed, error.hint) from error
