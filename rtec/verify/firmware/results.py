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
from rtec.verify.bench import Executed
from rtec.verify.contract.results import Verdict

_MEASURED = (
    "reading_us", "worst_insertion_cycles", "worst_insertion_us", "reset_worst_counts_off", "reset_illegal",
)  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class Trace:
    """The lines and pins around an insertion."""

    title: str
    encoder: EdgeStream
    controller: EdgeStream
    """Edges on both sides of the box."""
    requested: Totals
    completed: Totals
    """Totals of steps; the second as the check has seen it in the words to the PC."""
    insertions_ps: tuple[tuple[int, int], ...]
    """First and last change of the drive pins in each insertion."""
    pin_times_ps: NDArray[np.int64]
    pin_levels: NDArray[np.int64]
    initial_pins: int
    """Changes of port 1: the time at the pin, the byte from then on, the byte before the first."""
    from_ps: int
    to_ps: int
    """The part that matters."""
    zero_ps: int
    """The encoder's edge before the first change of a drive pin, or the change itself at rest."""
    mark_ps: int | None
    """The moment that failed, or None."""
    cycle_ps: float
    """Length of a cycle."""

    def write(self, file: Path) -> None:
        """Write both sides of the box, totals, insertions and the pins of port 1, in time since power-up.

        Raises
        ------
        OutputError
            The file cannot be written; one that exists is overwritten.
        """
        levels = np.concatenate([[self.initial_pins], self.pin_levels])
        beside = []
        for bit in range(8):
            at = np.flatnonzero(np.diff(levels >> bit & 1)) + 1
            signal = VcdSignal(scope="P1", name=f"P1_{bit}", initial=self.initial_pins >> bit & 1)
            beside.append((signal, self.pin_times_ps[at - 1], levels[at] >> bit & 1))
        mark_ps = np.array([] if self.mark_ps is None else [self.mark_ps], np.int64)
        beside.append((VcdSignal(scope="check", name="failed"), mark_ps, np.ones(mark_ps.size, np.int64)))
        sides = self.encoder, self.controller
        rows = rows_of_streams(*sides, self.requested, self.completed, inserted=self.insertions_ps)
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
    time_ps: int | None = None
    cycle: int | None = None
    """``time_ps``, ``cycle``: when it failed, since power-up."""
    executed: tuple[Executed, ...] = ()
    """The instructions up to there."""
    stream: str | None = None
    """The edges and requests that fail, where they are a run, as `rtec.verify.contract.streams.Stream` reads it."""

    @property
    def pc(self) -> int | None:
        """Return the address of the instruction that failed, or None where no instruction did it."""
        return self.executed[-1].address if self.executed else None

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain data."""
        return {
            "name": self.name,
            "passed": self.passed,
            "detail": self.detail,
            "cycle": self.cycle,
            "time_us": None if self.time_ps is None else self.time_ps / 1e6,
            "pc": self.pc,
            "stream": self.stream,
            "instructions": [
                {"cycle": at.cycle, "address": at.address, "text": at.text, "P1": at.port_1} for at in self.executed
            ],
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class FirmwareVerdict:
    """All points of the contract, and what was measured; None where it did not come to that."""

    image: str
    design: Design
    processor: str
    part: str
    hold_latch: bool
    frequencies_hz: tuple[float, ...]
    checks: tuple[Check, ...]
    suite: Verdict | None
    """As an insertion algorithm."""
    trace: Trace | None
    """The shortest run that fails, or else the slowest insertion."""
    reading_us: float | None
    """Between two readings of the PC's words, at rest."""
    worst_insertion_cycles: float | None
    worst_insertion_us: float | None
    """From the encoder's transition to the last change, over all steps made during motion."""
    reset_worst_counts_off: int | None
    reset_illegal: bool | None
    """What a reset does at worst."""

    @property
    def passed(self) -> bool:
        """Return whether every point was tried and holds."""
        return all(check.passed is True for check in self.checks)

    def to_dict(self) -> dict[str, Any]:
        """Return the verdict as plain data under the names that scripts rely on."""
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
            **{name: getattr(self, name) for name in _MEASURED},
        }
