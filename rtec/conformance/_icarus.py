"""A Verilog module compiled by Icarus Verilog; each stream is a process of its own, registers begin unknown."""

from __future__ import annotations

import re
import shutil
from collections.abc import Sequence
from importlib import resources
from pathlib import Path

import numpy as np

from rtec.conformance._verilog_runs import (
    BUILD_S,
    SETTLE_TICKS,
    SILENT_S,
    Runs,
    build_error,
    most_bytes,
    stream_rows,
)
from rtec.conformance._workshop import Workshop
from rtec.conformance.verilog_pins import Active, Pins, Port
from rtec.injector import Stimulus

_PORT = re.compile(r'^ +\.port_info \d+ /(INPUT|OUTPUT) (\d+) "([^"]+)"', re.MULTILINE)
_UNKNOWN = str.maketrans("xXzZ", "0000")


def installed() -> str | None:
    """Return the path of the program, or None."""
    return shutil.which("iverilog")


class Icarus:
    """A design compiled for vvp."""

    def __init__(self, shop: Workshop, file: Path, pins: Pins, clock_ps: tuple[int, int]) -> None:
        self._shop, self._cwd = shop, file.parent
        alone, self._program = shop.folder / "alone.vvp", shop.folder / "bench.vvp"
        bench = shop.folder / "rtec_bench.v"
        bench.write_text(resources.files("rtec.conformance").joinpath("_icarus_bench.v").read_text("utf-8"), "utf-8")
        options = [
            str(installed()),
            "-g2012",
            "-y",
            str(file.parent),
            "-Y.sv",
            f"-I{file.parent}",
            f"-I{shop.folder}",
        ]
        code, said = shop.run([*options, "-s", pins.top, "-o", str(alone), str(file)], within_s=BUILD_S)
        if code != 0:
            raise build_error(file, pins, said, "Icarus Verilog")
        self.widths = pins.widths(_ports(alone.read_text("utf-8", "replace"), pins.top))
        (shop.folder / "rtec_pins.vh").write_text(_header(pins, self.widths, clock_ps), "utf-8")
        code, said = shop.run(
            [*options, "-s", "rtec_bench", "-o", str(self._program), str(bench), str(file)], within_s=BUILD_S
        )
        if code != 0:
            raise build_error(file, pins, said, "Icarus Verilog")

    def play(self, stimuli: Sequence[Stimulus]) -> list[Runs]:
        """Return the run of each stream."""
        return [self._one(stimulus) for stimulus in stimuli]

    def _one(self, stimulus: Stimulus) -> Runs:
        into, out = self._shop.folder / "in", self._shop.folder / "out"
        rows = [(stimulus.until_ps, 0, stimulus.edges.initial), *stream_rows(stimulus).tolist()]
        into.write_text("".join(f"{t_ps} {kind} {value}\n" for t_ps, kind, value in rows), "ascii")
        out.unlink(missing_ok=True)
        command = [str(shutil.which("vvp")), "-n", str(self._program), f"+rtec_in={into}", f"+rtec_out={out}"]
        code, said = self._shop.watch(
            command, out, silent_s=SILENT_S, most_bytes=most_bytes([stimulus]), folder=self._cwd
        )
        text = out.read_text("ascii", "replace") if out.exists() else ""
        whole = text[: text.rfind("\n") + 1].translate(_UNKNOWN)
        values = np.array(whole.split(), np.int64)
        played = values.reshape(-1, 6)
        if played.size and played[-1, 0] in {3, 4}:
            return Runs([played])
        last_line = next(iter(said.strip().splitlines()[-1:]), "")
        return Runs([played], "" if code is None else last_line or f"the simulation ended with code {code}")


def _ports(compiled: str, top: str) -> list[Port]:
    """Read the ports from the compiled module: those behind the line of its scope, up to the next scope."""
    scope = compiled.partition(f'.scope module, "{top}" "{top}"')[2].partition(".scope")[0]
    return [Port(name, way == "INPUT", int(bits)) for way, bits, name in _PORT.findall(scope)]


def _header(pins: Pins, widths: dict[str, int], clock_ps: tuple[int, int]) -> str:
    connected = {
        pins.clock: "clock",
        pins.a_in: "a",
        pins.b_in: "b",
        pins.requested: "requested",
        pins.a_out: "a_out",
        pins.b_out: "b_out",
        pins.completed: "completed",
    }
    refused = "wire refused = 0;"
    if pins.refused:
        connected[pins.refused] = "refused"
        refused = f"wire [{widths[pins.refused] - 1}:0] refused;"
    if pins.reset:
        connected[pins.reset] = "reset" if pins.reset_active is Active.HIGH else "!reset"
    return "\n".join(
        [
            f"`define RTEC_DESIGN {pins.top}",
            f"`define RTEC_CONNECTIONS {', '.join(f'.{port}({net})' for port, net in connected.items())}",
            f"`define RTEC_REQUESTED_BITS {widths[pins.requested]}",
            f"`define RTEC_COMPLETED_BITS {widths[pins.completed]}",
            f"`define RTEC_REFUSED_WIRE {refused}",
            f"`define RTEC_RESET_TICKS {pins.reset_ticks}",
            f"`define RTEC_TICKS_BEFORE {pins.reset_ticks + SETTLE_TICKS}",
            f"`define RTEC_PERIOD_NUM 64'sd{clock_ps[0]}",
            f"`define RTEC_PERIOD_DEN 64'sd{clock_ps[1]}",
            "",
        ]
    )
