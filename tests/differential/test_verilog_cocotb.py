"""Design C in Verilog against itself in Python and under cocotb; and the ten lines of the documentation."""

import importlib.util
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from verilog_modules import WIRES, pins_text

import rtec.cocotb
import rtec.verify.contract
from rtec.injector import Design, Stimulus
from rtec.signal import EdgeStream
from rtec.verify.contract.contract import Contract
from rtec.verify.contract.judge import judge
from rtec.verify.contract.python_class import PythonClass
from rtec.verify.contract.streams import Stream
from rtec.verify.contract.verilog import VerilogAlgorithm
from rtec.verify.contract.verilog_pins import Pins

ROOT = Path(__file__).parents[2]
EXAMPLES = Path(rtec.verify.contract.__file__).parents[2] / "examples"
needs_cocotb = pytest.mark.skipif(
    importlib.util.find_spec("cocotb") is None or shutil.which("iverilog") is None,
    reason="cocotb or Icarus Verilog (iverilog) is not installed",
)
# a process of its own: cocotb's runner changes the environment, and a simulator is no part of this one
RUNNER = """
import sys
from cocotb_tools.runner import get_runner
source, top, module = sys.argv[1:]
runner = get_runner("icarus")
runner.build(sources=[source], hdl_toplevel=top, timescale=("1ps", "1ps"), build_dir="built")
runner.test(test_module=module, hdl_toplevel=top, build_dir="built", test_dir=".")
"""


def simulate(folder: Path, source: Path, top: str, module: str, **asked: object) -> str:
    """Run a cocotb test and return what it printed."""
    path = os.pathsep.join([str(folder), str(ROOT), str(ROOT / "tests" / "differential")])
    without_pytest = {name: value for name, value in os.environ.items() if not name.startswith("PYTEST")}
    done = subprocess.run(
        [sys.executable, "-c", RUNNER, str(source), top, module],
        cwd=folder,
        env=without_pytest | {"PYTHONPATH": path, "RTEC_ASKED": json.dumps(asked)},
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )
    return done.stdout + done.stderr


def answered(folder: Path, source: Path, top: str, *pins: Path, **asked: object) -> list:
    """Return what the bench of these tests has written down, for each pins file."""
    answer = folder / "answer.json"
    said = simulate(
        folder, source, top, "cocotb_bench", pins=[str(path) for path in pins], answer=str(answer), **asked
    )
    assert answer.exists(), said
    return json.loads(answer.read_text())


@pytest.fixture(scope="module")
def ours():
    """Return the shipped Design C, built by Verilator."""
    if not all(map(shutil.which, ("verilator", "make", "g++"))):
        pytest.skip("verilator, make or g++ is not installed")
    pins = Pins.read(EXAMPLES / "design_c.toml")
    with VerilogAlgorithm(EXAMPLES / "design_c.v", pins=pins, clock_ps=(20_000, 1)) as module:
        yield module


def drawn(seed: int, count: int, closest_ps: int = 120_000) -> list[Stimulus]:
    """Draw streams with rests between bursts, so that ticks are left out, and edges on ticks and beside them."""
    rng = np.random.default_rng(seed)
    made = []
    for _ in range(count):
        size = int(rng.integers(4, 30))
        gaps = rng.choice([closest_ps, 500_000, 2_000_000, 90_000_000], size) + rng.integers(0, 3, size)
        times = np.cumsum(gaps)
        moves = np.where(np.cumsum(rng.random(size) < 0.2) % 2, 1, -1)
        asks = sorted({int(t) for t in rng.integers(1, times[-1], 4)})
        totals = [(t, int(rng.integers(-3, 4))) for t in asks]
        until = int(times[-1]) + 300_000_000
        made.append(Stream.of(int(rng.integers(4)), np.stack([times, moves], axis=1), totals, until).stimulus())
    return made


def test_design_c_in_verilog_and_in_python_agree_on_counts(ours):
    stimuli = drawn(2, 24, 450_000)
    assert ours.note == ""
    with PythonClass(EXAMPLES / "design_c.py", "DesignC") as python:
        for stimulus, module, theirs in zip(stimuli, ours.play(stimuli), python.play(stimuli), strict=True):
            assert judge(stimulus, module, Contract.of(Design.C)).right
            assert module.completed.final == theirs.completed.final
            assert module.edges.counts() == theirs.edges.counts()


