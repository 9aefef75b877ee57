"""Where machine code is kept, keyed by what it is made from, and who may compile when.

numba's own cache looks at the file of a kernel only, although the kernel holds code of functions from other files.
Here a kernel's folder is named after the contents of its file and of all that this file imports, directly or not: a
change recompiles the kernels that contain it, and no others. Copies of a package share their machine code.
"""

from __future__ import annotations

import functools
import hashlib
import logging
import os
import re
import shutil
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from types import FunctionType
from typing import TYPE_CHECKING, TypeVar

import numba

if TYPE_CHECKING:
    from filelock import BaseFileLock

_T = TypeVar("_T")

KEPT = 4
"""States of a file, beside the present one, whose machine code stays: of other versions and other checkouts."""

_PATIENCE_S = 0.5
"""Whoever waits for another program longer says so."""

LOG = logging.getLogger("rtec.machine_code")
"""Tells when a kernel begins to compile (with ``kernel``), when it is done (with ``seconds``, too), or when another
program compiles it (with ``waits``)."""

_IMPORT = re.compile(r"^\s*(?:from\s+([\w.]+)\s+import\s+(\([^)]*\)|[^\n(]+)|import\s+([\w.]+))", re.MULTILINE)


def imported(file: Path, root: Path) -> Iterator[Path]:
    """Yield the files below a root that a file imports at its top level."""
    for module, names, plain in _IMPORT.findall(file.read_text(encoding="utf-8")):
        place = root.joinpath(*(module or plain).split("."))
        words = [
            re.split(r"\s+as\s+", name.strip())[0] for name in re.sub(r"#[^\n]*", "", names).strip("()").split(",")
        ]
        # a name that is a module, or a package, needs nothing of the package it lies in
        found = [_files_of(place / word) for word in words if word and place.is_dir()]
        for files in found:
            yield from files
        if not found or [] in found:
            yield from _files_of(place)


def _files_of(place: Path) -> list[Path]:
    return [path for path in (place.with_suffix(".py"), place / "__init__.py") if path.is_file()]


@functools.cache
def _seen(file: Path, root: Path) -> tuple[frozenset[Path], bytes]:
    """Return what a file imports and a digest of its contents."""
    return frozenset(imported(file, root)), hashlib.sha256(file.read_bytes()).digest()


def sources(file: Path, root: Path) -> list[Path]:
    """Return a file and all files below a root that it imports, directly or not, in the order of their names."""
    found, new = set(), {file}
    while new:
        found |= new
        new = {path for one in new for path in _seen(one, root)[0]} - found
    return sorted(found)


def digest_of(file: Path, root: Path) -> str:
    """Return a digest of a file and all that it imports below a root, of the compiler and of how it checks."""
    # numba itself does not tell code with checked indices from code without
    checked = os.environ.get("NUMBA_BOUNDSCHECK", "")
    digest = hashlib.sha256(f"{numba.__version__} {sys.version} {checked}".encode())
    for path in sources(file, root):
        name = path.relative_to(root) if path.is_relative_to(root) else path.name
        digest.update(f" {name} ".encode() + _seen(path, root)[1])
    return digest.hexdigest()[:16]


def _usable(folder: Path) -> bool:
    """Return whether a folder is the user's own, so that nobody else put code there, and files can be made in it."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if hasattr(os, "getuid") and folder.stat().st_uid != os.getuid():
            return False
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False


@functools.cache
def base_folder(name: str) -> Path:
    """Return the folder for machine code: in ``NUMBA_CACHE_DIR``, else in the user's cache, else a temporary one."""
    for place in (os.environ.get("NUMBA_CACHE_DIR"), os.environ.get("XDG_CACHE_HOME"), "~/.cache"):
        with suppress(RuntimeError):  # a user without a home
            if place and _usable(folder := Path(place).expanduser() / name):
                return folder
    return Path(tempfile.mkdtemp(prefix=f"{name}-"))


def folder_of(package: Path, file: Path) -> Path:
    """Return the folder for the machine code of a file's kernels, in the cache of a package."""
    root = package.parent
    module = file.relative_to(root) if file.is_relative_to(root) else Path(file.name)
    return base_folder(package.name) / f"{'.'.join(module.with_suffix('').parts)}-{digest_of(file, root)}"


