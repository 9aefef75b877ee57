"""Where machine code is kept: a folder for each content of the sources that it is made from.

numba's own cache looks at one file only, although a loop holds the code of functions from other files. And it keeps
the machine code of every copy of a package apart; here the same sources, wherever they lie, are compiled once.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import sys
import tempfile
from collections.abc import Callable, Iterable
from contextlib import suppress
from functools import cached_property
from pathlib import Path
from types import FunctionType
from typing import Any, TypeVar, cast

import numba
from numba.core import config as _numba_config
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler
from numba.core.registry import CPUDispatcher

config: Any = _numba_config  # its settings are made at run time

KEPT = 4
"""States of the sources, beside the present one, whose machine code stays: of other versions and other checkouts."""

_F = TypeVar("_F", bound=Callable[..., Any])


def writable(folder: Path) -> bool:
    """Return whether files can be made in a folder, which is made where it is missing."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False


def digest_of(sources: Iterable[Path], root: Path) -> str:
    """Return a digest of names (below a root) and contents of files, of the compiler and of how it checks."""
    # numba itself does not tell code with checked indices from code without
    checked = os.environ.get("NUMBA_BOUNDSCHECK", "")
    digest = hashlib.sha256(f"{numba.__version__} {sys.version} {checked}".encode())
    for path in sorted(sources):
        content = path.read_bytes()
        digest.update(f" {path.relative_to(root).as_posix()} {len(content)} ".encode() + content)
    return digest.hexdigest()[:16]


def folder_for(name: str, digest: str) -> Path:
    """Return a folder for machine code: in ``NUMBA_CACHE_DIR``, else in the user's cache, else a temporary one."""
    for base in (os.environ.get("NUMBA_CACHE_DIR"), os.environ.get("XDG_CACHE_HOME"), "~/.cache"):
        with suppress(RuntimeError):  # a user without a home
            if base and writable(root := Path(base).expanduser() / name):
                return root / digest
    return Path(tempfile.mkdtemp(prefix=f"{name}-"))


def is_empty(folder: Path) -> bool:
    """Return whether a folder holds no machine code yet."""
    return next(folder.rglob("*.nbi"), None) is None


def make_room(folder: Path) -> None:
    """Make a folder for new machine code, and remove what lies beside it but for the newest ``KEPT``."""
    if not writable(folder):
        return

    def born(other: Path) -> float:
        with suppress(OSError):  # another process has just removed it
            return other.stat().st_mtime
        return 0.0

    others = [other for other in folder.parent.iterdir() if other != folder and other.is_dir()]
    for other in sorted(others, key=born, reverse=True)[KEPT:]:
        shutil.rmtree(other, ignore_errors=True)


class Locator:
    """Tells numba where the machine code of a function lies: in the folder set, under the name of its module."""

    def __init__(self, function: FunctionType) -> None:
        self._folder = Path(config.CACHE_DIR) / function.__module__
        self._line = function.__code__.co_firstlineno

    @classmethod
    def from_function(cls, function: FunctionType, _file: str) -> Locator:
        """Return the locator of a function."""
        return cls(function)

    def ensure_cache_path(self) -> None:
        """Make the folder."""
        self._folder.mkdir(parents=True, exist_ok=True)

    def get_cache_path(self) -> str:
        """Return the folder."""
        return str(self._folder)

    def get_source_stamp(self) -> str:
        """Return the state of the sources: the folder's name tells it already."""
        return ""

    def get_disambiguator(self) -> str:
        """Return what tells functions of one name apart."""
        return str(self._line)


class _PartLibrary(JITCodeLibrary):
    """Code that kernels take in: there it is optimised and made machine code, with all else, so not before."""

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalized = True


class _PartCompiler(Compiler):
    """Compiles what kernels take in."""

    def compile_extra(self, function: FunctionType) -> Any:
        """Return the compiled function, in a library without machine code; callers know it by its descriptor."""
        library: Any = _PartLibrary  # numba's own classes have no types
        whole: Any = super()
        state = self.state
        state.library = library(state.targetctx.codegen(), function.__qualname__)
        state.flags.no_compile = True
        result = whole.compile_extra(function)
        state.targetctx.insert_user_function(result.fndesc, result.fndesc, [result.library])
        return result._replace(entry_point=result.fndesc)


class _Part(CPUDispatcher):
    """A function that kernels take in, without what calling it from Python needs: compiling it takes half as long.

    Called from Python all the same, as tests do, it is compiled a second time, as a function of its own.
    """

    def add_overload(self, result: Any) -> None:
        """Keep the code for kernels, out of the reach of Python's calls."""
        self.overloads[tuple(result.signature.args)] = result

    def _compile_for_args(self, *_arguments: Any, **_named: Any) -> Any:
        return self.alone

    @cached_property
    def alone(self) -> Any:
        """The function as Python calls it."""
        whole = {name: value for name, value in self.targetoptions.items() if name not in _NO_WRAPPERS}
        return CPUDispatcher(py_func=self.py_func, targetoptions=whole)


_NO_WRAPPERS = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}


def part(function: _F, **options: Any) -> _F:
    """Return a function that numba compiles into each kernel that calls it."""
    settings = {"nopython": True, "error_model": "numpy", "fastmath": False} | _NO_WRAPPERS | options
    dispatcher: Any = _Part(py_func=function, targetoptions=settings, pipeline_class=_PartCompiler)
    return cast(_F, function if config.DISABLE_JIT else dispatcher)


def compiled(function: _F, folder: Path, **options: Any) -> _F:
    """Return a function that numba compiles when it is called first, its machine code kept in a folder."""
    # numba reads both settings when it decorates, and offers no argument for them; one that does not know the second
    # looks into the same folder under names of its own
    settings = {"CACHE_DIR": str(folder), "CACHE_LOCATOR_CLASSES": f"{__name__}.{Locator.__name__}"}
    before = {name: getattr(config, name, "") for name in settings}
    njit: Any = numba.njit  # its types leave some options out
    try:
        for name, value in settings.items():
            setattr(config, name, value)
        dispatcher: _F = njit(**{"error_model": "numpy", "fastmath": False} | options)(function)
        return dispatcher
    finally:
        for name, value in before.items():
            setattr(config, name, value)
