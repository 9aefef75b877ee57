"""The only place with numba options: how every kernel of rtec is compiled.

Compiled functions live in files named ``*_kernels.py``. Their machine code is cached on disk
(`firmware_model._machine_code`): a file's in a folder named after the contents of all that the file imports.
"""

from __future__ import annotations

import functools
import hashlib
import importlib
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeAlias, TypeVar, cast

import numba
import numpy as np
from numba.np.numpy_support import from_dtype, map_layout

from firmware_model import _jit as _processor, _machine_code

_F = TypeVar("_F", bound=Callable[..., Any])

config = _processor.config

Record: TypeAlias = Any
"""The state of a stage: one element of a structured array, passed to step functions by reference."""

if config.DISABLE_JIT:
    # uncompiled, for debugging, whole numbers must wrap around as silently as they do in machine code
    np.seterr(over="ignore")

PACKAGE = Path(__file__).resolve().parent


def _compile(function: _F, **options: Any) -> _F:
    return _processor.compiled(function, PACKAGE, nogil=True, **options)


def step(function: _F) -> _F:
    """Compile a scalar step function; it is merged into every loop that calls it."""
    return _processor.part(function, forceinline=True, _nrt=False)


def fused_step(function: _F) -> _F:
    """Compile a step in which a product and the sum it goes into may be one instruction, rounded once."""
    return _processor.part(function, forceinline=True, _nrt=False, fastmath={"contract"})


def fused_kernel(function: _F) -> _F:
    """Compile a kernel as `kernel` does; a product and the sum it goes into may be one instruction, rounded once."""
    return _compile(function, _nrt=False, fastmath={"contract"})


def written_out(function: _F) -> _F:
    """Write a function out in every place that calls it, before types are known: compiled code returns no records."""
    return _processor.compiled(function, None, inline="always", _nrt=False)


def helper(function: _F) -> _F:
    """Compile a function that loops call now and then, kept as one copy."""
    return _processor.part(function, _nrt=False)


def fused_helper(function: _F) -> _F:
    """Compile a helper in which a product and the sum it goes into may be one instruction, rounded once."""
    return _processor.part(function, _nrt=False, fastmath={"contract"})


def summing_helper(function: _F) -> _F:
    """Compile a helper whose sums may be made in any order, so that the compiler makes several at once."""
    return _processor.part(function, _nrt=False, fastmath={"contract", "nsz", "reassoc"})


def kernel(function: _F) -> _F:
    """Compile a loop that Python calls; its machine code is cached on disk.

    It makes no arrays. So it does without numba's runtime, which counts every array that is handed on: with a model's
    five arrays that took as long as a tick of the servo.
    """
    return _compile(function, _nrt=False)


def array_helper(function: _F) -> _F:
    """Compile a function that makes arrays of its own, and that array kernels call."""
    return _processor.part(function)


def array_kernel(function: _F) -> _F:
    """Compile a loop that Python calls and that makes arrays of its own."""
    return _compile(function)


def guarded(function: Callable[..., Any], arguments: int) -> Any:
    """Return a user's function of three or four arrays, compiled so that it cannot write beside them.

    Where it raises it returns no number: called by its address, it would return zero.
    """
    njit: Any = numba.njit  # it says what is no function; its types leave some options out
    checked: Any = function if hasattr(function, "py_func") else njit(boundscheck=True, error_model="numpy")(function)

    # compiled code has no functions of any number of arguments
    def of_three(a: Any, b: Any, c: Any) -> float:
        try:
            return float(checked(a, b, c))
        except Exception:
            return float(np.nan)

    def of_four(a: Any, b: Any, c: Any, d: Any) -> float:
        try:
            return float(checked(a, b, c, d))
        except Exception:
            return float(np.nan)

    return _processor.compiled(of_three if arguments == 3 else of_four, None)


