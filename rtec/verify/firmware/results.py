"""What a check of a firmware gives back."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rtec.injector import Design, Totals
from rtec.injector.waves import rows_of_streams, write_waves
from rtec.signal import EdgeStream, VcdSignal
from rtec.verify.contract.results import Verdict

_PINS = ("P1_0", "P1_1", "P1_2", "P1_3", "P1_4", "P1_5", "P1_6", "P1_7")


@dataclass(frozen=True, slots=True, kw_only=True)
class Moment:
    """When something happened, and where the program was."""

    time_ps: int
    """Since power-up."""
    cycle: int
    """Of the processor, since power-up."""
    pc: int | None = None
    """Address of the instruction, or None where no instruction did it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Executed:
    """An instruction as it was executed near a moment: its first cycle, address and text, and port 1 after it."""

    cycle: int
    address: int
    text: str
    port_1: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Trace:
    """The lines and pins around an insertion."""

    title: str
    """What is seen."""
    encoder: EdgeStream
    controller: EdgeStream
    """``encoder``, ``controller``: edges on both sides of the box."""
    requested: Totals
    completed: Totals
    """``requested``, ``completed``: totals of steps; the second as the check has seen it in the words to the PC."""
    insertions_ps: tuple[tuple[int, int], ...]
    """First and last change of the drive pins in each insertion."""
    pin_times_ps: NDArray[np.int64]
    pin_levels: NDArray[np.int64]
    """``pin_times_ps``, ``pin_levels``: changes of port 1: the time at the pin, the byte from then on."""
    initial_pins: int
    """Port 1 before the first change."""
    from_ps: int
    to_ps: int
    """``from_ps``, ``to_ps``: the part that matters."""
    zero_ps: int
    """The encoder's edge before the first change of a drive pin, or the change itself at rest."""
    mark_ps: int | None
    """The moment that failed, or None."""
    cycle_ps: float
    """Length of a cycle."""

    def write(self, file: Path) -> None:
        """Write both sides of the box, totals, insertions and the pins of port 1, in time since power-up.

        Parameters
        ----------
        file
            The file; one that exists is overwritten.

        Raises
        ------
        OutputError
            It cannot be written.
        """
        levels = np.concatenate([[self.initial_pins], self.pin_levels])
        beside = []
        for bit, name in enumerate(_PINS):
            at = np.flatnonzero(np.diff(levels >> bit & 1)) + 1
            signal = VcdSignal(scope="P1", name=name, initial=self.initial_pins >> bit & 1)
            beside.append((signal, self.pin_times_ps[at - 1], levels[at] >> bit & 1))
        mark_ps = np.array([] if self.mark_ps is None else [self.mark_ps], np.int64)
        beside.append((VcdSignal(scope="check", name="failed"), mark_ps, np.ones(mark_ps.size, np.int64)))
        rows = rows_of_streams(
            self.encoder, self.controller, self.requested, self.completed, inserted=self.insertions_ps
        )
        initial = self.encoder.initial, self.controller.initial
        write_waves(file, rows, initial=initial, end_ps=self.to_ps, beside=beside)


@dataclass(frozen=True, slots=True, kw_only=True)
class Check:
    """One point of the contract."""

    name: str
    """The point, in one or two words."""
    passed: bool | None
    """None where it could not be tried, as the box does not answer."""
    detail: str
    """What was seen."""
    moment: Moment | None = None
    """Where it failed."""
    executed: tuple[Executed, ...] = ()
    """The instructions up to there."""
    stream: str | None = None
    """The edges and requests that fail, where they are a run, as `rtec.verify.contract.streams.Stream` reads it."""

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain data."""
        moment = self.moment
        return {
            "name": self.name,
            "passed": self.passed,
            "detail": self.detail,
            "cycle": None if moment is None else moment.cycle,
            "time_us": None if moment is None else moment.time_ps / 1e6,
            "pc": None if moment is None else moment.pc,
            "stream": self.stream,
            "instructions": [
                {"cycle": row.cycle, "address": row.address, "text": row.text, "P1": row.port_1}
                for row in self.executed
            ],
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class Seen:
    """What was measured on the way; None where it did not come to that."""

    reading_us: float | None = None
    """Between two readings of the PC's words, at rest."""
    worst_insertion_cycles: float | None = None
    """From the encoder's transition to the last change, over all steps made during motion."""
    worst_insertion_us: float | None = None
    reset_worst_counts_off: int | None = None
    reset_illegal: bool | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class FirmwareVerdict:
    """All points of the contract, and what was measured."""

    image: str
    design: Design
    processor: str
    part: str
    hold_latch: bool
    frequencies_hz: tuple[float, ...]
    checks: tuple[Check, ...]
    seen: Seen
    suite: Verdict | None
    """As an insertion algorithm; None where it came to none."""
    trace: Trace | None
    """The shortest run that fails, or else the slowest insertion."""

    @property
    def passed(self) -> bool:
        """Return whether every point was tried and holds."""
        return all(check.passed is True for check in self.checks)

    def to_dict(self) -> dict[str, Any]:
        """Return the verdict as plain data under the names that scripts rely on."""
        seen = self.seen
        suite = {} if self.suite is None else self.suite.to_dict()
        return suite | {
            "image": self.image,
            "design": self.design.value,
            "processor": self.processor,
            "part": self.part,
            "hold_latch": self.hold_latch,
            "frequencies_hz": list(self.frequencies_hz),
            "passed": self.passed,
            "checks": [check.to_dict() for check in self.checks],
            **{name: getattr(seen, name) for name in Seen.__dataclass_fields__},
        }
