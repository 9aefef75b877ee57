"""Figures of the house itself: its lines, the words of its pages, and how long its tests take.

Example::

    python benchmarks/figures_house.py
"""

from __future__ import annotations

import ast
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from children import measure
from figures import Bar, Figure, Setting, number, on_cores

HOUSE = Path(__file__).resolve().parents[1]
PACKAGES = ("firmware_model", "rtec")
KINDS = ("code", "docstrings", "comments", "blank")


def kinds_of(source: str) -> Counter[str]:
    """Return how many lines of a module are of which kind; a docstring is any text that stands alone."""
    strings: set[int] = set()
    for node in ast.walk(ast.parse(source)):
        match node:
            case ast.Expr(value=ast.Constant(value=str())):
                strings.update(range(node.lineno, (node.end_lineno or node.lineno) + 1))
    found: Counter[str] = Counter(dict.fromkeys(KINDS, 0))
    for number_of_line, line in enumerate(source.splitlines(), 1):
        text = line.strip()
        if number_of_line in strings:
            found["docstrings"] += 1
        else:
            found["blank" if not text else "comments" if text.startswith("#") else "code"] += 1
    return found


def lines_by_room() -> dict[str, Counter[str]]:
    """Return the lines of each room: a folder of a package, or a module that stands beside the folders."""
    rooms: dict[str, Counter[str]] = {}
    for package in PACKAGES:
        for path in sorted((HOUSE / package).rglob("*.py")):
            room = "/".join(path.relative_to(HOUSE).parts[:2])
            rooms.setdefault(room, Counter()).update(kinds_of(path.read_text(encoding="utf-8")))
    return rooms


def words() -> tuple[int, int]:
    """Return the words of the pages in prose and in tables; what stands in a fence is neither."""
    prose = tables = 0
    for path in (HOUSE / "docs").rglob("*.md"):
        fenced = False
        for line in path.read_text(encoding="utf-8").splitlines():
            if line.lstrip().startswith("```"):
                fenced = not fenced
            elif not fenced and line.startswith("|"):
                tables += len(line.replace("|", " ").split())
            elif not fenced:
                prose += len(line.split())
    return prose, tables


def additions_s() -> float:
    """Return how long Python takes for 20 million additions: by it, machines of different speed can be compared."""
    begun, total = time.perf_counter(), 0
    for k in range(20_000_000):
        total += k
    return time.perf_counter() - begun


def house(setting: Setting) -> Iterator[Figure]:
    """Count lines and words, and run the tests as the README says, on two cores."""
    command = "python benchmarks/figures_house.py"
    lines = sum(lines_by_room().values(), Counter())
    parts = ", ".join(f"{lines[kind]} {kind}" for kind in KINDS)
    yield Figure(what="Lines of the program", measured=f"{lines.total()}: {parts}", command=command)
    prose, tables = words()
    yield Figure(
        what="Words of docs/, without code",
        measured=f"{number(prose)} in prose, {number(tables)} in tables",
        value=prose,
        bar=Bar(value=32_000, unit="in prose", at_most=True),
        command=command,
    )
    scale_s = min(additions_s() for _ in range(3))
    yield Figure(what="20 million additions in Python, for scale", measured=f"{scale_s:.2f} s", command=command)
    if setting.quick:
        return
    for what, shown, program, bar_min in (
        ("The tests", "pytest", [sys.executable, "-m", "pytest"], 6.0),
        ("All checks in a fresh environment", ".ci/run", [str(HOUSE / ".ci" / "run")], 9.0),
    ):
        with tempfile.TemporaryDirectory() as name, on_cores({setting.core, setting.second_core}):
            child = measure(["env", "-C", str(HOUSE), *program], Path(name), NUMBA_CACHE_DIR=name)
        yield Figure(
            what=f"{what}, nothing compiled before",
            measured=f"{child.wall_s / 60:.1f} min (processor time {child.cpu_s / 60:.1f} min)",
            value=child.wall_s / 60,
            bar=Bar(value=bar_min, unit="min", at_most=True),
            command=shown,
        )


def main() -> int:
    """Print the lines of each room and the words of the pages."""
    rooms = lines_by_room()
    rooms["total"] = sum(rooms.values(), Counter())
    rows = [["", *KINDS], *([room, *(lines[kind] for kind in KINDS)] for room, lines in rooms.items())]
    text = "".join(f"{name:32}{''.join(f'{cell:>12}' for cell in cells)}\n" for name, *cells in rows)
    prose, tables = words()
    sys.stdout.write(f"{text}words: {prose} in prose, {tables} in tables\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
