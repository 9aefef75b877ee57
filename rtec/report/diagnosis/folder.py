"""The folder of a diagnosis or a comparison, which gets all of its files or none."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from rtec.inference.results import Diagnosis
from rtec.report.diagnosis.document import comparison_document, diagnosis_document
from rtec.report.diagnosis.figures_several import SEVERAL_CAPTION, several_figure
from rtec.report.diagnosis.page import comparison_page, diagnosis_page, several_page
from rtec.report.diagnosis.plates import comparison_figures, diagnosis_figures
from rtec.report.diagnosis.several import several_document
from rtec.report.figures_style import figure_style
from rtec.report.illustrations import illustration
from rtec.report.page_folder import write_page_folder

if TYPE_CHECKING:
    from rtec.inference.compare import Comparison
    from rtec.report.diagnosis.several import Changes, Results


def write_diagnosis(diagnosis: Diagnosis, folder: Path) -> Path:
    """Write page, figures and numbers of a search, all or nothing; errors as of `write_page_folder`.

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
    """
    figures = diagnosis_figures(diagnosis)
    document = diagnosis_document(diagnosis)
    return write_page_folder(folder, figures, document, partial(diagnosis_page, diagnosis, figures))


def write_comparison(comparison: Comparison, folder: Path) -> Path:
    """Write page, figures and numbers of a comparison; parameters, result and errors as for ``write_diagnosis``."""
    figures = comparison_figures(comparison.dataset, comparison.model, comparison.noise)
    document = comparison_document(comparison)
    return write_page_folder(folder, figures, document, partial(comparison_page, comparison, figures))


def write_several(results: Results, found: Changes, folder: Path) -> Path:
    """Write the pages of several measurements, each into a folder of its own, and one that holds them together.

    Errors are those of `write_page_folder`.

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
    """
    with figure_style():
        figure = illustration(several_figure(results), "several", "Several measurements", SEVERAL_CAPTION)
    parts = {name: f"{number}-{Path(name).stem[:60]}" for number, name in enumerate(results, 1)}

    def write_parts(new: Path) -> None:
        for name, one in results.items():
            part = new / parts[name]
            part.mkdir()
            if isinstance(one, Diagnosis):
                write_diagnosis(one, part)
            else:
                write_comparison(one, part)

    page = partial(several_page, results, found, figure, parts)
    return write_page_folder(folder, [figure], several_document(results, found), page, beside=write_parts)
