"""Where machine code is kept, and when it is compiled again."""

import ast
import os
import shutil
import subprocess
import sys
import tempfile
import threading
import warnings
from pathlib import Path

import numba
import numpy as np
import pytest
from numba.core.errors import NumbaExperimentalFeatureWarning

from firmware_model import _machine_code
from firmware_model._jit import expect_addresses
from rtec import _jit

ROOT = Path(__file__).resolve().parents[2]
KERNELS = sorted(path for room in ("rtec", "firmware_model") for path in (ROOT / room).rglob("*_kernels.py"))
MISSES = """
from rtec.link._crc_kernels import sealed
print(sealed(1, 2), sum(sealed.stats.cache_misses.values()))
"""


def started(script, **environment):
    """Start a program that may find machine code in a folder of its own."""
    kept = {name: value for name, value in os.environ.items() if name not in ("NUMBA_DISABLE_JIT", "XDG_CACHE_HOME")}
    return subprocess.Popen(
        [sys.executable, "-c", script],
        cwd=ROOT, env=kept | environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip


def said(program):
    out, err = program.communicate(timeout=120)
    assert program.returncode == 0, err
    return out.split()


@pytest.fixture(scope="module")
def kept(tmp_path_factory):
    """Return a folder with a kernel's machine code, and what that kernel says."""
    folder = tmp_path_factory.mktemp("kept")
    number, misses = said(started(MISSES, NUMBA_CACHE_DIR=str(folder)))
    assert misses == "1"
    return folder, number


@pytest.fixture
def no_folder_is_known():
    _machine_code.base_folder.cache_clear()
    yield
    _machine_code.base_folder.cache_clear()


def test_a_user_without_a_home_gets_a_temporary_folder(monkeypatch, tmp_path, no_folder_is_known):
    for name in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(os.path, "expanduser", lambda path: path)  # what it does where nobody knows the home
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    assert _machine_code.base_folder("rtec").parent == tmp_path
    assert not Path("~").exists()


def test_no_folder_of_another_user_is_taken(monkeypatch, tmp_path, no_folder_is_known):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "theirs"))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "ours"))
    owner = os.stat
    theirs = os.stat_result((0o40777, 0, 0, 1, os.getuid() + 1, 0, 0, 0, 0, 0))
    monkeypatch.setattr(Path, "stat", lambda path, **more: theirs if "theirs" in path.parts else owner(path, **more))
    assert _machine_code.base_folder("rtec") == tmp_path / "ours" / "rtec"


