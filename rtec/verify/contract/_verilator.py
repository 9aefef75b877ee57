"""A Verilog module built by Verilator into a program that plays streams."""

from __future__ import annotations

import re
import shutil
from dataclasses import dataclass
from importlib import resources
from pathlib import Path

from rtec.errors import ArgumentError, FileFormatError, RtecError, meant
from rtec.io import read_any_text
from rtec.verify.contract._process_group import run_group
from rtec.verify.contract._verilog_runs import SETTLE_TICKS
from rtec.verify.contract.verilog_pins import Active, Pins, Port

BUILD_S = 300.0
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
_NO_DELAYS = [f"-W{what}-{name}DLY" for name in ("STMT", "ASSIGN") for what in ("warn", "error")]
_ERROR = re.compile(r"^%Error[\w-]*: (?P<file>[^\s:][^:\n]*):(?P<line>\d+):(?:\d+:)? *(?P<what>.+)$", re.MULTILINE)
_MODULE = re.compile(r"^\s*module\s+(\w+)", re.MULTILINE)


@dataclass(frozen=True, slots=True, kw_only=True)
class Built:
    """A design as a program, one process for many streams."""

    program: Path
    widths: dict[str, int]
    """Bits of each port."""
    may_rest: bool
    """Whether its next state follows from its state and inputs alone, and all of it lies in one piece."""


def build(folder: Path, file: Path, pins: Pins, clock_ps: tuple[int, int]) -> Built:
    """Build a design in an empty folder.

    Raises
    ------
    RtecError
        A program that is missing, a file that does not build (with the line of the first error), ports that are not
        there.
    """
    missing = [program for program in ("verilator", "make", "g++") if shutil.which(program) is None]
    if missing:
        names = " and ".join(missing)
        packages = " ".join(missing)
        raise RtecError(f"Verilog needs {names}, not found on the path; on Debian and Ubuntu: apt install {packages}")
    # Verilator and make cut names at spaces: they see links with plain names, from within the folder of the build
    if " " in str(folder):
        where = folder.parent
        raise RtecError(f"Verilator cannot build in {where}, a name with a space; TMPDIR names another folder")
    source = f"design{file.suffix.lower()}"
    (folder / source).symlink_to(file)
    (folder / "beside").symlink_to(file.parent, target_is_directory=True)
    template = resources.files("rtec.verify.contract").joinpath("_verilator_main.cpp")
    (folder / "main.cpp").write_text(template.read_text("utf-8"), "utf-8")

    def run(*command: str) -> None:
        code, said = run_group(command, folder=folder, within_s=BUILD_S)
        if code != 0:
            said = said.replace(f": {source}:", f": {file}:").replace(": beside/", f": {file.parent}/")
            raise _error(file, pins, said)

    run(
        "verilator", "--cc", "--exe", "--no-timing", "-Wno-fatal", *_NO_DELAYS, "-O3", "--x-assign", "unique",
        "--x-initial", "unique", "--prefix", "Vdut", "--top-module", pins.top, "--Mdir", ".", "-y", "beside",
        "-Ibeside", "+libext+.v+.sv", source, "main.cpp",
    )  # fmt: skip
    widths = pins.widths(_ports((folder / "Vdut.h").read_text("utf-8")))
    may_rest = _may_rest(folder)
    (folder / "rtec_pins.h").write_text(_header(pins, widths, clock_ps, may_rest=may_rest), "utf-8")
    run("make", "-f", "Vdut.mk", "-j2", "OPT_FAST=-O2", "OPT_SLOW=-O0", "OPT_GLOBAL=-O1", "Vdut")
    return Built(program=folder / "Vdut", widths=widths, may_rest=may_rest)


def _error(file: Path, pins: Pins, said: str) -> RtecError:
    """Return what a failed build means: the first error in the user's files."""
    if found := _ERROR.search(said):
        what = found["what"].strip()
        if "due to --no-timing" in what:
            what = "a delay: Verilator plays logic without delays"
        return FileFormatError(found["file"], int(found["line"]), what[:300], "Verilog that Verilator builds")
    if "--top-module" in said:
        modules = _MODULE.findall(read_any_text(file)[0])
        allowed = f"a module of {file}: {', '.join(modules) or 'it has none'}"[:300]
        return ArgumentError(f"{pins.where}: top", repr(pins.top), allowed, meant(pins.top, modules))
    lines = said.splitlines()
    first = next((line for line in lines if "rror" in line), lines[0] if lines else "no message")
    return RtecError(f"{file}: Verilator cannot build it: {first.strip()[:300]}")


def _may_rest(build: Path) -> bool:
    """Return whether a design reads no time, file or random numbers, and keeps no strings, queues and objects."""
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

    level = "(on)" if pins.reset_active is Active.HIGH else "!(on)"
    defined = {
        "CLOCK": member(pins.clock),
        "A_IN": member(pins.a_in),
        "B_IN": member(pins.b_in),
        "A_OUT": member(pins.a_out),
        "B_OUT": member(pins.b_out),
        "REQUESTED": member(pins.requested),
        "REQUESTED_BITS": widths[pins.requested],
        "COMPLETED": member(pins.completed),
        "COMPLETED_BITS": widths[pins.completed],
        "REFUSED(dut)": f"(static_cast<int64_t>((dut).{member(pins.refused)}))" if pins.refused else "(0)",
        "RESET(dut, on)": f"(dut).{member(pins.reset)} = {level}" if pins.reset else "(void)(dut)",
        "RESET_TICKS": pins.reset_ticks,
        "TICKS_BEFORE": pins.reset_ticks + SETTLE_TICKS,
        "PERIOD_NUM": f"INT64_C({clock_ps[0]})",
        "PERIOD_DEN": f"INT64_C({clock_ps[1]})",
        "MAY_REST": int(may_rest),
    }
    return "".join(f"#define RTEC_{name} {value}\n" for name, value in defined.items())
