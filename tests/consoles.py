"""The consoles of a page: its commands are carried out, and what it shows under them is held to what they print.

Nobody types the figures of a tutorial; this writes them::

    python -m tests.consoles docs/tutorial.md docs/tutorial-diagnosis.md README.md
"""

from __future__ import annotations

import contextlib
import io
import os
import re
import shlex
import sys
import tempfile
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path

from rtec.cli import main

FENCE = re.compile(r"^```(?P<kind>[^\n]*)\n(?P<body>.*?)^```$", re.MULTILINE | re.DOTALL)
ENDLESS = {"box", "pc"}
"""Go on until somebody ends them; `test_two_terminals` in test_cli_box.py does."""
NUMBER = re.compile(r"\d{1,3}(?: \d{3})+(?!\d)|\d+(?:\.\d+)?(?:e[+-]\d+)?")
MEASURED = re.compile(rf"(?<![\w.])({NUMBER.pattern})[ -](?:[mµnkM]?(?:m|s|Hz)|inch|h|%|counts?|readings|targets)\b")
LEFT_OUT = "..."


@dataclass(frozen=True, slots=True, kw_only=True)
class Step:
    """A command of a page.

    Parameters
    ----------
    words
        Behind ``rtec``.
    line
        Number of its line on the page, from 0.
    shown
        The lines under it, up to the next command.
    code
        The exit code that the page shows, or None.
    """

    words: list[str]
    line: int
    shown: list[str]
    code: int | None


def files_of(text: str) -> dict[str, str]:
    """Return the files that a page holds, by name."""
    return {m["kind"].split()[1]: m["body"] for m in FENCE.finditer(text) if m["kind"].startswith("file ")}


def steps_of(text: str) -> list[Step]:
    """Return the commands of a page's consoles."""
    found = []
    for fence in FENCE.finditer(text):
        first = text[: fence.start("body")].count("\n")
        lines = fence["body"].splitlines() if fence["kind"] == "console" else []
        for number, line in enumerate(lines):
            if line.startswith("$ rtec"):
                end = next((i for i in range(number + 1, len(lines)) if lines[i].startswith("$")), len(lines))
                code = int(lines[end + 1]) if lines[end : end + 1] == ["$ echo $?"] else None
                shown = lines[number + 1 : end]
                found.append(Step(words=shlex.split(line)[2:], line=first + number, shown=shown, code=code))
    return found


def carried_out(text: str, but: Collection[tuple[str, ...]] = ()) -> list[tuple[Step, list[str]]]:
    """Carry out the commands of a page in the folder at hand, its files in it; return each with the lines it prints.

    Parameters
    ----------
    text
        The page.
    but
        Words of commands to leave out.

    Raises
    ------
    AssertionError
        An exit code that is not the one shown, 0 where none is shown under a command that shows all it prints.
    """
    for name, body in files_of(text).items():
        Path(name).write_text(body, encoding="utf-8")
    found = []
    for step in steps_of(text):
        if step.words[0] in ENDLESS or tuple(step.words) in but:
            continue
        with contextlib.redirect_stdout(io.StringIO()) as out, contextlib.redirect_stderr(io.StringIO()) as err:
            code = main(step.words)
        assert step.code is None or code == step.code, (step.words, code)
        found.append((step, (out.getvalue() + err.getvalue()).splitlines()))
    return found


def squeezed(line: str) -> str:
    """Return a line without what depends on the width of a column: one of them is the time that a run took."""
    return " ".join(line.split())


def differences(done: Sequence[tuple[Step, list[str]]]) -> list[tuple[list[str], str]]:
    """Return the commands with the lines shown that they do not print, in this order."""
    found = []
    for step, printed in done:
        left = iter([squeezed(line) for line in printed])
        found += [(step.words, line) for line in step.shown if line != LEFT_OUT and squeezed(line) not in left]
    return found


def rewritten(text: str, done: Sequence[tuple[Step, list[str]]]) -> str:
    """Return a page whose consoles show what the commands print: lines shown before, with the numbers of today.

    Raises
    ------
    ValueError
        A line to which none is alike any more but for its numbers: somebody has to choose another.
    """
    lines = text.splitlines()
    for step, printed in done:
        left = iter(printed)
        for number, shown in enumerate(step.shown, step.line + 1):
            if shown == LEFT_OUT:
                continue
            same = next((line for line in left if _but_numbers(line) == _but_numbers(shown)), None)
            if same is None:
                raise ValueError(f"line {number + 1}: 'rtec {shlex.join(step.words)}' prints no line like {shown!r}")
            if squeezed(same) != squeezed(shown):
                lines[number] = same.rstrip()
    return "\n".join(lines) + "\n"


def _but_numbers(line: str) -> str:
    return re.sub("─+", "─", squeezed(NUMBER.sub("#", line)).replace(" ", ""))


def unfounded(text: str) -> list[str]:
    """Return the numbers with a unit in a page's prose that no console beside it shows.

    A number has to stand, digit by digit, in a command, a line or a file of its section; a section without a console
    is left out.
    """
    found = []
    for section in re.split(r"^## ", text, flags=re.MULTILINE):
        fences = [fence for fence in FENCE.finditer(section) if fence["kind"].split()[0] in {"console", "file"}]
        if not any(fence["kind"] == "console" for fence in fences):
            continue
        shown = {float(one.replace(" ", "")) for fence in fences for one in NUMBER.findall(fence["body"])}
        prose = " ".join(re.sub(r"`[^`\n]*`", " ", FENCE.sub("", section)).split())
        found += [one[0] for one in MEASURED.finditer(prose) if float(one[1].replace(" ", "")) not in shown]
    return found


def _rewrite(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    here = Path.cwd()
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        try:
            page.write_text(rewritten(text, carried_out(text)), encoding="utf-8")
        finally:
            os.chdir(here)


if __name__ == "__main__":
    os.environ["COLUMNS"] = "100"
    for name in sys.argv[1:]:
        sys.stderr.write(f"{name}\n")
        _rewrite(Path(name).resolve())
