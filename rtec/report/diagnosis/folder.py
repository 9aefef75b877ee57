"""The folder of a diagnosis or a comparison: its page needs nothing else, and it gets all of its files or none."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from rtec.dataset.dataset import warnings_of
from rtec.inference.results import Diagnosis
from rtec.report.appearance import printable
from rtec.report.diagnosis import chapters
from rtec.report.diagnosis.document import comparison_document, diagnosis_document
from rtec.report.diagnosis.figures_several import (
    PARAMETERS_CAPTION,
    SEVERAL_CAPTION,
    parameters_figure,
    several_figure,
)
from rtec.report.diagnosis.plates import comparison_figures, diagnosis_figures
from rtec.report.diagnosis.quantities import shown_for
from rtec.report.diagnosis.sentence import comparison_sentence, spoken
from rtec.report.diagnosis.several import change_rows, changes_sentence, heads_of, left_rows, several_document
from rtec.report.drawn import Plate, drawn
from rtec.report.page_folder import write_page_folder

if TYPE_CHECKING:
    from rtec.dataset.dataset import Dataset
    from rtec.inference.compare import Comparison
    from rtec.report.diagnosis.several import Changes, Results

_FOR_COMPARISONS = 3
"""Definitions that concern a comparison, too: the first ones."""


def write_diagnosis(diagnosis: Diagnosis, folder: Path) -> Path:
    """Write page, figures and numbers of a search, all or nothing; errors as of `write_page_folder`.

    Parameters
    ----------
    diagnosis
        The search; names of columns and files, notes and reasons are text from outside and are escaped.
    folder
        Where to; it exists.

    Returns
    -------
    Path
        The page, ``report.html``; beside it are ``result.json`` and ``figures`` (each as SVG and as PNG).
    """
    dataset = diagnosis.dataset
    values = {
        "title": _title("What explains the", dataset),
        "search": chapters.search_text(diagnosis, shown_for(dataset)),
        "definitions": chapters.DEFINITIONS,
    }
    figures, document = diagnosis_figures(diagnosis), diagnosis_document(diagnosis)
    return write_page_folder(folder, figures, document, "diagnosis/diagnosis.html.j2", values)


def write_comparison(comparison: Comparison, folder: Path) -> Path:
    """Write page, figures and numbers of a comparison; parameters, result and errors as for ``write_diagnosis``."""
    c, shown = comparison, shown_for(comparison.dataset)
    values = {
        "title": _title("Residual of the", c.dataset),
        "sentence": comparison_sentence(c),
        "tone": "good" if c.at_the_floor else "mind",
        "facts": chapters.facts(c.dataset, c.noise, c.heldout, c.heldout_by),
        "notes": [printable(note) for note in (*warnings_of(c.dataset, c.heldout), *c.dataset.notes)],
        "effects": chapters.found_effects(c.model, ()),
        "where": [
            (row.quantity, row.share, row.place, row.mean_with_unit, row.rows)
            for row in chapters.where_rows(c, shown)
        ],
        "definitions": chapters.DEFINITIONS[:_FOR_COMPARISONS],
    }
    figures, document = comparison_figures(c.dataset, c.model, c.noise), comparison_document(c)
    return write_page_folder(folder, figures, document, "diagnosis/comparison.html.j2", values)


def _title(start: str, dataset: Dataset) -> str:
    name = dataset.source.replace("\\", "/").rsplit("/", 1)[-1]
    return f"{start} {spoken(dataset.observe)} in {printable(name)}"


def write_several(results: Results, found: Changes, folder: Path, against: str = "") -> Path:
    """Write the pages of several measurements, each into a folder of its own, and one that holds them together.

    Errors are those of `write_page_folder`.

    Parameters
    ----------
    results, found
        As for `several_document`.
    folder
        Where to; it exists. The folders in it bear the names of the files, with a number before them.
    against
        What the measurements are held against, where it is none of them: the file of a model.

    Returns
    -------
    Path
        The page that holds them together.
    """
    plates = [
        Plate("several", "Several measurements", SEVERAL_CAPTION, lambda: several_figure(results)),
        Plate("parameters", "From one to the next", PARAMETERS_CAPTION, lambda: parameters_figure(found, against)),
    ]
    parts = {name: f"{number}-{Path(name).stem[:60]}" for number, name in enumerate(results, 1)}

    def write_parts(new: Path) -> None:
        for name, one in results.items():
            part = new / parts[name]
            part.mkdir()
            if isinstance(one, Diagnosis):
                write_diagnosis(one, part)
            else:
                write_comparison(one, part)

    first = next(iter(results))
    held_against = against or first
    values = {
        "title": f"{spoken(results[first].dataset.observe).capitalize()} in {len(results)} measurements",
        "sentence": changes_sentence(held_against, found),
        "heads": heads_of(results),
        "left": [(name, part, cells) for part, (name, cells) in zip(parts.values(), left_rows(results), strict=True)],
        "first": printable(held_against),
        "changes": [(printable(name), change_rows(of_file)) for name, of_file in found.items()],
    }
    document = several_document(results, found)
    return write_page_folder(folder, drawn(plates), document, "diagnosis/several.html.j2", values, beside=write_parts)
