"""What the verbs show: JSON and tables on stdout, notes and progress on stderr."""

from __future__ import annotations

import logging
import sys
import time
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any, Protocol

LONG = {
    "firmware_model.core._execute_kernels.execute": ("the processor", 10),
    "rtec.machine._loop_kernels.run": ("the closed loop", 10),
    "rtec.machine._station_kernels.advance": ("an axis on the bus", 8),
    "rtec.machine._cell_kernels.run": ("the machine on its bus", 5),
    "rtec.machine._ahead_kernels.run_ahead": ("the signal path", 3),
    "rtec.machine._open_kernels.run": ("the signal path, edge by edge", 3),
    "rtec.machine._firmware_kernels.run_firmware": ("the box with its firmware", 4),
}
"""Kernels that take seconds to compile: what they are to a user, and how long it takes on a usual machine."""
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


def warn(texts: Iterable[str], where: str = "", what: str = "warning") -> None:
    """Write a line on stderr for each of some sentences that speak against a file, with its name before them."""
    for text in texts:
        sys.stderr.write(f"{what}: {where}{text}\n")


class _Compiling(logging.Handler):
    """Says on stderr what is compiled, where it takes a while, and where machine code cannot be kept."""

    def emit(self, record: logging.LogRecord) -> None:
        what, seconds = LONG.get(getattr(record, "kernel", ""), ("", 0))
        if record.levelno >= logging.WARNING:
            note(record.getMessage())
        elif what and hasattr(record, "seconds"):
            note(f"compiled {what} in {record.seconds:.0f} s")
        elif what and hasattr(record, "waits"):
            note(f"waiting for another program that compiles {what} ...")
        elif what:
            note(f"compiling {what} for this machine, once (about {seconds} s) ...")


def show_compilation() -> None:
    """Say from now on what is compiled."""
    log = logging.getLogger("rtec.machine_code")
    if not any(isinstance(handler, _Compiling) for handler in log.handlers):
        log.setLevel(logging.INFO)
        log.propagate = False
        log.addHandler(_Compiling())


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
