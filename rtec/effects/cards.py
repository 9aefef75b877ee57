"""What a user reads of the effects: needs and cards, as ``docs/effects.md`` has them, where they are written."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

from rtec.io import pages_folder

LABELS: Mapping[str, str] = {
    "In the plot": "plot",
    "Cause": "cause",
    "Consequence": "consequence",
    "Action": "action",
    "Invariant to": "invariant_to",
    "Source": "source",
}
"""What stands in front of each part of a card on the page."""
_ROW = re.compile(r"^\| `(\w+)` \| .+ \| (.+) \| .+ \|$", re.MULTILINE)
_HEAD = re.compile(r"^### `(\w+)`: (.+)$", re.MULTILINE)
_PART = re.compile(r"^- ([\w ]+): ", re.MULTILINE)


@dataclass(frozen=True, slots=True, kw_only=True)
class Card:
    """What a user reads about an effect, as on the cards of a ballbar's help."""

    title: str
    needs: str
    """What it needs from the data."""
    plot: str
    """How it looks, and in which plot."""
    cause: str
    consequence: str
    action: str
    invariant_to: str
    """What does not change it."""
    source: str
    """Paper, section, equation or table; docs/references.md has them in full."""


@cache
def cards() -> Mapping[str, Card]:
    """Return the card of each effect by its name, in the order of the page.

    Examples
    --------
    >>> cards()["drift"].invariant_to
    'position, direction and feed.'
    """
    page = (pages_folder() / "effects.md").read_text(encoding="utf-8")
    needs = dict(_ROW.findall(page))
    _, *sections = _HEAD.split(page)
    found = {}
    for name, title, text in zip(sections[::3], sections[1::3], sections[2::3], strict=True):
        _, *parts = _PART.split(text)
        words = {LABELS[label]: " ".join(part.split()) for label, part in zip(parts[::2], parts[1::2], strict=True)}
        found[name] = Card(title=title, needs=needs[name], **words)
    return found