def is_kept(package: Path, file: Path) -> bool:
    """Return whether machine code of a file's kernels is there."""
    return next(folder_of(package, file).glob("*.nbi"), None) is not None


def make_room(folder: Path) -> None:
    """Make a folder for new machine code, and remove those of the file's other states but for the newest ``KEPT``."""
    if folder.is_dir():
        return
    folder.mkdir(parents=True, exist_ok=True)  # another program may be doing the same

    def born(other: Path) -> float:
        with suppress(OSError):  # another process has just removed it
            return other.stat().st_mtime
        return 0.0

    states = folder.parent.glob(f"{folder.name.rpartition('-')[0]}-*")
    others = [other for other in states if other != folder and other.is_dir()]
    for other in sorted(others, key=born, reverse=True)[KEPT:]:
        shutil.rmtree(other, ignore_errors=True)


class Keeper:
    """Keeps the machine code of one kernel: one program compiles it while others wait, and no bad folder stops it.

    Parameters
    ----------
    function
        The kernel.
    folder
        Where its machine code lies.
    """

    def __init__(self, function: FunctionType, folder: Path) -> None:
        """Keep nothing yet."""
        self.folder = folder
        self._name = f"{function.__module__}.{function.__qualname__}"
        self._stem = f"{function.__name__}-{function.__code__.co_firstlineno}"
        self._lock: BaseFileLock | None = None
        self._begun = 0.0

    def load(self, read: Callable[[], _T | None]) -> _T | None:
        """Return the machine code; None where there is none, and it is this program's turn to compile."""
        found = self._tried(read)
        if found is not None:
            return found
        self._take_turn()
        found = self._tried(read)  # another program may have compiled it while this one waited
        if found is not None:
            self._end_turn()
        else:
            self._begun = time.perf_counter()
            LOG.info("compiling %s", self._name, extra={"kernel": self._name})
        return found

    def save(self, write: Callable[[], None]) -> None:
        """Keep what has been compiled; where it cannot be kept, the next program compiles it again."""
        seconds = time.perf_counter() - self._begun
        LOG.info("compiled %s in %.1f s", self._name, seconds, extra={"kernel": self._name, "seconds": seconds})
        try:
            write()
        except OSError as error:
            where = self.folder.parent
            _warn(f"machine code is not kept in {where}: {error.strerror}; NUMBA_CACHE_DIR chooses a folder")
        finally:
            self._end_turn()

    def _tried(self, read: Callable[[], _T | None]) -> _T | None:
        try:
            return read()
        except Warning:  # made an error by the user's filters: the files are good
            raise
        except Exception:  # what is read from files that were cut off is anything
            for path in self.folder.glob(f"*{self._stem}.*.nb?"):
                with suppress(OSError):
                    path.unlink()
            return None

    def _take_turn(self) -> None:
        if self._lock is not None:
            return
        with suppress(OSError, NotImplementedError):  # without a lock two programs may compile at once
            from filelock import FileLock, Timeout  # noqa: PLC0415 - only who compiles needs it

            make_room(self.folder)
            lock = FileLock(self.folder / f"{self._stem}.lock", thread_local=False)
            try:
                lock.acquire(timeout=_PATIENCE_S)
            except Timeout:
                LOG.info("waiting for %s", self._name, extra={"kernel": self._name, "waits": True})
                lock.acquire()
            self._lock = lock

    def _end_turn(self) -> None:
        if self._lock is not None:
            self._lock.release()
            self._lock = None


@functools.cache
def _warn(message: str) -> None:
    """Say it once."""
    LOG.warning(message)


class Locator:
    """Tells numba where the machine code of a kernel lies."""

    def __init__(self, function: FunctionType, folder: Path) -> None:
        self._folder, self._line = folder, function.__code__.co_firstlineno

    def from_function(self, _function: FunctionType, _file: str) -> Locator:
        """Return the locator, which is that of one function."""
        return self

    def ensure_cache_path(self) -> None:
        """Make the folder."""
        make_room(self._folder)

    def get_cache_path(self) -> str:
        """Return the folder."""
        return str(self._folder)

    def get_source_stamp(self) -> str:
        """Return the state of the sources: the folder's name tells it already."""
        return ""

    def get_disambiguator(self) -> str:
        """Return what tells functions of one name apart."""
        return str(self._line)