def imports(path, root):
    """Files of the house that a file imports, read from its syntax tree."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.module:
            base = root.joinpath(*node.module.split("."))
            modules = [base / f"{alias.name}.py" for alias in node.names]
            found = [file for file in modules if file.is_file()]
            if len(found) < len(modules):
                found += [base.with_suffix(".py"), base / "__init__.py"]
            yield from (file for file in found if file.is_file())


def test_a_change_of_a_file_recompiles_what_contains_it_and_nothing_else(tmp_path):
    for room in ("rtec", "firmware_model"):
        shutil.copytree(ROOT / room, tmp_path / room, ignore=shutil.ignore_patterns("__pycache__"))
    kernels = [tmp_path / path.relative_to(ROOT) for path in KERNELS]

    def digests():
        _machine_code._seen.cache_clear()
        return {path: _machine_code.digest_of(path, tmp_path) for path in kernels}

    contains = {path: {path} for path in kernels}
    for path, inside in contains.items():
        new = {path}
        while new:
            new = {file for one in new for file in imports(one, tmp_path)} - inside
            inside.update(new)
    before = digests()
    assert len(set(before.values())) == len(kernels)
    for changed in kernels[::7]:
        text = changed.read_text(encoding="utf-8")
        changed.write_text(text + "\nANOTHER = 1\n", encoding="utf-8")
        after = digests()
        changed.write_text(text, encoding="utf-8")
        assert {path for path in kernels if after[path] != before[path]} == {
            path for path, inside in contains.items() if changed in inside
        }
    assert digests() == before


def test_the_newest_states_of_a_file_stay(tmp_path):
    for age in range(7):
        (tmp_path / f"rtec.a-{age}").mkdir()
        os.utime(tmp_path / f"rtec.a-{age}", (1e9 - age, 1e9 - age))
    (tmp_path / "rtec.b-9").mkdir()
    _machine_code.make_room(tmp_path / "rtec.a-new")
    assert {path.name for path in tmp_path.iterdir()} == {
        "rtec.a-new", "rtec.a-0", "rtec.a-1", "rtec.a-2", "rtec.a-3", "rtec.b-9",
    }  # fmt: skip


def test_a_copy_of_the_sources_loads_what_was_compiled_elsewhere(tmp_path):
    misses = []
    for copy in ("one", "two"):
        for package in ("rtec", "firmware_model"):
            shutil.copytree(ROOT / package, tmp_path / copy / package, ignore=shutil.ignore_patterns("__pycache__"))
        script = f"import sys; sys.path.insert(0, {str(tmp_path / copy)!r}); {MISSES.strip().replace(chr(10), ';')}"
        misses.append(said(started(script, NUMBA_CACHE_DIR=str(tmp_path / "code")))[1])
    assert misses == ["1", "0"]


def test_of_programs_that_start_at_once_one_compiles(tmp_path):
    programs = [started(MISSES, NUMBA_CACHE_DIR=str(tmp_path)) for _ in range(3)]
    assert sorted(said(program)[1] for program in programs) == ["0", "0", "1"]


@pytest.mark.parametrize("kind", ["nbi", "nbc"])
def test_files_that_were_cut_off_are_compiled_again(tmp_path, kept, kind):
    shutil.copytree(kept[0], tmp_path, dirs_exist_ok=True)
    for path in tmp_path.rglob(f"*.{kind}"):
        path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    assert said(started(MISSES, NUMBA_CACHE_DIR=str(tmp_path))) == [kept[1], "1"]
    assert said(started(MISSES, NUMBA_CACHE_DIR=str(tmp_path))) == [kept[1], "0"]


def test_a_folder_that_cannot_be_made_is_passed_over(tmp_path, kept):
    (tmp_path / "file").write_text("")
    environment = {"NUMBA_CACHE_DIR": str(tmp_path / "file"), "XDG_CACHE_HOME": str(tmp_path / "cache")}
    assert said(started(MISSES, **environment)) == [kept[1], "1"]
    assert said(started(MISSES, **environment)) == [kept[1], "0"]


def test_a_full_disk_costs_time_and_one_line(tmp_path, caplog):
    def full():
        raise OSError(28, "No space left on device")

    keeper = _machine_code.Keeper(test_a_full_disk_costs_time_and_one_line, tmp_path / "rtec" / "folder")
    for _ in range(2):
        assert keeper.load(lambda: None) is None
        keeper.save(full)
    found = [record.getMessage() for record in caplog.records if record.levelname == "WARNING"]
    assert found == [
        f"machine code is not kept in {tmp_path / 'rtec'}: No space left on device; NUMBA_CACHE_DIR chooses a folder"
    ]


def test_an_unknown_numba_is_used_as_it_documents_itself(tmp_path, kept):
    unknown = "import numba; numba.__version__ = '99.0.0'\n" + MISSES
    script = unknown + "import sys; print('firmware_model._numba_inside' in sys.modules)"
    assert said(started(script, NUMBA_CACHE_DIR=str(tmp_path))) == [kept[1], "1", "False"]
    assert said(started(script, NUMBA_CACHE_DIR=str(tmp_path))) == [kept[1], "0", "False"]


@pytest.mark.parametrize("kind", [_jit.step, _jit.helper, _jit.array_helper])
def test_what_kernels_take_in_can_be_called_from_python_before_and_after(kind):
    part = kind(lambda numbers, factor: numbers[0] * factor)
    kernel = numba.njit(lambda numbers, factor: part(numbers, factor) + 1)
    numbers = np.array([1 << 62])
    # compiled both times, for it wraps around without a word
    assert part(numbers, 2) == -(1 << 63)
    assert kernel(numbers, 2) == 1 - (1 << 63)
    assert part(numbers, factor=4) == 0
    assert kernel(numbers, 2.0) == 2.0**63 + 1


def test_what_is_ignored_stays_ignored_while_another_thread_says_so_too():
    said = threading.Event()

    def say():
        while not said.is_set():
            expect_addresses()

    expect_addresses()
    other = threading.Thread(target=say)
    other.start()
    try:
        for _ in range(50_000):
            warnings.warn("a function as a value", NumbaExperimentalFeatureWarning, stacklevel=1)
    finally:
        said.set()
        other.join()
