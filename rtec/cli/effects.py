"""``rtec effects``: the library of physical effects, each with its card."""

from __future__ import annotations

from dataclasses import fields
from typing import TYPE_CHECKING, Any

import typer

from rtec.cli import _measured
from rtec.cli._console import print_json
from rtec.cli._words import EFFECTS, completing

if TYPE_CHECKING:
    from rtec.effects import Effect


def effects(
    name: str | None = typer.Argument(
        None, metavar="[NAME]", help="Show the card of one effect.", autocompletion=completing(EFFECTS)
    ),
    json: bool = _measured.JSON,
) -> None:
    """List the physical effects that are known, or show the card of one.

    Example: rtec effects backlash
    Example: rtec effects
    Example: rtec effects thermal_growth --json
    """
    from rtec.effects import LIBRARY, effect_named

    if name is not None:
        effect = effect_named(name)
        if json:
            print_json(_document(effect))
        else:
            _show_card(effect)
    elif json:
        print_json({"effects": [_document(effect) for effect in LIBRARY]})
    else:
        _show_library(LIBRARY)


def _document(effect: Effect) -> dict[str, Any]:
    from rtec.effects import Observable, Units
    from rtec.effects.protocol import LABELS
    from rtec.inference.forms import forms_of

    units = Units("n" if effect.observable is Observable.DRIVE else "mm", "mm", "s")
    card = effect.card
    return {
        "name": effect.name,
        "title": card.title,
        "observable": effect.observable.value,
        "needs": effect.needs,
        "parameters": _parameters(effect, units),
        **{key: getattr(card, key) for key in LABELS.values()},
        "look_alikes": [
            {"name": rival.name, "experiment": rival.experiment, "permanent": rival.permanent}
            for rival in effect.rivals
        ],
        "contains": sorted(forms_of(effect).contains),
        "at_most": forms_of(effect).at_most,
    }


def _parameters(effect: Effect, units: Any) -> list[dict[str, str]]:
    items = fields(effect.shape_type)
    found = [
        {"name": item.name, "unit": units.of(item), "meaning": str(item.metadata["meaning"])}
        for item in items
    ]
    amplitudes = effect.amplitudes(effect.shape_type(), units)
    for amplitude in amplitudes:
        found.append({"name": amplitude.name, "unit": amplitude.unit, "meaning": "amplitude"})
    if not amplitudes:
        found.append({"name": "at_...", "unit": units.shown[0], "meaning": "amplitude at each node"})
    return found


def _show_library(library: tuple[Effect, ...]) -> None:
    from rich.box import SIMPLE
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    console = Console(highlight=False)
    for kind, words in (("deviation", "deviation of position"), ("drive", "force or current of a drive")):
        table = Table(title=f"effects that explain a {words}", title_justify="left", box=SIMPLE, padding=(0, 1, 0, 0))
        table.add_column("name", no_wrap=True)
        table.add_column("what")
        table.add_column("needs")
        for effect in library:
            if effect.observable.value == kind:
                table.add_row(effect.name, escape(effect.card.title), escape(effect.needs))
        console.print(table)
    console.print("'rtec effects NAME' shows the card of one.")


def _show_card(effect: Effect) -> None:
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    from rtec.effects.protocol import LABELS

    document = _document(effect)
    *said, source = ((label.lower(), str(document[key])) for label, key in LABELS.items())
    rows = list(said)
    rows.append(("needs", effect.needs))
    quantities = [f"{p['name']} ({p['unit']})" if p["unit"] else p["name"] for p in document["parameters"]]
    rows.append(("parameters", ", ".join(quantities)))
    for rival in effect.rivals:
        never = " (with any plan of the same instrument)" if rival.permanent else ""
        rows.append(("confounded with", f"{rival.name}{never}; to separate them: {rival.experiment}"))
    rows.append(source)
    table = Table(title=f"{effect.name}: {effect.card.title}", title_justify="left", show_header=False, box=None)
    table.add_column(style="bold", no_wrap=True)
    table.add_column()
    for label, text in rows:
        table.add_row(label, Text(text))
    Console(highlight=False).print(table)
