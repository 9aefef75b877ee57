"""The process in which a user's Python algorithm runs: stimuli come in on a pipe, and responses go back as bytes.

It is started with the algorithm's file and class, and the descriptors of the pipe and of a file of three numbers in
memory that its parent watches: what it is doing, how many calls it has made, and the simulated time of the last one.
"""

from __future__ import annotations

import contextlib
import importlib.util
import inspect
import json
import mmap
import os
import struct
import sys
import traceback
from collections.abc import Callable
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rtec.verify.contract._python_compiled import compiled_functions, record_of

LOADING, COMPILING, PLAYING = 0, 1, 2
WATCHED = struct.Struct("qqq")
MOST_CHANGES = 2_000_000
MOST_BYTES = 3 << 30
"""Of memory that it may ask for, compiler included."""
_FIRST_ROOM = 4096
FULL, TWICE, LEVELS, TOTAL, TOO_OFTEN = 1, 2, 3, 4, 5
"""How a run ends early, in the loop's own words."""
_MOST_CALLS, _SOONEST_PS = 2_000_000, 10_000
"""More calls than these are made of a step that asks for them, on average, this far apart; a poll may rest long."""


def run(  # noqa: C901, PLR0912, PLR0915 - one loop, compiled and plain, calls nothing but the step
    step: Any,
    algorithm: Any,
    edges_ps: NDArray[np.int64],
    levels: NDArray[np.uint8],
    asked_ps: NDArray[np.int64],
    asked: NDArray[np.int64],
    power_up: int,
    until_ps: int,
    clock_num: int,
    clock_den: int,
    out_ps: NDArray[np.int64],
    out_levels: NDArray[np.int64],
    done_ps: NDArray[np.int64],
    done: NDArray[np.int64],
    refused_ps: NDArray[np.int64],
    refused: NDArray[np.int64],
    watched: NDArray[np.int64],
) -> tuple[int, int, int, int, int, int, int]:
    """Call ``step`` at power-up, at every change of its inputs, and when it has asked for it.

    Returns numbers of changes, totals and refusals, the levels at power-up, how it ended, when, and the value that
    ended it. Plain Python and compiled code run these same lines.
    """
    i, k, made, booked, no = 0, 0, 0, 0, 0
    t_ps, ab, requested = 0, power_up, 0
    first, ab_out, total, code = power_up, power_up, 0, 0
    calls = 0
    while t_ps < until_ps:
        watched[1] += 1
        watched[2] = t_ps
        calls += 1
        new_ab, new_total, wake_ps, new_code = step(algorithm, t_ps, ab, requested)
        if new_ab < 0 or new_ab > 3:
            return made, booked, no, first, LEVELS, t_ps, new_ab
        if new_total < -(2**31) or new_total > 2**31:
            return made, booked, no, first, TOTAL, t_ps, new_total
        if wake_ps != 0 and wake_ps <= t_ps:
            return made, booked, no, first, TWICE, t_ps, wake_ps
        if calls > _MOST_CALLS and t_ps < (calls - i - k - 1) * _SOONEST_PS:
            return made, booked, no, first, TOO_OFTEN, t_ps, calls
        if made == len(out_ps) or booked == len(done_ps) or no == len(refused_ps):
            return made, booked, no, first, FULL, t_ps, 0
        if t_ps == 0:
            first = new_ab
        elif new_ab != ab_out:
            out_ps[made] = t_ps
            out_levels[made] = new_ab
            made += 1
        ab_out = new_ab
        if new_total != total:
            done_ps[booked] = t_ps
            done[booked] = new_total
            booked += 1
            total = new_total
        if new_code not in (0, code):
            refused_ps[no] = t_ps
            refused[no] = new_code
            no += 1
        code = new_code
        # the next moment: an edge, a request, or its own; with a clock, the first tick at or after it
        next_ps = until_ps
        if wake_ps != 0:
            next_ps = min(next_ps, wake_ps)
        if i < len(edges_ps):
            next_ps = min(next_ps, edges_ps[i])
        if k < len(asked_ps):
            next_ps = min(next_ps, asked_ps[k])
        if clock_num > 0:
            tick = -((-next_ps * clock_den) // clock_num)
            next_ps = -((-tick * clock_num) // clock_den)
            if next_ps <= t_ps:
                next_ps = -((-(tick + 1) * clock_num) // clock_den)
        while i < len(edges_ps) and edges_ps[i] <= next_ps:
            ab = int(levels[i])
            i += 1
        while k < len(asked_ps) and asked_ps[k] <= next_ps:
            requested = asked[k]
            k += 1
        t_ps = next_ps
    return made, booked, no, first, 0, t_ps, 0


class Faulty(Exception):  # noqa: N818 - it is the algorithm's, not this program's
    """The algorithm did what no algorithm may."""


def checked(kind: Any) -> Callable[[Any, int, int, int], tuple[int, int, int, int]]:
    """Return the class's step with what it returns checked, for plain Python."""
    step = kind.step

    def call(algorithm: Any, t_ps: int, ab: int, requested: int) -> tuple[int, int, int, int]:
        given = step(algorithm, t_ps, ab, requested)
        if not isinstance(given, tuple) or len(given) not in (3, 4):
            what = "nothing" if given is None else repr(given)[:80]
            raise Faulty(f"step returned {what}; it has to return (levels, completed, wake_ps)")
        for name, value in zip(("levels", "completed", "wake_ps", "refused"), given, strict=False):
            if not isinstance(value, int | np.integer):
                raise Faulty(f"step returned {value!r} for {name}; a whole number is wanted"[:200])
        ab_out, total, wake_ps = (int(value) for value in given[:3])
        return ab_out, total, wake_ps, int(given[3]) if len(given) == 4 else 0

    return call


class Player:
    """The user's class, played as compiled code or as plain Python."""

    def __init__(self, kind: Any, watched: NDArray[np.int64]) -> None:
        self.kind, self.watched = kind, watched
        self.plain = checked(kind)
        self.compiled: Any = None
        reasons = getattr(kind, "REASONS", ())
        self.reasons = [str(reason)[:200] for reason in reasons] if isinstance(reasons, list | tuple) else []

    def compile(self) -> str:
        """Compile the class; return why that cannot be, or ""."""
        self.watched[0] = COMPILING
        try:
            record = record_of(self.kind())
            self.compiled = compiled_functions(self.kind, record, run)
            none, levels, some = np.zeros(0, np.int64), np.zeros(0, np.uint8), np.zeros(8, np.int64)
            loop, step = self.compiled
            loop(step, record, none, levels, none, none, 0, 0, 0, 1, some, some, some, some, some, some, self.watched)
        except Exception as error:  # whatever a compiler says of a user's code
            self.compiled = None
            lines = [line.strip() for line in str(error).splitlines() if line.strip()]
            return (lines[0] if lines else type(error).__name__)[:160]
        return ""

    def play(self, stimulus: tuple[Any, ...], *, plainly: bool = False) -> tuple[Any, ...]:
        """Return changes, totals, refusals, levels at power-up, and time and reason of a break."""
        self.watched[0] = PLAYING
        room = _FIRST_ROOM
        while True:
            changes = np.zeros((6, room), np.int64)
            try:
                if self.compiled is not None and not plainly:
                    loop, step = self.compiled
                    ended = loop(step, record_of(self.kind()), *stimulus, *changes, self.watched)
                else:
                    # plain Python wants its own integers
                    given: list[Any] = [*(array.tolist() for array in stimulus[:4]), *stimulus[4:]]
                    ended = run(self.plain, self.kind(), *given, *changes, self.watched)  # type: ignore[call-arg]  # 3 or 4
            except Faulty as error:
                return self._broken(int(self.watched[2]), str(error))
            except SystemExit:  # it ends its process, which is told with the code
                raise
            except BaseException as error:  # whatever a user's code raises; a KeyboardInterrupt here is its own
                if self.compiled is not None and not plainly:
                    return self.play(stimulus, plainly=True)  # which knows the line
                return self._broken(int(self.watched[2]), where_raised(error, Path(inspect.getfile(self.kind))))
            made, booked, no, first, how, t_ps, value = (int(number) for number in ended)
            if how != FULL:
                break
            if room >= MOST_CHANGES:
                return self._broken(t_ps, f"changes its outputs more than {MOST_CHANGES} times in one run")
            room = min(8 * room, MOST_CHANGES)
        reason = {
            TWICE: f"step returned wake_ps = {value}, which is not after its own time {t_ps} ps; 0 stands for none",
            LEVELS: f"step returned levels {value}; A + 2 * B is 0 to 3",
            TOTAL: f"step returned completed = {value}; totals stay below 2^31",
            TOO_OFTEN: f"asks to be called more than {_MOST_CALLS} times in one run, sooner than every 10 ns",
        }.get(how, "")
        return (
            changes[0, :made], changes[1, :made].astype(np.uint8), changes[2, :booked], changes[3, :booked],
            changes[4, :no], changes[5, :no], first, t_ps if how else -1, reason,
        )  # fmt: skip

    def same_as_plain(self, stimulus: tuple[Any, ...]) -> bool:
        """Return whether compiled code and Python give the same: compiled integers wrap."""
        ways = self.play(stimulus), self.play(stimulus, plainly=True)
        return all(np.array_equal(a, b) if isinstance(a, np.ndarray) else a == b for a, b in zip(*ways, strict=True))

    def _broken(self, t_ps: int, reason: str) -> tuple[Any, ...]:
        none = np.zeros(0, np.int64)
        return none, none.astype(np.uint8), none, none, none, none, 0, t_ps, reason


def where_raised(error: BaseException, file: Path) -> str:
    """Return what a user's code raised, with file and line, or did otherwise."""
    if isinstance(error, Faulty):
        return str(error)
    rows = [row for row in traceback.extract_tb(error.__traceback__) if row.filename == str(file)]
    place = f" in {file.name}, line {rows[-1].lineno}" if rows else ""
    said = " ".join(str(error).split())[:160]
    return f"step raised {type(error).__name__}{f': {said}' if said else ''}{place}"


def load(file: Path, name: str) -> Any:
    """Return the class of that name in a file.

    Raises
    ------
    ImportError
        It cannot be loaded, or is not what is wanted, said in one line.
    """
    sys.path.insert(0, str(file.parent))
    spec = importlib.util.spec_from_file_location("algorithm", file)
    if spec is None or spec.loader is None:
        raise ImportError(f"{file.name} is no Python file")
    module = importlib.util.module_from_spec(spec)
    sys.modules["algorithm"] = module
    try:
        spec.loader.exec_module(module)
    except SyntaxError as error:
        place = "" if error.lineno is None else f"line {error.lineno}: "
        raise ImportError(f"{place}{error.msg}") from None
    except BaseException as error:  # a file may even end the process when it is loaded
        rows = [row for row in traceback.extract_tb(error.__traceback__) if row.filename == str(file)]
        place = f"line {rows[-1].lineno}: " if rows else ""
        raise ImportError(f"{place}{type(error).__name__}: {' '.join(str(error).split())[:160]}") from None
    found: Any = getattr(module, name, None)
    classes = [n for n, v in vars(module).items() if isinstance(v, type) and callable(getattr(v, "step", None))]
    if found is None:
        known = f"its classes with a step: {', '.join(classes)}" if classes else "it has no class with a step"
        raise ImportError(f"there is no class {name}; {known}")
    if name not in classes:
        raise ImportError(f"{name} is no class with a method step(self, t_ps, ab, requested)")
    wanted = 4
    try:
        given = len(inspect.signature(found.step).parameters)
    except (TypeError, ValueError):
        given = wanted
    if given != wanted:
        raise ImportError(f"{name}.step takes {given - 1} arguments; (self, t_ps, ab, requested) are given")
    try:
        found()
    except BaseException as error:
        raise ImportError(f"{name}() raised {type(error).__name__}: {' '.join(str(error).split())[:160]}") from None
    return found


def main(file: str, name: str, link_to: int, watched_by: int) -> None:
    """Serve stimuli until the parent closes its pipe."""
    _limit_memory()
    # a copy would read the same stimuli, and make copies in its turn, until the machine has no room left
    os.register_at_fork(after_in_child=lambda: os._exit(0))
    watched = np.frombuffer(mmap.mmap(watched_by, WATCHED.size), np.int64)
    link = Connection(link_to)
    try:
        player = Player(load(Path(file), name), watched)
        note = player.compile()
    except ImportError as error:
        link.send_bytes(json.dumps([str(error), []]).encode())
        return
    link.send_bytes(json.dumps(["", player.reasons]).encode())
    played = False
    with contextlib.suppress(EOFError, ConnectionResetError):
        while True:
            given = link.recv()
            # as the loop was compiled for: not read-only
            stimulus = (*(np.array(array) for array in given[:4]), *given[4:])
            if not played and player.compiled is not None and not player.same_as_plain(stimulus):
                player.compiled = None
                note = "compiled code does not do the same (its integers have 64 bits)"
            played = True
            *arrays, first, broken_ps, reason = player.play(stimulus)
            head = json.dumps([*(array.size for array in arrays[::2]), first, broken_ps, reason, note])
            link.send_bytes(head.encode() + b"\n" + np.concatenate(arrays, dtype=np.int64).tobytes())


def _limit_memory() -> None:
    """Let an algorithm that allocates without end meet a MemoryError before the machine has none left."""
    try:
        import resource  # noqa: PLC0415 - no such module on Windows
    except ImportError:
        return
    hard = resource.getrlimit(resource.RLIMIT_AS)[1]
    most = MOST_BYTES if hard == resource.RLIM_INFINITY else min(MOST_BYTES, hard)
    resource.setrlimit(resource.RLIMIT_AS, (most, hard))


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], int(sys.argv[3]), int(sys.argv[4]))
