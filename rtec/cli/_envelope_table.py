"""How ``rtec envelope`` tells its result on the terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table

from rtec.report.appearance import MISSING, joined

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rtec.campaign.envelope import EnvelopeRow

_HEADINGS = ("processor", "design", "safe to", "limited by", "inserts to", "m/s²")
_WORDS = ("processor", "design", "limited by")


def show(rows: Sequence[EnvelopeRow]) -> None:
    """Print a line for each row, and what they mean."""
    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0), header_style="bold")
    for heading in _HEADINGS:
        table.add_column(heading, justify="left" if heading in _WORDS else "right", no_wrap=True)
    for row in rows:
        gate = row.gate
        table.add_row(
            row.processor,
            row.design.value,
            hertz(row.max_safe_hz),
            row.limited_by.value,
            MISSING if gate is None or gate.gate_hz is None else hertz(gate.gate_hz),
            MISSING if gate is None else _acceleration(gate.max_acceleration_counts_s2),
        )
    console = Console(highlight=False)
    console.print(table)
    reaching = [f"{row.design.value} on {row.processor}" for row in rows if row.reaches_500khz]
    console.print(f"500 kHz: {joined(reaching) or 'none of these'}", soft_wrap=True)
    for row in rows:
        if row.gate is not None and row.gate.counts_right is False:
            words = f"design {row.design.value}, {row.processor}: counts go wrong above the speed gate"
            console.print(words, style="bold red")
    swept = "clock by clock" if rows and rows[0].exhaustive else "in steps of 61 clocks (--exhaustive: of one)"
    console.print(
        "Frequencies of the encoder's square waves. Safe: no count lost, whatever came before. Inserts to: what the "
        "speed gate lets through at steady speed. m/s²: acceleration that its insertions bear, at counts of 1 um. "
        f"The limits found were swept over a reading {swept}.",
        soft_wrap=True,
    )


def hertz(value: float) -> str:
    """Return a frequency with four digits and its unit.

    Examples
    --------
    >>> hertz(26909.3), hertz(1107128.0), hertz(0.0)
    ('26.91 kHz', '1.107 MHz', 'none')
    """
    for factor, unit in ((1e6, "MHz"), (1e3, "kHz"), (1.0, "Hz")):
        if value >= factor:
            return f"{value / factor:.4g} {unit}"
    return "none"


def _acceleration(counts_s2: float | None) -> str:
    if counts_s2 is None:
        return MISSING
    return f"{counts_s2 * 1e-6:.3g}" if counts_s2 else "none"
