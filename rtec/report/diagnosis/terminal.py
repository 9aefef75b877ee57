"""What ``rtec diagnose`` and ``rtec add`` show on the terminal."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from rich.box import SIMPLE
from rich.console import Group
from rich.table import Table
from rich.text import Text

from rtec.inference.fit import values_of
from rtec.inference.model import Model
from rtec.inference.results import Diagnosis, Verdict
from rtec.report.appearance import printable
from rtec.report.diagnosis.quantities import Shown, parameter_texts, probability, shown_for
from rtec.report.diagnosis.sentence import floor_words, heldout_words, spoken, stretch_mean, stretch_words, term_words

if TYPE_CHECKING:
    from rtec.inference.compare import Comparison

_STYLES = {
    Verdict.NAMED: "bold green",
    Verdict.LIKELY: "bold green",
    Verdict.NONE: "bold green",
    Verdict.TIED: "bold yellow",
    Verdict.INCONCLUSIVE: "bold yellow",
    Verdict.NOT_TESTABLE: "bold yellow",
    Verdict.UNKNOWN: "bold red",
}
_MOST_PARAMETERS = 6
_MOST_CANDIDATES = 8


def diagnosis_table(diagnosis: Diagnosis) -> Group:
    """Return what a search found, the way to it, the candidates that were not taken, and what could not be tested.

    It fits 80 columns. The sentence of the verdict is not part of it.

    Parameters
    ----------
    diagnosis
        The search.
    """
    shown = shown_for(diagnosis.dataset)
    parts: list[Table | Text] = [Text(diagnosis.verdict.value, style=_STYLES[diagnosis.verdict])]
    if diagnosis.model.terms:
        parts.append(found_table(diagnosis.model))
    parts.append(_steps(diagnosis, shown))
    others = [candidate for candidate in diagnosis.candidates if not candidate.accepted]
    if others:
        parts.append(_candidates(diagnosis, shown))
    if diagnosis.not_testable:
        parts.append(_pairs("not testable", [(spoken(name), printable(why)) for name, why in diagnosis.not_testable]))
    if diagnosis.experiment.text:
        parts.append(Text.assemble(("Measure next: ", "bold"), printable(diagnosis.experiment.text)))
    return Group(*parts)


def comparison_table(comparison: Comparison) -> Group:
    """Return with what the residual goes and where it is worst; the sentence is not part of it.

    It fits 80 columns.

    Parameters
    ----------
    comparison
        A model against a measurement.
    """
    shown = shown_for(comparison.dataset)
    table = Table(box=SIMPLE, padding=(0, 1, 0, 0))
    table.add_column("what is left goes with", overflow="fold")
    table.add_column("share", justify="right", no_wrap=True)
    table.add_column("worst at", overflow="fold")
    table.add_column(f"mean there ({shown.symbol})", justify="right")
    for where in comparison.where:
        worst = where.worst[0] if where.worst else None
        table.add_row(
            Text(printable(where.quantity).replace("_", " ")),
            f"{where.share:.0%}",
            Text("" if worst is None else stretch_words(worst, where.unit)),
            "" if worst is None else shown.text(stretch_mean(worst)),
        )
    by = Text(f"held out {heldout_words(comparison.heldout_by)}", style="dim")
    return Group(table, by) if comparison.where else Group(by)


def found_table(model: Model) -> Table:
    """Return the parameters of a model with their standard errors: those at the end of a search, not on the way."""
    table = Table(box=SIMPLE, padding=(0, 1, 0, 0))
    table.add_column("found", no_wrap=True)
    table.add_column("parameters", overflow="fold")
    for term in model.terms:
        words = parameter_texts(values_of(term, model), _MOST_PARAMETERS)
        table.add_row(Text(term_words(term)), Text("\n".join(words)))
    return table


def _steps(diagnosis: Diagnosis, shown: Shown) -> Table:
    floor = floor_words(diagnosis.noise, shown)
    by = f"held out: {heldout_words(diagnosis.heldout_by)}"
    table = Table(
        box=SIMPLE, padding=(0, 1, 0, 0), caption=Text(f"{floor}; {by}"), caption_justify="left", caption_style="dim"
    )
    table.add_column("step", no_wrap=True)
    table.add_column(f"RMS ({shown.symbol})", justify="right", no_wrap=True)
    table.add_column("held out", justify="right", no_wrap=True)
    table.add_column("adjusted p", justify="right", no_wrap=True)
    taken_out = not all(step.added for step in diagnosis.steps)
    if taken_out:
        table.add_column("why", overflow="fold")
    started = ", ".join(spoken(name) for name in diagnosis.start.names) or "no effect"
    before = diagnosis.rms_heldout_before
    held_out = shown.text(before) if math.isfinite(before) else ""
    table.add_row(Text(f"start: {started}"), shown.text(diagnosis.rms_before), held_out, "")
    for step in diagnosis.steps:
        sign, style = ("+ ", "") if step.added else ("− ", "yellow")
        table.add_row(
            Text(sign + spoken(step.effect), style=style),
            shown.text(step.rms_train),
            shown.text(step.rms_heldout),
            probability(step.p_adjusted) if step.added else "",
            *([] if step.added else [Text(printable(step.reason))]),
        )
    return table


def _candidates(diagnosis: Diagnosis, shown: Shown) -> Table:
    table = Table(box=SIMPLE, padding=(0, 1, 0, 0))
    table.add_column("not added", no_wrap=True)
    table.add_column(f"RMS with it ({shown.symbol})", justify="right")
    table.add_column("adjusted p", justify="right", no_wrap=True)
    table.add_column("why not", overflow="fold")
    left = [candidate for candidate in diagnosis.candidates if not candidate.accepted]
    for candidate in left[:_MOST_CANDIDATES]:
        words = printable(candidate.reason)
        if candidate.tied_with:
            words += f"{'; ' if words else ''}tied with {', '.join(spoken(name) for name in candidate.tied_with)}"
        table.add_row(
            Text(spoken(candidate.effect)),
            shown.text(candidate.predicted_rms),
            probability(candidate.p_adjusted),
            Text(words),
        )
    if len(left) > _MOST_CANDIDATES:
        table.caption = Text(f"and {len(left) - _MOST_CANDIDATES} more")
    return table


def _pairs(head: str, rows: list[tuple[str, str]]) -> Table:
    table = Table(box=SIMPLE, padding=(0, 1, 0, 0))
    table.add_column(head, no_wrap=True)
    table.add_column("why", overflow="fold")
    for name, words in rows:
        table.add_row(Text(name), Text(words))
    return table
