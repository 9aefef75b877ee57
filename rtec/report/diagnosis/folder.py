"""The folder of a diagnosis or a comparison, which gets all of its files or none."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rtec.inference.results import Diagnosis
from rtec.io import json_text, whole_folder, write_text
from rtec.report.diagnosis.document import comparison_document, diagnosis_document
from rtec.report.diagnosis.figures_several import SEVERAL_CAPTION, several_figure
from rtec.report.diagnosis.page import comparison_page, diagnosis_page, several_page
from rtec.report.diagnosis.plates import comparison_figures, diagnosis_figures
from rtec.report.diagnosis.several import several_document
from rtec.report.figures_style import figure_style
from rtec.report.illustrations import Illustration, illustration
from rtec.report.page_folder import PAGE, without_empty, write_figures

if TYPE_CHECKING:
    from rtec.inference.compare import Comparison
    from rtec.report.diagnosis.several import Changes, Results

Render = Callable[[Sequence[Illustration], Sequence[str]], str]


def write_diagnosis(diagnosis: Diagnosis, folder: Path) -> Path:
    """Write page, figures and numbers of a search.

    Everything is put in place at the end: an error, a full disk or Ctrl-C leaves the folder as it was. What stands in
    the way under the same name is replaced.

    Parameters
    ----------
    diagnosis
        The search.
    folder
        Where to; it exists.

    Returns
    -------
    Path
        The page, ``report.html``; beside it are ``result.json`` and ``figures`` (each as SVG and as PNG).

    Raises
    ------
    OutputError
        The folder is missing or not writable, or the disk is full.
    """
    figures = diagnosis_figures(diagnosis)
    document = diagnosis_document(diagnosis)
    return _written(folder, figures, document, lambda drawn, files: diagnosis_page(diagnosis, drawn, files))


def write_comparison(comparison: Comparison, folder: Path) -> Path:
    """Write page, figures and numbers of a comparison; parameters, result and errors as for ``write_diagnosis``."""
    figures = comparison_figures(comparison.dataset, comparison.model, comparison.noise)
    document = comparison_document(comparison)
    return _written(folder, figures, document, lambda drawn, files: comparison_page(comparison, drawn, files))


def write_several(results: Results, found: Changes, folder: Path) -> Path:
    """Write the pages of several measurements, each into a folder of its own, and one that holds them together.

    Parameters
    ----------
    results, found
        As for `several_document`.
    folder
        Where to; it exists. The folders in it bear the names of the files, with a number before them.

    Returns
    -------
    Path
        The page that holds them together.

    Raises
    ------
    OutputError
        The folder is missing or not writable, or the disk is full.
    """
    with figure_style():
        figure = illustration(several_figure(results), "several", "Several measurements", SEVERAL_CAPTION)
    parts = {name: f"{number}-{Path(name).stem[:60]}" for number, name in enumerate(results, 1)}
    with whole_folder(folder, last=PAGE) as new:
        for name, one in results.items():
            part = new / parts[name]
            part.mkdir()
            if isinstance(one, Diagnosis):
                write_diagnosis(one, part)
            else:
                write_comparison(one, part)
        write_figures(new, [figure])
        document = several_document(results, found)
        write_text(new / "result.json", json_text(document, indent=2) + "\n")
        files = without_empty(new, ("figures",))
        write_text(new / PAGE, several_page(results, found, figure, parts, files))
    return folder / PAGE


def _written(folder: Path, figures: list[Illustration], document: dict[str, Any], render: Render) -> Path:
    with whole_folder(folder, last=PAGE) as new:
        write_figures(new, figures)
        write_text(new / "result.json", json_text(document, indent=2) + "\n")
        files = without_empty(new, ("figures",))
        write_text(new / PAGE, render(figures, files))
    return folder / PAGE
