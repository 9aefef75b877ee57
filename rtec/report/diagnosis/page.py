"""A diagnosis or a comparison as one page of HTML that needs nothing else."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from rtec.inference.results import Diagnosis
from rtec.report.appearance import printable
from rtec.report.diagnosis import chapters
from rtec.report.diagnosis.quantities import shown_for
from rtec.report.diagnosis.sentence import (
    comparison_sentence,
)
from rtec.report.diagnosis.several import change_rows, changes_sentence, heads_of, left_rows
from rtec.report.illustrations import Illustration
from rtec.report.rendering import embedded, page_environment

if TYPE_CHECKING:
    from rtec.inference.compare import Comparison
    from rtec.report.diagnosis.several import Changes, Results

_FOR_COMPARISONS = 3
"""Definitions that concern a comparison, too: the first ones."""


def diagnosis_page(diagnosis: Diagnosis, figures: Sequence[Illustration], files: Sequence[str]) -> str:
    """Return the page of a search.

    Parameters
    ----------
    diagnosis
        The search; names of columns and files, notes and reasons are text from outside and are escaped.
    figures
        Drawn already.
    files
        What lies beside the page, as paths from it.
    """
    dataset = diagnosis.dataset
    return page_environment().get_template("diagnosis/diagnosis.html.j2").render(
        title=_title("What explains the", dataset.observe, dataset.source),
        search=chapters.search_text(diagnosis, shown_for(dataset)),
        figures=_by_name(figures),
        definitions=chapters.DEFINITIONS,
        files=files,
    )  # fmt: skip


def comparison_page(comparison: Comparison, figures: Sequence[Illustration], files: Sequence[str]) -> str:
    """Return the page of a comparison; parameters as for ``diagnosis_page``."""
    c, shown = comparison, shown_for(comparison.dataset)
    return page_environment().get_template("diagnosis/comparison.html.j2").render(
        title=_title("Residual of the", c.dataset.observe, c.dataset.source),
        sentence=comparison_sentence(c),
        tone="good" if c.at_the_floor else "mind",
        facts=chapters.facts(c.dataset, c.noise, c.heldout, c.heldout_by),
        notes=[printable(note) for note in c.dataset.notes],
        effects=chapters.found_effects(c.model, ()),
        where=chapters.where_rows(c, shown),
        figures=_by_name(figures),
        definitions=chapters.DEFINITIONS[:_FOR_COMPARISONS],
        files=files,
    )  # fmt: skip


def several_page(
    results: Results, found: Changes, figure: Illustration, parts: Mapping[str, str], files: Sequence[str]
) -> str:
    """Return the page that holds several measurements together.

    Parameters
    ----------
    results, found
        As for `several_document`.
    figure
        Drawn already.
    parts
        The folder of each measurement's own page.
    files
        What lies beside the page, as paths from it.
    """
    first = next(iter(results))
    dataset = results[first].dataset
    return page_environment().get_template("diagnosis/several.html.j2").render(
        title=f"{printable(dataset.observe).replace('_', ' ').capitalize()} in {len(results)} measurements",
        sentence=changes_sentence(first, found),
        heads=heads_of(results),
        left=[(name, part, cells) for part, (name, cells) in zip(parts.values(), left_rows(results), strict=True)],
        first=printable(first),
        changes=[(printable(name), change_rows(of_file)) for name, of_file in found.items()],
        figures=_by_name([figure]),
        files=files,
    )  # fmt: skip


def _title(start: str, observe: str, source: str) -> str:
    name = source.replace("\\", "/").rsplit("/", 1)[-1]
    return f"{start} {printable(observe).replace('_', ' ')} in {printable(name)}"


def _by_name(figures: Sequence[Illustration]) -> dict[str, tuple[Illustration, str]]:
    return {figure.name: (figure, embedded(figure)) for figure in figures}
