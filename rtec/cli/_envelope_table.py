"""How ``rtec envelope`` tells its result on the terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table

from rtec.report.appearance import MISSING

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rtec.campaign.envelope import EnvelopeRow

_HEADINGS = ("processor", "design", "safe up to", "limited by", "inserts up to", "acceleration", "500 kHz")


def show(rows: Sequence[EnvelopeRow]) -> None:
    """Print a line for each row, and what they mean."""
    table = Table()
    for heading in _HEADINGS:
        table.add_column(heading, justify="left" if heading in ("processor", "design", "limited by") else "right")
    for row in rows:
        gate = row.gate
        table.add_row(
            row.processor,
            row.design.value,
            hertz(row.max_safe_hz),
            row.limited_by.value,
            MISSING if gate is None or gate.gate_hz is None else hertz(gate.gate_hz),
            MISSING if gate is None else _acceleration(gate.max_acceleration_counts_s2),
            "yes" if row.reaches_500khz else "no",
        )
    console = Console(highlight=False)
    console.print(table)
    for row in rows:
        if row.gate is not None and row.gate.counts_right is False:
            console.print(
                f"design {row.design.value}, {row.processor}: counts go wrong above the speed gate", style="bold red"
            )
    swept = "clock by clock" if rows and rows[0].exhaustive else "in steps of 61 clocks (--exhaustive: of one)"
    console.print(
        "Frequencies of the encoder's square waves. Safe: no count lost whatever came before; 'inserts up to': what "
        "the speed gate lets through at steady speed; acceleration at counts of 1 um. Limits found are swept over a "
        f"reading {swept}.",
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
    return f"{counts_s2 * 1e-6:.3g} m/s²" if counts_s2 else "none"
