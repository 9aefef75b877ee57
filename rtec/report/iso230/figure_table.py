"""Figures of positioning tests as tables list them: names, definitions, groups, and numbers with equal decimals."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from rtec.readable import MISSING


class FigureName(NamedTuple):
    """How a table calls a figure."""

    key: str
    """In the document of a test; those of the single directions end in ``_forward`` and ``_backward``."""
    symbol: str
    """As standards write it, or nothing."""
    words: str
    """In the field's words."""
    definition: str
    """One sentence."""


ISO_FIGURES = (
    FigureName("A", "A", "accuracy", "Largest mean + 2s less smallest mean - 2s, over all targets."),
    FigureName(
        "R", "R", "repeatability",
        "Largest, over the targets, of 4s of a direction and of 2s forward + 2s backward + |reversal|.",
    ),
    FigureName("E", "E", "systematic error", "Largest mean less smallest mean."),
    FigureName("M", "M", "mean bidirectional error", "Largest less smallest average of both directions' means."),
    FigureName(
        "B", "B", "reversal error",
        "Largest difference, of either sign, of the means forward and backward at one target.",
    ),
    FigureName(
        "B_mean", "B̄", "mean reversal error",
        "Mean over the targets of the mean forward less the mean backward, with its sign.",
    ),
)  # fmt: skip
"""Figures of ISO 230-2:2014, clause 3."""
VDI_FIGURES = (
    FigureName(
        "P", "P", "positional uncertainty",
        "Positionsunsicherheit: largest mean + (U + Ps) / 2 less smallest mean - (U + Ps) / 2, both ways.",
    ),
    FigureName(
        "Pa", "Pa", "positional deviation", "Positionsabweichung: largest less smallest mean of both directions."
    ),
    FigureName(
        "U_max", "Umax", "largest reversal",
        "Umkehrspanne: U is the size of the difference of both directions' means at a target.",
    ),
    FigureName("U_mean", "Ū", "mean reversal", "Mean of U over the targets."),
    FigureName(
        "Ps_max", "Psmax", "largest scatter, 6s",
        "Positionsstreubreite: Ps is six times the mean of both directions' s at a target.",
    ),
    FigureName("Ps_mean", "P̄s", "mean scatter, 6s", "Mean of Ps over the targets."),
)  # fmt: skip
"""Figures of VDI/DGQ 3441."""
READING_FIGURES = (
    FigureName(
        "max_average_error", "", "maximum average error",
        "Largest less smallest mean, both directions: the thesis's name for E.",
    ),
    FigureName(
        "max_reversal_error", "", "maximum reversal error",
        "Largest difference between the means of both directions at one target: the thesis's name for B.",
    ),
    FigureName(
        "max_repeat", "", "maximum repeat",
        "The thesis names it and does not define it; here: largest less smallest of all readings at one target, both "
        "directions, where that is largest.",
    ),
    FigureName(
        "cyclic_pp", "", "cyclic, peak to peak",
        "Peak to peak of what repeats with the period (a turn of the screw), forward where that was measured: fitted "
        "to the means together with a slow trend.",
    ),
    FigureName("rms", "rms", "root mean square", "Of all readings, about zero."),
    FigureName("pp", "pp", "peak to peak", "Largest less smallest reading."),
)  # fmt: skip
"""Figures of the thesis and of the bare readings."""
_GROUPS = (("ISO 230-2", ISO_FIGURES), ("VDI/DGQ 3441", VDI_FIGURES), ("thesis and all readings", READING_FIGURES))
DIRECTIONS = {"": "", "_forward": "↑", "_backward": "↓"}
"""Ends of keys, and the arrow behind the symbol."""

_DECIMALS = {"um": 1, "mm": 4, "nm": 0, "inch": 6, "arcsec": 1, "deg": 5, "urad": 1}
_MOST_MORE = 4


