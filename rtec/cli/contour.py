"""``rtec contour``: a toolpath on emulated feed drives, its feed planned, and how far the tool is from the path."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import typer

from rtec.cli import _measured
from rtec.cli._console import print_json, progress
from rtec.cli._parameters import folder, force, option, quantity, whole, word
from rtec.units import LENGTH

if TYPE_CHECKING:
    from rtec.toolpath.contouring import ContourRun

_FAILS = 1


def contour(
    path: str = option("--path", "butterfly|circle|random|FILE", "A file is G-code or a NURBS (JSON).", default=...),
    drive: str = word("--drive", "ball-screw|linear-motor", "In each axis.", default=...),
    limit_mm: float | None = quantity(
        "--limit", LENGTH, "20um", "Lower the feed where the contour error would exceed this."
    ),
    output: Path | None = folder("-o --output", "Folder of a report with figures and the log."),
    force: bool = force("Write into a folder that is not empty."),
    seed: int = whole("--seed", "Of a random path.", low=0, default=0),
    json: bool = _measured.JSON,
) -> None:
    """Plan the feed of a toolpath, run it on two emulated drives, and show following and contour error.

    No axis exceeds its velocity, acceleration and jerk, which is audited between the nodes of the plan as well. With
    --limit the feed is lowered where the contour error would exceed it; the run afterwards proves it, and the time is
    compared with that of a constant feed. 'rtec diagnose --axis x' reads the log in the report. Exits with 1 where a
    limit is not kept.

    Example: rtec contour --path butterfly --drive linear-motor -o out
    Example: rtec contour --path circle --drive ball-screw --limit 20um
    Example: rtec contour --path part.ngc --drive ball-screw --json
    """
    from rtec.io import report_folder
    from rtec.report.contour import write_contour
    from rtec.toolpath import read_path
    from rtec.toolpath.contouring import run_contour

    with progress(f"contour {path}"[:60]) as show:
        way = read_path(path, seed=seed)
        run = run_contour(way, drive, limit_mm=limit_mm, progress=lambda share: show(0.9 * share))
        made = {}
        if output is not None:
            with report_folder(output, "contour") as folder_:
                made["report"] = str(write_contour(run, folder_))
        show(1.0)
    if json:
        print_json(run.document() | made)
    else:
        _show(run)
        for what, place in made.items():
            typer.echo(f"{what.capitalize()}: {place}")
    raise typer.Exit(0 if run.limits_held else _FAILS)


def _show(run: ContourRun) -> None:
    from rich.console import Console

    from rtec.report.contour import contour_sentence, contour_table

    console = Console(highlight=False)
    console.print(contour_table(run))
    console.print(contour_sentence(run), soft_wrap=True, markup=False)
