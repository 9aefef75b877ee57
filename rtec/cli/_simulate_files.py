"""The files that ``rtec simulate`` writes beside its result: an insertion as a picture, the lines as waveforms."""

from __future__ import annotations

import shutil
import sys
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from rtec.cli import _console
from rtec.errors import OutputError

if TYPE_CHECKING:
    from rtec.machine import OpenPath
    from rtec.machine.stretch import Stretch

LARGE_BYTES = 10**9
"""Above this a waveform file is not written without a word."""
_LEVELS = ("00", "10", "11", "01")


@dataclass(slots=True, kw_only=True)
class Seen:
    """What the user wants to see of a run.

    Parameters
    ----------
    figure, vcd
        Files, or None.
    state
        The encoder's state 1..4 at the insertion of the figure, or None for the first one.
    force
        Whether files may be overwritten, and large.
    """

    figure: Path | None
    state: int | None
    vcd: Path | None
    force: bool
    stretch: Stretch | None = field(init=False, default=None)

    def check(self, path: OpenPath) -> None:
        """Ask about what is large, and get ready to look.

        Raises
        ------
        OutputError
            A large file that nobody has agreed to.
        """
        if self.figure is not None:
            from rtec.machine.stretch import Stretch

            self.stretch = Stretch(self.state)
        if self.vcd is None:
            return
        if not self.force and (self.vcd.is_file() or not self.vcd.exists()):  # a pipe fills no disk
            _agree_to_size(self.vcd, path)

    def written(self, path: OpenPath) -> dict[str, str | None]:
        """Draw the figure; return the files by their names, None for one that there is nothing to show in."""
        files: dict[str, str | None] = {} if self.vcd is None else {"vcd": str(self.vcd)}
        if self.figure is None or self.stretch is None:
            return files
        if self.stretch.found is None:
            _console.note(f"{self.figure} not written: {_why_not(self.stretch, self.state, path)}")
            return files | {"figure": None}
        from rtec.readable import hertz_text
        from rtec.report.figures_simulate import insertion_figure
        from rtec.report.figures_style import write_figure

        design, processor = path.injector.design, path.microcontroller
        works = "" if processor is None else f", {processor.name}"
        name = f"{design.title}{works}, {hertz_text(path.frequency_hz)}"
        write_figure(partial(insertion_figure, self.stretch.found, name, design.step_counts), self.figure)
        return files | {"figure": str(self.figure)}


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


def _why_not(stretch: Stretch, state: int | None, path: OpenPath) -> str:
    """Return why there is no insertion to be drawn."""
    seen = {number: times for number, times in stretch.seen_in.items() if times}
    if not seen or state is None:
        return "the box has inserted nothing"
    begun = ", ".join(f"{_LEVELS[number - 1]} ({times} times)" for number, times in seen.items())
    hint = ""
    if not path.injector.design.one_state:
        usual = max(seen, key=lambda number: seen[number])
        hint = f"; try --home-state {(path.encoder.home_state + state - usual) % 4}"
    return f"no insertion began in state {_LEVELS[state - 1]} but in {begun}{hint}"
