"""A Verilog module built by Verilator into a program that plays streams."""

from __future__ import annotations

import re
import shutil
from collections.abc import Sequence
from importlib import resources
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rtec.errors import RtecError
from rtec.injector import Stimulus
from rtec.verify.contract._build_sandbox import BuildSandbox, Program
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

_PORT = re.compile(r"\bVL_(IN|OUT)(?:8|16|64|W)?\(&?(\w+),(\d+),(\d+)")
_CODED = re.compile(r"__0([0-9A-F]{2})")
_SOURCE = re.compile(r'^S .*"(.*)"$', re.MULTILINE)
_ITS_OWN = ("verilator_bin", "verilator_bin_dbg", "verilated_std.sv")
_FOREIGN = re.compile(
    r"\$(?!(?:un)?signed\b|clog2\b|bits\b|size\b|high\b|low\b|left\b|right\b|countones\b|onehot0?\b|isunknown\b"
    r"|finish\b|stop\b|display\b|write\b|error\b|warning\b|info\b|fatal\b|readmem[hb]\b)|`systemc_|\bimport +\""
)
"""What may depend on more than state and inputs: system functions other than these, code in C."""
_ELSEWHERE = re.compile(r"\bstd::|\bVl(?!Unpacked|Wide|TriggerVec)[A-Z]")
"""Types that keep their values outside of the object."""
_ROW = 6 * 8
_NO_DELAYS = [f"-W{what}-{name}DLY" for name in ("STMT", "ASSIGN") for what in ("warn", "error")]
_PLAYS = 3
"""Registers that the design leaves open are all 0 in the first play, all 1 in the second, random in the third."""


