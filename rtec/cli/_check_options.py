"""What the user says of an algorithm and its contract, handed from the verb to what makes the algorithm."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from rtec.cli._groups import OptionGroup
from rtec.cli._kinds import Clock, Design, Microcontroller, Processor, RealEdges, States
from rtec.cli._parameters import design, flag, member, named, option, processor, quantity, share, time_ps, whole, word
from rtec.cli._words import PROCESSORS, completing, files_ending
from rtec.units import FREQUENCY, SWEEP


@dataclass(frozen=True, slots=True, kw_only=True)
class ContractOptions(OptionGroup):
    """What is asked of an algorithm; None where nothing was said."""

    PANEL = "The contract"

    design: Annotated[Design | None, design("Takes step and states from a known design.")] = None
    step_counts: Annotated[int | None, whole("--step", "Counts of one step.", low=1)] = None
    states: Annotated[
        States | None,
        named(
            "--states",
            "rtec.conformance.contract:states_of",
            "00|00,11|all",
            "Levels of A and B in which it inserts at rest; all.",
        ),
    ] = None
    frequency_hz: Annotated[
        float | None, quantity("--frequency", FREQUENCY, "500kHz", "Up to here every count is right; 500 kHz.")
    ] = None
    acceleration_hz_s: Annotated[
        float | None, quantity("--acceleration", SWEEP, "'100 MHz/s'", "Of that frequency; 100 MHz/s.")
    ] = None
    jitter: Annotated[float | None, share("--jitter", "10%", "Of the distance of two edges there; 10%.")] = None
    separation_ps: Annotated[
        int | None, time_ps("--separation", "60ns", "Between changes at the controller; 60 ns.")
    ] = None
    delay_ps: Annotated[
        int | None, time_ps("--delay", "50us", "For so long a count may be wrong; 50 us, of firmware five readings.")
    ] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class RunnerOptions(OptionGroup):
    """What runs an algorithm; None where nothing was said."""

    PANEL = "What runs it"

    clock_ps: Annotated[
        Clock | None,
        named(
            "--clock",
            "rtec.conformance.verilog:clock_of",
            "50MHz",
            "Verilog's clock; a Python class then sees ticks only.",
        ),
    ] = None
    pins: Annotated[Path | None, option("--pins", "P.toml", "Which port of the module is what.")] = None
    simulator: Annotated[
        str | None, option("--simulator", "verilator|icarus", "For Verilog; the first that is installed.")
    ] = None
    processor: Annotated[Microcontroller | None, processor(f"For machine code: {', '.join(PROCESSORS)}.")] = None
    part: Annotated[str | None, word("--part", "8051|8052", "For machine code.")] = None
    hold_latch: Annotated[
        bool | None,
        flag(
            "--hold-latch/--no-hold-latch",
            "Machine code: P1.7 works a latch that holds real edges back; it does if not said.",
            show_default=False,
        ),
    ] = None
    timing: Annotated[
        Processor | None,
        member("--timing", "rtec.injector:Processor", "8051|fast", "What works in a design of rtec; fast."),
    ] = None
    real_edges: Annotated[
        RealEdges | None,
        member(
            "--real-edges", "rtec.injector:RealEdges", "hold|merge", "What a design of rtec does with them; hold."
        ),
    ] = None


def _algorithms(incomplete: str) -> list[str]:
    files = files_ending(".py", ".v", ".sv", ".ihx", ".hex")
    return [*completing(("original", "a", "b", "c"))(incomplete), *files(incomplete)]


@dataclass(frozen=True, slots=True, kw_only=True)
class Options(OptionGroup):
    """An algorithm, and what was said of it."""

    algorithm: Annotated[
        str,
        typer.Argument(
            metavar="ALGORITHM",
            autocompletion=_algorithms,
            help="file.py:Name, top.v, image.ihx, or original, a, b, c for a design of rtec.",
            show_default=False,
        ),
    ]
    contract: ContractOptions
    runner: RunnerOptions
