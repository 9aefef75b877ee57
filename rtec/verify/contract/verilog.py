"""The Verilog interface: a module clocked by Verilator or Icarus Verilog, whichever is installed."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from pathlib import Path

from rtec.closing import Closing
from rtec.errors import ArgumentError, RtecError, unknown
from rtec.injector import Reach, Response, Stimulus
from rtec.io import read_bytes
from rtec.units import FREQUENCY, PS_PER_S, parse_exact, parse_quantity
from rtec.verify.contract._build_sandbox import BuildSandbox
from rtec.verify.contract._icarus import Icarus
from rtec.verify.contract._verilator import Verilator
from rtec.verify.contract._verilog_runs import response_of
from rtec.verify.contract.verilog_pins import Pins

SIMULATORS: dict[str, tuple[str, type[Verilator | Icarus]]] = {
    "verilator": ("verilator", Verilator),
    "icarus": ("iverilog", Icarus),
}
"""Program, which is its package on Debian, too, and what it is; the first one installed is taken."""
_BATCH = 100_000
"""Changes that one process plays: what comes out of it is held in memory."""


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
    module's other files are looked for beside it by their names. Delays (``#5``) are an error with Verilator.

    Outputs that are X or Z behind time 0 (Icarus Verilog), or that differ with what registers hold at power-up that
    nothing sets (Verilator: all 0, all 1, random), break the run, as do ``$finish``, logic that does not settle, and
    10 s without progress.

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
    simulator
        ``"verilator"`` (5 or newer), ``"icarus"``, or None: the first of them that is installed.

    Raises
    ------
    RtecError
        No simulator, a file that does not build (with the line of the first error), ports that are not there.

    Examples
    --------
    ::

        pins = Pins.read(Path("design_c.toml"))
        with VerilogAlgorithm(Path("design_c.v"), pins=pins, clock_ps=clock_of("50MHz")) as mine:
            response = mine.play([stimulus])[0]
        judge(stimulus, response, Contract.of(Design.C))
    """

    def __init__(self, file: Path, *, pins: Pins, clock_ps: tuple[int, int], simulator: str | None = None) -> None:
        read_bytes(file, "a Verilog file")
        self._file, self._pins = file, pins
        self.simulator, kind = _chosen(simulator)
        self._shop = BuildSandbox()
        try:
            self._simulator = kind(self._shop, file.resolve(), pins, clock_ps)
        except BaseException:
            self._shop.close()
            raise

    @property
    def name(self) -> str:
        """Return the file's name."""
        return self._file.name

    @property
    def note(self) -> str:
        """Return why every tick is simulated, or nothing where a design at rest needs none."""
        if self._simulator.may_rest:
            return ""
        return (
            "clocked at every tick, which takes longer: it reads the time, files or random numbers, delays something "
            "or keeps values that cannot be compared; --tries 300 shortens the hunt"
        )

    @property
    def reach(self) -> Reach:
        """Return what the port for requests holds."""
        return Reach(total=2 ** (self._simulator.widths[self._pins.requested] - 1) - 1)

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
        while len(responses) < len(stimuli):
            batch = _batch(stimuli[len(responses) :])
            runs = self._simulator.play(batch)
            responses += [response_of(*pair, self._pins) for pair in zip(batch, runs, strict=True)]
        return responses

    def close(self) -> None:
        """Remove what was built."""
        self._shop.close()

    def _check_totals(self, stimulus: Stimulus) -> None:
        bits = self._simulator.widths[self._pins.requested]
        top = 2 ** (bits - 1)
        for total in (stimulus.requests.totals.min(initial=0), stimulus.requests.totals.max(initial=0)):
            if not -top <= total < top:
                where = f"{self._pins.where}: requested"
                raise ArgumentError(where, f"a total of {total} on {bits} bits", f"totals from {-top} to {top - 1}")


def _chosen(simulator: str | None) -> tuple[str, type[Verilator | Icarus]]:
    if simulator is not None and simulator not in SIMULATORS:
        raise unknown("simulator", simulator, SIMULATORS, noun="simulator")
    for name, (program, kind) in SIMULATORS.items():
        if simulator in {None, name} and shutil.which(program) is not None:
            return name, kind
    package = "verilator (or iverilog)" if simulator is None else SIMULATORS[simulator][0]
    raise RtecError(f"no simulator for Verilog found on the path; on Debian and Ubuntu: apt install {package}")


def _batch(stimuli: Sequence[Stimulus]) -> Sequence[Stimulus]:
    """Return as many of the first ones as one process plays, at least one."""
    changes = 0
    for index, stimulus in enumerate(stimuli):
        changes += len(stimulus.edges) + len(stimulus.requests) + 100
        if changes > _BATCH and index:
            return stimuli[:index]
    return stimuli
