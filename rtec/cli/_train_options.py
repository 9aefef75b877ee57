"""What ``rtec train`` was asked for, whatever kind of data it trains on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from rtec.cli._measured import AxisOptions, ColumnOptions
from rtec.errors import ArgumentError, unknown


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

    def row(self, names: Sequence[str], noun: str) -> str | None:
        """Return the row that --pick names, as it is or as one word; None without it."""
        if self.pick is None:
            return None
        as_one_word = {name.lower().replace(" ", "-"): name for name in names}
        if (word := self.pick.lower().replace(" ", "-")) not in as_one_word:
            raise unknown("--pick", self.pick, names, noun=noun)
        return as_one_word[word]

    def refuse_itself(self, data: Path, what_judges: str) -> None:
        """Refuse a log that is to judge what it trains."""
        heldout = self.heldout
        if heldout is not None and data.exists() and heldout.exists() and data.samefile(heldout):
            allowed = f"another one; without it {what_judges}"
            raise ArgumentError("--heldout", heldout, allowed, problem="is the log itself")
