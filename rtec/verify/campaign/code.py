"""Which code carries a job out, in one line: a record holds for this code, and a worker with other code refuses."""

from __future__ import annotations

import hashlib
import re
import sys
from contextlib import suppress
from functools import cache
from importlib import import_module, metadata
from pathlib import Path

from firmware_model._machine_code import sources
from rtec import __version__
from rtec._jit import PACKAGE, cpu_target, source_digest

_IMPORT = re.compile(r"^\s*(?:from\s+(?=[\w.]+\s+import\b)|import\s+)(\w+)", re.MULTILINE)
_NO_NUMBERS = {"filelock", "matplotlib", "rich", "threadpoolctl", "typer"}
"""Libraries on which no number depends."""
_DATA = ("*.ihx", "*.dbc", "*.csv", "*.toml")


@cache
def code_of(function: str) -> str:
    """Return what a job's result depends on beside the job itself.

    Parameters
    ----------
    function
        ``package.module:name``, as of `rtec.verify.campaign.job.Job`.

    Notes
    -----
    The version of rtec, a digest of the function's module, of everything of rtec that it imports (the kernels
    included) and of the data files of the package, the versions of the libraries that they import, and the processor
    that numba compiles for: results are equal bit for bit only where all of these are.

    Examples
    --------
    >>> code_of("rtec.verify.safety.jobs:inject").split()[:3]
    ['rtec', '0.1.0,', 'code']
    """
    module = function.partition(":")[0]
    digest = f"{source_digest(module)}-{_data_digest()}"
    libraries = sorted({"numba", "numpy"} | _libraries(module) - _NO_NUMBERS)
    versions = [f"{name} {version}" for name in libraries if (version := _version(name))]
    return f"rtec {__version__}, code {digest}, {', '.join(versions)}, processor {cpu_target()}"


def _libraries(module: str) -> set[str]:
    """Return what a module, and all of rtec that it imports, imports from elsewhere; also in functions."""
    file = Path(str(import_module(module).__file__)).resolve()
    found = {name for path in sources(file, PACKAGE.parent) for name in _IMPORT.findall(path.read_text("utf-8"))}
    return found - sys.stdlib_module_names - {"rtec", "firmware_model"}


def _version(package: str) -> str:
    """Return the version of the distribution that a package is named after; empty where there is none."""
    with suppress(metadata.PackageNotFoundError):
        return metadata.version(package)
    return ""


@cache
def _data_digest() -> str:
    digest = hashlib.sha256()
    for package in (PACKAGE, PACKAGE.parent / "firmware_model"):
        for path in sorted(path for pattern in _DATA for path in package.rglob(pattern)):
            digest.update(path.relative_to(package).as_posix().encode() + path.read_bytes())
    return digest.hexdigest()[:8]
