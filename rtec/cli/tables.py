"""``rtec tables``: the state tables that the code walks."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rtec.cli import _console, _measured
from rtec.cli._parameters import design

if TYPE_CHECKING:
    from rtec.injector import Design
    from rtec.injector.walk import Walk


def tables(
    design: Design | None = design("Insertion design; all four without it."),
    json: bool = _measured.JSON,
) -> None:
    """Show what each design does to A and B, from every state and for both signs.

    The states are the report's: 1 is 00, 2 is 10, 3 is 11, 4 is 01 (A, then B), one count from each to the next.

    Example: rtec tables --design c
    Example: rtec tables
    Example: rtec tables --design original --json
    """
    from rtec.injector import Design
    from rtec.injector.walk import walks

    designs = list(Design) if design is None else [design]
    made = [(known, walks(known)) for known in designs]
    if json:
        rows = [{"design": known.key} | walk.to_dict() for known, found in made for walk in found]
        _console.print_json({"design": None if design is None else designs[0].key, "rows": rows})
        return
    for known, found in made:
        _show(known, found)


def _show(design: Design, found: list[Walk]) -> None:
    from rich.console import Console
    from rich.table import Table

    counts = "1 count" if design.step_counts == 1 else f"{design.step_counts} counts"
    table = Table(title=f"{design.title}: a step of {counts}", title_justify="left")
    table.add_column("encoder")
    table.add_column("sign")
    for title in ("states", "A and B", "counts", "changes"):
        table.add_column(title)
    for walk in found:
        table.add_row(
            f"{walk.state} ({walk.start_levels})",
            "+" if walk.sign > 0 else "-",
            " ".join(str(state) for state in walk.states),
            " ".join(walk.levels),
            " ".join(f"{count:+d}" for count in walk.counts),
            " ".join(walk.lines),
        )
    Console(highlight=False).print(table)
