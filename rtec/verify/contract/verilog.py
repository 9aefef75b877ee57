"""The Verilog interface: a module built by Verilator, in a process of its own."""

from __future__ import annotations

import os
import re
import select
import signal
import subprocess
import tempfile
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

import numpy as np

from rtec.closing import Closing
from rtec.errors import ArgumentError, OutputError
from rtec.injector import Reach, Response, Stimulus
from rtec.io import read_bytes
from rtec.units import FREQUENCY, PS_PER_S, parse_exact, parse_quantity
from rtec.verify.contract._process_group import begin_group, end_group, signal_group
from rtec.verify.contract._verilator import build
from rtec.verify.contract._verilog_runs import Runs, response_of, stream_rows
from rtec.verify.contract.verilog_pins import Pins

SILENT_S = 10.0
"""A simulation that shows no sign of life for so long is told to end."""
_GRACE_S = 1.0
"""So long it may still write what it knows."""
_ROW = 6 * 8
_PLAYS = 3
"""Registers that the design leaves open are all 0 in the first play, all 1 in the second, random in the third."""
_ALL_PLAYED = np.int64(6).tobytes()
_TOLD_TO_END = 4
"""Exit code of a simulation behind SIGTERM, or that has printed more than 50 MB."""


def clock_of(text: str) -> tuple[int, int]:
    """Read the frequency of a clock; return its period in ps as a ratio of whole numbers.

    Raises
    ------
    ArgumentError
        No frequency from 1 kHz to 1 GHz, or one with more digits than can be kept.

    Examples
    --------
    Tick k is at ``k * numerator / denominator`` ps, rounded up each for itself, so that nothing drifts:

    >>> clock_of("50MHz"), clock_of("3 MHz"), clock_of("33.333 MHz")
    ((20000, 1), (1000000, 3), (1000000000, 33333))
    """
    if 1e3 <= parse_quantity(text, FREQUENCY, name="clock") <= 1e9:
        period = PS_PER_S / parse_exact(text, FREQUENCY.unit, name="clock")
        if max(period.numerator, period.denominator) < 2**60:
            return period.numerator, period.denominator
    raise ArgumentError("clock", repr(text)[:60], "a frequency from 1 kHz to 1 GHz, of at most 12 digits")


