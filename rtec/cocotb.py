"""The checks of an insertion algorithm in a cocotb test: a driver, a monitor, and the suite on a running simulation.

Needs cocotb 2 (``pip install "rtec[cocotb]"``) and a simulator that it works with, such as Icarus Verilog. The clock
is the test's own. One simulation plays many streams, and each begins at power-up: the module is reset before each of
them, and one without a reset needs a ``power_up`` of the user's.
"""

from __future__ import annotations

import enum
from collections.abc import Awaitable, Callable, Iterable, Sequence
from itertools import islice
from typing import Any

import numpy as np

from rtec.errors import ArgumentError, RtecError, nearest
from rtec.injector import Response, Stimulus
from rtec.verify.contract import cases
from rtec.verify.contract._verilog_runs import SETTLE_TICKS, Runs, response_of, stream_rows
from rtec.verify.contract.contract import Contract
from rtec.verify.contract.suite import check_algorithm
from rtec.verify.contract.trials import Case, Run, Trials
from rtec.verify.contract.verilog_pins import Active, Pins

try:
    import cocotb
    from cocotb.task import bridge, resume
    from cocotb.triggers import First, ReadOnly, RisingEdge, Timer, ValueChange
    from cocotb.utils import get_sim_steps, get_sim_time

    _MISSING = ""
except ImportError as _error:  # this module can be read without cocotb, not used
    _MISSING = f'rtec.cocotb needs cocotb 2 or newer ({_error}): pip install "rtec[cocotb]"'

PowerUp = Callable[[Any], Awaitable[None]]
"""What brings the module back to where it is at power-up, given the handle of the module."""

_FIRST_REVERSALS, _EVERY_REVERSAL = 96, 7
"""Edges into an insertion at rest, of each state and sign; every seventh takes moments and kinds in turn."""
_SHARP, _EVERY_TURN = (0.0005, 0.02), 17
"""Turns of the axis so many counts behind an edge, with an insertion at every 17th of their moments."""


class Extent(enum.Enum):
    """How much of the suite is tried."""

    SHORT = "short"
    """Insertions at rest, in motion, with edges and turns in them: about 280 runs. A pass is partial."""
    WHOLE = "whole"
    """All that ``rtec check`` does, with as many ticks of the clock: hours in cocotb."""


async def hold(
    dut: Any,
    pins: Pins,
    contract: Contract,
    *,
    extent: Extent = Extent.SHORT,
    more: Iterable[Case] = (),
    power_up: PowerUp | None = None,
) -> int:
    """Hold a module in a running simulation to the contract of a corrector.

    Parameters
    ----------
    dut
        Handle of the module; its clock runs.
    pins
        Which of its ports is what.
    contract
        What is asked of it.
    extent
        How much of the suite is tried.
    more
        Cases of the caller's own, tried behind it.
    power_up
        What comes before each run instead of the reset of the pins.

    Returns
    -------
    int
        How many runs were made.

    Raises
    ------
    AssertionError
        A run in which something does not hold: what, when, and the stream that shows it.
    RtecError
        As for `Bench`.

    Examples
    --------
    ::

        @cocotb.test()
        async def inserts_as_design_c(dut):
            Clock(dut.clk, 20, "ns").start()
            await hold(dut, Pins.read(Path("design_c.toml")), Contract.of(Design.C))
    """
    bench = Bench(dut, pins, power_up=power_up)
    made: int = await bridge(_whole if extent is Extent.WHOLE else _short)(bench, contract, list(more))
    if extent is Extent.SHORT:
        cocotb.log.warning(
            "%s: %d runs hold; a pass is partial: rtec check makes some ten thousand", bench.name, made
        )
    return made


class Driver:
    """Drives A, B and the requested total as a stimulus says.

    Parameters
    ----------
    dut
        Handle of the module.
    pins
        Which of its ports is what.
    """

    def __init__(self, dut: Any, pins: Pins) -> None:
        _check_cocotb()
        ports = [_port(dut, pins, key) for key in ("a_in", "b_in", "requested")]
        self._a, self._b, self._requested = ports
        self._mask = 2 ** len(self._requested) - 1

    def begin(self, stimulus: Stimulus) -> None:
        """Set the levels of power-up, and nothing requested."""
        self._set_levels(stimulus.edges.initial)
        self._requested.value = 0

    async def drive(self, stimulus: Stimulus) -> None:
        """Make all changes; now is time 0."""
        begin_ps = _now_ps()
        for t_ps, kind, value in stream_rows(stimulus).tolist():
            if begin_ps + t_ps > _now_ps():
                await Timer(begin_ps + t_ps - _now_ps(), "ps")
            if kind == 1:
                self._set_levels(value)
            else:
                self._requested.value = value & self._mask

    def _set_levels(self, levels: int) -> None:
        self._a.value, self._b.value = levels & 1, levels >> 1 & 1


