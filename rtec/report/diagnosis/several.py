"""Several diagnoses or comparisons beside each other: what differs from the first."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from rich.box import SIMPLE
from rich.console import Group
from rich.table import Table
from rich.text import Text

from rtec.inference.changes import Change, Outcome
from rtec.inference.results import Diagnosis, Value
from rtec.io import strict
from rtec.report.appearance import printable
from rtec.report.diagnosis.document import comparison_document, diagnosis_document
from rtec.report.diagnosis.quantities import probability, shown_for, value_text
from rtec.report.diagnosis.sentence import spoken

if TYPE_CHECKING:
    from collections.abc import Mapping

    from rtec.inference.compare import Comparison

    Results = Mapping[str, Diagnosis | Comparison]
    Changes = Mapping[str, Sequence[Change]]

_WAYS_TO_EFFECTS = "'rtec diagnose' looks for effects in each, --model M.toml of 'rtec compare' names some"
_STYLES = {
    Outcome.SAME: "dim",
    Outcome.DIFFERS: "bold yellow",
    Outcome.NEW: "bold yellow",
    Outcome.GONE: "bold yellow",
    Outcome.OPEN: "dim",
}


def several_document(results: Results, found: Changes) -> dict[str, Any]:
    """Return several results as plain data.

    Parameters
    ----------
    results
        Diagnoses or comparisons by the name of their file, the first of which the others are held against.
    found
        What differs from the first, by the name of the file.

    Returns
    -------
    dict
        ``files``: the document of each, with its ``file``; ``changes``: one entry a parameter.
    """
    documents = [
        {"file": name} | (diagnosis_document(one) if isinstance(one, Diagnosis) else comparison_document(one))
        for name, one in results.items()
    ]
    entries = [{"file": name} | entry for name, of_file in found.items() for entry in change_entries(of_file)]
    cleaned: dict[str, Any] = strict({"files": documents, "changes": entries})
    return cleaned


def change_entries(found: Sequence[Change]) -> list[dict[str, Any]]:
    """Return changes as plain data, one entry a parameter."""
    entries = [
        {
            "effect": change.effect,
            "parameter": change.parameter,
            "first": _plain_value(change.first),
            "other": _plain_value(change.other),
            "difference": change.difference,
            "error": change.error,
            "p_adjusted": change.p_adjusted,
            "outcome": change.outcome.value,
            "reason": change.reason,
        }
        for change in found
    ]
    cleaned: list[dict[str, Any]] = strict(entries)
    return cleaned


def _plain_value(value: Value | None) -> list[float | str | None] | None:
    return None if value is None else [value.value, value.error, value.unit]


def several_table(results: Results, found: Changes, first: str = "") -> Group:
    """Return what is left of each measurement, and what differs from the first of them, or from ``first``."""
    table = Table(box=SIMPLE, padding=(0, 1, 0, 0))
    table.add_column("file", overflow="fold")
    for head in heads_of(results):
        table.add_column(head, justify="right")
    for name, cells in left_rows(results):
        table.add_row(Text(name), *cells)
    return Group(
        table, *(changes_table(first or next(iter(results)), name, of_file) for name, of_file in found.items())
    )


def heads_of(results: Results) -> tuple[str, ...]:
    """Return the headings over `left_rows`, behind that of the file."""
    unit = shown_for(next(iter(results.values())).dataset).symbol
    left = (f"left ({unit})", f"held out ({unit})", f"noise ({unit})")
    return ("verdict", f"measured ({unit})", *left) if _all_diagnosed(results) else left


def _all_diagnosed(results: Results) -> bool:
    return all(isinstance(one, Diagnosis) for one in results.values())


def left_rows(results: Results) -> list[tuple[str, list[str]]]:
    """Return the RMS of each measurement, of what is left of it and of its noise, in the unit of the first."""
    shown = shown_for(next(iter(results.values())).dataset)
    rows = []
    for name, one in results.items():
        left, before = (one.rms_after, one.rms_before) if isinstance(one, Diagnosis) else (one.rms, 0.0)
        cells = [shown.text(value) for value in (left, one.rms_heldout, one.noise.floor)]
        if isinstance(one, Diagnosis):
            cells = [one.verdict.value, shown.text(before), *cells]
        rows.append((printable(name), cells))
    return rows


def change_rows(found: Sequence[Change]) -> list[list[str]]:
    """Return effect, first value, other value, adjusted p and outcome of each change, as people read them."""
    return [
        [
            _what(change),
            *("" if value is None else value_text(value) for value in (change.first, change.other)),
            "" if change.p_adjusted is None else probability(change.p_adjusted),
            ": ".join(filter(None, (change.outcome.value, printable(change.reason)))),
        ]
        for change in found
    ]


def _what(change: Change) -> str:
    apart = change.parameter and change.parameter != change.effect
    return f"{spoken(change.effect)}, {spoken(change.parameter)}" if apart else spoken(change.effect)


def changes_table(first: str, name: str, found: Sequence[Change]) -> Table | Text:
    """Return what differs between two measurements, or between a measurement and a model, by their names."""
    if not found:
        return Text(f"{printable(name)} and {printable(first)}: no effect to compare; {_WAYS_TO_EFFECTS}")
    table = Table(box=SIMPLE, padding=(0, 1, 0, 0), title=Text(f"{printable(name)} against {printable(first)}"))
    table.title_justify = "left"
    for head, justify in (("effect", "left"), ("first", "right"), ("other", "right"), ("p", "right"), ("", "left")):
        table.add_column(head, justify=justify, overflow="fold")  # type: ignore[arg-type]  # words of the library
    for change, row in zip(found, change_rows(found), strict=True):
        table.add_row(*map(Text, row[:-1]), Text(row[-1], style=_STYLES[change.outcome]))
    return table


def changes_sentence(first: str, found: Changes) -> str:
    """Return what differs from the first measurement, in one sentence a file: the first parameter of each effect.

    Examples
    --------
    >>> change = Change(effect="backlash", parameter="backlash", first=Value("backlash", 12.0, 0.2, "um"),
    ...                 other=Value("backlash", 3.0, 0.2, "um"), outcome=Outcome.DIFFERS)
    >>> changes_sentence("before.csv", {"after.csv": [change]})
    'after.csv against before.csv: backlash 3.00 ± 0.20 µm instead of 12.00 ± 0.20 µm.'
    >>> changes_sentence("before.csv", {"after.csv": []})
    'after.csv against before.csv: nothing that could be compared.'
    """
    sentences = []
    for name, of_file in found.items():
        differing: dict[str, str] = {}
        for change in of_file:
            if change.outcome not in (Outcome.SAME, Outcome.OPEN):
                differing.setdefault(change.effect, _in_words(change))
        told = any(change.outcome is not Outcome.OPEN for change in of_file)
        none = "no difference beyond the errors" if told else "nothing that could be compared"
        says = "; ".join(differing.values()) or none
        sentences.append(f"{printable(name)} against {printable(first)}: {says}.")
    return " ".join(sentences)


def _in_words(change: Change) -> str:
    if change.first is not None and change.other is not None:
        return f"{_what(change)} {value_text(change.other)} instead of {value_text(change.first)}"
    return f"{spoken(change.effect)} is {change.outcome.value}"