class VerilogAlgorithm(Closing):
    """A Verilog module as an `rtec.injector.Algorithm`; built once, played in one process for many streams.

    Before time 0 the module is reset, where it has a reset, and clocked on for 100 ticks with A and B at their levels
    of power-up and nothing requested. A tick of the clock is at time 0. A and B and the requested total change when
    they change, without regard to the clock; what changes at the instant of a tick is seen by the next one. The
    module's other files are looked for beside it by their names. Delays (``#5``) are an error.

    Outputs that differ with what registers hold at power-up that nothing sets (all 0, all 1, random) break the run,
    as do ``$finish``, logic that does not settle, and 10 s without progress.

    A design at rest is not clocked on: where all that it remembers is the same at two ticks in a row, with nothing in
    or out between them, the ticks up to the next input are left out. Where that cannot be known, every tick is
    simulated, and `note` says so.

    A Verilog file runs with the user's rights, as a Python file does: ``$fopen``, ``$system`` and the like work.

    Parameters
    ----------
    file
        The module's source, Verilog or SystemVerilog.
    pins
        Which port is what.
    clock_ps
        Period of its clock in ps, a ratio of whole numbers (`clock_of`).

    Raises
    ------
    RtecError
        No Verilator (5 or newer), a file that does not build (with the line of the first error), ports that are not
        there, no room for what is built.

    Examples
    --------
    ::

        pins = Pins.read(Path("design_c.toml"))
        with VerilogAlgorithm(Path("design_c.v"), pins=pins, clock_ps=clock_of("50MHz")) as mine:
            response = mine.play([stimulus])[0]
        judge(stimulus, response, Contract.of(Design.C))
    """

    def __init__(self, file: Path, *, pins: Pins, clock_ps: tuple[int, int]) -> None:
        read_bytes(file, "a Verilog file")
        self._file, self._pins = file, pins
        self._simulation: subprocess.Popen[bytes] | None = None
        try:
            self._folder = tempfile.TemporaryDirectory(prefix="rtec-", ignore_cleanup_errors=True)
        except OSError as error:
            said = error.strerror or str(error)
            raise OutputError(f"no temporary folder: {said}; TMPDIR names one that can be written to") from error
        try:
            self._built = build(Path(self._folder.name), file.resolve(), pins, clock_ps)
        except BaseException:
            self.close()
            raise

    @property
    def name(self) -> str:
        """Return the file's name."""
        return self._file.name

    @property
    def note(self) -> str:
        """Return why every tick is simulated, or nothing where a design at rest needs none."""
        if self._built.may_rest:
            return ""
        return (
            "clocked at every tick, which takes longer: it reads the time, files or random numbers, or keeps values "
            "that cannot be compared; --tries 300 shortens the hunt"
        )

    @property
    def reach(self) -> Reach:
        """Return what the port for requests holds."""
        return Reach(total=2 ** (self._built.widths[self._pins.requested] - 1) - 1)

    def play(self, stimuli: Sequence[Stimulus]) -> list[Response]:
        """Return what comes out for each stimulus.

        Raises
        ------
        ArgumentError
            A total that the bus for requests cannot hold.
        """
        for stimulus in stimuli:
            self._check_totals(stimulus)
        responses: list[Response] = []
        while len(responses) < len(stimuli):  # behind a stream that ended the process it is begun again
            rest = stimuli[len(responses) :]
            responses += [
                response_of(stimulus, runs, self._pins)
                for stimulus, runs in zip(rest, self._runs(rest), strict=False)
            ]
        return responses

    def close(self) -> None:
        """End the simulation and remove what was built."""
        if self._simulation is not None:
            end_group(self._simulation)
        self._folder.cleanup()

    def _check_totals(self, stimulus: Stimulus) -> None:
        most, totals = self.reach.total, stimulus.requests.totals
        for total in (totals.min(initial=0), totals.max(initial=0)):
            if not -most - 1 <= total <= most:
                bits = self._built.widths[self._pins.requested]
                where = f"{self._pins.where}: requested"
                raise ArgumentError(where, f"a total of {total} on {bits} bits", f"totals from {-most - 1} to {most}")

    def _runs(self, stimuli: Sequence[Stimulus]) -> list[Runs]:
        """Return the plays of each stream, up to the first that ends the process."""
        if self._simulation is None or self._simulation.poll() is not None:
            with self._said.open("wb") as said:
                self._simulation = begin_group(
                    [str(self._built.program)], folder=self._file.resolve().parent, stdin=subprocess.PIPE,
                    stdout=subprocess.PIPE, stderr=said,
                )  # fmt: skip
        changes = [stream_rows(stimulus) for stimulus in stimuli]
        numbers = np.concatenate(
            [
                np.append([stimulus.until_ps, stimulus.edges.initial, len(rows)], rows)
                for stimulus, rows in zip(stimuli, changes, strict=True)
            ]
        )
        # a sane design writes less about such streams, with room to spare
        most_bytes = 100_000_000 + 10_000 * sum(map(len, changes))
        answer = _answer_of(self._simulation, np.append(numbers.size, numbers).tobytes(), most_bytes)
        rows = np.frombuffer(answer[: len(answer) // _ROW * _ROW], np.int64).reshape(-1, 6)
        *plays, rest = np.split(rows, np.flatnonzero((rows[:, 0] == 3) | (rows[:, 0] == 4)) + 1)
        runs = [Runs(plays[k : k + _PLAYS]) for k in range(0, len(plays) - _PLAYS + 1, _PLAYS)]
        return runs if len(runs) == len(stimuli) else [*runs, Runs([rest], self._why_it_ended(self._simulation))]

    def _why_it_ended(self, simulation: subprocess.Popen[bytes]) -> str:
        """Return what the simulation says, or nothing where it was told to end."""
        with suppress(subprocess.TimeoutExpired):
            simulation.wait(_GRACE_S)
        end_group(simulation)
        if simulation.returncode in (_TOLD_TO_END, -signal.SIGKILL):
            return ""
        errors = re.findall(r"^%Error: ?(.*)$", self._said.read_text("utf-8", "replace"), re.MULTILINE)
        if any("converge" in error for error in errors):
            return "its combinational logic does not settle"
        return errors[-1] if errors else f"the simulation ended with code {simulation.returncode}"

    @property
    def _said(self) -> Path:
        return Path(self._folder.name) / "said"


def _answer_of(simulation: subprocess.Popen[bytes], question: bytes, most_bytes: int) -> bytes:
    """Return the answer to a question, or as much of it as came before the simulation ended."""
    into, out = simulation.stdin, simulation.stdout
    assert into is not None and out is not None  # noqa: S101 - it was begun with pipes
    answer, endings = bytearray(), [signal.SIGKILL, signal.SIGTERM]
    with suppress(OSError):  # it has ended, which its answer will show
        into.write(question)
    while not _is_whole(answer):
        silent = not select.select([out], [], [], SILENT_S if len(endings) == 2 else _GRACE_S)[0]
        if silent or len(answer) > most_bytes:
            if not endings:
                break
            signal_group(simulation, endings.pop())
        elif part := os.read(out.fileno(), 1 << 20):
            answer += part
        else:
            break
    return bytes(answer)


def _is_whole(answer: bytes | bytearray) -> bool:
    return len(answer) % _ROW == 0 and answer[-_ROW : 8 - _ROW] == _ALL_PLAYED
