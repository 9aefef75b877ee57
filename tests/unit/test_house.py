"""The rules of the house: each page has one owner, and what goes beyond a rule says why."""

import ast
import re
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[2]
MODULES = sorted(path for folder in ("rtec", "firmware_model") for path in (ROOT / folder).rglob("*.py"))
LONG = {
    "firmware_model/core/_execute_kernels.py": "one instruction set is one table",
    "rtec/board/_board_kernels.py": "the circuits share the record of one board",
    "rtec/examples/late_mutants.py": "one fault a class",
    "rtec/link/simulated.py": "the simulated bus and the ways to take part in it",
    "rtec/machine/closed_loop.py": "a setup of many parts and its results",
    "rtec/study/c_source.py": "the text of a program in C",
    "rtec/study/definition.py": "every key of a study",
}
"""Modules of more than 400 lines, each with its reason."""
MOST_BRANCHING = 8
LIBRARIES = {"can": "python-can", "serial": "python-can"}
"""What is imported under another name than it is installed: pyserial is an extra of python-can."""
BROUGHT_BY_THE_USER = {"cocotb", "distributed", "pyarrow", "pytest"}
"""Libraries for users who have them already: of rtec.cocotb, of campaigns on a cluster, and of the fixtures."""
EXCEPTION = re.compile(r"#\s*(?:noqa|type:\s*ignore)\b.*")
REASONED = re.compile(r"#\s*(?:noqa:(?:\s*[A-Z]+\d+,?)+|type:\s*ignore\[[\w, -]+\])\s+(?:#|-)\s*\w.*")


def name_of(path):
    return path.relative_to(ROOT).as_posix()


def imported(path):
    """Top-level packages that a module imports, anywhere in it."""
    nodes = [*ast.walk(ast.parse(path.read_text(encoding="utf-8")))]
    names = [alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names]
    names += [node.module for node in nodes if isinstance(node, ast.ImportFrom) and node.module]
    return {name.partition(".")[0] for name in names}


def excepted(text):
    """Comments of a source that let a check pass over a line."""
    return [found[0] for line in text.splitlines() if (found := EXCEPTION.search(line)) and '"#' not in line]


def test_every_page_has_one_owner():
    table = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8").split("\n## Pages\n")[1]
    linked = re.findall(r"^\| \[[^]]+\]\(([\w./-]+\.md)\) \|", table, re.MULTILINE)
    pages = {path.name for path in (ROOT / "docs").glob("*.md")} | {"decisions/README.md"}
    assert sorted(linked) == sorted(pages), "docs/architecture.md, Pages: each page once"


def test_the_install_brings_every_library_that_is_imported_and_no_other():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    brought = {re.match(r"[\w-]+", one)[0] for one in project["dependencies"]}
    wanted = set().union(*map(imported, MODULES)) - sys.stdlib_module_names - {"rtec", "firmware_model"}
    assert {LIBRARIES.get(name, name) for name in wanted - BROUGHT_BY_THE_USER} == brought


def test_a_module_has_at_most_400_lines_or_a_reason():
    long = {name_of(path) for path in MODULES if len(path.read_text(encoding="utf-8").splitlines()) > 400}
    assert not long - set(LONG)
    assert all((ROOT / name).is_file() for name in LONG)


def test_a_module_is_named_for_what_it_holds():
    assert not [
        name_of(path) for path in MODULES if path.stem.strip("_") in {"utils", "helpers", "common", "core", "misc"}
    ]


def test_what_a_check_passes_over_has_its_reason():
    other = [path for folder in ("tests", "benchmarks", "tools") for path in (ROOT / folder).rglob("*.py")]
    bare = {
        name_of(path): [one for one in excepted(path.read_text(encoding="utf-8")) if not REASONED.fullmatch(one)]
        for path in MODULES + other
        if path != Path(__file__).resolve()
    }
    assert not {name: comments for name, comments in bare.items() if comments}


def test_few_functions_have_more_than_ten_branches():
    """What ruff's C901 finds is told to pass at the function, and so seldom that it stays an exception."""
    passed = [one for path in MODULES for one in excepted(path.read_text(encoding="utf-8")) if "C901" in one]
    assert 0 < len(passed) <= MOST_BRANCHING
