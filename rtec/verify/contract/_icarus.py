"""A Verilog module compiled by Icarus Verilog; each stream is a process of its own, registers begin unknown."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from importlib import resources
from pathlib import Path

import numpy as np

from rtec.errors import RtecError
from rtec.injector import Stimulus
from rtec.verify.contract._build_sandbox import BuildSandbox, Program
from rtec.verify.contract._icarus_memory import memory_of
from rtec.verify.contract._verilog_runs import (
    BUILD_S,
    SETTLE_TICKS,
    SILENT_S,
    Runs,
    build_error,
    most_bytes,
    stream_rows,
)
from rtec.verify.contract.verilog_pins import Active, Pins, Port

_PORT = re.compile(r'^ +\.port_info \d+ /(INPUT|OUTPUT) (\d+) "([^"]+)"', re.MULTILINE)
_FINISH = 4
_UNKNOWN = str.maketrans("xXzZ", "0000")


class Icarus:
    """A design compiled for vvp."""

    def __init__(self, shop: BuildSandbox, file: Path, pins: Pins, clock_ps: tuple[int, int]) -> None:
        self._shop, self._cwd = shop, file.parent
        alone, self._program = shop.folder / "alone.vvp", shop.folder / "bench.vvp"
        bench = shop.folder / "rtec_bench.v"
        bench.write_text(
            resources.files("rtec.verify.contract").joinpath("_icarus_bench.v").read_text("utf-8"), "utf-8"
        )
        options = ["iverilog", "-g2012", "-y", str(file.parent), "-Y.sv", f"-I{file.parent}", f"-I{shop.folder}"]
        code, said = shop.run([*options, "-s", pins.top, "-o", str(alone), str(file)], within_s=BUILD_S)
        if code != 0:
            raise build_error(file, pins, said, "Icarus Verilog")
        compiled = alone.read_text("utf-8", "replace")
        self.widths = pins.widths(_ports(compiled, pins.top))
        command = [*options, "-s", "rtec_bench", "-o", str(self._program), str(bench), str(file)]
        memory = memory_of(compiled, pins.top)
        for known in [memory, None] if memory else [None]:  # what cannot be named is not looked at
            (shop.folder / "rtec_pins.vh").write_text(_header(pins, self.widths, clock_ps, known), "utf-8")
            code, said = shop.run(command, within_s=BUILD_S)
            if code == 0:
                self.may_rest = known is not None
                return
        raise build_error(file, pins, said, "Icarus Verilog")

    def play(self, stimuli: Sequence[Stimulus]) -> list[Runs]:
        """Return the run of each stream; some processes run side by side."""
        played: list[Runs] = []
        at_once = 2 * (os.cpu_count() or 1)
        for first in range(0, len(stimuli), at_once):
            played += self._side_by_side(stimuli[first : first + at_once])
        return played

    def _side_by_side(self, stimuli: Sequence[Stimulus]) -> list[Runs]:
        command = ["vvp", "-n", str(self._program)]
        programs = [
            self._shop.begin(lambda out: [*command, f"+rtec_out=/dev/fd/{out}"], folder=self._cwd) for _ in stimuli
        ]

        def answer_of(program: Program, stimulus: Stimulus) -> bytes:
            return program.answer_to(
                _stream(stimulus), is_whole=lambda _: False, silent_s=SILENT_S, most_bytes=most_bytes(stimuli)
            )

        with ThreadPoolExecutor(len(programs)) as pool:
            try:
                answers = list(pool.map(answer_of, programs, stimuli))
            except BaseException:
                for program in programs:
                    program.kill()
                raise
        return [_runs(*pair) for pair in zip(programs, answers, strict=True)]


def _stream(stimulus: Stimulus) -> bytes:
    rows = [(stimulus.until_ps, 0, stimulus.edges.initial), *stream_rows(stimulus).tolist(), (0, 0, 0)]
    return "".join(f"{t_ps} {kind} {value}\n" for t_ps, kind, value in rows).encode("ascii")


def _runs(program: Program, answer: bytes) -> Runs:
    text = answer.decode("ascii", "replace")
    whole = text[: text.rfind("\n") + 1].translate(_UNKNOWN)
    played = np.array(whole.split(), np.int64).reshape(-1, 6)
    if program.code is not None and played.size and played[-1, 0] in {3, 4}:
        return Runs([played])
    played = played[played[:, 0] != _FINISH]  # it says so, too, where it was ended from outside
    last_line = next(iter(program.said.strip().splitlines()[-1:]), "")
    code = program.code
    if code and not played.size:
        raise RtecError(f"vvp cannot run what iverilog has built: {last_line[:300] or f'code {code}'}")
    return Runs([played], "" if code is None else last_line or f"the simulation ended with code {code}")


def _ports(compiled: str, top: str) -> list[Port]:
    """Read the ports from the compiled module: those behind the line of its scope, up to the next scope."""
    scope = compiled.partition(f'.scope module, "{top}" "{top}"')[2].partition(".scope")[0]
    return [Port(name, way == "INPUT", int(bits)) for way, bits, name in _PORT.findall(scope)]


def _header(pins: Pins, widths: dict[str, int], clock_ps: tuple[int, int], memory: tuple[str, int] | None) -> str:
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
            f"`define RTEC_MAY_REST {1 if memory else 0}",
            f"`define RTEC_MEMORY {memory[0] if memory else 0}",
            f"`define RTEC_MEMORY_BITS {memory[1] if memory else 1}",
            "",
        ]
    )
