"""What a user of ``rtec simulate`` wants to see of a run: a figure of an insertion, waveforms."""

from __future__ import annotations

import shutil
import sys
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from rtec.cli import _console
from rtec.cli._groups import OptionGroup
from rtec.cli._parameters import choice, force, option, written
from rtec.errors import OutputError
from rtec.io import FIGURES

if TYPE_CHECKING:
    from rtec.injector.insertion_capture import InsertionCapture
    from rtec.machine import OpenPath

LARGE_BYTES = 10**9
"""Above this a waveform file is not written without a word."""
LEVELS = ("00", "10", "11", "01")


@dataclass(frozen=True, slots=True, kw_only=True)
class Seen(OptionGroup):
    """What the user wants to see of a run."""

    PANEL = "Output"

    figure: Path | None = written(
        "--figure", "FILE.png", "Draw an insertion, before and after: .png, .svg, .pdf.", endings=FIGURES
    )
    figure_state: int | None = option(
        "--figure-state",
        "00|10|11|01",
        "A and B when it begins; the first insertion without it.",
        read=lambda said: LEVELS.index(choice(said, LEVELS, name="--figure-state")) + 1,
    )
    vcd: Path | None = written("--vcd", "FILE.vcd", "Write both sides of the box as waveforms.")
    force: bool = force("Overwrite files; write a VCD above 1 GB.")

    def check(self, path: OpenPath) -> InsertionCapture | None:
        """Ask about what is large; return what looks for an insertion, if one is to be drawn.

        Raises
        ------
        OutputError
            A large file that nobody has agreed to.
        """
        from rtec.injector.insertion_capture import InsertionCapture

        if self.vcd is not None and not self.force and (self.vcd.is_file() or not self.vcd.exists()):
            _agree_to_size(self.vcd, path)  # a pipe fills no disk
        return None if self.figure is None else InsertionCapture(self.figure_state)

    def written(self, path: OpenPath, capture: InsertionCapture | None, *, name: str = "") -> dict[str, str | None]:
        """Draw the figure; return the files by their names, None for one that there is nothing to show in."""
        files: dict[str, str | None] = {} if self.vcd is None else {"vcd": str(self.vcd)}
        if self.figure is None or capture is None:
            return files
        if capture.found is None:
            _console.note(f"{self.figure} not written: {_why_not(capture, self.figure_state, path)}")
            return files | {"figure": None}
        from rtec.readable import hertz_text
        from rtec.report.figures_simulate import insertion_figure
        from rtec.report.figures_style import write_figure

        design, processor = path.injector.design, path.microcontroller
        works = "" if processor is None else f", {processor.name}"
        name = f"{name or design.title}{works}, {hertz_text(path.frequency_hz)}"
        write_figure(partial(insertion_figure, capture.found, name, design.step_counts), self.figure)
        return files | {"figure": str(self.figure)}

    @staticmethod
    def say(written: dict[str, str | None]) -> None:
        """Print the names of the files."""
        for name, file in written.items():
            if file is not None:
                typer.echo(f"{name}: {file}")


def _agree_to_size(vcd: Path, path: OpenPath) -> None:
    """Ask before a large file is written; refuse it where there is nobody to ask."""
    from rtec.machine.tape import estimated_bytes

    size = estimated_bytes(path)
    if size <= LARGE_BYTES:
        return
    folder = vcd.parent if vcd.parent.is_dir() else Path()
    free = shutil.disk_usage(folder).free
    what = f"{vcd} becomes about {size / 1e9:.3g} GB long, and {free / 1e9:.3g} GB are free there"
    if sys.stdin.isatty() and sys.stderr.isatty() and typer.confirm(f"{what}. Write it?", err=True):
        return
    raise OutputError(f"--vcd: {what}; write it with --force, or take fewer --cycles")


def _why_not(capture: InsertionCapture, state: int | None, path: OpenPath) -> str:
    """Return why there is no insertion to be drawn."""
    seen = {number: times for number, times in capture.seen_in.items() if times}
    if not seen or state is None:
        return "the box has inserted nothing"
    begun = ", ".join(f"{LEVELS[number - 1]} ({times} times)" for number, times in seen.items())
    hint = ""
    if not path.injector.design.one_state:
        usual = max(seen, key=lambda number: seen[number])
        hint = f"; try --home-state {(path.encoder.home_state + state - usual) % 4}"
    return f"no insertion began in state {LEVELS[state - 1]} but in {begun}{hint}"
