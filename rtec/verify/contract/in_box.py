"""A user's Python class in a box of a machine: its step as machine code that the loops of the machine call."""

from __future__ import annotations

import contextlib
import copy
import ctypes
import os
import sys
import threading
import time
import weakref
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rtec._jit import STEPS, Record, config
from rtec.errors import RtecError
from rtec.injector._state_kernels import OWN
from rtec.readable import printable
from rtec.units import PS_PER_S
from rtec.verify.contract._python_child import checked, load, where_raised
from rtec.verify.contract._python_compiled import compiled_functions, record_of

SILENT_S = 10.0
"""A step that does not return within so long ends the process: machine code cannot be interrupted."""
_LOOK_S = 0.5
_RAISED, _LEVELS, _TOTAL, _BACK, _TOO_OFTEN = 1, 2, 3, 4, 5
"""How an algorithm ends early."""
_MOST_TOTAL = 1 << 31
_MOST_CALLS, _SOONEST_PS = 2_000_000, 10_000
"""More calls than these are made of a step that asks for them, on average, this far apart."""
_CALLED = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)
_OWN_BYTES = ctypes.c_char * OWN.itemsize


class PythonInBox:
    r"""A class with a step (docs/algorithm.md) for `rtec.machine.station_settings.StationSettings`.

    It is loaded into this process, and compiled where its state is made of numbers; else it runs as plain Python. It
    serves any number of boxes, each of which has a state of its own.

    Parameters
    ----------
    file
        A Python file; loading it runs it.
    name
        Of the class.

    Raises
    ------
    RtecError
        The file or the class cannot be used, in one line.

    Notes
    -----
    Where its step does not return within `SILENT_S`, the process says so and ends with exit code 2.

    Examples
    --------
    >>> import tempfile
    >>> from rtec.machine.station import Station, StationSettings
    >>> file = Path(tempfile.mkdtemp()) / "wires.py"
    >>> _ = file.write_text("class Wires:\n    def step(self, t_ps, ab, requested):\n        return ab, 0, 0\n")
    >>> station = Station(StationSettings(algorithm=PythonInBox(file, "Wires")))
    >>> _ = station.advance(until_ps=10**9)
    >>> station.audit
    True
    """

    def __init__(self, file: Path, name: str) -> None:
        if not file.is_file():
            raise RtecError(f"{file}: no such file; an algorithm is file.py:Name")
        self.name = f"{file.name}:{name}"
        self.note = ""
        """Why it runs as plain Python, or "" where it is compiled."""
        self._file = file.resolve()
        with _own_modules(self._file.parent):
            kind = self._loaded(name)
            try:
                self._step: _Compiled | _Plain = _Compiled(kind)
            except Exception as error:  # whatever a compiler says of a user's code
                lines = [line.strip() for line in str(error).splitlines() if line.strip()]
                self.note = printable((lines[0] if lines else type(error).__name__)[:160])
                self._step = _Plain(kind)

    def attach(self, own: Record) -> Attached:
        """Let it work in the box whose record has this part, for as long as what is returned is kept."""
        return Attached(self.name, self._file, self._step, own, self._step.memory())

    def _loaded(self, name: str) -> Any:
        alarm = threading.Timer(SILENT_S, _end_process, [f"{self.name}: the file did not come to its end"])
        alarm.daemon = True
        alarm.start()
        try:
            with contextlib.redirect_stdout(sys.stderr):
                return load(self._file, name)
        except ImportError as error:
            raise RtecError(f"{self._file.name}: {printable(str(error))}") from None
        finally:
            alarm.cancel()


