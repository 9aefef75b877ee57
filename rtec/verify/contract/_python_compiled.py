"""A user's class as compiled code: its state as a record, its methods as functions that take it."""

from __future__ import annotations

import ast
import inspect
import textwrap
import types
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

_METHOD = "_method_of_the_class_"


def record_of(algorithm: Any) -> Any:
    """Return the state of an algorithm as a record: its own attributes and those of its class.

    Raises
    ------
    TypeError
        An attribute that is no number and no array of numbers.
    """
    named: dict[str, Any] = {}
    for kind in reversed(type(algorithm).__mro__[:-1]):
        named |= {
            name: value
            for name, value in vars(kind).items()
            if not name.startswith("__")
            and name not in ("REASONS", "TIMES", "TOTALS")
            and not callable(value)
            and not isinstance(value, staticmethod | property | str)
        }
    named |= vars(algorithm)
    fields: list[tuple[Any, ...]] = []
    for name, value in named.items():
        array = np.asarray(value)
        if array.dtype.kind not in "biuf" or array.size == 0:
            raise TypeError(f"attribute {name} is no number and no list of numbers")
        fields.append((name, np.float64 if array.dtype.kind == "f" else np.int64, array.shape))
    record = np.zeros(1, np.dtype(fields or [("_", np.int64)], align=True))[0]
    for name, value in named.items():
        record[name] = np.asarray(value)
    return record


def compiled_functions(kind: Any, record: Any, loop: Callable[..., Any]) -> Any:
    """Return a loop and the step of a class that it calls, both compiled.

    Methods of the class, and functions of files in its folder, are compiled where they are called.

    Raises
    ------
    Exception
        Whatever the compiler says.
    """
    import numba as compiler  # noqa: PLC0415 - half a second, for those who want it

    numba: Any = compiler
    warnings.filterwarnings("ignore", message="First-class function type feature is experimental")
    options = {"boundscheck": True, "error_model": "python"}
    inner = _Functions(kind, lambda function: numba.njit(function, **options)).step()
    whole = numba.types.int64
    signature = (numba.typeof(record), whole, whole, whole)
    inner.compile(signature)
    given: Any = inner.overloads[signature].signature.return_type
    kinds = numba.types.Integer, numba.types.Boolean
    if not isinstance(given, numba.types.BaseTuple) or not all(isinstance(item, kinds) for item in given):
        raise TypeError(f"step returns {given}")

    def of_three(algorithm: Any, t_ps: int, ab: int, requested: int) -> tuple[int, int, int, int]:
        ab_out, total, wake_ps = inner(algorithm, t_ps, ab, requested)
        return int(ab_out), int(total), int(wake_ps), 0

    def of_four(algorithm: Any, t_ps: int, ab: int, requested: int) -> tuple[int, int, int, int]:
        ab_out, total, wake_ps, refused = inner(algorithm, t_ps, ab, requested)
        return int(ab_out), int(total), int(wake_ps), int(refused)

    return numba.njit(loop), numba.njit(of_three if len(given) == 3 else of_four)


def _constant(value: Any) -> Any:
    """Return lists, also those in lists, as tuples: what is changed in them does not compile."""
    return tuple(_constant(item) for item in value) if isinstance(value, list) else value


class _Functions:
    """The methods of a class, with what they call, as functions for the compiler, which knows no methods."""

    def __init__(self, kind: Any, compile_one: Callable[[types.FunctionType], Any]) -> None:
        self.compile_one = compile_one
        self.folder = Path(inspect.getfile(kind)).parent
        self.methods: dict[str, types.FunctionType] = {
            name: found
            for name in dir(kind)
            if not name.startswith("__") and inspect.isfunction(found := inspect.getattr_static(kind, name))
        }
        self.names: dict[int, dict[str, Any]] = {}
        """Global names of each file, with functions in the place of what they were."""

    def step(self) -> Any:
        """Return the compiled step."""
        made = {name: self._compiled(self._without_methods(method)) for name, method in self.methods.items()}
        for names in self.names.values():
            names |= {_METHOD + name: function for name, function in made.items()}
        return made["step"]

    def _compiled(self, function: types.FunctionType) -> Any:
        names = self._names_of(function.__globals__)
        again = types.FunctionType(
            function.__code__, names, function.__name__, function.__defaults__, function.__closure__
        )
        return self.compile_one(again)

    def _names_of(self, names: dict[str, Any]) -> dict[str, Any]:
        if id(names) not in self.names:
            ours = self.names[id(names)] = dict(names)
            for name, value in names.items():
                if isinstance(value, list):
                    ours[name] = _constant(value)  # the compiler knows no list outside a function
                elif isinstance(value, types.FunctionType) and Path(value.__code__.co_filename).parent == self.folder:
                    ours[name] = self._compiled(value)
        return self.names[id(names)]

    def _without_methods(self, method: types.FunctionType) -> types.FunctionType:
        """Return a method in which ``self.name(x)`` reads ``name(self, x)``."""
        if not set(method.__code__.co_names) & self.methods.keys() or method.__closure__:
            return method
        written = ast.parse(textwrap.dedent(inspect.getsource(method))).body[0]
        if not isinstance(written, ast.FunctionDef) or written.decorator_list:
            return method
        _Calls(written.args.args[0].arg, self.methods).visit(written)
        written.args.defaults, written.args.kw_defaults, written.returns = (
            [],
            [None] * len(written.args.kwonlyargs),
            None,
        )
        for argument in written.args.args:
            argument.annotation = None
        defined: dict[str, Any] = {}
        module = ast.fix_missing_locations(ast.Module(body=[written], type_ignores=[]))
        # the user's own lines, which were run when the file was loaded
        exec(compile(module, method.__code__.co_filename, "exec"), defined)  # noqa: S102 - as above
        code = defined[method.__name__].__code__
        return types.FunctionType(code, method.__globals__, method.__name__, method.__defaults__)


class _Calls(ast.NodeTransformer):
    """Turns calls of methods into calls of functions."""

    def __init__(self, own_name: str, methods: dict[str, types.FunctionType]) -> None:
        self.own_name, self.methods = own_name, methods

    def visit_Call(self, node: ast.Call) -> ast.AST:
        """Turn one call, and those in its arguments."""
        self.generic_visit(node)
        called = node.func
        if (
            isinstance(called, ast.Attribute)
            and isinstance(called.value, ast.Name)
            and called.value.id == self.own_name
            and called.attr in self.methods
        ):
            node.args.insert(0, called.value)
            node.func = ast.Name(id=_METHOD + called.attr, ctx=ast.Load())
        return node
