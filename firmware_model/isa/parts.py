"""The parts simulated: memory, special function registers and timing.

References
----------
Intel, "MCS 51 Microcontroller Family User's Manual" (272383-002, 1994), chapter 1 (special function registers,
memory) and chapter 3 ("Timer/Counters", "Interrupts").
"""

from __future__ import annotations

from dataclasses import dataclass
from types import MappingProxyType

_SFR_8051 = {
    0x80: "P0", 0x81: "SP", 0x82: "DPL", 0x83: "DPH", 0x87: "PCON",
    0x88: "TCON", 0x89: "TMOD", 0x8A: "TL0", 0x8B: "TL1", 0x8C: "TH0", 0x8D: "TH1",
    0x90: "P1", 0x98: "SCON", 0x99: "SBUF", 0xA0: "P2", 0xA8: "IE",
    0xB0: "P3", 0xB8: "IP", 0xD0: "PSW", 0xE0: "ACC", 0xF0: "B",
}  # fmt: skip
_SFR_TIMER2 = {0xC8: "T2CON", 0xCA: "RCAP2L", 0xCB: "RCAP2H", 0xCC: "TL2", 0xCD: "TH2"}

SFR_NAMES: MappingProxyType[int, str] = MappingProxyType(_SFR_8051 | _SFR_TIMER2)
"""Name of each special function register at its direct address, timer 2 included."""

BIT_NAMES: MappingProxyType[int, str] = MappingProxyType({
    **{0x88 + i: name for i, name in enumerate("IT0 IE0 IT1 IE1 TR0 TF0 TR1 TF1".split())},
    **{0x98 + i: name for i, name in enumerate("RI TI RB8 TB8 REN SM2 SM1 SM0".split())},
    **{0xA8 + i: name for i, name in enumerate("EX0 ET0 EX1 ET1 ES".split())},
    0xAF: "EA",
    **{0xB8 + i: name for i, name in enumerate("PX0 PT0 PX1 PT1 PS".split())},
    0xD0: "P", 0xD2: "OV", 0xD3: "RS0", 0xD4: "RS1", 0xD5: "F0", 0xD6: "AC", 0xD7: "CY",
})  # fmt: skip
"""Name of each bit that the manual names and the assembler knows, at its bit address."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Part:
    """A member of the family.

    Examples
    --------
    >>> PARTS["8051"].iram_bytes, 0xC8 in PARTS["8051"].sfr, 0xC8 in PARTS["8052"].sfr
    (128, False, True)
    """

    name: str
    """``"8051"`` or ``"8052"``."""
    iram_bytes: int
    """Internal RAM: 128 or 256 bytes."""
    has_timer2: bool
    """Whether it has the third timer, with its interrupt."""
    sfr: frozenset[int]
    """Direct addresses of its special function registers."""


PARTS: MappingProxyType[str, Part] = MappingProxyType(
    {
        "8051": Part(name="8051", iram_bytes=128, has_timer2=False, sfr=frozenset(_SFR_8051)),
        "8052": Part(name="8052", iram_bytes=256, has_timer2=True, sfr=frozenset(SFR_NAMES)),
    }
)
"""The parts by name."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Timing:
    """How a part counts its time.

    Parameters
    ----------
    name
        ``"12-clock"`` or ``"one-clock"``.
    clocks_per_cycle
        Oscillator periods of one unit of ``Mcs51.cycles``: 12 (a machine cycle) or 1.
    cycles_per_tick
        Units between two increments of timers 0 to 2: 1 or 12, so that both count at a twelfth of the oscillator.
    recognition_cycles
        Whole units between the one in which a request is sampled and the hardware's call: the request sampled in one
        machine cycle is polled in the next (manual, "How Interrupts Are Handled"); the one-clock part samples and
        decides in the same clock (C8051F12x data sheet, section 11.7.4, "Interrupt Latency").
    call_cycles
        Units of the hardware's call of a service routine: 2 machine cycles or 4 clocks (same places).

    Examples
    --------
    >>> TIMINGS["12-clock"].clocks_per_cycle * 83_333  # picoseconds of a machine cycle at 12 MHz, truncated
    999996
    """

    name: str
    clocks_per_cycle: int
    cycles_per_tick: int
    recognition_cycles: int
    call_cycles: int


TIMINGS: MappingProxyType[str, Timing] = MappingProxyType(
    {
        "12-clock": Timing(
            name="12-clock", clocks_per_cycle=12, cycles_per_tick=1, recognition_cycles=1, call_cycles=2
        ),
        "one-clock": Timing(
            name="one-clock", clocks_per_cycle=1, cycles_per_tick=12, recognition_cycles=0, call_cycles=4
        ),
    }
)
"""The timing models by name."""
