"""The command line: one file a verb, no logic.

Exit codes: 0 done, 1 done and the answer is "fails", 2 a bad argument or file, 130 Ctrl-C, 141 nobody reads the
output any more, 143 SIGTERM, 70 a bug in rtec. Whatever is wrong is said in one line on stderr.
"""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Sequence
from typing import TYPE_CHECKING

from rtec.cli._outcome import exit_code

if TYPE_CHECKING:
    from typer import Typer

__all__ = ["application", "main"]


def application() -> Typer:
    """Return the command line with all its verbs, for what reads their options and help: tests, pages, completion.

    Examples
    --------
    >>> import typer
    >>> "simulate" in typer.main.get_command(application()).commands
    True
    """
    from rtec.cli import _verbs  # loads typer and every verb

    return _verbs.application()


def main(argv: Sequence[str] | None = None) -> int:
    """Carry out one command and return the exit code of the process.

    Parameters
    ----------
    argv
        The words after ``rtec``; those of the process by default.

    Examples
    --------
    >>> main(["--version"])
    rtec 0.1.0
    0
    """
    words = list(sys.argv[1:] if argv is None else argv)
    # the matrices of rtec are small: several threads for each would wait for each other, ten times as long at worst
    for library in ("OPENBLAS", "OMP", "MKL"):
        os.environ.setdefault(f"{library}_NUM_THREADS", "1")

    # numba's word to us; firmware_model/_jit.py says why we do it all the same
    warnings.filterwarnings("ignore", message="First-class function type feature is experimental")

    def carry_out() -> None:
        from rtec.cli._console import show_compilation
        from rtec.cli._verbs import call  # Ctrl-C while it loads must meet the handler, too

        show_compilation()
        call(words)

    return exit_code(carry_out)
