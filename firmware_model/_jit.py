"""The only place with numba options: how the processor's kernels are compiled and where their machine code is kept.

The machine code lies in a folder named after the state of every source file it is made from. numba's own cache looks
at one file only, although the loop holds the code of the peripherals it calls from another.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import sys
import tempfile
import warnings
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any, TypeVar

import numba
import numpy as np
from numba.core import config as _numba_config

config: Any = _numba_config  # its settings are made at run time

_F = TypeVar("_F", bound=Callable[..., Any])

if config.DISABLE_JIT:
    # uncompiled, for debugging, whole numbers must wrap around as silently as they do in machine code
    np.seterr(over="ignore")

_PACKAGE = Path(__file__).resolve().parent


def _digest_of_sources() -> str:
    """Return a digest of name, size and time of every file whose functions or constants are compiled in."""
    checked = os.environ.get("NUMBA_BOUNDSCHECK", "")
    digest = hashlib.sha256(f"{numba.__version__} {sys.version} {checked}".encode())
    for path in sorted([Path(__file__).resolve(), *(_PACKAGE / "core").glob("_*.py")]):
        stat = path.stat()
        digest.update(f"{path.relative_to(_PACKAGE)} {stat.st_size} {stat.st_mtime_ns}".encode())
    return digest.hexdigest()[:16]


def _writable(folder: Path) -> bool:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False


def _cache_folder() -> Path:
    """Return the folder for machine code: ``NUMBA_CACHE_DIR``, else the user's cache, else a temporary one."""
    home = hashlib.sha256(str(_PACKAGE).encode()).hexdigest()[:8]
    for base in (os.environ.get("NUMBA_CACHE_DIR"), os.environ.get("XDG_CACHE_HOME"), "~/.cache"):
        with suppress(RuntimeError):  # a user without a home
            if base and _writable(root := Path(base).expanduser() / "firmware_model" / home):
                return root / _digest_of_sources()
    return Path(tempfile.mkdtemp(prefix="firmware-model-"))


CACHE_FOLDER = _cache_folder()
"""Folder that holds the machine code of this version of the sources."""

FIRST_RUN = next(CACHE_FOLDER.rglob("*.nbi"), None) is None
"""True where nothing is compiled yet, so that a command line can say why it takes long."""

if FIRST_RUN and _writable(CACHE_FOLDER):
    for _other in CACHE_FOLDER.parent.iterdir():
        if _other != CACHE_FOLDER and _other.is_dir():
            shutil.rmtree(_other, ignore_errors=True)


def _compile(function: _F, **options: Any) -> _F:
    # numba reads the folder when it decorates, and offers no argument for it. No kernel here allocates: without
    # numba's runtime an array handed on is not counted, which took half the time of an instruction
    before = config.CACHE_DIR
    config.CACHE_DIR = str(CACHE_FOLDER)
    try:
        njit: Any = numba.njit  # its types leave `_nrt` out
        compiled: _F = njit(error_model="numpy", fastmath=False, _nrt=False, **options)(function)
        return compiled
    finally:
        config.CACHE_DIR = before


def step(function: _F) -> _F:
    """Compile a small function that is merged into every place that calls it."""
    return _compile(function, forceinline=True)


def helper(function: _F) -> _F:
    """Compile a function that loops call; LLVM decides whether it is merged into them."""
    return _compile(function)


def kernel(function: _F) -> _F:
    """Compile a loop that Python calls; its machine code is cached on disk."""
    return _compile(function, cache=True, nogil=True)


class _Address(numba.types.WrapperAddressProtocol):
    """A compiled function as a value that kernels call by its address."""

    def __init__(self, compiled: Any) -> None:
        self._compiled = compiled

    def __wrapper_address__(self) -> int:
        """Return where its machine code begins."""
        name = self._compiled.fndesc.llvm_cfunc_wrapper_name
        return int(self._compiled.library.get_pointer_to_function(name))

    def signature(self) -> Any:
        """Return its types."""
        return self._compiled.signature


def address_of(function: Any, arguments: tuple[Any, ...]) -> Any:
    """Return a kernel, compiled for types of arguments, as a value that other kernels call by its address."""
    # numba calls passing functions as values experimental, with each kernel that does so; the tests hold us to it
    warnings.filterwarnings("ignore", "First-class function type", numba.core.errors.NumbaExperimentalFeatureWarning)
    function.compile(arguments)
    return _Address(function.overloads[arguments])
