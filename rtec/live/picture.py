"""The view of box and PC on a terminal: from a plain document to what rich draws."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from rtec.live.waveform_text import caption_of, waveform_text

Document = Mapping[str, Any]

EVENTS = 6
"""Events shown: with one axis the whole view has its place on 80 columns and 24 lines."""


def picture(document: Document, *, width: int = 100) -> RenderableType:
    """Return what shows the state of a box (`kind` box) or a PC (`kind` pc).

    Parameters
    ----------
    document
        As `box_screen` and `pc_screen` make it.
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
    parts.extend(_latest_waveform(axes, width))
    parts += [Text(str(event), style="dim") for event in list(document["events"])[-EVENTS:]]
    return Group(*parts)


def _table(axes: Sequence[Document]) -> Table:
    table = Table(box=None, header_style="bold", pad_edge=False, padding=(0, 2, 0, 0))
    table.add_column("")
    for axis in axes:
        table.add_column(f"axis {axis['axis']}", justify="right", no_wrap=True)
    for name in axes[0]["cells"]:
        table.add_row(name, *(str(axis["cells"][name]) for axis in axes))
    return table


def _latest_waveform(axes: Sequence[Document], width: int) -> list[RenderableType]:
    """Return the lines around the last insertion of any axis."""
    inserted = [axis for axis in axes if axis.get("insertion")]
    if not inserted:
        return []
    axis = max(inserted, key=lambda one: int(one["insertion"][-1][0]))
    changes = [(int(t), int(level), int(out)) for t, level, out in axis["insertion"]]
    rows = waveform_text(changes, most_columns=max(width - 8, 20))
    head = Text(f"last insertion of axis {axis['axis']}: {caption_of(changes)}", style="dim")
    return [
        head,
        *(Text(f"  {name:3}{row}", style="cyan" if name.endswith("'") else "") for name, row in rows.items()),
    ]