class Attached:
    """An algorithm in one box, with what it keeps there."""

    def __init__(self, name: str, file: Path, step: _Compiled | _Plain, own: Record, memory: NDArray[Any]) -> None:
        self.name, self._file, self._step, self._own, self._memory = name, file, step, own, memory
        own.function, own.memory = self._step.address, memory.ctypes.data
        self.seen, self.since_s = -1, 0.0
        """Of the watch: the call that has not returned, and since when."""
        _WATCH.over(self)

    def copied_to(self, own: Record) -> Attached:
        """Let a copy work in the box whose record was copied."""
        return Attached(self.name, self._file, self._step, own, self._step.copied(self._memory))

    def check(self) -> None:
        """Raise what has ended the algorithm.

        Raises
        ------
        RtecError
            It raised, or returned what no algorithm may.
        """
        if self._own.broken:
            at_s = (int(self._own.since_ps) + int(self._own.t_ps)) / PS_PER_S
            raise RtecError(f"{self.name}: {self._why()}, {at_s:.6f} s into the run")

    def _why(self) -> str:
        value = int(self._own.value)
        if self._own.broken == _RAISED:
            return printable(self._step.why(self._own, self._memory, self._file))
        return {
            _LEVELS: f"step returned levels {value}; A + 2 * B is 0 to 3",
            _TOTAL: f"step returned completed = {value}; totals stay below 2^31",
            _BACK: f"step returned wake_ps = {value}, not after its own time {self._own.t_ps} ps; 0 stands for none",
            _TOO_OFTEN: f"asks to be called more than {_MOST_CALLS} times, sooner than every 10 ns",
        }[int(self._own.broken)]

    def silent(self, now_s: float) -> bool:
        """Return whether the same call has been under way for too long."""
        entered = int(self._own.entered)
        if entered == self._own.left or entered != self.seen:
            self.seen, self.since_s = entered, now_s
        return now_s - self.since_s > SILENT_S


def _answer(o: Record, levels: int, total: int, wake_ps: int, refused: int, raised: bool) -> None:
    """Put down what a step has returned, or why it has ended; plain Python and compiled code run these lines."""
    broken, value = 0, 0
    calls = o.entered - o.value
    if raised:
        broken = _RAISED
    elif levels < 0 or levels > 3:
        broken, value = _LEVELS, levels
    elif total < -_MOST_TOTAL or total > _MOST_TOTAL:
        broken, value = _TOTAL, total
    elif wake_ps != 0 and wake_ps <= o.t_ps:
        broken, value = _BACK, wake_ps
    elif calls > _MOST_CALLS and o.t_ps < calls * _SOONEST_PS:
        broken = _TOO_OFTEN
    o.left += 1
    if broken != 0:
        o.broken = broken
        o.value = value
        o.wake_ps = 0
    else:
        o.levels = levels
        o.completed = total
        o.wake_ps = wake_ps
        o.refused = refused


class _Compiled:
    """The step as machine code; a box keeps three records: the state now, before the last call, and at power-up."""

    def __init__(self, kind: Any) -> None:
        import numba as compiler  # noqa: PLC0415 - half a second, for those who want it

        if config.DISABLE_JIT:
            raise TypeError("nothing is compiled (NUMBA_DISABLE_JIT)")
        numba: Any = compiler
        self._kind, self._new = kind, record_of(kind())
        _, step = compiled_functions(kind, self._new, lambda: 0)
        answer = numba.njit(_answer)
        carray, pointer = numba.carray, numba.types.CPointer
        from_dtype = numba.np.numpy_support.from_dtype

        def call(own: Any, memory: Any) -> None:
            o, kept = carray(own, (1,))[0], carray(memory, (3,))
            o.entered += 1
            if o.fresh == 1:
                kept[0] = kept[2]
                o.fresh = 0
                o.value = o.entered
            kept[1] = kept[0]
            raised, levels, total, wake_ps, refused = False, 0, 0, 0, 0
            try:
                levels, total, wake_ps, refused = step(kept[0], o.t_ps, o.ab, o.requested)
            except Exception:
                raised = True
            answer(o, levels, total, wake_ps, refused, raised)

        types = pointer(from_dtype(OWN)), pointer(from_dtype(self._new.dtype))
        self._code = numba.cfunc(numba.types.void(*types))(call)
        self.address = int(self._code.address)

    def memory(self) -> NDArray[Any]:
        """Return room for a box."""
        return np.array([self._new] * 3)

    def copied(self, memory: NDArray[Any]) -> NDArray[Any]:
        """Return a copy of what a box keeps."""
        return memory.copy()

    def why(self, own: Record, memory: NDArray[Any], file: Path) -> str:
        """Return what the last call raised: plain Python knows the line."""
        algorithm = self._kind()
        for name in memory.dtype.names or ():
            was, value = getattr(algorithm, name, 0), memory[1][name]
            setattr(algorithm, name, value.copy() if isinstance(was, np.ndarray) else value.tolist())
        try:
            checked(self._kind)(algorithm, int(own.t_ps), int(own.ab), int(own.requested))
        except Exception as error:  # a user's code
            return where_raised(error, file)
        return "step raised as compiled code (its integers have 64 bits)"


