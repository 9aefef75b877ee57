"""The coverage of a campaign as a table of its report, with the names of its holes, and as CSV."""

from __future__ import annotations

from typing import Any

from rtec.report.rendering import csv_text
from rtec.verify.campaign.coverage import Coverage, Group

Cell = tuple[str, str]
"""Text and look of a cell: ``full``, ``part``, ``none``; empty where nothing can be."""


def coverage_values(coverage: Coverage | None) -> dict[str, Any]:
    """Return what the template of the page names: heads and rows of the table, holes by name, and what is left out.

    The last dimension is laid out across.
    """
    if coverage is None:
        return {"coverage": None}
    groups = coverage.groups()
    *down, across = [name for name in coverage.dimensions if name != coverage.named]
    columns = list(dict.fromkeys(key[-1] for key in groups))
    rows: dict[tuple[str, ...], dict[str, Group]] = {}
    for key, group in groups.items():
        rows.setdefault(key[:-1], {})[key[-1]] = group
    laid_out = [(key, [_cell(of.get(column)) for column in columns]) for key, of in rows.items()]
    document = coverage.to_dict()
    return {
        "coverage": f"{document['hit']} of {document['possible']} combinations of {', '.join(coverage.dimensions)} "
        f"were hit; the others are holes. Each cell counts the values of {coverage.named}.",
        "coverage_heads": [*down, *(f"{across} {one}" for one in columns)],
        "coverage_rows": [(key, cells) for key, cells in laid_out if any(text for text, _ in cells)],
        "coverage_holes": [
            (
                ", ".join(f"{name} {value}" for name, value in zip((*down, across), key, strict=True)),
                "; ".join(group.holes) if group.hit else f"all {len(group.holes)}",
            )
            for key, group in groups.items() if group.holes
        ],
        "left_out": document["left_out"],
    }  # fmt: skip


def _cell(group: Group | None) -> Cell:
    possible = 0 if group is None else len(group.hit) + len(group.holes)
    if group is None or not possible:
        return "", ""
    look = "full" if not group.holes else "part" if group.hit else "none"
    return f"{len(group.hit)} of {possible}", look


def coverage_csv(coverage: Coverage) -> str:
    """Return a row for each combination: its values, the jobs that took effect so, and why none can."""
    rows: list[tuple[object, ...]] = [(*coverage.dimensions, "jobs", "hole", "left_out")]
    for one in coverage.combinations():
        rows.append((*one.values.values(), one.jobs, "yes" if one.hole else "", one.reason))
    return csv_text(rows)