class Verilator:
    """A design as a program, one process for many streams."""

    def __init__(self, shop: BuildSandbox, file: Path, pins: Pins, clock_ps: tuple[int, int]) -> None:
        self._shop, self._cwd = shop, file.parent
        # Verilator and make cut names at spaces: they see links with plain names, from within the folder of the build
        build, source = shop.folder / "build", f"design{file.suffix.lower()}"
        build.mkdir()
        (build / source).symlink_to(file)
        (build / "beside").symlink_to(file.parent, target_is_directory=True)
        template = resources.files("rtec.verify.contract").joinpath("_verilator_main.cpp")
        (build / "main.cpp").write_text(template.read_text("utf-8"), "utf-8")
        self._say_what_is_missing()
        command = [
            "verilator", "--cc", "--exe", "--no-timing", "-Wno-fatal", *_NO_DELAYS, "-O3", "--x-assign",
            "unique", "--x-initial", "unique", "--prefix", "Vdut", "--top-module", pins.top, "--Mdir", ".",
            "-y", "beside", "-Ibeside", "+libext+.v+.sv", source, "main.cpp",
        ]  # fmt: skip
        code, said = shop.run(command, within_s=BUILD_S, folder=build)
        said = said.replace(f": {source}:", f": {file}:").replace(": beside/", f": {file.parent}/")
        if code != 0:
            raise build_error(file, pins, said, "Verilator")
        ports = _ports((build / "Vdut.h").read_text("utf-8"))
        widths = pins.widths(ports)
        self.may_rest = _may_rest(build)
        (build / "rtec_pins.h").write_text(_header(pins, widths, clock_ps, may_rest=self.may_rest), "utf-8")
        make = ["make", "-f", "Vdut.mk", "-j2", "OPT_FAST=-O2", "OPT_SLOW=-O0", "OPT_GLOBAL=-O1", "Vdut"]
        code, said = shop.run(make, within_s=BUILD_S, folder=build)
        if code != 0:
            raise build_error(file, pins, said, "Verilator")
        self.widths, self._program = widths, build / "Vdut"
        self._running: Program | None = None

    def _say_what_is_missing(self) -> None:
        missing = [program for program in ("make", "g++") if shutil.which(program) is None]
        if " " in str(self._shop.folder):
            folder = self._shop.folder.parent
            raise RtecError(f"Verilator cannot build in {folder}, a name with a space; TMPDIR names another folder")
        if missing:
            names = " and ".join(missing)
            raise RtecError(f"Verilator needs {names}, not found on the path; on Debian: apt install g++ make")

    def play(self, stimuli: Sequence[Stimulus]) -> list[Runs]:
        """Return the runs of each stream; the process is begun again behind a stream that ended it."""
        played: list[Runs] = []
        while len(played) < len(stimuli):
            played += self._play_until_it_ends(stimuli[len(played) :])
        return played

    def _play_until_it_ends(self, stimuli: Sequence[Stimulus]) -> list[Runs]:
        if self._running is None or not self._running.running:
            self._running = self._shop.begin(lambda out: [str(self._program), str(out)], folder=self._cwd)
        program = self._running
        numbers = np.concatenate([_stream(stimulus) for stimulus in stimuli])
        question = np.append(numbers.size, numbers).tobytes()
        answer = program.answer_to(question, is_whole=_is_whole, silent_s=SILENT_S, most_bytes=most_bytes(stimuli))
        rows = np.frombuffer(answer[: len(answer) // _ROW * _ROW], np.int64).reshape(-1, 6)
        ends = np.flatnonzero((rows[:, 0] == 3) | (rows[:, 0] == 4)) + 1
        runs = np.split(rows, ends)
        whole = min(len(ends) // _PLAYS, len(stimuli))
        played = [Runs(runs[_PLAYS * k : _PLAYS * (k + 1)]) for k in range(whole)]
        if whole < len(stimuli):
            played.append(Runs([runs[-1]], self._why(program.code, program.said)))
        return played

    @staticmethod
    def _why(code: int | None, said: str) -> str:
        if code is None:
            return ""
        errors = re.findall(r"^%Error: ?(.*)$", said, re.MULTILINE)
        if any("converge" in error for error in errors):
            return "its combinational logic does not settle"
        return errors[-1] if errors else f"the simulation ended with code {code}"


def _is_whole(answer: bytearray) -> bool:
    return len(answer) % _ROW == 0 and answer[-_ROW : 8 - _ROW] == b"\6\0\0\0\0\0\0\0"


def _stream(stimulus: Stimulus) -> NDArray[np.int64]:
    rows = stream_rows(stimulus)
    return np.concatenate([[stimulus.until_ps, stimulus.edges.initial, len(rows)], rows.ravel()])


def _may_rest(build: Path) -> bool:
    """Return whether a design's next state follows from its state and inputs alone, and all of it lies in one piece.

    Where it reads the time, a file or random numbers, or keeps strings, queues and objects, every tick is played.
    """
    names = _SOURCE.findall((build / "Vdut__verFiles.dat").read_text("utf-8", "replace"))
    sources = [build / name for name in names if Path(name).name not in _ITS_OWN]
    try:
        pure = all(_FOREIGN.search(path.read_text("utf-8", "replace")) is None for path in sources)
    except OSError:
        return False
    return pure and all(_ELSEWHERE.search(path.read_text("utf-8")) is None for path in build.glob("Vdut_*.h"))


def _ports(header: str) -> list[Port]:
    found = _PORT.findall(header)
    plain = [(way, _CODED.sub(lambda code: chr(int(code[1], 16)), name), high, low) for way, name, high, low in found]
    return [
        Port(name.removeprefix("__SYM__"), way == "IN", int(high) - int(low) + 1) for way, name, high, low in plain
    ]


def _header(pins: Pins, widths: dict[str, int], clock_ps: tuple[int, int], *, may_rest: bool) -> str:
    def member(name: str) -> str:
        return name.replace("__", "___05F").replace("$", "__024")

    refused = f"(static_cast<int64_t>((dut).{member(pins.refused)}))" if pins.refused else "(0)"
    level = "(on)" if pins.reset_active is Active.HIGH else "!(on)"
    reset = f"(dut).{member(pins.reset)} = {level}" if pins.reset else "(void)(dut)"
    return "\n".join(
        [
            f"#define RTEC_CLOCK {member(pins.clock)}",
            f"#define RTEC_A_IN {member(pins.a_in)}",
            f"#define RTEC_B_IN {member(pins.b_in)}",
            f"#define RTEC_A_OUT {member(pins.a_out)}",
            f"#define RTEC_B_OUT {member(pins.b_out)}",
            f"#define RTEC_REQUESTED {member(pins.requested)}",
            f"#define RTEC_REQUESTED_BITS {widths[pins.requested]}",
            f"#define RTEC_COMPLETED {member(pins.completed)}",
            f"#define RTEC_COMPLETED_BITS {widths[pins.completed]}",
            f"#define RTEC_REFUSED(dut) {refused}",
            f"#define RTEC_RESET(dut, on) {reset}",
            f"#define RTEC_RESET_TICKS {pins.reset_ticks}",
            f"#define RTEC_TICKS_BEFORE {pins.reset_ticks + SETTLE_TICKS}",
            f"#define RTEC_PERIOD_NUM INT64_C({clock_ps[0]})",
            f"#define RTEC_PERIOD_DEN INT64_C({clock_ps[1]})",
            f"#define RTEC_MAY_REST {may_rest:d}",
            "",
        ]
    )
