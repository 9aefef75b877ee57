"""Several measurements at once: what tells them apart, what is refused, and how they are shown beside each other."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from rtec.cli._console import note, print_json, warn
from rtec.cli._measured import Inputs, MeasuredOptions
from rtec.cli._parameters import apart
from rtec.errors import ArgumentError

if TYPE_CHECKING:
    from rtec.dataset.dataset import Dataset
    from rtec.inference.changes import Change
    from rtec.inference.compare import Comparison
    from rtec.inference.results import Diagnosis

_R = TypeVar("_R", "Diagnosis", "Comparison")


def names_of(files: Sequence[Path]) -> list[str]:
    """Return the shortest names that tell several files apart.

    Raises
    ------
    ArgumentError
        One of them comes twice.

    Examples
    --------
    >>> names_of([Path("before/x.csv"), Path("after/x.csv"), Path("after/y.csv")])
    ['before/x.csv', 'after/x.csv', 'y.csv']
    """
    for number, file in enumerate(files):
        if file in files[:number]:
            raise ArgumentError("DATA", file, "different files", problem="is given twice")
    plain = [file.name for file in files]
    return [name if plain.count(name) == 1 else str(file) for name, file in zip(plain, files, strict=True)]


def refuse_with_several(files: Sequence[Path], **options: object) -> None:
    """Refuse options that belong to a single measurement where several are given.

    Raises
    ------
    ArgumentError
        One of ``options``, by its name without the dashes, is not None or False.

    Examples
    --------
    >>> refuse_with_several([Path("x.csv")], save="m.toml")
    """
    for name, value in options.items():
        if len(files) > 1 and value not in (None, False):
            raise apart(f"--{name}", "several measurements")


def read_each(files: Sequence[Path], names: Sequence[str], measured: MeasuredOptions) -> Iterator[tuple[str, Inputs]]:
    """Yield the name of each file with what is in it, of one quantity in the same units.

    Parameters
    ----------
    files, names
        Measurements, and what tells them apart.
    measured
        How they are read.

    Raises
    ------
    RtecError
        A file that cannot be read or is of something else than the first.
    """
    first = None
    for name, file in zip(names, files, strict=True):
        given = measured.read(file, several=len(files) > 1)
        first = given.dataset if first is None else first
        _refuse_another_quantity(first, given.dataset)
        yield name, given


def _refuse_another_quantity(first: Dataset, other: Dataset) -> None:
    """Refuse a measurement beside another one of something else, or in units that cannot be held against it.

    Raises
    ------
    ArgumentError
        Quantity or units differ.
    """
    seen = [f"{one.observe} in {one.units.observed} over {one.units.position}" for one in (first, other)]
    if seen[0] != seen[1]:
        problem = f"is of {seen[1]}"
        raise ArgumentError("DATA", other.source, f"{seen[0]}, as in {first.source}", problem=problem)


def show_several(
    results: Mapping[str, _R],
    found: Mapping[str, Sequence[Change]],
    sentence: Callable[[_R], str],
    more: Mapping[str, object],
    *,
    against: str = "",
    as_json: bool,
) -> None:
    """Print results beside each other and what differs from the first: one JSON document, or sentences and tables.

    Parameters
    ----------
    results, found
        As for `rtec.report.diagnosis.several_document`.
    sentence
        What is said of each.
    more
        Of the document.
    against
        What they are held against, where it is none of them.
    as_json
        Whether it is to be JSON.
    """
    from rich.console import Console

    from rtec.report.diagnosis import several_document, several_table

    if as_json:
        print_json({**several_document(results, found), **more})
        return
    console = Console(highlight=False)
    for name, result in results.items():
        for said in result.dataset.notes:
            note(f"{name}: {said}")
        warn(result.dataset.warnings, f"{name}: ")
        console.print(f"{name}: {sentence(result)}", soft_wrap=True, markup=False)
    console.print(several_table(results, found, against))