@dataclass(frozen=True, slots=True, kw_only=True)
class FigureRow:
    """A row of a table of figures: words, symbol, and a text in each column."""

    words: str
    symbol: str
    cells: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class FigureGroup:
    """Rows of one standard."""

    title: str
    rows: tuple[FigureRow, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class FigureTable:
    """The figures of one test or several, all with the same decimals."""

    headings: tuple[str, ...]
    """Of the columns: one test has both directions, each of them, and the uncertainty where one is stated; several
    have a column each."""
    groups: tuple[FigureGroup, ...]
    """ISO 230-2, VDI/DGQ 3441, thesis and bare readings, without what no test has."""
    decimals: int
    """Of every number."""


def figure_table(names: Sequence[str], documents: Sequence[Mapping[str, Any]]) -> FigureTable:
    """Return the figures of tests of one kind of axis as a table."""
    flat = [_flat(document) for document in documents]
    digits = decimals(
        documents[0]["unit"], (document.get(key) for document in flat for key in ("A", "R", "E", "M", "B"))
    )
    several, sure = len(names) > 1, any(document["uncertainty"]["contributions"] for document in documents)
    headings = tuple(names) if several else ("both", "forward", "backward", *["U, k = 2"][:sure])
    groups = []
    for title, listed in _GROUPS:
        rows = []
        for figure in listed:
            keys = {f"{figure.symbol}{arrow}": f"{figure.key}{end}" for end, arrow in DIRECTIONS.items()}
            if several:
                rows += [_row(figure, symbol, [(d, key) for d in flat], digits) for symbol, key in keys.items()]
            else:
                keys |= {"U": f"U_{figure.key}"} if sure else {}
                rows.append(_row(figure, figure.symbol, [(flat[0], key) for key in keys.values()], digits))
        known = _named_once([row for row in rows if row.cells.count("") < len(row.cells)])
        groups += [FigureGroup(title=title, rows=known)] if known else []
    return FigureTable(headings=headings, groups=tuple(groups), decimals=digits)


def _named_once(rows: Sequence[FigureRow]) -> tuple[FigureRow, ...]:
    """Return rows of which those of single directions do not repeat the words of the row above."""
    above = ["", *(row.words for row in rows)]
    return tuple(
        replace(row, words="") if row.words == before else row for row, before in zip(rows, above, strict=False)
    )


def _flat(document: Mapping[str, Any]) -> dict[str, Any]:
    """Return the document with the figures of VDI/DGQ 3441 and the uncertainties beside those of ISO 230-2."""
    return {**document, **(document["vdi3441"] or {}), **document["uncertainty"]}


def _row(figure: FigureName, symbol: str, cells: Iterable[tuple[dict[str, Any], str]], digits: int) -> FigureRow:
    values = [document.get(key) for document, key in cells]
    texts = tuple("" if value is None else number_text(value, digits) for value in values)
    return FigureRow(words=figure.words, symbol=symbol, cells=texts)


def decimals(unit: str, values: Iterable[float | None]) -> int:
    """Return the decimals with which all numbers of a table in one unit are written.

    As many as the unit is usually written with (a tenth of a micrometre), and more where a figure would have fewer
    than two digits.

    Examples
    --------
    >>> decimals("um", [135.26, 33.58]), decimals("um", [0.0889, 0.0122]), decimals("mm", [0.13, None, 0.0])
    (1, 3, 4)
    """
    usual = _DECIMALS[unit]
    sizes = [abs(value) for value in values if value is not None and value != 0.0 and math.isfinite(value)]
    needed = 1 - math.floor(math.log10(min(sizes))) if sizes else usual
    return min(max(usual, needed), usual + _MOST_MORE)


def number_text(value: object, digits: int) -> str:
    """Return a number with so many decimals, or a dash where there is none.

    Examples
    --------
    >>> number_text(1.25, 1), number_text(-0.01, 1), number_text(None, 1)
    ('1.2', '0.0', '–')
    """
    if not isinstance(value, int | float) or not math.isfinite(value):
        return MISSING
    return f"{round(value, digits) + 0.0:.{digits}f}"
