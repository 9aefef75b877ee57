"""The view of box and PC on a terminal: from a plain document to what rich draws."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from rtec.live.waveform_text import waveform_text

Document = Mapping[str, Any]

EVENTS = 8
"""Events shown."""


def picture(document: Document, *, typed: str = "", width: int = 100) -> RenderableType:
    """Return what shows the state of a box (`kind` box) or a PC (`kind` pc).

    Parameters
    ----------
    document
        As `box_screen` and `pc_screen` make it.
    typed
        What the operator has typed of an order.
    width
        Of the terminal, in columns.

    Examples
    --------
    >>> from rich.console import Console
    >>> axis = {"axis": 1, "held": False, "words": "corrections follow", "cells": {"position": "+1 mm"}}
    >>> console = Console(width=60, file=None, color_system=None)
    >>> with console.capture() as shown:
    ...     console.print(picture({"title": "rtec box", "axes": [axis], "events": []}))
    >>> "corrections follow" in shown.get()
    True
    """
    parts: list[RenderableType] = [Text(str(document["title"]), style="bold")]
    axes = list(document["axes"])
    if axes:
        parts.append(_table(axes))
    for axis in axes:
        style = "bold red" if axis["held"] else "green"
        parts.append(Text(f"axis {axis['axis']}: {axis['words']}", style=style))
    for axis in axes[:3]:
        parts.extend(_waveform(axis, width))
    parts += [Text(str(event), style="dim") for event in list(document["events"])[-EVENTS:]]
    if "prompt" in document:
        parts.append(Text(f"{document['prompt']}> {typed}▏"))
    return Group(*parts)


def _table(axes: Sequence[Document]) -> Table:
    table = Table(show_header=True, header_style="bold")
    table.add_column("axis", justify="right")
    for name in axes[0]["cells"]:
        table.add_column(name, justify="right")
    for axis in axes:
        table.add_row(str(axis["axis"]), *(str(cell) for cell in axis["cells"].values()))
    return table


def _waveform(axis: Document, width: int) -> list[RenderableType]:
    """Return the lines around the last insertion."""
    changes = [(int(t), int(level), int(out)) for t, level, out in axis.get("insertion", ())]
    text = waveform_text(changes, most_columns=max(width - 8, 20))
    if text is None:
        return []
    rows = [("A", text.a), ("B", text.b), ("A'", text.a_out), ("B'", text.b_out)]
    head = Text(f"last insertion of axis {axis['axis']}: {text.caption}", style="dim")
    return [head, *(Text(f"  {name:3}{row}", style="cyan" if name.endswith("'") else "") for name, row in rows)]
