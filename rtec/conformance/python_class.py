"""The Python interface: a user's class, played in a process of its own that is ended when it no longer moves on."""

from __future__ import annotations

import contextlib
import mmap
import os
import select
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from rtec.closing import Closing
from rtec.conformance._programs import signal_group
from rtec.conformance._python_child import ANSWER, COMPILING, LOADING, REQUEST, WATCHED
from rtec.errors import RtecError
from rtec.injector import Break, Response, Stimulus, Totals
from rtec.signal import EdgeStream

SILENT_S = 10.0
"""Without a call of its step for so long, an algorithm is ended."""
_COMPILING_S = 120.0
_LOOK_S = 0.2
_PIECE = 1 << 16
_PACKAGE = str(Path(__file__).resolve().parents[2])


class _Silent(Exception):  # noqa: N818 - a result, not an error of this program
    """The process did not move on, or has ended."""


class PythonClass(Closing):
    r"""A class in a file of the user's as an `rtec.injector.Algorithm`.

    The class is made anew for each run, without arguments, and has one method (docs/algorithm.md)::

        def step(self, t_ps, ab, requested):
            return ab_out, completed, wake_ps

    It runs as compiled code where its state is made of numbers, else as plain Python.

    Parameters
    ----------
    file
        A Python file; loading it runs it.
    name
        Of the class.
    clock_ps
        Period of a clock as a ratio in ps: the class then sees its inputs at ticks only. None for logic without one.

    Raises
    ------
    RtecError
        The file or the class cannot be used, in one line.

    Examples
    --------
    >>> import tempfile
    >>> file = Path(tempfile.mkdtemp()) / "wires.py"
    >>> _ = file.write_text("class Wires:\n    def step(self, t_ps, ab, requested):\n        return ab, 0, 0\n")
    >>> edges = EdgeStream.from_states([1_000, 2_000], [1, 2], 0)
    >>> with PythonClass(file, "Wires") as wires:
    ...     wires.play([Stimulus(edges=edges, requests=Totals(), until_ps=9_000)])[0].edges == edges
    True
    """

    def __init__(self, file: Path, name: str, *, clock_ps: tuple[int, int] | None = None) -> None:
        if not file.is_file():
            raise RtecError(f"{file}: no such file; ALGORITHM is file.py:Name, top.v, image.ihx or a design")
        self.file, self.class_name = file.resolve(), name
        self.clock_ps = (0, 1) if clock_ps is None else clock_ps
        self.note = ""
        """Why it runs as plain Python, or "" where it is compiled; known once something was played."""
        self._folder = tempfile.TemporaryDirectory(prefix="rtec-check-")
        self._process: subprocess.Popen[bytes] | None = None
        self._memory: mmap.mmap | None = None
        self._reasons: list[str] = []
        try:
            self._start()
        except BaseException:
            self.close()
            raise

    @property
    def name(self) -> str:
        """Return file and class."""
        return f"{self.file.name}:{self.class_name}"

    def play(self, stimuli: Sequence[Stimulus]) -> list[Response]:
        """Return what comes out for each stimulus; behind one that ends the process no more are played.

        Raises
        ------
        RtecError
            The process behind it cannot be started again.
        """
        responses: list[Response] = []
        if self._process is None:
            self._start()
        self._unsent += b"".join(self._packed(stimulus) for stimulus in stimuli)
        try:
            for stimulus in stimuli:
                responses.append(self._answer(stimulus))
        except _Silent as silent:
            broken = Break(time_ps=WATCHED.unpack(self._watched())[2], reason=str(silent), ended=True)
            self._end()
            responses.append(_nothing_came(stimuli[len(responses)], broken))
            # each of the others may cost ten seconds, too, and nobody looks behind the first that is broken
            not_played = Break(time_ps=0, reason="not played: its process ended in the run before", ended=True)
            responses += [_nothing_came(stimulus, not_played) for stimulus in stimuli[len(responses) :]]
        return responses

    def close(self) -> None:
        """End the process and remove what it needed."""
        self._end()
        self._folder.cleanup()

    # --- the process ---
    def _start(self) -> None:
        watched = Path(self._folder.name) / "watched"
        watched.write_bytes(bytes(WATCHED.size))
        with open(watched, "r+b") as file:
            self._memory = mmap.mmap(file.fileno(), WATCHED.size)
        from_us, to_child = os.pipe()
        from_child, to_us = os.pipe()
        command = [sys.executable, "-m", "rtec.conformance._python_child", str(self.file), self.class_name]
        path = os.pathsep.join(filter(None, (_PACKAGE, os.environ.get("PYTHONPATH", ""))))
        try:
            self._process = subprocess.Popen(  # noqa: S603 - the user's own file, which they asked to run
                [*command, str(from_us), str(to_us), str(watched)],
                stdin=subprocess.DEVNULL,
                stdout=sys.__stderr__ if sys.__stderr__ is not None else subprocess.DEVNULL,
                pass_fds=(from_us, to_us),
                start_new_session=True,  # Ctrl-C is its parent's, which ends it
                env=os.environ | {"PYTHONPATH": path, "PYTHONDONTWRITEBYTECODE": "1"},
            )
        finally:
            os.close(from_us)
            os.close(to_us)
        os.set_blocking(to_child, False)
        os.set_blocking(from_child, False)
        self._to_child, self._from_child = to_child, from_child
        self._unsent, self._unread = bytearray(), bytearray()
        try:
            kind, text = self._said()
        except _Silent as silent:
            raise RtecError(f"{self.name}: {silent} while the file is loaded") from None
        if kind == b"E":
            raise RtecError(f"{self.file.name}: {text}")
        self._reasons = text.split("\n")
        self._noted = False

    def _end(self) -> None:
        process, self._process = self._process, None
        if process is None:
            return
        os.close(self._to_child)
        os.close(self._from_child)
        signal_group(process, signal.SIGKILL)  # with what the algorithm has begun
        process.wait()

    def _packed(self, stimulus: Stimulus) -> bytes:
        edges, requests = stimulus.edges, stimulus.requests
        head = REQUEST.pack(len(edges), len(requests), edges.initial, stimulus.until_ps, *self.clock_ps)
        arrays = edges.times_ps, edges.levels, requests.times_ps, requests.totals
        return head + b"".join(np.ascontiguousarray(array).tobytes() for array in arrays)

    def _answer(self, stimulus: Stimulus) -> Response:
        if not self._noted:
            self.note, self._noted = self._said()[1], True
        made, booked, no, first, broken_ps, size = ANSWER.unpack(self._read(ANSWER.size))
        changes = np.frombuffer(self._read(8 * made), np.int64), np.frombuffer(self._read(made), np.uint8)
        totals = [np.frombuffer(self._read(8 * booked), np.int64) for _ in range(2)]
        refusals = [np.frombuffer(self._read(8 * no), np.int64).tolist() for _ in range(2)]
        reason = self._read(size).decode(errors="replace")
        return Response(
            edges=EdgeStream(*changes, initial=first),
            completed=Totals(*totals),
            refusals=tuple((t, self._reason(code)) for t, code in zip(*refusals, strict=True)),
            broken=None if broken_ps < 0 else Break(time_ps=broken_ps, reason=reason),
        )

    def _reason(self, code: int) -> str:
        known = 0 < code < len(self._reasons)
        return self._reasons[code] if known else f"reason {code}"

    def _said(self) -> tuple[bytes, str]:
        kind = self._read(1)
        return kind, self._read(int.from_bytes(self._read(8), "little")).decode(errors="replace")

    def _watched(self) -> bytes:
        return b"" if self._memory is None else self._memory[:]

    def _read(self, size: int) -> bytes:
        """Return so many bytes from the process, as long as it moves on; what waits to be sent goes out meanwhile."""
        seen, since = self._watched(), time.monotonic()
        while len(self._unread) < size:
            if self._exchange():
                continue
            now = self._watched()
            if now != seen:
                seen, since = now, time.monotonic()
            doing = WATCHED.unpack(now)[0]
            if time.monotonic() - since > (_COMPILING_S if doing == COMPILING else SILENT_S):
                what = "the file did not come to its end" if doing == LOADING else "step did not return"
                raise _Silent(f"{what} within {SILENT_S:g} s")
        part = bytes(self._unread[:size])
        del self._unread[:size]
        return part

    def _exchange(self) -> bool:
        """Move bytes to and from the process where the pipes have room; return whether any came."""
        sending = [self._to_child] if self._unsent else []
        readable, writable, _ = select.select([self._from_child], sending, [], _LOOK_S)
        if writable:
            try:
                del self._unsent[: os.write(self._to_child, self._unsent[:_PIECE])]
            except BlockingIOError:
                pass
            except OSError:  # nobody reads any more; answers may still stand in the other pipe
                self._unsent.clear()
        if readable:
            part = os.read(self._from_child, _PIECE)
            if not part:
                raise _Silent(self._how_it_ended())
            self._unread += part
        return bool(readable)

    def _how_it_ended(self) -> str:
        if self._process is None:
            return "its process is gone"
        with contextlib.suppress(subprocess.TimeoutExpired):
            code = self._process.wait(timeout=5.0)
            return (
                f"its process was ended by signal {-code}" if code < 0 else f"it ended its process with code {code}"
            )
        return "it closed its pipes"


def _nothing_came(stimulus: Stimulus, broken: Break) -> Response:
    return Response(edges=EdgeStream([], [], initial=stimulus.edges.initial), completed=Totals(), broken=broken)
