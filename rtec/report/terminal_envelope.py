"""How ``rtec envelope`` tells its result on the terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table

from rtec.readable import hertz_text

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rtec.verify.envelope.rows import EnvelopeRow

_HEADINGS = ("processor", "design", "500 kHz", "inserts to", "safe to", "limited by")
_WORDS = ("processor", "design", "500 kHz", "limited by")


def show(rows: Sequence[EnvelopeRow]) -> None:
    """Print a line for each row, and what they mean."""
    table = Table(box=None, pad_edge=False, padding=(0, 1, 0, 0), header_style="bold")
    for heading in _HEADINGS:
        table.add_column(heading, justify="left" if heading in _WORDS else "right", no_wrap=True)
    for row in rows:
        table.add_row(
            row.processor.name,
            row.design.value,
            row.speeds.at_top.value,
            *(
                hertz_text(value, 4) if value else "none"
                for value in (row.speeds.frequencies.max_inserting_hz, row.max_safe_hz)
            ),
            row.limited_by.value,
        )
    console = Console(highlight=False)
    console.print(table)
    for row in rows:
        console.print(f"{row.design.value} on {row.processor.name}: {_more(row)}", soft_wrap=True)
    for row in rows:
        if row.counts_right is False:
            words = f"design {row.design.value}, {row.processor.name}: counts go wrong above the speed gate"
            console.print(words, style="bold red")
    console.print(_meaning(rows), soft_wrap=True)


def _more(row: EnvelopeRow) -> str:
    """Return what stands in the data sheet of a row, and how fast its steady motion may become faster."""
    said = [value if name == "frequency" else f"{name}: {value}" for name, value in row.speeds.data_sheet()]
    ramp = row.max_acceleration_counts_s2
    if ramp is not None:
        said.append(f"from steady motion: {ramp * 1e-6:.3g} m/s² at counts of 1 um")
    return "; ".join(said)


def _meaning(rows: Sequence[EnvelopeRow]) -> str:
    said = (
        "Frequencies of the encoder's square waves. Inserts to: a step is completed during the motion. Passes to: "
        "every count is right. "
    )
    plan = rows[0].plan if rows else None
    if plan is not None and plan.motion is not None:
        return f"{said}Safe to: the same. The frequency is the top speed of the motion: {plan.motion.kind.value}."
    swept = (
        "clock by clock" if plan is not None and plan.exhaustive else "in steps of 61 clocks (--exhaustive: of one)"
    )
    return (
        f"{said}Both at steady speed. Safe to: no count lost in a burst behind an insertion, whatever came before. "
        "Acceleration: of starts from rest at any moment of an insertion; from steady motion: what insertions that "
        f"the speed gate lets through bear. The limits found were swept over a reading {swept}."
    )
