"""``rtec effects``: the library of physical effects, each with its card."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from rtec.cli import _measured
from rtec.cli._console import print_json
from rtec.cli._parameters import needs, option
from rtec.cli._words import EFFECTS, completing

if TYPE_CHECKING:
    from rtec.effects import Effect, Library
    from rtec.inference.effect_check import EffectCheck


def effects(
    name: str | None = typer.Argument(
        None, metavar="[NAME]", help="Show the card of one effect.", autocompletion=completing(EFFECTS)
    ),
    *,
    own: Path | None = _measured.EFFECTS,
    check: Path | None = option("--check", "FILE.py", "See what effects of your own would show on a plan."),
    plan: Path | None = option("--plan", "DATA", "The plan: a measurement, for its targets, speeds and noise."),
    observe: str | None = option("--observe", "QUANTITY", "What is explained of it: deviation without it."),
    json: bool = _measured.JSON,
) -> None:
    """List the physical effects that are known, show the card of one, or check those that you wrote.

    A check runs the functions on the readings of a plan: are they finite, how long does a call take, which effects of
    the library look alike there, and how small an amplitude would be found? Exits with 1 where the plan shows none.

    Example: rtec effects backlash
    Example: rtec effects thermal_growth --json
    Example: rtec effects --check mine.py --plan z_axis.csv
    """
    from rtec.effects.library import OF_LOOP
    from rtec.effects.own_file import library_of_file

    if check is not None or plan is not None:
        if check is None or plan is None:
            raise needs("--plan", "--check FILE.py") if check is None else needs("--check", "--plan DATA")
        _check(check, plan, observe, as_json=json)
        return
    library = library_of_file(own).with_own(OF_LOOP)
    if name is not None:
        effect = library.named(name)
        if json:
            print_json(_document(effect))
        else:
            _show_card(effect)
    elif json:
        print_json({"effects": [_document(effect) for effect in library]})
    else:
        _show_library(library)


def _document(effect: Effect) -> dict[str, Any]:
    from rtec.effects import Observable, Units
    from rtec.effects.protocol import LABELS
    from rtec.inference.forms import forms_of

    units = Units("n" if effect.observable is Observable.DRIVE else "mm", "mm", "s")
    card = effect.card
    return {
        "name": effect.name,
        "title": card.title,
        "observable": "any" if effect.observable is None else effect.observable.value,
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
    found = [{"name": item.name, "unit": units.of(item), "meaning": str(item.metadata["meaning"])} for item in items]
    amplitudes = effect.amplitudes(effect.shape_type(), units)
    for amplitude in amplitudes:
        found.append({"name": amplitude.name, "unit": amplitude.unit, "meaning": "amplitude"})
    if not amplitudes:
        found.append({"name": "at_...", "unit": units.shown[0], "meaning": "amplitude at each node"})
    return found


def _show_library(library: Library) -> None:
    from rich.box import SIMPLE
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    from rtec.effects import Observable

    console = Console(highlight=False)
    kinds = {Observable.DEVIATION: "deviation of position", Observable.DRIVE: "force or current of a drive"}
    for kind, words in kinds.items():
        table = Table(title=f"effects that explain a {words}", title_justify="left", box=SIMPLE, padding=(0, 1, 0, 0))
        table.add_column("name", no_wrap=True)
        table.add_column("what")
        table.add_column("needs")
        for effect in library:
            if effect.explains(kind):
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


def _check(file: Path, plan: Path, observe: str | None, *, as_json: bool) -> None:
    from rtec.dataset.load import load_dataset
    from rtec.effects.own_file import library_of_file
    from rtec.inference.effect_check import check_effect

    library = library_of_file(file, name="--check")
    dataset = load_dataset(plan, observe=observe, library=library)
    found = [check_effect(effect, dataset) for effect in library.own]
    unit, factor = dataset.units.shown
    if as_json:
        print_json({"plan": str(plan), "rows": dataset.rows, "unit": unit,
                    "effects": [_checked(one, factor) for one in found]})  # fmt: skip
    else:
        for one in found:
            typer.echo(_check_words(one, unit, factor))
    if any(one.untestable for one in found):
        raise typer.Exit(1)


def _checked(one: EffectCheck, factor: float) -> dict[str, Any]:
    return {
        "name": one.effect.name,
        "not_testable": one.untestable,
        "shapes": one.shapes,
        "call_s": one.call_s,
        "smallest_amplitude": None if one.smallest is None else [amplitude * factor for amplitude in one.smallest],
        "same_as": one.same,
        "look_alikes": [{"name": a.effect, "cosine": a.cosine, "largest_cosine": a.most} for a in one.alike],
    }


def _check_words(one: EffectCheck, unit: str, factor: float) -> str:
    """Return what a check says of one effect, in lines."""
    from rtec.readable import quantity_text

    name = one.effect.name
    if one.untestable is not None:
        return f"{name}: this plan cannot show it: {one.untestable}"
    lines = [f"{name}: finite at every reading; {one.shapes} shapes, {1e3 * one.call_s:.2g} ms a call"]
    if one.smallest is not None:
        usual, worst = (quantity_text(amplitude * factor, unit, digits=2) for amplitude in one.smallest)
        unfavourable = f" ({worst} where its shape is least favourable)" if worst != usual else ""
        lines.append(f"  found from an amplitude of {usual} on{unfavourable}")
    if one.same is not None:
        lines.append(f"  on this plan it equals {one.same}: no reading tells the two apart")
    others = [
        f"{a.effect} (cosine {a.cosine:.3f}, at most {a.most:.3f})" for a in one.alike[:5] if a.effect != one.same
    ]
    lines.append(f"  looks like {', '.join(others)}" if others else "  looks like no other effect")
    return "\n".join(lines)
