"""Write the table and the cards of docs/effects.md from the library: python -m tools.effects_page.

What stands before the table and between table and cards is written by hand and stays; the cards end the page.
"""

from __future__ import annotations

import textwrap
from pathlib import Path

from rtec.effects import LIBRARY, Effect, Observable, Units
from rtec.effects.library import OF_LOOP
from rtec.effects.protocol import LABELS

PAGE = Path(__file__).parents[1] / "docs" / "effects.md"
TABLE = "| effect | adds | needs | amplitude in |\n|---|---|---|---|\n"
CARDS = "## Cards\n"
UNITS = {Observable.DEVIATION: Units("mm", "mm", "s"), Observable.DRIVE: Units("n", "mm", "s", "kg")}
TURNING = {"gravity": Units("nm", "deg", "s")}
"""Units of effects that the table shows on a rotary axis."""


def row(effect: Effect) -> str:
    """Return an effect's row of the table."""
    units = TURNING.get(effect.name, UNITS[effect.observable])
    amplitudes = effect.amplitudes(effect.shape_type(), units)
    unit = amplitudes[0].unit if amplitudes else units.shown[0]
    return f"| `{effect.name}` | {effect.card.formula} | {effect.needs} | {unit or 'none'} |\n"


def card(effect: Effect) -> str:
    """Return an effect's card."""
    parts = [f"- {label}: {getattr(effect.card, key)}" for label, key in LABELS.items()]
    lines = [textwrap.fill(part, 118, subsequent_indent="  ", break_on_hyphens=False) for part in parts]
    return "\n".join([f"\n### `{effect.name}`: {effect.card.title}\n", *lines, ""])


def page(written: str) -> str:
    """Return the page with the table and the cards of today; ``written`` is the page as it stands."""
    table, cards = written.index(TABLE), written.index(CARDS)
    between = written[written.index("\n\n", table) + 1 : cards]
    every = (*LIBRARY, *OF_LOOP)
    return written[:table] + TABLE + "".join(map(row, every)) + between + CARDS + "".join(map(card, every))


if __name__ == "__main__":
    PAGE.write_text(page(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