@needs_cocotb
def test_both_benches_record_the_same(tmp_path, ours):
    # nothing comes at the instant of a tick: there cocotb leaves open what is seen first
    streams = [
        "00 1.001us:+ 1.507us:r1 1.903us:+ 9us:end",
        "11 1.001us:- 1.5071us:r-2 2.0015us:- 2.503us:- 2.607us:+ 20us:end",
        "01 3.0009us:r3 3.109us:- 5.001us:r-1 7.113us:+ 30us:end",
    ]
    source, toml = EXAMPLES / "design_c.v", EXAMPLES / "design_c.toml"
    (seen,) = answered(tmp_path, source, "design_c", toml, period_ns=20, streams=streams)
    responses = ours.play([Stream.read(text).stimulus() for text in streams])
    assert [one[:5] for one in seen] == [
        [
            response.edges.initial,
            response.edges.times_ps.tolist(),
            response.edges.levels.tolist(),
            response.completed.times_ps.tolist(),
            response.completed.totals.tolist(),
        ]
        for response in responses
    ]
    assert [one[5] for one in seen] == [None] * 3
    assert [one[4] for one in seen] == [[1], [-1, -2], [1, 2, 3, 2, 1, 0, -1]]


@needs_cocotb
def test_the_planted_bug_fails_the_test(tmp_path):
    source, toml = EXAMPLES / "design_c_bug.v", EXAMPLES / "design_c_bug.toml"
    (error,) = answered(tmp_path, source, "design_c_bug", toml, period_ns=50)
    assert error.startswith("AssertionError: ")
    stream = error.partition("the stream: ")[2]
    (seen,) = answered(tmp_path, source, "design_c_bug", toml, period_ns=50, streams=[stream])
    initial, times_ps, levels, _, totals, _ = seen[0]
    counts = EdgeStream(times_ps, levels, initial=initial).counts()
    wrong = counts.net != int(Stream.read(stream).moves.sum()) + 2 * [0, *totals][-1]
    assert wrong or counts.illegal


@needs_cocotb
def test_what_a_bench_needs_and_outputs_that_are_unknown(tmp_path):
    source = tmp_path / "wires.v"
    text = WIRES.replace("qb = b", "qb = asked == 1 ? 1'bx : b")
    source.write_text(text.replace("input wire a,", "input wire a, input wire rst,"))
    files = []
    for reset in ("", "rts", "rst"):
        files.append(tmp_path / f"pins{len(files)}.toml")
        files[-1].write_text(pins_text("wires", reset=reset))
    stream = "00 1.001us:r1 9us:end"
    without, wrong, played = answered(tmp_path, source, "wires", *files, period_ns=20, streams=[stream])
    assert re.fullmatch(r"ArgumentError: .*reset is missing; .* power_up=.*", without)
    assert re.fullmatch(r"ArgumentError: .*reset: 'rts' .* a port of wires; did you mean 'rst'\?", wrong)
    assert played[0][5] == [1_001_000, "qb: unknown (X) or floating (Z)"]


@needs_cocotb
def test_ten_lines_of_the_documentation(tmp_path):
    page = (ROOT / "docs" / "how-to-verilog.md").read_text(encoding="utf-8")
    code = next(block for block in re.findall(r"```python\n(.*?)```", page, re.DOTALL) if "@cocotb.test" in block)
    assert code.count("\n") <= 16
    # a fifth of the ticks, and turns of one depth, so that it takes seconds
    slower = code.replace('Clock(dut.clk, 20, "ns")', 'Clock(dut.clk, 100, "ns")')
    assert slower != code
    fewer = "import rtec.cocotb as bench\n\nbench._SHARP = bench._SHARP[1:]\n"
    (tmp_path / "test_design_c.py").write_text(fewer + slower)
    shutil.copy(EXAMPLES / "design_c.toml", tmp_path)
    said = simulate(tmp_path, EXAMPLES / "design_c.v", "design_c", "test_design_c")
    assert "TESTS=1 PASS=1 FAIL=0" in said, said


def printed(code: str, *folders: Path) -> str:
    """Return what a Python of its own prints."""
    path = os.pathsep.join(map(str, [*folders, ROOT]))
    command = [sys.executable, "-c", code]
    return subprocess.run(
        command, env=os.environ | {"PYTHONPATH": path}, stdout=subprocess.PIPE, text=True, check=True
    ).stdout


def test_without_cocotb_it_says_what_to_install(tmp_path):
    (tmp_path / "cocotb.py").write_text("raise ImportError('none here')\n")
    code = (
        "import rtec.cocotb\nfrom rtec.errors import RtecError\n"
        "try:\n    rtec.cocotb.Driver(None, None)\nexcept RtecError as error:\n    print(error)\n"
    )
    said = printed(code, tmp_path)
    assert said == 'rtec.cocotb needs cocotb 2 or newer (none here): pip install "rtec[cocotb]"\n'


def test_nothing_else_of_rtec_imports_cocotb():
    code = "import sys, rtec.verify.contract.verilog, rtec.cli.check\nprint('cocotb' in sys.modules)"
    assert printed(code) == "False\n"
