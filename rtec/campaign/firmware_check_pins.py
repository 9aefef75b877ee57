"""Which pins a firmware drives: all that its design needs, and none that is not its own."""

from __future__ import annotations

from collections.abc import Iterable

from rtec.campaign.firmware_algorithm import Firmware
from rtec.campaign.firmware_check_bench import Bench
from rtec.campaign.firmware_check_contract import DECODER_RST, HOLD, NOT_VALID, Failed
from rtec.campaign.firmware_check_reset import pin_names
from rtec.conformance.trials import Case

_OTHERS = {0: "P0 is the bus", 2: "port 2 has to stay FFh for MOVX @Ri", 3: "inputs and bus of port 3 stay high"}


def pins(firmware: Firmware, cases: Iterable[Case]) -> str:
    """Play insertions at rest in every state, and look at all latches.

    Raises
    ------
    Failed
        A pin of the design is never driven, or another one is.
    """
    bench = firmware.bench
    needed = bench.design.pins | (HOLD if bench.hold_latch and not bench.design.in_path else 0)
    own = {0: 0, 1: bench.design.pins | DECODER_RST | HOLD, 2: 0, 3: NOT_VALID}
    driven = 0
    for case in cases:
        firmware.replay(case.stream.stimulus())
        for port in range(4):
            _own_alone(bench, port, ~bench.first_latches[port] & ~own[port] & 0xFF, bench.begun_ps)
            for cycle, before, latch in bench.changes(port):
                driven |= before ^ latch if port == 1 else 0
                _own_alone(bench, port, ~latch & ~own[port] & 0xFF, bench.time_of(cycle))
    missing = needed & ~driven
    if missing:
        raise Failed(
            f"never drives {pin_names(1, missing)}, whatever is asked for; design {bench.design.value} inserts with "
            f"{pin_names(1, needed)}",
            bench.now_ps,
        )
    return f"drives {pin_names(1, needed)}, and no pin that is not its own"


def _own_alone(bench: Bench, port: int, foreign: int, t_ps: int) -> None:
    """Refuse pins that are low and are not the design's own."""
    if foreign:
        why = _OTHERS.get(port, f"design {bench.design.value} has nothing there")
        raise Failed(f"drives {pin_names(port, foreign)} low: {why}", t_ps)
