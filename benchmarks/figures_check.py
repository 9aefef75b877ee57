"""How soon `rtec check` gives a verdict, its picture and the shortest stream that breaks an algorithm."""

from __future__ import annotations

import re
import shutil
import tempfile
from collections.abc import Iterator
from importlib.resources import files
from pathlib import Path

from children import Child, ChildFailedError, measure, rtec
from figures import Bar, Figure, Setting, Spread, on_cores, skipped

_README = Path(__file__).parents[1] / "README.md"
_EXAMPLES = files("rtec.examples")
_WORDS = ("check", "mine.py:Mine", "--design", "c", "--figure", "worst.png", "--force")
_VERILOG = ("check", "design_c.v", "--clock", "50MHz", "--pins", "design_c.toml", "--design", "c")


def check(setting: Setting) -> Iterator[Figure]:
    """Measure the README's algorithm and the Verilog example as a new user runs them, on two cores."""
    with tempfile.TemporaryDirectory() as name, on_cores({setting.core, setting.second_core}):
        folder = Path(name)
        algorithm = re.search(r"^```file mine\.py\n(.*?)^```$", _README.read_text(), re.MULTILINE | re.DOTALL)
        if algorithm is None:
            raise ChildFailedError("the README has no mine.py any more")
        (folder / "mine.py").write_text(algorithm[1])
        yield _verdict(
            "The README's Python algorithm with its bug, picture included", [_broken(folder)], 20.0, _WORDS
        )
        warm = [_broken(folder) for _ in range(setting.of(5, 2))]
        yield _verdict("The same again, its machine code kept", warm, 20.0, _WORDS)
        with tempfile.TemporaryDirectory() as cache:
            yield _verdict(
                "The same on a fresh machine, where everything is compiled first",
                [_broken(folder, NUMBA_CACHE_DIR=cache)], None, _WORDS, prefix="NUMBA_CACHE_DIR=$(mktemp -d) ",
            )  # fmt: skip
        words = ("check", str(_EXAMPLES / "designs.py:C"), "--design", "c")
        right = measure([rtec(), *words], folder)
        yield Figure(
            what="A right Python design, all checks, processor time",
            measured=f"{right.cpu_s:.1f} s",
            value=right.cpu_s,
            bar=Bar(value=60.0, unit="s", at_most=True),
            command="rtec check rtec/examples/designs.py:C --design c",
        )
        for design in ("original", "a", "b", "c"):
            words = ("check", design)
            yield _verdict(f"Design {design}, all checks", [measure([rtec(), *words], folder)], None, words)
        what, bar = "Design C in Verilog, all checks", Bar(value=120.0, unit="s", at_most=True)
        if shutil.which("verilator") is None:
            yield skipped(what, "verilator is not installed", " ".join(("rtec", *_VERILOG)), bar)
            return
        for file in ("design_c.v", "design_c.toml"):
            (folder / file).write_text((_EXAMPLES / file).read_text())
        yield _verdict(what, [measure([rtec(), *_VERILOG], folder)], 120.0, _VERILOG)


def _broken(folder: Path, **environment: str) -> Child:
    """Check the README's algorithm; it has to be found out, with the stream and the picture."""
    child = measure([rtec(), *_WORDS], folder, exit_code=1, **environment)
    if "--stream" not in child.out or not (folder / "worst.png").stat().st_size:
        raise ChildFailedError(f"no stream or no picture: {child.out[-300:]}")
    return child


def _verdict(
    what: str, children: list[Child], bar_s: float | None, words: tuple[str, ...], *, prefix: str = ""
) -> Figure:
    wall = Spread(tuple(child.wall_s for child in children))
    median = f", median {wall.median:.1f} s" if len(children) > 1 else ""
    return Figure(
        what=what,
        measured=f"{wall.best:.1f} s{median}",
        value=wall.best,
        bar=None if bar_s is None else Bar(value=bar_s, unit="s", at_most=True),
        command=prefix + " ".join(("rtec", *words)),
    )
