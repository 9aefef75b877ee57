"""A firmware held to the contract of a design, by experiment on the board.

What the contract is stands in docs/firmware.md: pins, words, messages. A check is a function that plays with a
:class:`Bench` and raises `Failed` where something does not hold; what led there is played once more to say which
instruction was executed then.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial

from firmware_model import Image
from rtec.board import Microcontroller
from rtec.campaign import firmware_check_answers as conversation
from rtec.campaign.firmware_check_bench import Bench, BenchState
from rtec.campaign.firmware_check_contract import Failed
from rtec.campaign.firmware_check_insertion import (
    Measured,
    Trial,
    TrialFailed,
    hertz,
    hold_to,
    motion_trials,
    rest_trials,
)
from rtec.campaign.firmware_check_limit import speed_limit
from rtec.campaign.firmware_check_pins import pins
from rtec.campaign.firmware_check_reset import AfterReset, resets
from rtec.campaign.firmware_check_results import Check, FirmwareVerdict, Seen, Trace
from rtec.errors import ArgumentError
from rtec.injector import Design

SLOWEST_HZ, FASTEST_HZ = 100.0, 2e6
_LISTED_CYCLES = 40
"""Executed instructions are kept for so many cycles before a failure."""

_LIMIT_PHASES = 5
"""At each speed of the search for the limit, at most."""


def default_frequencies(microcontroller: Microcontroller) -> tuple[float, ...]:
    """Return the speeds that are tried where none is given, hertz.

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

    Parameters
    ----------
    image
        The program.
    design
        Whose circuits stand around it and whose contract it is held to.
    microcontroller
        The processor.
    hold_latch
        As of `rtec.board.Board`.
    frequencies_hz
        Of the encoder in the trials in motion; () for `default_frequencies`.
    phases
        Phases between edge and program at each speed, direction and sign.

    Raises
    ------
    ArgumentError
        A speed or a number out of range.
    """

    image: Image
    design: Design
    microcontroller: Microcontroller
    hold_latch: bool = False
    frequencies_hz: tuple[float, ...] = ()
    phases: int = 24

    def __post_init__(self) -> None:
        """Check the ranges."""
        for frequency in self.frequencies_hz:
            if not SLOWEST_HZ <= frequency <= FASTEST_HZ:
                raise ArgumentError(
                    "frequency", f"{frequency:g} Hz", f"{SLOWEST_HZ:g} Hz to {FASTEST_HZ / 1e6:g} MHz"
                )
        if not 1 <= self.phases <= 10_000:
            raise ArgumentError("phases", self.phases, "1 to 10000")

    @property
    def speeds_hz(self) -> tuple[float, ...]:
        """Return the speeds that are tried."""
        return tuple(sorted(self.frequencies_hz)) or default_frequencies(self.microcontroller)


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
    >>> [(check.name, check.passed) for check in verdict.checks][:3]
    [('runs', True), ('answers', False), ('home', None)]
    """
    return _Campaign(plan, progress).verdict()


