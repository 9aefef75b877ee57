"""What stands in the folder of every report: the page, its figures, and whatever else there is."""

from __future__ import annotations

import contextlib
from collections.abc import Iterable
from pathlib import Path

from rtec.report.illustrations import Illustration

PAGE = "report.html"


def write_figures(folder: Path, figures: Iterable[Illustration]) -> None:
    """Write each figure as SVG and as PNG into ``figures`` under ``folder``."""
    place = folder / "figures"
    place.mkdir()
    for figure in figures:
        (place / f"{figure.name}.svg").write_bytes(figure.svg)
        (place / f"{figure.name}.png").write_bytes(figure.png)


def without_empty(folder: Path, names: Iterable[str]) -> list[str]:
    """Take away those of the folders that are empty, and return all files as paths from ``folder``."""
    for name in names:
        with contextlib.suppress(OSError):
            (folder / name).rmdir()
    return sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file())
