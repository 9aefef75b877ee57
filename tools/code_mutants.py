"""Mutants of decoder, windows and PC: one place of a kernel in other words, played by the bench.

Each row of code_mutants.toml is one. A copy of the package gets all of them at once: a function that has mutants
becomes a choice between itself and them, by a number in memory that a child process sets (mutant schemata: Untch,
Offutt and Harrold 1993). So all are compiled together, once, instead of a hundred times.

python -m tools.code_mutants
"""

from __future__ import annotations

import ast
import json
import os
import shutil
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
TABLE = Path(__file__).with_suffix(".toml")
_CHOICE = '''"""Which mutant plays."""

import ctypes

import llvmlite.ir as ir
from numba.core import config, types
from numba.extending import intrinsic

CHOSEN = ctypes.c_int64(0)
_AT = ctypes.addressof(CHOSEN)


def _chosen():
    return CHOSEN.value


def _read(typingctx):
    def read(context, builder, signature, arguments):
        word = ir.IntType(64)
        return builder.load(ir.Constant(word, _AT).inttoptr(word.as_pointer()))
    return types.int64(), read


chosen = _chosen if config.DISABLE_JIT else intrinsic(_read)
'''


@dataclass(frozen=True, slots=True, kw_only=True)
class CodeMutant:
    """One row of the table."""

    number: int
    place: str
    file: str
    function: str
    old: str
    new: str
    wrong: str
    equivalent: str = ""
    blind: str = ""

    def source(self, text: str) -> str:
        """Return the function of a file with the mutation; its place has to be there once."""
        if text.count(self.old) != 1:
            raise ValueError(f"{self.file}, {self.function}: {self.old!r} is there {text.count(self.old)} times")
        return text.replace(self.old, self.new)


def table() -> list[CodeMutant]:
    """Return the mutants in their order."""
    rows = [
        {"place": place, "file": group["file"]} | row
        for place, group in tomllib.loads(TABLE.read_text(encoding="utf-8")).items()
        for row in group["mutants"]
    ]
    return [CodeMutant(number=number, **row) for number, row in enumerate(rows, start=1)]


def functions(file: Path) -> dict[str, tuple[ast.FunctionDef, str]]:
    """Return the functions of a file with their source, decorators included."""
    text = file.read_text(encoding="utf-8")
    lines = text.splitlines(keepends=True)
    found = {}
    for node in ast.parse(text).body:
        if isinstance(node, ast.FunctionDef):
            first = min([node.lineno, *(one.lineno for one in node.decorator_list)])
            found[node.name] = node, "".join(lines[first - 1 : node.end_lineno])
    return found


def with_choice(node: ast.FunctionDef, source: str, mutants: list[CodeMutant]) -> str:
    """Return a function as itself, its mutants, and the choice between them."""
    name, arguments = node.name, ", ".join(argument.arg for argument in node.args.args)
    head = f"def {name}("
    parts = [source.replace(head, f"def {name}__0(")]
    parts += [mutant.source(source).replace(head, f"def {name}__{mutant.number}(") for mutant in mutants]
    choice = source[: source.index(head)] + ast.unparse(node).split("def ", 1)[1].split("\n", 1)[0].join(
        ["def ", "\n"]
    )
    choice += "    number = chosen()\n"
    for mutant in mutants:
        choice += f"    if number == {mutant.number}:\n        return {name}__{mutant.number}({arguments})\n"
    return "\n\n".join([*parts, choice + f"    return {name}__0({arguments})\n"])


def make_copy(folder: Path, mutants: list[CodeMutant]) -> None:
    """Write the package with all mutants into a folder."""
    for package in ("rtec", "firmware_model"):
        shutil.copytree(ROOT / package, folder / package, ignore=shutil.ignore_patterns("__pycache__"))
    (folder / "rtec" / "_chosen_mutant.py").write_text(_CHOICE, encoding="utf-8")
    for file in sorted({mutant.file for mutant in mutants}):
        path = folder / file
        text = path.read_text(encoding="utf-8")
        for name, (node, source) in functions(path).items():
            own = [mutant for mutant in mutants if (mutant.file, mutant.function) == (file, name)]
            if own:
                text = text.replace(source, with_choice(node, source, own))
        first = "from rtec._jit import"
        path.write_text(text.replace(first, f"from rtec._chosen_mutant import chosen\n{first}", 1), encoding="utf-8")


def played(places: Sequence[str]) -> Iterator[tuple[CodeMutant, str]]:
    """Yield each mutant of some places and what finds it ("": nothing)."""
    mutants = [mutant for mutant in table() if mutant.place in places]
    with tempfile.TemporaryDirectory() as folder:
        make_copy(Path(folder), mutants)
        environment = os.environ | {"PYTHONPATH": str(ROOT), "NUMBA_CACHE_DIR": f"{folder}/machine-code"}
        environment |= {"PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}
        command = [sys.executable, "-m", "tools.mutant_bench", *(f"{one.number}:{one.place}" for one in mutants)]
        with subprocess.Popen(command, cwd=folder, env=environment, stdout=subprocess.PIPE, text=True) as bench:
            assert bench.stdout is not None
            for mutant, line in zip(mutants, bench.stdout, strict=True):
                yield mutant, json.loads(line)


def main() -> None:
    """Print what finds each mutant."""
    for mutant, finder in played(sys.argv[1:]):
        sys.stdout.write(
            f"{mutant.number:3} {mutant.place} {mutant.function}: {mutant.wrong}: {finder or 'NOTHING'}\n"
        )
        sys.stdout.flush()


if __name__ == "__main__":
    main()
