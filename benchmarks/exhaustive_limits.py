"""How fast the encoder may be by exhaustive search: `python benchmarks/exhaustive_limits.py 8051 b`."""

from __future__ import annotations

import argparse
import sys

from rtec.injector import Design, InjectorSettings, Processor, RealEdges, Timing
from rtec.verify.contract.built_in import BuiltIn
from rtec.verify.contract.contract import Contract
from rtec.verify.contract.exhaustive.prove import prove
from rtec.verify.contract.exhaustive.result import Ending, Exhausted

CLOSE = 1.02


def verdict(design: Design, processor: Processor, hertz: float, most_states: int) -> Exhausted:
    """Return what the search says of a design at a frequency."""
    timing = Timing.of(design, processor)
    box = BuiltIn(InjectorSettings(design=design, timing=timing, real_edges=RealEdges.HOLD))
    return prove(box, Contract.of(design, frequency_hz=hertz), most_states=most_states, most_s=120.0)


def main() -> None:
    """Bisect from a frequency that is proved to one that is not, and print each step."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("processor", type=Processor, choices=Processor)
    parser.add_argument("design", type=Design.named)
    parser.add_argument("--from", dest="low", type=float, default=5e3)
    parser.add_argument("--to", dest="high", type=float, default=6e6)
    parser.add_argument("--states", type=int, default=8_000_000)
    given = parser.parse_args()
    low, high = given.low, given.high
    while high / low > CLOSE:
        middle = float(f"{(low * high) ** 0.5:.4g}")
        found = verdict(given.design, given.processor, middle, given.states)
        sys.stdout.write(f"{middle / 1e3:.4g} kHz: {found.reason} ({found.seconds:.1f} s)\n")
        sys.stdout.flush()
        low, high = (middle, high) if found.ending is Ending.PROVED else (low, middle)


if __name__ == "__main__":
    main()