def is_compiled(module: str) -> bool:
    """Return whether machine code of a module's kernels, such as ``rtec.machine._loop_kernels``, is kept already."""
    file = PACKAGE.parent.joinpath(*module.split(".")).with_suffix(".py")
    return bool(config.DISABLE_JIT) or _machine_code.is_kept(PACKAGE, file)


def source_digest(module: str) -> str:
    """Return a digest of a module and of all of rtec that it imports, of the compiler and of Python."""
    file = importlib.import_module(module).__file__
    if file is None:
        raise ImportError(f"{module} has no file")
    return _machine_code.digest_of(Path(file).resolve(), PACKAGE.parent)


def cpu_target() -> str:
    """Return the processor that numba compiles for, and a digest of its abilities; ``NUMBA_CPU_NAME`` chooses one."""
    name, features = numba.core.registry.cpu_target.target_context.codegen().magic_tuple()[1:3]
    return f"{name} {hashlib.sha256(features.encode()).hexdigest()[:8]}"


def prepared(function: Any, *arguments: object) -> Any:
    """Return a kernel compiled for arguments of these types, to be called with such arguments only.

    Called by its name a kernel looks up the type of each argument every time: a tenth of a millisecond, where one of
    them is a compiled function.
    """
    if config.DISABLE_JIT:
        return function
    types = _types_of(arguments)
    function.compile(types)
    return function.overloads[types].entry_point


def _types_of(arguments: tuple[object, ...]) -> tuple[Any, ...]:
    _processor.expect_addresses()
    return tuple(map(_type_of, arguments))


def _type_of(value: Any) -> Any:
    """Return a value's type; those of records, which numba takes milliseconds to read, are read once."""
    types: Any = numba.types
    if isinstance(value, tuple):
        return types.BaseTuple.from_types(tuple(map(_type_of, value)), type(value))
    if isinstance(value, np.void):
        return _record_type(value.dtype)
    if isinstance(value, np.ndarray) and value.dtype.names is not None:
        return _array_type(value.dtype, value.ndim, map_layout(value), value.flags.writeable)
    return numba.typeof(value)  # type: ignore[no-untyped-call]  # numba has no types


_record_type = functools.cache(from_dtype)


@functools.cache
def _array_type(dtype: np.dtype[np.void], dimensions: int, layout: str, writeable: bool) -> Any:
    types: Any = numba.types  # its types know no structured arrays
    return types.Array(_record_type(dtype), dimensions, layout, readonly=not writeable)


def by_address(function: Any, *arguments: object) -> Any:
    """Return a kernel compiled for arguments of these types, as a value that other kernels call by its address.

    Called by its name it would be compiled anew into each of them, and once more into each of their callers.
    """
    return function if config.DISABLE_JIT else _processor.address_of(function, _types_of(arguments))


STEPS: dict[int, Callable[[Record, int], None]] = {}
"""Functions by their addresses, for `call_at` where nothing is compiled."""


def _call_at_plainly(address: int, record: Record, memory: int) -> None:
    STEPS[int(address)](record, int(memory))


def _call_at(context: Any, address: Any, record: Any, memory: Any) -> Any:
    """Return type and code of a call of ``void f(record *, memory *)`` at an address that a record holds."""
    types: Any = numba.types
    ir: Any = importlib.import_module("llvmlite.ir")

    def code(context: Any, builder: Any, signature: Any, given: Any) -> Any:
        pointer = ir.IntType(8).as_pointer()
        function = ir.FunctionType(ir.VoidType(), [pointer, pointer]).as_pointer()
        arguments = [builder.bitcast(given[1], pointer), builder.inttoptr(given[2], pointer)]
        builder.call(builder.inttoptr(given[0], function), arguments)
        return context.get_dummy_value()

    return types.void(address, record, memory), code


call_at: Any = _call_at_plainly if config.DISABLE_JIT else cast(Any, numba.extending).intrinsic(_call_at)
"""Calls a user's function at an address, with a record and the address of what the function keeps."""


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
