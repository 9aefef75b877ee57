"""The only place with numba options of the processor's kernels, and what every compiled function is made by."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
import numpy as np
from numba.core import config as _numba_config

from firmware_model import _machine_code

_F = TypeVar("_F", bound=Callable[..., Any])

config: Any = _numba_config  # its settings are made at run time

if config.DISABLE_JIT:
    # uncompiled, for debugging, whole numbers must wrap around as silently as they do in machine code
    np.seterr(over="ignore")

PACKAGE = Path(__file__).resolve().parent

KNOWN = (0, 60) <= tuple(map(int, numba.__version__.split(".")[:2])) <= (0, 68)
"""Whether this is a numba whose inside is known, so that `firmware_model._numba_inside` can be used."""

# what is not said is inherited from the function whose compilation asks for this one first: all is said
_OPTIONS = {"nopython": True, "error_model": "numpy", "fastmath": False, "forceinline": False}


def compiled(function: _F, package: Path | None, **options: Any) -> _F:
    """Return a function that is compiled when it is called first; its machine code is kept as that of a package."""
    if config.DISABLE_JIT:
        return function
    code: Any = function
    folder = None if package is None else _machine_code.folder_of(package, Path(code.__code__.co_filename))
    if KNOWN:
        from firmware_model._numba_inside import Kernel  # noqa: PLC0415 - an unknown numba may lack what it imports

        return cast(_F, Kernel(code, _OPTIONS | options, folder=folder))
    return _plainly(function, folder, options)


def part(function: _F, **options: Any) -> _F:
    """Return a function that is compiled into each kernel that calls it."""
    if config.DISABLE_JIT:
        return function
    if KNOWN:
        from firmware_model._numba_inside import Part  # noqa: PLC0415 - as above

        return cast(_F, Part(cast(Any, function), _OPTIONS | options))
    return _plainly(function, None, options)


def _plainly(function: _F, folder: Path | None, options: dict[str, Any]) -> _F:
    """Compile a function in the way that numba documents."""
    before, njit = config.CACHE_DIR, cast(Any, numba.njit)  # its types leave some options out
    try:
        config.CACHE_DIR = str(folder or before)  # numba has no argument for it and reads it as it decorates
        return cast(_F, njit(cache=folder is not None, **(_OPTIONS | options))(function))
    finally:
        config.CACHE_DIR = before


def step(function: _F) -> _F:
    """Compile a small function that is merged into every place that calls it."""
    return part(function, _nrt=False, forceinline=True)


def helper(function: _F) -> _F:
    """Compile a function that loops call; LLVM decides whether it is merged into them."""
    return part(function, _nrt=False)


def kernel(function: _F) -> _F:
    """Compile a loop that Python calls; its machine code is cached on disk.

    No kernel here allocates. Without numba's runtime an array that is handed on is not counted, which took half the
    time of an instruction.
    """
    return compiled(function, PACKAGE, _nrt=False, nogil=True)


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
