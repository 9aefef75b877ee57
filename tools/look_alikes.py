"""Print docs/look-alikes.md from the library: python -m tools.look_alikes > docs/look-alikes.md."""

from __future__ import annotations

import sys
import textwrap

from rtec.effects import LIBRARY, Observable
from rtec.effects.library import OF_LOOP

HEAD = """# Which experiment tells them apart

Written by `python -m tools.look_alikes > docs/look-alikes.md` from the cards of the [library](effects.md). On a poor
plan the effects of a line predict the same readings: the verdict is TIED, and `rtec diagnose` prints the sentence
below. On the plan that the sentence describes they differ.
"""
TITLES = {
    Observable.DEVIATION: "## Errors of position",
    Observable.DRIVE: "## Forces, torques and currents of a drive",
}


def page() -> str:
    """Return the page."""
    every = (*LIBRARY, *OF_LOOP)
    order = [effect.name for effect in every]
    parts = [HEAD]
    for kind, title in TITLES.items():
        pairs: dict[str, list[str]] = {}
        for effect in every:
            for rival in effect.rivals:
                if effect.observable is kind and order.index(effect.name) < order.index(rival.name):
                    pairs.setdefault(rival.experiment, []).append(f"`{effect.name}` and `{rival.name}`")
        parts.append(title + "\n")
        for experiment, names in pairs.items():
            words = f"- {', '.join(names)}: {experiment}."
            parts.append(textwrap.fill(words, 118, subsequent_indent="  ", break_on_hyphens=False) + "\n")
    return "\n".join(parts)


if __name__ == "__main__":
    sys.stdout.write(page())
