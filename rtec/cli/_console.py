"""What the verbs show: JSON and tables on stdout, notes and progress on stderr."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any, Protocol

COMPILING = "compiling the simulation for this machine, once (about a minute) ..."
_PATIENCE_S = 1.0
"""Work shorter than this shows no progress."""
_LINE_S = 30.0
"""Where there is no terminal, a line comes so often."""


def print_json(document: Mapping[str, object]) -> None:
    """Print one strict JSON document on stdout; what JSON has no number for becomes null.

    Examples
    --------
    >>> print_json({"A": 1.5, "B": float("nan"), "rows": (1, float("inf"))})
    {"A": 1.5, "B": null, "rows": [1, null]}
    """
    from rtec.io import json_text

    # what the stream cannot encode would be spelled out as on a terminal, which is no JSON
    ascii_only = not (sys.stdout.encoding or "").lower().startswith("utf")
    sys.stdout.write(json_text(document, ascii_only=ascii_only) + "\n")


def note(message: str) -> None:
    """Write one line on stderr."""
    sys.stderr.write(f"rtec: {message}\n")
    sys.stderr.flush()


def compilation_ahead() -> bool:
    """Return whether nothing is compiled yet on this machine, so that the first run takes long."""
    from rtec import _jit  # loads the compiler

    return _jit.FIRST_RUN and not _jit.config.DISABLE_JIT


def announce_compilation() -> None:
    """Say that the first run takes long, and why; call it when the input is known to be good."""
    if compilation_ahead():
        note(COMPILING)


class Show(Protocol):
    """What long work calls with the share done, 0..1, and with what is being done where that changes."""

    def __call__(self, share: float, what: str = "") -> None:
        """Show it."""


@contextmanager
def progress(label: str, *, lines: str | None = None) -> Iterator[Show]:
    """Show the share done of long work on stderr where that is a terminal.

    Parameters
    ----------
    label
        Of the work.
    lines
        Where stderr is no terminal, a line is written every half minute, with this behind it; None for no line.

    Yields
    ------
    Callable
        To be called now and then with the share done, 0..1, and what is being done where that changes.
    """
    if not sys.stderr.isatty():
        yield (lambda share, what="": None) if lines is None else _by_lines(label, lines)
        return
    begun = time.monotonic()
    shown: list[tuple[Any, Any]] = []

    def show(share: float, what: str = "") -> None:
        if not shown and time.monotonic() - begun > _PATIENCE_S:
            from rich.console import Console
            from rich.progress import Progress

            bar = Progress(console=Console(stderr=True), transient=True)
            bar.start()
            shown.append((bar, bar.add_task(label, total=1.0)))
        for bar, task in shown:
            bar.update(task, completed=share, description=f"{label}: {what}" if what else label)

    try:
        yield show
    finally:
        for bar, _ in shown:
            bar.stop()


def _by_lines(label: str, more: str) -> Show:
    """Return what writes a line on stderr now and then."""
    begun = last = time.monotonic()

    def show(share: float, what: str = "") -> None:
        nonlocal last
        now = time.monotonic()
        if now - last >= _LINE_S:
            last = now
            note(f"{label}{f': {what}' if what else ''}: {share:.0%} after {now - begun:.0f} s{more}")

    return show
