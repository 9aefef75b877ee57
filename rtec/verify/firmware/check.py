"""A firmware held to the contract of a design, by experiment on the board.

What the contract is stands in docs/firmware.md: pins, words, messages, and what every insertion algorithm owes,
which `rtec.verify.contract` tries. A check is a function that plays with a :class:`Bench` and raises `Failed` where
something does not hold; the bench then says which instructions were executed last.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field, replace

import numpy as np

from firmware_model import Image
from rtec.board import Microcontroller
from rtec.board.board import Snapshot
from rtec.checks import number_within, whole_within
from rtec.injector import Design
from rtec.readable import hertz_text
from rtec.verify.bench import Bench, Failed
from rtec.verify.contract import cases
from rtec.verify.contract.contract import Contract
from rtec.verify.contract.results import Verdict
from rtec.verify.contract.suite import TRIES, check_algorithm
from rtec.verify.contract.trials import Run, Trials
from rtec.verify.firmware import handshake
from rtec.verify.firmware.algorithm import Firmware
from rtec.verify.firmware.handshake import START
from rtec.verify.firmware.pins import AfterReset, pins, resets
from rtec.verify.firmware.results import Check, FirmwareVerdict, Trace
from rtec.verify.firmware.trace import insertions, trace_of

SLOWEST_HZ, FASTEST_HZ = 100.0, 2e6
_LEAST_SETTLE_READINGS = 8
"""In which insertions are looked for where the suite has found none."""

_OF_SUITE = 0.8
"""Of the time, which the progress shows."""


def default_frequencies(microcontroller: Microcontroller) -> tuple[float, ...]:
    """Return the speeds at which insertions are asked for where none is given, hertz.

    The lower one is four edges to a reading of the shipped images: below it an image may take the axis for neither
    moving nor resting. The higher one every shipped image manages; Design B on the 12-clock part passes about 7 kHz.

    Examples
    --------
    >>> default_frequencies(Microcontroller.named("8051-24mhz"))
    (2000.0, 10000.0)
    """
    if microcontroller.timing == "one-clock":
        return 2_500.0, 50_000.0
    share = microcontroller.clock_hz / 12e6
    return 1_000.0 * share, 5_000.0 * share


@dataclass(frozen=True, slots=True, kw_only=True)
class FirmwareCheckPlan:
    """What is tried.

    Raises
    ------
    ArgumentError
        A speed or a number out of range.
    """

    image: Image
    """The program."""
    design: Design
    """Whose circuits stand around it and whose contract it is held to."""
    microcontroller: Microcontroller
    """The processor."""
    hold_latch: bool = True
    """As of `rtec.board.Board`."""
    frequencies_hz: tuple[float, ...] = ()
    """Of the encoder, where a step has to be inserted during the motion; () for `default_frequencies`."""
    phases: int = 24
    """Phases between edge and program at each of these speeds, direction and sign."""
    tries: int = TRIES
    seed: int = 0
    """Of the hunt for the worst case."""

    def __post_init__(self) -> None:
        for frequency in self.frequencies_hz:
            number_within("frequency_hz", frequency, SLOWEST_HZ, FASTEST_HZ, unit="Hz")
        whole_within("phases", self.phases, 1, 10_000)
        whole_within("tries", self.tries, 0, 10_000_000)
        whole_within("seed", self.seed, 0, 2**32 - 1)

    @property
    def speeds_hz(self) -> tuple[float, ...]:
        """Return the speeds at which insertions are asked for."""
        return tuple(sorted(self.frequencies_hz)) or default_frequencies(self.microcontroller)

    def contract(self, delay_ps: int) -> Contract:
        """Return what the program owes as an insertion algorithm.

        Every count has to be right up to 500 kHz, as of any algorithm: the lines go round the processor, through
        gates, and its speed gate keeps it from inserting too fast. Those of Design B go through the processor; there
        the fastest speed is that at which it has to insert. ``delay_ps``: how late it may say what it has inserted.
        """
        contract = Contract.of(self.design)
        fastest_hz = self.speeds_hz[-1] if self.design.in_path else max(contract.frequency_hz, self.speeds_hz[-1])
        return replace(contract, frequency_hz=fastest_hz, delay_ps=max(contract.delay_ps, delay_ps))


def check_firmware(
    plan: FirmwareCheckPlan, progress: Callable[[float], None] = lambda share: None
) -> FirmwareVerdict:
    """Hold a program to the contract of a design.

    Parameters
    ----------
    plan
        What is tried.
    progress
        Called with the share done.

    Returns
    -------
    FirmwareVerdict
        Every point, passed or failed with cycle and address, and what was measured.

    Examples
    --------
    A program that only waits never publishes its words:

    >>> from firmware_model import Image
    >>> wait = Image.of(bytes([0x80, 0xFE]))  # SJMP $
    >>> cpu = Microcontroller.named("8051-12mhz")
    >>> verdict = check_firmware(FirmwareCheckPlan(image=wait, design=Design.C, microcontroller=cpu))
    >>> [(check.name, check.passed) for check in verdict.checks]
    [('starts', True), ('answers', False), ('home', None), ('all else', None)]
    """
    bench = Bench(plan.design, plan.microcontroller, plan.image, hold_latch=plan.hold_latch)
    return _Campaign(plan, progress, bench).verdict()


@dataclass(slots=True)
class _Campaign:
    plan: FirmwareCheckPlan
    progress: Callable[[float], None]
    bench: Bench
    checks: list[Check] = field(default_factory=list)
    after_reset: AfterReset | None = None
    suite: Verdict | None = None
    slowest: tuple[int, Run] | None = None
    """Latency in ps of the slowest insertion that was right, and its run."""

    def verdict(self) -> FirmwareVerdict:
        plan, bench, trace = self.plan, self.bench, None
        for name, check in START.items():
            if self.checks and not self.checks[-1].passed:
                self.checks.append(Check(name=name, passed=None, detail="not tried: see above"))
            else:
                self._try(name, check, bench)
        if self.checks[-1].passed:
            home = bench.keep()
            firmware = Firmware(bench, homed=True)
            self._insertions(firmware)
            self._of_the_box(home)
            trace = self._trace(firmware)
        else:
            self.checks.append(Check(name="all else", passed=None, detail="not tried: the box is not at home"))
        answered = any(check.name == "answers" and check.passed for check in self.checks)
        latency_ps, reset = None if self.slowest is None else self.slowest[0], self.after_reset
        cycle_num, cycle_den = plan.microcontroller.cycle_ps
        return FirmwareVerdict(
            image=plan.image.source,
            design=plan.design,
            processor=replace(plan.microcontroller, part="8052").name,  # the part has a place of its own
            part=plan.microcontroller.part,
            hold_latch=plan.hold_latch,
            frequencies_hz=plan.speeds_hz,
            checks=tuple(self.checks),
            suite=self.suite,
            trace=trace,
            reading_us=bench.reading_ps / 1e6 if answered else None,
            worst_insertion_us=None if latency_ps is None else latency_ps / 1e6,
            worst_insertion_cycles=None if latency_ps is None else latency_ps * cycle_den / cycle_num,
            reset_worst_counts_off=None if reset is None else reset.worst_counts_off,
            reset_illegal=None if reset is None else reset.illegal_cycle is not None,
        )

    def _of_the_box(self, home: Snapshot) -> None:
        speeds = self.plan.speeds_hz
        # the decoder counts by itself; the lines of Design B go through the program, which may break at more
        travel_hz = speeds[-1] * (1.0 if self.plan.design.in_path else 4.0)
        for check, *more in (
            (handshake.window,), (handshake.disbelief,), (handshake.large_correction,), (handshake.switch,),
            (handshake.probing, speeds[0]), (handshake.position, travel_hz), (handshake.words, speeds[-1]),
            (self._reset,),
        ):  # fmt: skip
            self._try(check.__name__.strip("_").replace("_", " "), check, self.bench, home, *more)

    def _try(self, name: str, check: Callable[..., str], *what: object) -> None:
        try:
            self.checks.append(Check(name=name, passed=True, detail=check(*what)))
        except Failed as failed:
            self._fail(name, failed.detail, failed.time_ps)

    def _fail(self, name: str, detail: str, t_ps: int, stream: str | None = None) -> None:
        """Book a check that does not hold, with the instructions up to the moment."""
        cycle = self.bench.cycle_at(t_ps)
        executed = self.bench.executed_before(t_ps)
        self.checks.append(
            Check(name=name, passed=False, detail=detail, time_ps=t_ps, cycle=cycle, executed=executed, stream=stream)
        )

    def _reset(self, bench: Bench, home: Snapshot) -> str:
        self.after_reset = resets(bench, home)
        return str(self.after_reset)

    def _insertions(self, firmware: Firmware) -> None:
        """Hold the program to the suite of all algorithms, then to the pins and speeds that are its own."""
        plan = self.plan
        contract = plan.contract(firmware.delay_ps)
        suite = self.suite = check_algorithm(
            firmware, contract, tries=plan.tries, seed=plan.seed,
            progress=lambda share: self.progress(_OF_SUITE * share),
        )  # fmt: skip
        trials = Trials(firmware, contract)
        trials.settle_ps = max(suite.settle_ps, _LEAST_SETTLE_READINGS * self.bench.reading_ps)
        self._try("pins", pins, firmware, cases.at_rest(trials))
        for check in suite.checks:
            if check.run is None:
                self.checks.append(Check(name=check.name, passed=check.passed, detail=check.reason))
            else:
                self._fail_run(firmware, check.name, check.reason, check.run)
        self._at_speed(firmware, trials)
        self.progress(_OF_SUITE + 0.1)

    def _at_speed(self, firmware: Firmware, trials: Trials) -> None:
        """Ask for a step during motion at the speeds at which it has to come, and measure how long it takes."""
        plan, name, made = self.plan, "inserts at speed", 0
        for plain in cases.in_motion(trials, plan.speeds_hz, plan.phases):
            # a quarter that is a whole number of cycles would meet the program in one phase alone
            later_ps = round(made * cases.GOLDEN % 1.0 * np.diff(plain.stream.edges_ps[:2])[0])
            case = replace(plain, stream=plain.stream.later(later_ps))
            run = trials.one(case)
            done, edges = run.response.completed.times_ps, case.stream.edges_ps
            if not run.right:
                self._fail_run(firmware, name, str(run), run)
                return
            if not done.size or done[-1] > edges[-1]:
                self._fail_run(firmware, name, f"{case.title}: nothing inserted while the axis moves", run)
                return
            firmware.replay(case.stream.stimulus())
            made_ps = [found.last_ps - found.edge_ps for found in insertions(self.bench) if found.edge_ps is not None]
            latency_ps = max(made_ps, default=0)
            if self.slowest is None or latency_ps > self.slowest[0]:
                self.slowest = latency_ps, run
            made += 1
        speeds = " and ".join(hertz_text(speed) for speed in plan.speeds_hz)
        detail = f"{made} steps at {speeds} made while the axis moves"
        self.checks.append(Check(name=name, passed=True, detail=detail))

    def _fail_run(self, firmware: Firmware, name: str, reason: str, run: Run) -> None:
        stimulus, violation = run.case.stream.stimulus(), run.judgement.violation
        t_ps = run.case.stream.last_ps if violation is None else violation.time_ps
        with suppress(Failed):
            firmware.replay(stimulus, to_ps=t_ps)
        self._fail(name, reason, self.bench.begun_ps + t_ps, str(run.case.stream))

    def _trace(self, firmware: Firmware) -> Trace | None:
        """Return the shortest run that fails as the bench records it, or else the slowest insertion."""
        worst = None if self.suite is None else self.suite.worst
        run = worst if worst is not None and not worst.right else None if self.slowest is None else self.slowest[1]
        if run is None:
            return None
        try:
            firmware.replay(run.case.stream.stimulus())
        except Failed:
            return None
        return trace_of(self.bench, run)
