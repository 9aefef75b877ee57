"""Which code carries a job out, in one line: a record holds for this code, and a worker with other code refuses."""

from __future__ import annotations

import hashlib
from functools import cache

import numba
import numpy as np

from rtec import __version__
from rtec._jit import PACKAGE, cpu_target, source_digest

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
    included) and of the data files of the package, the versions of numba and numpy, and the processor that numba
    compiles for: results are equal bit for bit only where all of these are.

    Examples
    --------
    >>> code_of("rtec.verify.safety.jobs:inject").split()[:3]
    ['rtec', '0.1.0,', 'code']
    """
    digest = f"{source_digest(function.partition(':')[0])}-{_data_digest()}"
    libraries = f"numba {numba.__version__}, numpy {np.__version__}"
    return f"rtec {__version__}, code {digest}, {libraries}, processor {cpu_target()}"


@cache
def _data_digest() -> str:
    digest = hashlib.sha256()
    for package in (PACKAGE, PACKAGE.parent / "firmware_model"):
        for path in sorted(path for pattern in _DATA for path in package.rglob(pattern)):
            digest.update(path.relative_to(package).as_posix().encode() + path.read_bytes())
    return digest.hexdigest()[:8]
