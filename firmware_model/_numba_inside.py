"""All that rtec uses of numba's inside, which numba does not document; with a numba that is not known, nothing of it.

Without it kernels take about twice as long to compile, and programs that start at once may all compile the same.
"""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache, cached_property
from pathlib import Path
from types import FunctionType
from typing import Any

from numba.core import caching, codegen, compiler, registry, types

from firmware_model._machine_code import Keeper, Locator

# each pass writes out the types of the arguments, and a machine's state has hundreds of fields: a tenth of the time
_Record: Any = types.Record
_Record.__repr__ = cache(_Record.__repr__)


class _Cache(caching.FunctionCache):
    def __init__(self, function: FunctionType, folder: Path) -> None:
        place = {"_locator_classes": [Locator(function, folder)]}
        self._impl_class: Any = type("Code", (caching.CompileResultCacheImpl,), place)
        self._keeper = Keeper(function, folder)
        super().__init__(function)

    def load_overload(self, *key: Any) -> Any:
        return self._keeper.load(lambda: super(_Cache, self).load_overload(*key))

    def save_overload(self, *content: Any) -> None:
        self._keeper.save(lambda: super(_Cache, self).save_overload(*content))


@contextmanager
def _uncollected() -> Iterator[None]:
    """Let the garbage lie: looking for it among all that a compiler holds takes another tenth of the time."""
    collects = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if collects:
            gc.enable()


class Kernel(registry.CPUDispatcher):
    def __init__(self, function: FunctionType, options: dict[str, Any], *, folder: Path | None = None) -> None:
        super().__init__(function, targetoptions=options)
        if folder is not None:
            self._cache = _Cache(function, folder)

    def compile(self, signature: Any) -> Any:
        with _uncollected():
            return super().compile(signature)

    def get_call_template(self, args: Any, kws: Any) -> Any:  # numbers written out make no versions of their own
        plain = types.unliteral
        return super().get_call_template(tuple(map(plain, args)), {name: plain(kind) for name, kind in kws.items()})


class _PartLibrary(codegen.JITCodeLibrary):
    def _optimize_final_module(self) -> None: ...  # the kernel that takes a part in optimises it with its own code

    def _finalize_final_module(self) -> None:
        self._finalized = True


class _PartCompiler(compiler.Compiler):
    def compile_extra(self, function: FunctionType) -> Any:
        whole: Any = super()
        context = self.state.targetctx
        self.state.library = _PartLibrary(context.codegen(), function.__qualname__)
        self.state.flags.no_compile = True
        result = whole.compile_extra(function)
        context.insert_user_function(result.fndesc, result.fndesc, [result.library])
        return result._replace(entry_point=result.fndesc)


class Part(Kernel):
    def __init__(self, function: FunctionType, options: dict[str, Any]) -> None:
        inside = options | {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
        registry.CPUDispatcher.__init__(self, function, targetoptions=inside, pipeline_class=_PartCompiler)
        self._options = options

    def add_overload(self, result: Any) -> None:
        self.overloads[tuple(result.signature.args)] = result

    def _compile_for_args(self, *_arguments: Any, **_named: Any) -> Any:
        return self.alone

    @cached_property
    def alone(self) -> Any:  # as Python calls it
        function: Any = self.py_func
        return Kernel(function, self._options)
