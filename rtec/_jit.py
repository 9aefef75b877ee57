"""The only place with numba options: how every kernel of rtec is compiled and where its machine code is kept.

Compiled functions live in files named ``*_kernels.py``. Their machine code is cached on disk, in a folder named after
the state of those files. numba's own cache looks at one file only, although a kernel holds the code of the step
functions it calls from other files; with the folder named after all of them, a changed step function never meets
stale machine code of its callers.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import sys
import tempfile
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any, TypeAlias, TypeVar

import numba
import numpy as np
from numba.core import config as _numba_config

config: Any = _numba_config  # its settings are made at run time

_F = TypeVar("_F", bound=Callable[..., Any])

Record: TypeAlias = Any
"""The state of a stage: one element of a structured array, passed to step functions by reference."""

if config.DISABLE_JIT:
    # uncompiled, for debugging, whole numbers must wrap around as silently as they do in machine code
    np.seterr(over="ignore")

_PACKAGE = Path(__file__).resolve().parent


def _digest_of_sources() -> str:
    """Return a digest of name, size and time of every source file that holds compiled functions."""
    # numba itself does not tell code with checked indices from code without
    checked = os.environ.get("NUMBA_BOUNDSCHECK", "")
    digest = hashlib.sha256(f"{numba.__version__} {sys.version} {checked}".encode())
    root = _PACKAGE.parent  # the processor's loop is compiled into the kernels of the board
    sources = [*_PACKAGE.rglob("*_kernels.py"), *(root / "firmware_model" / "core").glob("_*.py")]
    for path in sorted([Path(__file__).resolve(), *sources]):
        stat = path.stat()
        digest.update(f"{path.relative_to(root)} {stat.st_size} {stat.st_mtime_ns}".encode())
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
    bases = [os.environ.get("NUMBA_CACHE_DIR"), os.environ.get("XDG_CACHE_HOME"), "~/.cache"]
    for base in bases:
        with suppress(RuntimeError):  # a user without a home
            if base and _writable(root := Path(base).expanduser() / "rtec" / home):
                return root / _digest_of_sources()
    return Path(tempfile.mkdtemp(prefix="rtec-"))


CACHE_FOLDER = _cache_folder()
"""Folder that holds the machine code of this version of the sources."""

FIRST_RUN = next(CACHE_FOLDER.rglob("*.nbi"), None) is None
"""True where nothing is compiled yet, so that the command line can say why it takes long."""


def _drop_older_versions() -> None:
    for other in CACHE_FOLDER.parent.iterdir():
        if other != CACHE_FOLDER and other.is_dir():
            shutil.rmtree(other, ignore_errors=True)


if FIRST_RUN and _writable(CACHE_FOLDER):
    _drop_older_versions()


def _compile(function: _F, **options: Any) -> _F:
    # numba reads the folder when it decorates, and offers no argument for it
    before = config.CACHE_DIR
    config.CACHE_DIR = str(CACHE_FOLDER)
    try:
        return numba.njit(error_model="numpy", fastmath=False, **options)(function)  # type: ignore[no-any-return]  # numba has no types
    finally:
        config.CACHE_DIR = before


def step(function: _F) -> _F:
    """Compile a scalar step function; it is merged into every loop that calls it."""
    return _compile(function, forceinline=True)


def helper(function: _F) -> _F:
    """Compile a function that loops call now and then, kept as one copy."""
    return _compile(function)


def kernel(function: _F) -> _F:
    """Compile a loop that Python calls; its machine code is cached on disk."""
    return _compile(function, cache=True, nogil=True)


def new_record(layout: np.dtype[np.void]) -> Record:
    """Return the state of a stage with all fields zero.

    Examples
    --------
    >>> state = new_record(np.dtype([("count", np.int64)], align=True))
    >>> state.count += 1
    >>> int(state.count)
    1
    """
    return np.rec.array(np.zeros(1, dtype=layout))[0]
