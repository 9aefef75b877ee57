"""What a sheet shows, as texts: the same for the page and for the PDF."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from rtec.metrology import UNITS, JudgedTest
from rtec.report.appearance import joined, printable
from rtec.report.iso230.figure_table import (
    ISO_FIGURES,
    READING_FIGURES,
    VDI_FIGURES,
    FigureTable,
    figure_table,
    number_text,
)
from rtec.units import symbol

_TARGET_COLUMNS = (
    ("mean_forward", "mean ↑"),
    ("mean_backward", "mean ↓"),
    ("mean", "mean"),
    ("reversal", "B"),
    ("s_forward", "s ↑"),
    ("s_backward", "s ↓"),
    ("R_forward", "R ↑"),
    ("R_backward", "R ↓"),
    ("R", "R"),
    ("n_forward", "n ↑"),
    ("n_backward", "n ↓"),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class SheetUnits:
    """Units of a sheet."""

    name: str
    symbol: str
    """Of deviations, as in files and for people."""
    factor: float
    """From the unit inside to it."""
    position_symbol: str
    position_factor: float
    """The same for targets."""


def units_of(test: JudgedTest, unit: str | None) -> SheetUnits:
    """Return the units of a test's sheet.

    Raises
    ------
    ArgumentError
        A unit that the axis does not have.
    """
    name, factor = test.figures.unit_of(unit)
    coordinate = test.figures.coordinate
    position = "inch" if name == "inch" else coordinate.value
    return SheetUnits(
        name=name,
        symbol=symbol(name),
        factor=factor,
        position_symbol=symbol(position),
        position_factor=UNITS[coordinate][position],
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SheetOfTest:
    """What is shown of one test."""

    judged: JudgedTest
    document: dict[str, Any]
    """The test, and all its figures in the unit of the sheet, under the contract's names."""
    name: str
    """Of the file, for people."""
    facts: tuple[tuple[str, str], ...]
    """What it is: targets, runs, and what the file says of it."""
    warnings: tuple[str, ...]
    uncertainty: tuple[str, ...]
    """Sentences."""
    targets: tuple[tuple[str, ...], ...]
    """A row of texts for each target, under ``Sheet.target_headings``."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Sheet:
    """One test, or several beside each other."""

    title: str
    finding: str
    caption: str
    """For people; the caption is that of the plot."""
    units: SheetUnits
    """Of all numbers."""
    table: FigureTable
    """The figures."""
    target_headings: tuple[str, ...]
    """Of the tables of targets."""
    tests: tuple[SheetOfTest, ...]
    """What differs from test to test."""
    definitions: tuple[tuple[str, str], ...]
    """Terms and what they mean."""

    @property
    def document(self) -> dict[str, Any]:
        """What programs get: the document of the test, or those of several as ``files``, each with its ``name``."""
        if len(self.tests) == 1:
            return self.tests[0].document
        return {"files": [{"name": test.judged.name, **test.document} for test in self.tests]}

    @property
    def statements(self) -> list[tuple[str, tuple[str, ...]]]:
        """What is said of the uncertainty, with the names of the tests of which it is said."""
        said: dict[tuple[str, ...], list[str]] = {}
        for test in self.tests:
            said.setdefault(test.uncertainty, []).append(test.name)
        return [(joined(names), sentences) for sentences, names in said.items()]


def sheet_of(tests: Sequence[JudgedTest], unit: str | None) -> Sheet:
    """Return what is shown of tests of one kind of axis.

    Raises
    ------
    ArgumentError
        A unit that the axis does not have.
    """
    units = units_of(tests[0], unit)
    documents = [test.to_dict(units.name) for test in tests]
    names = [printable(test.name) for test in tests]
    table = figure_table(names, documents)
    return Sheet(
        title=f"Positioning test: {joined(names)}",
        finding=_finding(documents, units, table.decimals),
        caption=_caption(tests),
        units=units,
        table=table,
        target_headings=("target", *(heading for _, heading in _TARGET_COLUMNS)),
        tests=tuple(_test_sheet(*one, units, table.decimals) for one in zip(tests, documents, strict=True)),
        definitions=_definitions(),
    )


def _finding(documents: Sequence[dict[str, Any]], units: SheetUnits, decimals: int) -> str:
    said = []
    for key in ("A", "R", "E", "B", "M", "A_forward", "A_backward", "E_forward", "E_backward"):
        values = [document[key] for document in documents]
        if any(value is not None for value in values) and not (len(key) > 1 and documents[0][key[0]] is not None):
            symbol = key.replace("_forward", "↑").replace("_backward", "↓")
            said.append(f"{symbol} {' → '.join(number_text(value, decimals) for value in values)} {units.symbol}")
    return ", ".join(said)


def _caption(tests: Sequence[JudgedTest]) -> str:
    text = (
        "Means of the runs at each target, approached forward (▲, solid) and backward (▽, dashed), with bands of two "
        "standard deviations to either side. Beside the plot: A from the lowest to the highest edge of the bands, E "
        "from the lowest to the highest mean, M the same of the means of both directions (dash-dotted). At the "
        "targets where they are largest: the reversal error B between both means, and the repeatability R over both "
        "bands."
    )
    return text + (" Panels whose ranges differ much have scales of their own." if len(tests) > 1 else "")


def _test_sheet(test: JudgedTest, document: dict[str, Any], units: SheetUnits, decimals: int) -> SheetOfTest:
    at = test.figures.at_targets.target * units.position_factor
    facts = [
        ("targets", f"{at.size}, from {at.min():.9g} to {at.max():.9g} {units.position_symbol}"),
        ("runs in each direction", str(test.figures.runs)),
        *((key.replace("_", " "), text) for key, text in test.facts.items()),
    ]
    rows = []
    for place, row in zip(at.tolist(), document["at_targets"], strict=True):
        cells = [str(row[key]) if key[:2] == "n_" else number_text(row[key], decimals) for key, _ in _TARGET_COLUMNS]
        rows.append((f"{place:.9g}", *cells))
    return SheetOfTest(
        judged=test,
        document=document,
        name=printable(test.name),
        facts=tuple((printable(key), printable(text)) for key, text in facts),
        warnings=tuple(printable(text) for text in test.warnings),
        uncertainty=test.uncertainty.statement(units.symbol, units.factor),
        targets=tuple(rows),
    )


def _definitions() -> tuple[tuple[str, str], ...]:
    first = (
        ("deviation", "Actual position less target (ISO 230-2), as it was measured."),
        ("mean, s", "Mean and standard deviation (with n - 1) of the readings at a target from one direction."),
        ("↑, ↓", "Of one direction of approach: forward, the position increases; backward, it decreases."),
    )
    named = ((f.symbol or f.words, f.definition) for f in (*ISO_FIGURES, *VDI_FIGURES, *READING_FIGURES))
    last = ("U, k = 2", "Expanded measurement uncertainty of the figure for both directions, from what is stated.")
    return (*first, *named, last)