@dataclass(slots=True)
class _Campaign:
    plan: FirmwareCheckPlan
    progress: Callable[[float], None]
    checks: list[Check] = field(default_factory=list)
    measured: Measured = field(default_factory=Measured)
    after_reset: AfterReset = field(default_factory=AfterReset)
    seen: Seen = field(default_factory=Seen)
    failing_trace: Trace | None = None

    def verdict(self) -> FirmwareVerdict:
        plan = self.plan
        bench = Bench(plan.design, plan.microcontroller, plan.image, hold_latch=plan.hold_latch)
        power_up = bench.keep()
        home = self._start(bench, power_up)
        later = self._later(bench, power_up if home is None else home)
        for index, (name, check) in enumerate(later):
            if home is None:
                self.checks.append(Check(name=name, passed=None, detail="not tried: the box is not at home"))
            else:
                self._try(bench, name, check)
            self.progress((index + 1) / len(later))
        return FirmwareVerdict(
            image=plan.image.source,
            design=plan.design,
            processor=replace(plan.microcontroller, part="8052").name,  # the part has a place of its own
            part=plan.microcontroller.part,
            hold_latch=plan.hold_latch,
            frequencies_hz=plan.speeds_hz,
            checks=tuple(self.checks),
            seen=self._seen(bench),
            trace=self.failing_trace or self.measured.trace,
        )

    def _start(self, bench: Bench, power_up: BenchState) -> BenchState | None:
        """Make the checks up to the home position, each going on from the one before; return the state there."""
        done: list[Callable[[Bench], str]] = []
        for name, check in (
            ("runs", conversation.starts),
            ("answers", conversation.answers),
            ("home", conversation.takes_home),
        ):
            if self.checks and not self.checks[-1].passed:
                self.checks.append(Check(name=name, passed=None, detail="not tried: see above"))
                continue
            done.append(check)
            self._try(bench, name, partial(check, bench), replay=partial(_from, bench, power_up, tuple(done)))
        if not self.checks[-1].passed:
            return None
        return bench.keep()

    def _later(self, bench: Bench, home: BenchState) -> list[tuple[str, Callable[[], str]]]:
        speeds = self.plan.speeds_hz
        # the decoder counts by itself; the lines of Design B go through the program, which may break at more
        travel_hz = speeds[-1] * (1.0 if self.plan.design.in_path else 4.0)

        def bound(check: Callable[..., str], *more: object) -> Callable[[], str]:
            return partial(check, bench, home, *more)

        return [
            ("pins", bound(pins)),
            ("inserts at rest", partial(self._at_rest, bench, home)),
            ("inserts in motion", partial(self._in_motion, bench, home)),
            ("window", bound(conversation.window)),
            ("disbelief", bound(conversation.disbelief)),
            ("large correction", bound(conversation.large_correction)),
            ("switch", bound(conversation.switch)),
            ("probing", bound(conversation.probing, speeds[0])),
            ("position", bound(conversation.position, travel_hz)),
            ("words", bound(conversation.words, speeds[-1])),
            ("reset", partial(self._reset, bench, home)),
        ]

    def _try(
        self, bench: Bench, name: str, check: Callable[[], str], replay: Callable[[], object] | None = None
    ) -> None:
        """Make one check."""
        bench.takes = 0
        try:
            self.checks.append(Check(name=name, passed=True, detail=check()))
            return
        except TrialFailed as failed:
            why: Failed = failed
            replay = partial(failed.trial.play, bench, failed.home)
            if failed.outcome is not None and self.failing_trace is None:
                self.failing_trace = failed.outcome.trace
        except Failed as failed:
            why = failed
        moment, take = bench.moment(why.time_ps), bench.takes if replay is None else 1
        executed = bench.executed_until(replay or check, take=take, t_ps=why.time_ps, cycles=_LISTED_CYCLES)
        moment = replace(moment, pc=executed[-1].address if executed else None)
        self.checks.append(Check(name=name, passed=False, detail=why.detail, moment=moment, executed=executed))

    def _at_rest(self, bench: Bench, home: BenchState) -> str:
        tried = [hold_to(trial, bench, home, self.measured) for trial in rest_trials()]
        made = sum(outcome.inserted for outcome in tried)
        waits = "" if made == len(tried) else "; the others wait for A and B low"
        return f"{made} of {len(tried)} requests made, every count right{waits}"

    def _in_motion(self, bench: Bench, home: BenchState) -> str:
        trials: list[Trial] = []
        for frequency in self.plan.speeds_hz:
            trials += motion_trials(frequency, self.plan.phases)
        for trial in trials:
            hold_to(trial, bench, home, self.measured)
        limit = speed_limit(bench, home, from_hz=self.plan.speeds_hz[-1], phases=min(self.plan.phases, _LIMIT_PHASES))
        self.seen = replace(self.seen, good_up_to_hz=limit.good_hz, fails_from_hz=limit.bad_hz, failing=limit.failing)
        speeds = ", ".join(hertz(frequency) for frequency in self.plan.speeds_hz)
        return f"{len(trials)} insertions at {speeds}, every count right"

    def _reset(self, bench: Bench, home: BenchState) -> str:
        seen = self.after_reset
        resets(bench, home, seen)
        self.seen = replace(self.seen, reset_worst_counts_off=seen.worst_counts_off, reset_illegal=seen.illegal)
        illegal = (
            f", an illegal transition (first in cycle {seen.illegal_cycle})" if seen.illegal else ", none illegal"
        )
        off = f"the controller off by {seen.worst_counts_off:+d} counts at worst{illegal}"
        return f"{seen.tried} resets, all lines released; {off}"

    def _seen(self, bench: Bench) -> Seen:
        latency, separation = self.measured.latency_ps, self.measured.separation_ps
        answered = any(check.name == "answers" and check.passed for check in self.checks)
        return replace(
            self.seen,
            reading_us=bench.reading_ps / 1e6 if answered else None,
            worst_insertion_us=None if latency is None else latency / 1e6,
            worst_insertion_cycles=None if latency is None else latency * bench.cycle_den / bench.cycle_num,
            least_separation_us=None if separation is None else separation / 1e6,
        )


def _from(bench: Bench, power_up: BenchState, done: tuple[Callable[[Bench], str], ...]) -> None:
    """Go through the start-up again."""
    bench.go_back(power_up)
    for check in done:
        check(bench)
