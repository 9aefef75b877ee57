"""The options ``--capture``, ``--a`` and ``--b`` of every command that has them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from rtec.cli._groups import OptionGroup
from rtec.cli._parameters import apart, needs, option
from rtec.cli._verb import said
from rtec.cli._words import files_ending

if TYPE_CHECKING:
    from rtec.signal.captures import Capture


@dataclass(frozen=True, slots=True, kw_only=True)
class CaptureOptions(OptionGroup):
    """A captured stream in place of a made one."""

    PANEL = "A captured stream"

    capture: Path | None = option(
        "--capture",
        "FILE",
        "Edges that a logic analyser recorded: Saleae .csv, sigrok .sr, .vcd.",
        read=Path,
        complete=files_ending(".csv", ".sr", ".vcd"),
    )
    channel_a: str | None = option("--a", "NAME", "Channel of line A; A.")
    channel_b: str | None = option("--b", "NAME", "Channel of line B; B.")

    def read(self) -> Capture | None:
        """Read the capture, None where there is none.

        Raises
        ------
        RtecError
            A file or a channel that cannot be read.
        """
        if self.capture is None:
            for name, value in (("--a", self.channel_a), ("--b", self.channel_b)):
                if value is not None:
                    raise needs(name, "--capture")
            return None
        from rtec.signal.captures import read_capture

        return read_capture(self.capture, self.channel_a, self.channel_b)


def refuse_made(context: typer.Context, names: Iterable[str]) -> None:
    """Refuse options of a made stream beside a captured one.

    Raises
    ------
    ArgumentError
        The user has said one of them.
    """
    words = said(context, *names)
    if words:
        raise apart(words[0], "--capture", "the captured stream has its own motion and encoder")
