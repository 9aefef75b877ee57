"""The Python interface: a user's class, played in a process of its own that is ended when it no longer moves on."""

from __future__ import annotations

import contextlib
import json
import mmap
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from multiprocessing import Pipe
from pathlib import Path
from typing import Any

import numpy as np

from rtec.closing import Closing
from rtec.errors import RtecError
from rtec.injector import Break, Response, Stimulus, Totals
from rtec.readable import printable
from rtec.signal import EdgeStream
from rtec.verify.contract._process_group import begin_group, end_group
from rtec.verify.contract._python_child import COMPILING, LOADING, WATCHED

SILENT_S = 10.0
"""Without a call of its step for so long, an algorithm is ended."""
_COMPILING_S = 120.0
_LOOK_S = 0.2
_PACKAGE = str(Path(__file__).resolve().parents[3])


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
        """That it runs as plain Python and why, or "" where it is compiled; known once something was played."""
        self._process: subprocess.Popen[bytes] | None = None
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
        try:
            for stimulus in stimuli:
                responses.append(self._answer(stimulus))
        except _Silent as silent:
            broken = Break(time_ps=WATCHED.unpack(self._watched[:])[2], reason=str(silent), ended=True)
            self.close()
            responses.append(_nothing_came(stimuli[len(responses)], broken))
            # each of the others may cost ten seconds, too, and nobody looks behind the first that is broken
            not_played = Break(time_ps=0, reason="not played: its process ended in the run before", ended=True)
            responses += [_nothing_came(stimulus, not_played) for stimulus in stimuli[len(responses) :]]
        return responses

    def close(self) -> None:
        """End the process."""
        process, self._process = self._process, None
        if process is not None:
            self._link.close()
            end_group(process)  # with what the algorithm has begun

    def _start(self) -> None:
        path = os.pathsep.join(filter(None, (_PACKAGE, os.environ.get("PYTHONPATH", ""))))
        self._link, its = Pipe()
        with its, tempfile.TemporaryFile() as watched:
            watched.truncate(WATCHED.size)
            self._watched = mmap.mmap(watched.fileno(), WATCHED.size)
            passed = its.fileno(), watched.fileno()
            self._process = begin_group(
                [sys.executable, "-m", "rtec.verify.contract._python_child", str(self.file), self.class_name]
                + [str(descriptor) for descriptor in passed],
                stdout=sys.__stderr__ if sys.__stderr__ is not None else subprocess.DEVNULL,
                descriptors=passed,
                environment=os.environ | {"PYTHONPATH": path, "PYTHONDONTWRITEBYTECODE": "1"},
            )
        try:
            error, self._reasons = json.loads(self._received())
        except _Silent as silent:
            raise RtecError(f"{self.name}: {silent} while the file is loaded") from None
        if error:
            raise RtecError(f"{self.file.name}: {printable(error)}")

    def _answer(self, stimulus: Stimulus) -> Response:
        edges, requests = stimulus.edges, stimulus.requests
        streams = edges.times_ps, edges.levels, requests.times_ps, requests.totals
        with contextlib.suppress(OSError):  # it has ended, which its answer will show
            self._link.send((*streams, edges.initial, stimulus.until_ps, *self.clock_ps))
        head, _, numbers = self._received().partition(b"\n")
        *sizes, first, broken_ps, reason, note = json.loads(head)
        self.note = f"runs as plain Python, slower: {printable(note)}" if note else ""
        arrays = np.split(np.frombuffer(numbers, np.int64), np.cumsum(np.repeat(sizes, 2))[:-1])
        return response_of((*arrays, first, broken_ps, reason), self._reasons)

    def _received(self) -> bytes:
        """Return what the process sends next, as long as it moves on; bytes: unpickling would run what they say."""
        seen, since = self._watched[:], time.monotonic()
        while not self._link.poll(_LOOK_S):
            now = self._watched[:]
            if now != seen:
                seen, since = now, time.monotonic()
            doing = WATCHED.unpack(now)[0]
            if time.monotonic() - since > (_COMPILING_S if doing == COMPILING else SILENT_S):
                what = "the file did not come to its end" if doing == LOADING else "step did not return"
                raise _Silent(f"{what} within {SILENT_S:g} s")
        try:
            return self._link.recv_bytes()
        except (EOFError, OSError):
            raise _Silent(self._how_it_ended()) from None

    def _how_it_ended(self) -> str:
        if self._process is None:
            return "its process is gone"
        with contextlib.suppress(subprocess.TimeoutExpired):
            code = self._process.wait(timeout=5.0)
            return (
                f"its process was ended by signal {-code}" if code < 0 else f"it ended its process with code {code}"
            )
        return "it closed its pipes"


def response_of(answer: tuple[Any, ...], reasons: Sequence[str]) -> Response:
    """Return what `rtec.verify.contract._python_child.Player.play` says; ``reasons`` by the codes of a refusal."""
    changes_ps, levels, done_ps, done, refused_ps, codes, first, broken_ps, reason = answer
    why = (reasons[code] if 0 < code < len(reasons) else f"reason {code}" for code in codes.tolist())
    return Response(
        edges=EdgeStream(changes_ps, levels, initial=first),
        completed=Totals(done_ps, done),
        refusals=tuple(zip(refused_ps.tolist(), why, strict=True)),
        broken=None if broken_ps < 0 else Break(time_ps=broken_ps, reason=reason),
    )


def _nothing_came(stimulus: Stimulus, broken: Break) -> Response:
    return Response(edges=EdgeStream([], [], initial=stimulus.edges.initial), completed=Totals(), broken=broken)
