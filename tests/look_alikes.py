"""Print docs/look-alikes.md from the library, or the cards of docs/effects.md.

python -m tests.look_alikes > docs/look-alikes.md
python -m tests.look_alikes --cards
"""

from __future__ import annotations

import sys
import textwrap

from rtec.effects import LIBRARY, Effect, Observable

HEAD = """# Which experiment tells them apart

Written by `python -m tests.look_alikes > docs/look-alikes.md` from the cards of the [library](effects.md). On a poor
plan the effects of a line predict the same readings: the verdict is TIED, and `rtec diagnose` prints the sentence
below. On the plan that the sentence describes they differ.
"""
TITLES = {
    Observable.DEVIATION: "## Errors of position",
    Observable.DRIVE: "## Forces, torques and currents of a drive",
}


def page() -> str:
    """Return the page."""
    order = [effect.name for effect in LIBRARY]
    parts = [HEAD]
    for kind, title in TITLES.items():
        pairs: dict[str, list[str]] = {}
        for effect in LIBRARY:
            for rival in effect.rivals:
                if effect.observable is kind and order.index(effect.name) < order.index(rival.name):
                    pairs.setdefault(rival.experiment, []).append(f"`{effect.name}` and `{rival.name}`")
        parts.append(title + "\n")
        for experiment, names in pairs.items():
            words = f"- {', '.join(names)}: {experiment}."
            parts.append(textwrap.fill(words, 118, subsequent_indent="  ", break_on_hyphens=False) + "\n")
    return "\n".join(parts)


def cards() -> str:
    """Return what docs/effects.md shows of each card: how to recognise the effect, and what to do about it."""
    return "\n".join(_card(effect) for effect in LIBRARY)


def _card(effect: Effect) -> str:
    card = effect.card
    lines = [f"In the plot: {card.plot}", f"Cause: {card.cause}", f"Action: {card.action}"]
    items = [textwrap.fill(f"- {line}", 118, subsequent_indent="  ", break_on_hyphens=False) for line in lines]
    return f"### `{effect.name}`: {card.title}\n\n" + "\n".join(items) + "\n"


if __name__ == "__main__":
    sys.stdout.write(cards() if "--cards" in sys.argv else page())
