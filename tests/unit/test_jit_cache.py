"""Where machine code is kept."""

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
from numba.core.registry import CPUDispatcher

from firmware_model import _machine_code
from firmware_model._jit import expect_addresses
from rtec import _jit

ROOT = Path(__file__).resolve().parents[2]


def test_a_user_without_a_home_gets_a_temporary_folder(monkeypatch, tmp_path):
    for name in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(os.path, "expanduser", lambda path: path)  # what it does where nobody knows the home
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    assert _machine_code.folder_for("rtec", "00").parent == tmp_path
    assert not Path("~").exists()


def test_a_folder_is_named_after_names_and_contents(tmp_path):
    first, second = tmp_path / "a.py", tmp_path / "b.py"
    first.write_text("x = 1")
    second.write_text("y = 2")
    state = _machine_code.digest_of([first, second], tmp_path)
    os.utime(first, (0, 0))
    assert _machine_code.digest_of([second, first], tmp_path) == state  # neither time nor order
    first.write_text("x = 3")
    changed = _machine_code.digest_of([first, second], tmp_path)
    first.write_text("x = 1")
    renamed = _machine_code.digest_of([first, second.rename(tmp_path / "c.py")], tmp_path)
    assert len({state, changed, renamed}) == 3


def test_the_newest_states_stay(tmp_path):
    for age in range(7):
        (tmp_path / str(age)).mkdir()
        os.utime(tmp_path / str(age), (1e9 - age, 1e9 - age))
    _machine_code.make_room(tmp_path / "new")
    assert {path.name for path in tmp_path.iterdir()} == {"new", "0", "1", "2", "3"}


def test_a_copy_of_the_sources_loads_what_was_compiled_elsewhere(tmp_path):
    script = "from rtec.link._crc_kernels import sealed; sealed(1, 2); print(sum(sealed.stats.cache_misses.values()))"
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "code")}
    environment.pop("NUMBA_DISABLE_JIT", None)
    misses = []
    for copy in ("one", "two"):
        for package in ("rtec", "firmware_model"):
            shutil.copytree(ROOT / package, tmp_path / copy / package, ignore=shutil.ignore_patterns("__pycache__"))
        found = subprocess.run(
            [sys.executable, "-c", script],
            cwd=tmp_path / copy, env=environment, capture_output=True, text=True, check=True,
        )  # fmt: skip
        misses.append(int(found.stdout))
    assert misses == [1, 0]


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


def test_what_kernels_take_in_becomes_machine_code_in_them_only():
    part = _jit.helper(lambda factor: factor + 2)
    kernel = numba.njit(lambda factor: part(factor) * 3)
    assert kernel(4) == 18
    engine = CPUDispatcher.targetdescr.target_context.codegen()._engine
    begins = [
        engine.get_function_address(next(iter(code.overloads.values())).fndesc.mangled_name)
        for code in (kernel, part)
    ]
    assert begins[0] != 0
    assert begins[1] == 0


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
