"""What ``rtec train`` was asked for, whatever kind of data it trains on."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from rtec.cli._measured import AxisOptions, ColumnOptions


@dataclass(frozen=True, slots=True, kw_only=True)
class TrainOptions:
    """Options and their values; None where the user said nothing."""

    heldout: Path | None
    output: Path | None
    pick: str | None
    observe: str | None
    blocks: str | None
    inputs: list[str] | None
    figure: Path | None
    budget_s: float | None
    starts: int
    thesis: bool
    axis: AxisOptions
    effects: Path | None
    columns: ColumnOptions
    seed: int
    force: bool
    json: bool
