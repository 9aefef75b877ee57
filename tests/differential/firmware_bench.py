"""The box's firmware on ``s51`` of ucsim: pins and memory-mapped words set from outside, every instruction looked at.

All commands of a session are written beforehand, so the encoder's edges stand between instructions: a quarter of a
cycle lasts a number of instructions, and the trace says how many machine cycles that was.
"""

from __future__ import annotations

import itertools
import re
import shutil
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

IMAGES = Path(__file__).parents[2] / "firmware_model" / "images"
# (A, B) in the order of forward motion, as the report has it
STATES = ((0, 0), (1, 0), (1, 1), (0, 1))
LARGE, PROBING, GO_HOME = 1, 2, 4
WORDS = (
    "position0 position1 position2 completed0 completed1 accepted0 accepted1 message trip0 trip1 trip2 trips refused"
).split()
_LOOK = re.compile(
    r"PC= 0x([0-9a-f]+).*?\((\d+) clks\).*?^0x90 ([0-9a-f]{2}).*?^0xb0 ([0-9a-f]{2})", re.DOTALL | re.M
)
_WORDS = re.compile(r"^0xff20 ((?:[0-9a-f]{2} ){13})", re.M)


def absent() -> bool:
    return shutil.which("s51") is None


def symbols(name: str) -> dict[str, int]:
    lines = (IMAGES / f"{name}.sym").read_text(encoding="utf-8").splitlines()
    return {label: int(address, 16) for address, label in (line.split() for line in lines)}


@dataclass(frozen=True, slots=True)
class Look:
    """What holds after an instruction: latches of ports 1 and 3, the encoder's lines, the cycles done."""

    cycle: int
    pc: int
    p1: int
    p3: int
    lines: tuple[int, int]


@dataclass(frozen=True, slots=True)
class Words:
    position: int
    completed: int
    accepted: int
    message: int
    trip: int
    trips: int
    refused: int


def signed(*parts: int) -> int:
    return int.from_bytes(bytes(parts), "little", signed=True)


class Session:
    """Write down what happens, then play it."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.commands: list[str] = []
        self.traced: list[tuple[int, int]] = []
        self.state = 0
        self.count = 0
        self.enabled, self.tripped = True, False
        self.pins()

    def pins(self) -> None:
        a, b = STATES[self.state]
        circuit = a | b if self.name == "original" else a ^ b
        level = 0xC2 | (not self.enabled) | circuit << 2 | (not self.tripped) << 3 | a << 4 | b << 5
        self.commands.append(f"set hardware port[3] {level:#04x}")

    def xram(self, address: int, value: int) -> None:
        self.commands.append(f"set memory xram {address:#06x} {value & 0xFF:#04x}")

    def ask(self, total: int, status: int = 0) -> None:
        self.xram(0xFF10, total)
        self.xram(0xFF11, total >> 8)
        self.xram(0xFF12, status)

    def move(self, steps: int, *, counted: bool = True) -> None:
        """Let the encoder go on by an edge; its decoder counts it."""
        self.state = (self.state + steps) % 4
        if counted:
            self.set_count(self.count + steps)
        self.pins()

    def set_count(self, count: int) -> None:
        self.count = count
        self.xram(0xFF00, (count >> 8) & 0x0F)
        self.xram(0xFF01, count)

    def trip(self, tripped: bool) -> None:
        self.tripped = tripped
        self.pins()

    def enable(self, enabled: bool) -> None:
        self.enabled = enabled
        self.pins()

    def skip(self, instructions: int) -> None:
        self.commands.append(f"step {instructions}")

    def trace(self, instructions: int) -> None:
        for _ in range(instructions):
            self.commands += ["step 1", "state", "dump /h sfr 0x90 0x90 1", "dump /h sfr 0xb0 0xb0 1"]
            self.traced.append(STATES[self.state])

    def words(self) -> None:
        self.commands.append("dump /h xram 0xff20 0xff2c 13")

    def home(self) -> None:
        """Through start-up: home is taken, then nothing is requested."""
        self.ask(0, GO_HOME)
        self.skip(3000)
        self.ask(0)
        self.skip(1500)

    def play(self) -> tuple[list[Look], list[Words]]:
        with tempfile.TemporaryDirectory(prefix="s51-") as folder:
            shutil.copyfile(IMAGES / f"{self.name}.ihx", Path(folder) / "image.hex")
            begin = ['file "image.hex"', "fill iram 0 0x7f 0xa5", "fill xram 0 0xffff 0", "reset"]
            script = "\n".join([*begin, *self.commands, "quit"]) + "\n"
            (Path(folder) / "commands").write_text(script, encoding="ascii")
            said = subprocess.run(
                ["s51", "-t", "51", "-X", "12M", "-b", "-q", "-R", "1", "-C", "commands"],
                stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=120, check=True, cwd=folder,
            ).stdout  # fmt: skip
        found = _LOOK.findall(said)
        assert len(found) == len(self.traced), f"s51 answered {len(found)} of {len(self.traced)} times"
        looks = [
            Look(int(clocks) // 12, int(pc, 16), int(p1, 16), int(p3, 16), lines)
            for (pc, clocks, p1, p3), lines in zip(found, self.traced, strict=True)
        ]
        words = [dict(zip(WORDS, bytes.fromhex(line), strict=True)) for line in _WORDS.findall(said)]
        return looks, [
            Words(
                position=signed(w["position0"], w["position1"], w["position2"]),
                completed=signed(w["completed0"], w["completed1"]),
                accepted=signed(w["accepted0"], w["accepted1"]),
                message=w["message"],
                trip=signed(w["trip0"], w["trip1"], w["trip2"]),
                trips=w["trips"],
                refused=w["refused"],
            )
            for w in words
        ]


def output(name: str, look: Look) -> tuple[int, int]:
    """Return A and B at the controller: the gates, inverters or wires behind port 1."""
    a, b = look.lines
    p = [look.p1 >> bit & 1 for bit in range(8)]
    if name == "b":
        return p[4], p[5]
    if name == "c":
        return a ^ (1 - p[0]), b ^ (1 - p[1])
    return (a | (1 - p[0])) & p[2], (b | (1 - p[1])) & p[3]


def count_of(outputs: list[tuple[int, int]]) -> tuple[int, int]:
    """Return counts and illegal changes of an ideal decoder."""
    count = illegal = 0
    for before, after in itertools.pairwise(outputs):
        step = (STATES.index(after) - STATES.index(before)) % 4
        count += {0: 0, 1: 1, 3: -1, 2: 0}[step]
        illegal += step == 2
    return count, illegal