class Monitor:
    """Records A, B, the completed total and refusals at the outputs.

    Parameters
    ----------
    dut
        Handle of the module.
    pins
        Which of its ports is what.
    """

    def __init__(self, dut: Any, pins: Pins) -> None:
        _check_cocotb()
        self._pins = pins
        keys = ("a_out", "b_out", "completed", "refused")
        self._ports = [_port(dut, pins, key) for key in keys if getattr(pins, key) is not None]

    async def record(self, stimulus: Stimulus) -> Response:
        """Record until the end of a run; now is time 0."""
        begin_ps = _now_ps()
        await ReadOnly()
        rows = [self._row(0, 0)]
        end = Timer(stimulus.until_ps, "ps")
        while True:
            seen = await First(end, *(ValueChange(port) for port in self._ports))
            if seen is end:
                break
            await ReadOnly()
            if _now_ps() - begin_ps >= stimulus.until_ps:
                break
            rows.append(self._row(1, _now_ps() - begin_ps))
        rows.append((3, stimulus.until_ps, 0, 0, 0, 0))
        return response_of(stimulus, Runs([np.array(rows, np.int64)]), self._pins)

    def _row(self, kind: int, t_ps: int) -> tuple[int, ...]:
        values = [port.value for port in self._ports]
        known = [value.is_resolvable for value in values]
        a, b, *others = (int(value) if good else 0 for value, good in zip(values, known, strict=True))
        completed, refused = others[0], others[1] if len(others) > 1 else 0
        bits = len(self._ports[2])
        completed -= (completed >> bits - 1) << bits  # signed
        unknown = sum((not good) << bit for bit, good in enumerate(known))
        return kind, t_ps, a + 2 * b, completed, refused, unknown


class Bench:
    """A module in a running simulation as an `rtec.injector.Algorithm`, each run after a reset.

    Parameters
    ----------
    dut
        Handle of the module.
    pins
        Which of its ports is what.
    power_up
        What comes before each run instead of the reset of the pins.

    Raises
    ------
    RtecError
        No cocotb, a precision coarser than 1 ps, no reset and no ``power_up``, a port that is not there.
    """

    def __init__(self, dut: Any, pins: Pins, *, power_up: PowerUp | None = None) -> None:
        self._driver, self._monitor = Driver(dut, pins), Monitor(dut, pins)
        self._dut, self._pins, self._clock = dut, pins, _port(dut, pins, "clock")
        self._reset = None if pins.reset is None else _port(dut, pins, "reset")
        self._power_up = power_up or self._pulse_reset
        if power_up is None and self._reset is None:
            hint = "name the module's reset in the pins, or give power_up=, which brings it back to power-up"
            raise ArgumentError(f"{pins.where}: reset", None, "a port that resets the module", hint)
        try:
            get_sim_steps(1, "ps")
        except ValueError:
            allowed = "1 ps; compile with timescale=('1ps', '1ps')"
            raise ArgumentError("precision of the simulation", "coarser", allowed) from None

    @property
    def name(self) -> str:
        """Return the module's name."""
        return self._pins.top

    async def run(self, stimulus: Stimulus) -> Response:
        """Reset the module, play a stimulus and return what comes out; a tick of the clock is at time 0."""
        self._driver.begin(stimulus)
        await self._power_up(self._dut)
        for _ in range(SETTLE_TICKS):
            await RisingEdge(self._clock)
        driving = cocotb.start_soon(self._driver.drive(stimulus))
        response = await self._monitor.record(stimulus)
        driving.cancel()
        return response

    def play(self, stimuli: Sequence[Stimulus]) -> list[Response]:
        """Return what comes out for each stimulus; from a thread that `cocotb.task.bridge` has begun."""
        return [resume(self.run)(stimulus) for stimulus in stimuli]

    def close(self) -> None:
        """Do nothing: the simulation is the test's own."""

    async def _pulse_reset(self, _dut: Any) -> None:
        resets = self._pins.reset_active is Active.HIGH
        assert self._reset is not None  # noqa: S101 - __init__ has checked it
        self._reset.value = int(resets)
        for _ in range(self._pins.reset_ticks):
            await RisingEdge(self._clock)
        self._reset.value = int(not resets)


def _short(bench: Bench, contract: Contract, more: Sequence[Case]) -> int:
    """Make the runs of the short suite; in a thread of its own."""
    trials = Trials(bench, contract)
    _refuse("inserts at rest", trials.measure_settling())
    reversals = _FIRST_REVERSALS * 2 * len(contract.states)
    top_hz = contract.frequency_hz
    for name, tried in (
        ("inserts at rest", cases.at_rest(trials)),
        ("inserts in motion", cases.in_motion(trials, [top_hz, top_hz / 5.0], phases=2)),
        ("reversals", islice(cases.reversing(trials), 0, reversals, _EVERY_REVERSAL)),
        ("turns", islice(cases.turning(trials, contract, _SHARP), 0, None, _EVERY_TURN)),
        ("cases of its own", iter(more)),
    ):
        _refuse(name, trials.first_wrong(tried, at_once=1)[0])
    return trials.made


def _whole(bench: Bench, contract: Contract, more: Sequence[Case]) -> int:
    """Make the runs of the whole suite; in a thread of its own."""
    verdict = check_algorithm(bench, contract, more=(lambda _: more) if more else None)
    for check in verdict.checks:
        _refuse(check.name, check.run)
        if check.passed is not True:
            raise AssertionError(f"{check.name}: {check.reason}")
    return verdict.runs


def _refuse(name: str, wrong: Run | None) -> None:
    if wrong is not None:
        raise AssertionError(f"{name}: {wrong}; the stream: {wrong.case.stream}")


def _port(dut: Any, pins: Pins, key: str) -> Any:
    name = getattr(pins, key)
    try:
        return getattr(dut, name)
    except AttributeError:
        known = [handle._name for handle in dut]  # noqa: SLF001 - cocotb has no other word for it
        hint = nearest(name, known)
        raise ArgumentError(f"{pins.where}: {key}", repr(name), f"a port of {pins.top}", hint) from None


def _now_ps() -> int:
    return int(get_sim_time("ps"))


def _check_cocotb() -> None:
    if _MISSING:
        raise RtecError(_MISSING)