class _Plain:
    """The step as plain Python, called from machine code; what a box keeps is the number of its object."""

    def __init__(self, kind: Any) -> None:
        self._kind, self._checked = kind, checked(kind)
        self._objects: dict[int, Any] = {}
        self._errors: dict[int, BaseException] = {}
        self._code = _CALLED(self._called)
        self.address = int(ctypes.cast(self._code, ctypes.c_void_p).value or 0)
        STEPS[self.address] = self._call

    def memory(self) -> NDArray[Any]:
        """Return room for a box."""
        return self._room(self._kind())

    def copied(self, memory: NDArray[Any]) -> NDArray[Any]:
        """Return a copy of what a box keeps."""
        return self._room(copy.deepcopy(self._objects[memory.ctypes.data]))

    def _room(self, algorithm: Any) -> NDArray[Any]:
        memory = np.zeros(1, np.int64)
        at = memory.ctypes.data
        self._objects[at] = algorithm
        for kept in (self._objects, self._errors):
            weakref.finalize(memory, kept.pop, at, None)
        return memory

    def _called(self, own_at: int, memory_at: int) -> None:
        """Take a call from machine code."""
        there = np.frombuffer(memoryview(_OWN_BYTES.from_address(own_at)), OWN)
        self._call(np.rec.array(there, copy=False)[0], memory_at)

    def _call(self, o: Record, memory_at: int) -> None:
        o.entered += 1
        if o.fresh:
            self._objects[memory_at] = self._kind()
            o.fresh = 0
            o.value = o.entered
        answer, raised = (0, 0, 0, 0), False
        try:
            answer = self._checked(self._objects[memory_at], int(o.t_ps), int(o.ab), int(o.requested))
        except BaseException as error:  # whatever a user's code raises
            raised, self._errors[memory_at] = True, error
        _answer(o, *answer, raised)

    def why(self, own: Record, memory: NDArray[Any], file: Path) -> str:
        """Return what the last call raised."""
        return where_raised(self._errors[memory.ctypes.data], file)


class _Watch:
    """A thread that ends the process where a step does not return."""

    def __init__(self) -> None:
        self._boxes: weakref.WeakSet[Attached] = weakref.WeakSet()
        self._thread: threading.Thread | None = None

    def over(self, box: Attached) -> None:
        """Watch over a box, too."""
        self._boxes.add(box)
        if self._thread is None:
            self._thread = threading.Thread(target=self._look, name="rtec-watch", daemon=True)
            self._thread.start()

    def _look(self) -> None:
        while True:
            time.sleep(_LOOK_S)
            with contextlib.suppress(RuntimeError):  # another thread adds one
                for box in tuple(self._boxes):
                    if box.silent(time.monotonic()):
                        _end_process(f"{box.name}: step did not return")


_WATCH = _Watch()


def _end_process(why: str) -> None:
    """End this process with a line: a thread in a user's machine code cannot be stopped otherwise."""
    os.write(2, f"rtec: {why} within {SILENT_S:g} s\n".encode(errors="replace"))
    os._exit(2)


@contextlib.contextmanager
def _own_modules(folder: Path) -> Iterator[None]:
    """Forget what was loaded from a user's folder: another algorithm may have files of the same names."""
    path, before = list(sys.path), set(sys.modules)
    try:
        yield
    finally:
        sys.path[:] = path
        for name in set(sys.modules) - before:
            file = getattr(sys.modules[name], "__file__", None)
            if name == "algorithm" or (file is not None and Path(file).is_relative_to(folder)):
                del sys.modules[name]
