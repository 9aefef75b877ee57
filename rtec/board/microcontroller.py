"""The processors that the box can be built with: a timing model and a clock."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, replace
from importlib.resources import files
from pathlib import Path
from types import MappingProxyType
from typing import Literal

from firmware_model import TIMINGS
from rtec.checks import whole_within
from rtec.errors import ArgumentError, unknown
from rtec.injector import DesignRow
from rtec.units import PS_PER_S

_MOST_RATIO = 1 << 62


@dataclass(frozen=True, slots=True, kw_only=True)
class Microcontroller:
    """A member of the MCS-51 family at its clock.

    Parameters
    ----------
    timing
        ``"12-clock"``, the original, or ``"one-clock"``, the CIP-51 core.
    clock_hz
        Of its oscillator, whole hertz.
    part
        ``"8051"`` or ``"8052"``.
    program
        Intel HEX that it runs whatever the design; None: the committed image of the design.

    Raises
    ------
    ArgumentError
        A timing or part that is not known, or a clock out of range.

    Examples
    --------
    >>> Microcontroller.named("8051-12mhz").cycle_ps
    (1000000, 1)
    >>> Microcontroller.named("one-clock 33 MHz").cycle_ps
    (1000000, 33)
    """

    timing: Literal["12-clock", "one-clock"]
    clock_hz: int
    part: Literal["8051", "8052"] = "8052"
    program: Path | None = None

    def __post_init__(self) -> None:
        if self.timing not in TIMINGS:
            raise unknown("timing", self.timing, TIMINGS, noun="timing")
        whole_within("clock_hz", self.clock_hz, 10_000, 1_000_000_000, unit="Hz")
        num, den = self.cycle_ps
        if num * den >= _MOST_RATIO:
            raise ArgumentError(
                "clock_hz",
                self.clock_hz,
                "a clock whose cycle is a ratio of smaller whole numbers of picoseconds",
                "round it to a multiple of 100 Hz",
            )

    @classmethod
    def named(cls, name: str) -> Microcontroller:
        """Return one of `MICROCONTROLLERS`, or what a timing and a clock say: ``"12-clock 16MHz"``.

        Raises
        ------
        ArgumentError
            Neither the one nor the other.
        """
        known = MICROCONTROLLERS.get(name.strip().lower())
        if known is not None:
            return known
        said = re.fullmatch(r"\s*(12-clock|one-clock)[\s@,-]+(\d+(?:\.\d+)?)\s*([kMG]?)Hz\s*", name, re.IGNORECASE)
        if said is None:
            raise ArgumentError(
                "processor",
                repr(name),
                f"{', '.join(MICROCONTROLLERS)}, or a timing and a clock as in '12-clock 16MHz'",
                problem="is not a processor",
            )
        timing: Literal["12-clock", "one-clock"] = "12-clock" if said[1].lower() == "12-clock" else "one-clock"
        return cls(
            timing=timing, clock_hz=round(float(said[2]) * {"": 1, "k": 1e3, "m": 1e6, "g": 1e9}[said[3].lower()])
        )

    @property
    def name(self) -> str:
        """Return the name that `named` takes; before it the program, where it runs one of its own."""
        if self.program is not None:
            return f"{self.program.name} on {replace(self, program=None).name}"
        for name, known in MICROCONTROLLERS.items():
            if known == self:
                return name
        return f"{self.timing} {self.clock_hz / 1e6:g}MHz"

    @property
    def cycle_ps(self) -> tuple[int, int]:
        """Return the length of a cycle, the unit in which the processor counts, as a ratio in picoseconds."""
        num = PS_PER_S * TIMINGS[self.timing].clocks_per_cycle
        shared = math.gcd(num, self.clock_hz)
        return num // shared, self.clock_hz // shared

    @property
    def sample_ps(self) -> int:
        """Return when in a cycle pins are sampled: S5P2, after 9 of 12 clocks; at its beginning with one clock."""
        return 9 * PS_PER_S // self.clock_hz if self.timing == "12-clock" else 0

    def image(self, design: DesignRow) -> Path:
        """Return its program, or the committed Intel HEX of a design: made for this clock or the next faster one.

        An image waits between two changes of the lines for the sake of the controller's filter; on a slower clock it
        waits longer, never too short.
        """
        if self.program is not None:
            return self.program
        folder = Path(str(files("firmware_model") / "images"))
        if self.timing == "one-clock":
            made_hz = min((hz for hz in _ONE_CLOCK if hz >= self.clock_hz), default=max(_ONE_CLOCK))
            folder /= _ONE_CLOCK[made_hz]
        return folder / f"{design.key}.ihx"


_ONE_CLOCK = {25_000_000: "one_clock_25mhz", 100_000_000: "one_clock_100mhz"}

MICROCONTROLLERS: MappingProxyType[str, Microcontroller] = MappingProxyType(
    {
        "8051-12mhz": Microcontroller(timing="12-clock", clock_hz=12_000_000),
        "8051-24mhz": Microcontroller(timing="12-clock", clock_hz=24_000_000),
        "one-clock-25mhz": Microcontroller(timing="one-clock", clock_hz=25_000_000),
        "one-clock-100mhz": Microcontroller(timing="one-clock", clock_hz=100_000_000),
    }
)
"""The processors that images are made for, and the 8051 at twice its clock."""
