"""``rtec ballbar``: a circle test, measured or of emulated feed drives, after ISO 230-4, and what it shows."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import typer

from rtec.cli import _measured
from rtec.cli._console import note, print_json, progress
from rtec.cli._parameters import apart, folder, force, option, quantity, word
from rtec.errors import ArgumentError
from rtec.units import LENGTH, SPEED

if TYPE_CHECKING:
    from collections.abc import Callable

    from rtec.metrology.ballbar import CircleTest, Found

    Progress = Callable[[float], None]

_FILE = "How the file is read"


def ballbar(
    data: Path | None = typer.Argument(
        None, help="Circle test: a table of angle and radius, or the log of two axes.", show_default=False
    ),
    drive: str | None = word("--drive", "ball-screw|linear-motor", "In place of DATA: emulated drives in both axes."),
    radius_mm: float | None = quantity(
        "--radius",
        LENGTH,
        "150mm",
        "Nominal radius, where the file does not state it; of the emulated circle 150 mm.",
    ),
    feed_mm_s: float | None = quantity(
        "--feed", SPEED, "1000mm/min", "Along the circle, where the file does not tell it; emulated 1000 mm/min."
    ),
    output: Path | None = folder("-o --output", "Folder of a report with figures."),
    force: bool = force("Write into a folder that is not empty."),
    axes: str = option("--axes", "xy", "Axes of a log, the first as X of the circle.", default="xy", panel=_FILE),
    maps: list[str] | None = option(
        "--map", "'HEADING=MEANING'", "What a column of a log is; may be repeated.", panel=_FILE
    ),
    decimal: str | None = option("--decimal", "MARK", "point or comma.", panel=_FILE),
    json: bool = _measured.JSON,
) -> None:
    """Judge a circle test after ISO 230-4, and name the errors of the machine that it shows.

    Each error is given with its value and with its share of what all of them would show alone. The file has columns
    angle_deg, deviation_um (or radius_mm) and sense (+1 counter-clockwise, -1 clockwise), and a line
    '# radius: 150 mm'; or it is a log with target_x_mm, actual_x_mm, target_y_mm, actual_y_mm and time_s. Both senses
    are needed.

    Example: rtec ballbar circle.csv --radius 150mm -o out
    Example: rtec ballbar log.csv --axes xz --json
    Example: rtec ballbar --drive linear-motor --radius 100mm --feed 2000mm/min
    """
    from rtec.metrology.ballbar import analysed
    from rtec.report.ballbar import write_ballbar

    if data is not None and drive is not None:
        raise apart("DATA", "--drive", "a measured circle or an emulated one")
    name = str(drive if data is None else data)
    with progress(f"ballbar {name}"[:60]) as show:
        if data is not None:
            test = _measured_test(data, radius_mm, feed_mm_s, axes, maps, decimal)
        else:
            test = _driven_test(drive, radius_mm, feed_mm_s, lambda share: show(0.6 * share))
        show(0.6)
        found = analysed(test)
        show(0.9)
        made = {}
        if output is not None:
            from rtec.io import report_folder

            with report_folder(output, "ballbar") as place:
                made["report"] = str(write_ballbar(found, name, place))
        show(1.0)
    if json:
        print_json({"data": name, **found.document(), **made})
        return
    for text in found.notes:
        note(text)
    _show(found, name)
    for what, where in made.items():
        typer.echo(f"{what.capitalize()}: {where}")


def _measured_test(
    data: Path,
    radius_mm: float | None,
    feed_mm_s: float | None,
    axes: str,
    maps: list[str] | None,
    decimal: str | None,
) -> CircleTest:
    from rtec.metrology import column_choices
    from rtec.metrology.ballbar.reading import Stated, read_circle_test

    stated = Stated(radius_mm=radius_mm, feed_mm_s=feed_mm_s, axes=axes)
    return read_circle_test(data, stated, column_choices(maps or (), decimal=decimal))


def _driven_test(drive: str | None, radius_mm: float | None, feed_mm_s: float | None, show: Progress) -> CircleTest:
    from rtec.toolpath.driven_circle import driven_circle

    if drive is None:
        raise ArgumentError("DATA", None, "a file with a circle test, or --drive ball-screw|linear-motor")
    radius = 150.0 if radius_mm is None else radius_mm
    feed = 1000.0 / 60.0 if feed_mm_s is None else feed_mm_s
    return driven_circle(drive, radius_mm=radius, feed_mm_s=feed, progress=show)


def _show(found: Found, name: str) -> None:
    from rich.console import Console

    from rtec.report.ballbar import ballbar_sentence, errors_table, figures_table

    console = Console(highlight=False)
    console.print(figures_table(found, name))
    if found.errors:
        console.print(errors_table(found))
    console.print(ballbar_sentence(found), soft_wrap=True, markup=False)
