"""``rtec contour``: a toolpath on emulated feed drives, its feed planned, and how far the tool is from the path."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import typer

from rtec.cli import _measured
from rtec.cli._console import print_json, progress
from rtec.cli._groups import OptionGroup
from rtec.cli._parameters import Works, design, folder, force, needs, option, quantity, whole, word, works
from rtec.errors import ArgumentError
from rtec.units import LENGTH

if TYPE_CHECKING:
    from rtec.injector import Design
    from rtec.predictors import Predictor
    from rtec.predictors.motion_file import KnownMotion
    from rtec.toolpath.contour_run import ContourRun
    from rtec.toolpath.pulses import Pulses

T = TypeVar("T")
_FAILS = 1


@dataclass(frozen=True, slots=True, kw_only=True)
class _PulseOptions(OptionGroup):
    """What is between drives and controller."""

    PANEL = "Encoders and corrector"

    count_mm: float | None = quantity("--count", LENGTH, "1um", "Encoders that count so much; else they are ideal.")
    scale_error: list[str] | None = option(
        "--scale-error",
        "[x=]FILE",
        "What the scale of an axis, or of all, is wrong by: a table of errors, or a predictor of 'rtec train'.",
    )
    design: Design | None = design("A box of this design corrects that error, in each axis; needs --count.")
    timing: Works = works("What works in the box.", default="fast")

    def pulses(self) -> Pulses | None:
        """Return encoders and boxes; None where nothing was asked for."""
        given = {"--design": self.design, "--scale-error": self.scale_error}
        if self.count_mm is None:
            for name, value in given.items():
                if value is not None:
                    raise needs(name, "--count", "a box inserts counts")
            return None
        from rtec.injector import InjectorSettings, RealEdges, Timing
        from rtec.toolpath.pulses import Pulses

        box = None
        if self.design is not None:
            timing = Timing.of(self.design, self.timing.processor)
            box = InjectorSettings(design=self.design, timing=timing, real_edges=RealEdges.HOLD)
        return Pulses(
            count_mm=self.count_mm,
            injector=box,
            microcontroller=self.timing.microcontroller if box is not None else None,
            errors=_by_axis("--scale-error", self.scale_error or [], _scale_error),
        )


def _by_axis(name: str, given: list[str], read: Callable[[str], T]) -> dict[str, T]:
    """Return what files hold, by the letter of the axis; a file without one is for all."""
    from rtec.toolpath.contour_run import LETTERS

    found: dict[str, T] = {}
    for said in given:
        letter, _, file = said.rpartition("=")
        letters = letter.lower() or LETTERS
        if letters not in (*LETTERS, LETTERS):
            raise ArgumentError(name, repr(said)[:60], f"x, y or z before the =, as in x={file or 'FILE'}")
        content = read(file)
        for one in letters:
            if one in found:
                raise ArgumentError(name, f"axis {one} twice", "one file for each axis")
            found[one] = content
    return found


def _scale_error(file: str) -> Predictor:
    from rtec.predictors import read_predictor, read_table

    return read_predictor(file).of_position if Path(file).suffix == ".toml" else read_table(file)


def _motion_models(given: list[str] | None) -> dict[str, KnownMotion] | None:
    if not given:
        return None
    from rtec.predictors.motion_file import read_motion

    return _by_axis("--model", given, read_motion)


def contour(
    path: str = option("--path", "butterfly|circle|random|FILE", "A file is G-code or a NURBS (JSON).", default=...),
    drive: str = word("--drive", "ball-screw|linear-motor", "In each axis.", default=...),
    *,
    limit_mm: float | None = quantity(
        "--limit", LENGTH, "20um", "Lower the feed where the contour error would exceed this."
    ),
    models: list[str] | None = option(
        "--model",
        "[x=]NET.toml",
        "Of motion, of 'rtec train --dynamic': predicts the contour error, also where --limit lowers the feed.",
    ),
    travel_mm: float | None = quantity("--travel", LENGTH, "1300mm", "How far each axis can go."),
    pulses: _PulseOptions,
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

    With --count the drives' controllers count the pulses of encoders, and --design puts a corrector's box between;
    it corrects the --scale-error in motion, a request every 10 ms.

    Example: rtec contour --path butterfly --drive linear-motor -o out
    Example: rtec contour --path butterfly --drive linear-motor --limit 100um --model x=x.toml --model y=y.toml
    Example: rtec contour --path circle --drive ball-screw --count 1um --scale-error x=scale.csv --design c
    """
    from rtec.io import report_folder
    from rtec.report.contour import write_contour
    from rtec.toolpath import read_path
    from rtec.toolpath.contouring import run_contour

    with progress(f"contour {path}"[:60]) as show:
        way = read_path(path, seed=seed)
        run = run_contour(
            way,
            drive,
            limit_mm=limit_mm,
            pulses=pulses.pulses(),
            models=_motion_models(models),
            travel_mm=travel_mm,
            progress=lambda share: show(0.9 * share),
        )
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
