"""A diagnosis or a comparison as one page of HTML that needs nothing else."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from rtec.inference.results import Diagnosis, Verdict
from rtec.report.appearance import printable
from rtec.report.diagnosis import chapters
from rtec.report.diagnosis.quantities import probability, shown_for
from rtec.report.diagnosis.sentence import (
    comparison_sentence,
    floor_words,
    stretch_mean,
    stretch_words,
    verdict_sentence,
)
from rtec.report.diagnosis.several import change_rows, changes_sentence, heads_of, left_rows
from rtec.report.illustrations import Illustration
from rtec.report.rendering import embedded, page_environment

if TYPE_CHECKING:
    from rtec.inference.compare import Comparison, Where
    from rtec.report.diagnosis.quantities import Shown
    from rtec.report.diagnosis.several import Changes, Results

TONES = {
    Verdict.NAMED: "good",
    Verdict.LIKELY: "good",
    Verdict.NONE: "good",
    Verdict.TIED: "mind",
    Verdict.INCONCLUSIVE: "mind",
    Verdict.NOT_TESTABLE: "mind",
    Verdict.UNKNOWN: "bad",
}
"""Class of each verdict on a page."""
_AT_THE_FLOOR = 1.1
"""Held-out RMS over noise floor up to which a comparison is good."""
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
    d, shown = diagnosis, shown_for(diagnosis.dataset)
    floor = floor_words(d.noise, shown)
    return page_environment().get_template("diagnosis/diagnosis.html.j2").render(
        title=_title("What explains the", d.dataset.observe, d.dataset.source),
        verdict=d.verdict.value,
        sentence=verdict_sentence(d),
        tone=TONES[d.verdict],
        unit=shown.symbol,
        facts=chapters.facts(d.dataset, d.noise, d.heldout, d.heldout_by),
        notes=[printable(note) for note in d.dataset.notes],
        search_notes=[printable(note) for note in d.notes],
        steps=chapters.step_rows(d, shown),
        floor=floor[:1].upper() + floor[1:],
        effects=chapters.found_effects(d.model, d.candidates),
        candidates=chapters.candidate_rows(d, shown),
        unknown="" if d.unknown is None else printable(d.unknown.description),
        lack_of_fit=chapters.pairs_text(d.lack_of_fit, probability),
        not_testable=chapters.unmeasured(d),
        detectable=chapters.pairs_text(d.minimum_detectable, shown.with_unit),
        experiment=printable(d.experiment.text),
        ties=chapters.tie_words(d),
        alike=chapters.likeness_rows(d),
        figures=_by_name(figures),
        definitions=chapters.DEFINITIONS,
        files=files,
    )  # fmt: skip


def comparison_page(comparison: Comparison, figures: Sequence[Illustration], files: Sequence[str]) -> str:
    """Return the page of a comparison; parameters as for ``diagnosis_page``."""
    c, shown = comparison, shown_for(comparison.dataset)
    floor = c.noise.floor
    good = floor is not None and c.rms_heldout <= _AT_THE_FLOOR * floor
    return page_environment().get_template("diagnosis/comparison.html.j2").render(
        title=_title("Residual of the", c.dataset.observe, c.dataset.source),
        sentence=comparison_sentence(c),
        tone="good" if good else "mind",
        facts=chapters.facts(c.dataset, c.noise, c.heldout, c.heldout_by),
        notes=[printable(note) for note in c.dataset.notes],
        effects=chapters.found_effects(c.model, ()),
        where=[_where(where, shown) for where in c.where],
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


def _where(where: Where, shown: Shown) -> dict[str, str]:
    worst = where.worst[0] if where.worst else None
    return {
        "quantity": printable(where.quantity).replace("_", " "),
        "share": f"{where.share:.0%}",
        "place": "" if worst is None else stretch_words(worst, where.unit),
        "mean": "" if worst is None else shown.with_unit(stretch_mean(worst)),
        "rows": "" if worst is None else str(worst.rows),
    }
