"""The folder of every report, which gets all of its files or none."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from rtec.io import json_text, whole_folder, write_text
from rtec.report.drawn import Illustration
from rtec.report.rendering import html_page

PAGE = "report.html"


def write_page_folder(
    folder: Path,
    figures: Sequence[Illustration],
    document: dict[str, Any],
    template: str,
    values: dict[str, Any],
    *,
    beside: Callable[[Path], None] = lambda new: None,
) -> Path:
    """Write a report's folder.

    Everything is made in a hidden folder inside ``folder`` and moved to its place at the end, so that an error, a
    full disk or Ctrl-C leaves the folder as it was. What stands in the way under the same name is replaced.

    Parameters
    ----------
    folder
        Where to; it exists.
    figures
        Written as SVG and as PNG into ``figures``.
    document
        Written as ``result.json``.
    template, values
        Of the page, ``report.html``, and what the template names besides the figures and ``files``, the paths of all
        other files from there.
    beside
        Writes what else belongs to the report into a folder; a folder in it that stays empty is taken away.

    Returns
    -------
    Path
        The page.

    Raises
    ------
    OutputError
        The folder is missing or not writable, or the disk is full.
    """
    with whole_folder(folder, last=PAGE) as new:
        place = new / "figures"
        place.mkdir()
        for figure in figures:
            (place / f"{figure.name}.svg").write_bytes(figure.svg)
            (place / f"{figure.name}.png").write_bytes(figure.png)
        write_text(new / "result.json", json_text(document, indent=2) + "\n")
        beside(new)
        for part in (part for part in new.iterdir() if part.is_dir()):
            with contextlib.suppress(OSError):
                part.rmdir()
        files = sorted(path.relative_to(new).as_posix() for path in new.rglob("*") if path.is_file())
        write_text(new / PAGE, html_page(template, figures, files=files, **values))
    return folder / PAGE
