"""The only place with numba options: how the processor's kernels are compiled."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numba
import numpy as np

from firmware_model import _machine_code

_F = TypeVar("_F", bound=Callable[..., Any])

config = _machine_code.config

if config.DISABLE_JIT:
    # uncompiled, for debugging, whole numbers must wrap around as silently as they do in machine code
    np.seterr(over="ignore")

PACKAGE = Path(__file__).resolve().parent

SOURCES = (*(PACKAGE / name for name in ("_jit.py", "_machine_code.py")), *(PACKAGE / "core").glob("_*.py"))
"""Every file whose functions or constants are compiled in."""

CACHE_FOLDER = _machine_code.folder_for("firmware_model", _machine_code.digest_of(SOURCES, PACKAGE))
"""Folder that holds the machine code of this version of the sources."""

FIRST_RUN = _machine_code.is_empty(CACHE_FOLDER)
"""True where nothing is compiled yet, so that a command line can say why it takes long."""

if FIRST_RUN:
    _machine_code.make_room(CACHE_FOLDER)


def _compile(function: _F, **options: Any) -> _F:
    # no kernel here allocates: without numba's runtime an array handed on is not counted, which took half the time of
    # an instruction
    return _machine_code.compiled(function, CACHE_FOLDER, _nrt=False, **options)


def step(function: _F) -> _F:
    """Compile a small function that is merged into every place that calls it."""
    return _machine_code.part(function, _nrt=False, forceinline=True)


def helper(function: _F) -> _F:
    """Compile a function that loops call; LLVM decides whether it is merged into them."""
    return _machine_code.part(function, _nrt=False)


def kernel(function: _F) -> _F:
    """Compile a loop that Python calls; its machine code is cached on disk."""
    return _compile(function, cache=True, nogil=True)


class _Address(numba.types.WrapperAddressProtocol):
    """A compiled function as a value that kernels call by its address."""

    def __init__(self, compiled: Any) -> None:
        self._compiled = compiled
        name = compiled.fndesc.llvm_cfunc_wrapper_name
        self._begins = int(compiled.library.get_pointer_to_function(name))

    def __wrapper_address__(self) -> int:
        return self._begins

    def signature(self) -> Any:
        """Return its types."""
        return self._compiled.signature


def expect_addresses() -> None:
    """Ignore that numba calls functions as values experimental, with each kernel that takes one; tests hold us to it.

    By the category: its words begin with a colour where colorama is installed. It has to be said again wherever such
    a kernel is compiled or loaded: test frameworks forget from test to test what is ignored. But not where it is said
    already: for a moment the filter is taken out of the list, and a warning in another thread passes through the gap.
    """
    ignored = ("ignore", None, numba.core.errors.NumbaExperimentalFeatureWarning, None, 0)
    if warnings.filters[:1] != [ignored]:
        warnings.simplefilter("ignore", numba.core.errors.NumbaExperimentalFeatureWarning)


def address_of(function: Any, arguments: tuple[Any, ...]) -> Any:
    """Return a kernel, compiled for types of arguments, as a value that other kernels call by its address."""
    if config.DISABLE_JIT:
        return function
    expect_addresses()
    function.compile(arguments)
    return _Address(function.overloads[arguments])
