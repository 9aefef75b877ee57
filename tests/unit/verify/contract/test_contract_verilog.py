"""The Verilog interface: both simulators against each other, exact ticks, and everything that can be wrong."""

import contextlib
import functools
import os
import shutil
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from verilog_modules import MODES, PORTS, SAMPLER, WIRES, pins_text

import rtec.verify.contract._icarus as icarus
import rtec.verify.contract._verilator as verilator
from rtec.errors import ArgumentError, FileFormatError, OutputError, RtecError
from rtec.injector import Design, Stimulus, Totals
from rtec.signal import EdgeStream
from rtec.verify.contract.contract import Contract
from rtec.verify.contract.judge import judge
from rtec.verify.contract.python_class import PythonClass
from rtec.verify.contract.streams import Stream
from rtec.verify.contract.verilog import VerilogAlgorithm, clock_of
from rtec.verify.contract.verilog_pins import Pins

EXAMPLES = Path(icarus.__file__).parents[2] / "examples"
NEEDS = {
    "verilator": pytest.mark.skipif(
        not all(map(shutil.which, ("verilator", "make", "g++"))), reason="verilator, make or g++ is not installed"
    ),
    "icarus": pytest.mark.skipif(
        shutil.which("iverilog") is None, reason="Icarus Verilog (iverilog) is not installed"
    ),
}
BOTH = [pytest.param(name, marks=mark) for name, mark in NEEDS.items()]
C = Contract.of(Design.C)


def written(folder: Path, text: str, *, name: str = "module.v", **pins: str) -> tuple[Path, Path]:
    """Write a module and its pins file."""
    file = folder / name
    file.write_text(text)
    top = text.partition("module ")[2].partition("(")[0].partition("#")[0].strip()
    (folder / "pins.toml").write_text(pins_text(top, **pins))
    return file, folder / "pins.toml"


def opened(folder: Path, text: str, simulator: str, *, clock: str = "50MHz", name: str = "module.v", **pins: str):
    """Build a module."""
    file, toml = written(folder, text, name=name, **pins)
    return VerilogAlgorithm(file, pins=Pins.read(toml), clock_ps=clock_of(clock), simulator=simulator)


def stream(text: str) -> Stimulus:
    """Return what goes in."""
    return Stream.read(text).stimulus()


def rows(response):
    """Return all of a response as plain numbers."""
    edges, done = response.edges, response.completed
    return (
        edges.initial, edges.times_ps.tolist(), edges.levels.tolist(), done.times_ps.tolist(), done.totals.tolist(),
        response.refusals, response.broken,
    )  # fmt: skip


@contextlib.contextmanager
def once_each(build):
    """Return what builds a module for a simulator where it is asked for first, and closes all in the end."""
    with contextlib.ExitStack() as stack:
        yield functools.cache(lambda simulator: stack.enter_context(build(simulator)))


@pytest.fixture(scope="module")
def example():
    """Return the shipped Design C."""
    pins = Pins.read(EXAMPLES / "design_c.toml")
    clock_ps = clock_of("50MHz")
    with once_each(
        lambda name: VerilogAlgorithm(EXAMPLES / "design_c.v", pins=pins, clock_ps=clock_ps, simulator=name)
    ) as by:
        yield by


@pytest.fixture(scope="module")
def modes(tmp_path_factory):
    """Return the module in which what is asked for goes wrong."""
    with once_each(lambda name: opened(tmp_path_factory.mktemp(name), MODES, name, refused="no")) as by:
        yield by


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


# --- the same from both, and the right thing ---
@NEEDS["verilator"]
@NEEDS["icarus"]
def test_both_simulators_give_the_same(example):
    stimuli = drawn(1, 24)
    assert [example(simulator).note for simulator in NEEDS] == ["", ""]
    ours, theirs = (example(simulator).play(stimuli) for simulator in NEEDS)
    assert [rows(one) for one in ours] == [rows(other) for other in theirs]
    assert sum(len(response.edges) for response in ours) > 300
    assert sum(len(response.completed) for response in ours) > 60


@pytest.mark.parametrize("simulator", BOTH)
def test_design_c_in_verilog_and_in_python_agree_on_counts(example, simulator):
    stimuli = drawn(2, 24, 450_000)
    with PythonClass(EXAMPLES / "design_c.py", "DesignC") as python:
        pairs = zip(stimuli, example(simulator).play(stimuli), python.play(stimuli), strict=True)
        for stimulus, ours, theirs in pairs:
            assert judge(stimulus, ours, C).right
            assert ours.completed.final == theirs.completed.final
            assert ours.edges.counts() == theirs.edges.counts()


# --- ticks ---
@pytest.fixture(scope="module")
def sampler(tmp_path_factory):
    """Return the module that counts ticks, at 33.333 MHz."""
    with once_each(lambda name: opened(tmp_path_factory.mktemp(name), SAMPLER, name, clock="33.333 MHz")) as by:
        yield by


def tick_at(k: int, period: Fraction) -> int:
    """Return when tick k is, in whole picoseconds: not before its exact time."""
    return -(-k * period.numerator // period.denominator)


@pytest.mark.parametrize("simulator", BOTH)
def test_ticks_stay_exact_over_many(sampler, simulator):
    period = Fraction(10**12, 33_333_000)
    until = tick_at(200_100, period)
    stimulus = Stimulus(
        edges=EdgeStream.from_states([], [], 0), requests=Totals([1], [1]), until_ps=until
    )  # fmt: skip
    done = sampler(simulator).play([stimulus])[0].completed
    # asked for between ticks 0 and 1: tick 1 takes 0, and begins to count 4096 at a time
    assert done.times_ps.tolist() == [tick_at(1 + 4096 * k, period) for k in range(200_099 // 4096 + 1)]
    assert done.totals.tolist() == list(range(1, len(done) + 1))
    assert done.times_ps[-1] - int((1 + 4096 * 48) * period) in (0, 1)


@pytest.mark.parametrize("simulator", BOTH)
def test_a_level_is_taken_over_by_the_first_tick_behind_it(sampler, simulator):
    period = Fraction(10**12, 33_333_000)
    rng = np.random.default_rng(7)
    # far apart and close, on ticks, a picosecond before them and behind them, and on the falls of the clock between
    ticks = np.cumsum(rng.choice([1, 2, 3, 9, 40, 12_345], 300)) + 1
    times = sorted({tick_at(int(k), period) + int(rng.choice([-1, 0, 1, 9_000, 15_000])) for k in ticks})
    edges = EdgeStream.from_states(times, np.arange(1, len(times) + 1) % 4, 0)
    stimulus = Stimulus(edges=edges, requests=Totals(), until_ps=times[-1] + 100_000)
    seen = sampler(simulator).play([stimulus])[0].edges
    # what changes with a tick is seen by the next one: the first tick at which the change has been there
    expected = {}
    for t, level in zip(times, edges.levels.tolist(), strict=True):
        expected[
            tick_at(int(t / period) + 1 if tick_at(int(t / period) + 1, period) > t else int(t / period) + 2, period)
        ] = level
    changes = [(t, level) for t, level in expected.items()]
    kept = [pair for k, pair in enumerate(changes) if pair[1] != (changes[k - 1][1] if k else 0)]
    assert list(zip(seen.times_ps.tolist(), seen.levels.tolist(), strict=True)) == kept


@pytest.mark.parametrize(
    ("text", "period"),
    [
        ("50MHz", (20_000, 1)),
        ("3 MHz", (1_000_000, 3)),
        ("33.333 MHz", (1_000_000_000, 33_333)),
        ("1 GHz", (1000, 1)),
    ],
)
def test_clock_is_a_ratio(text, period):
    assert clock_of(text) == period


@pytest.mark.parametrize("text", ["0 Hz", "0MHz", "999 Hz", "2 GHz", "-5 MHz", "1.0000000000000000000001 MHz"])
def test_clock_out_of_range(text):
    with pytest.raises(ArgumentError, match=r"^clock: .* is not valid; use .*Hz"):
        clock_of(text)


@pytest.mark.parametrize("text", ["50", "50 mm", "fast", "", "nan MHz", "inf Hz"])
def test_clock_that_is_no_frequency(text):
    with pytest.raises(ArgumentError, match="clock"):
        clock_of(text)


# --- designs at rest: ticks are left out only where nothing can happen in them ---
@NEEDS["icarus"]
@pytest.mark.parametrize(
    "behaviour",
    [
        "always begin repeat (500) @(posedge clk); done = done + 1; end",
        "always @(posedge clk) begin @(negedge clk); repeat (499) @(posedge clk); done = done + 1; end",
        "always @(posedge clk) if (asked != seen) begin seen <= asked; done <= #10_000_000 asked; end",
        "always @(posedge clk) if (asked == 1 && $time > 64'd12_000_000) done <= 1;",
        "always @(posedge clk) if (asked == 1 && $random % 512 == 0) done <= done + 1;",
        "wire late; assign #(10_000_000) late = asked == 1; always @(posedge clk) done <= late === 1;",
        "reg [9:0] n = 0; always @(posedge clk) begin n <= n + 1; if (n == 0) done <= done + 1; end",
        "real r = 0; always @(posedge clk) begin r = r + 1; if (r > 600) done <= 1; end",
    ],
)
def test_what_is_hidden_from_the_values_is_played(tmp_path, behaviour):
    """With ticks left out, none of these would ever change anything behind the first microsecond."""
    text = (
        "`timescale 1ps/1ps\n"
        f"module hidden({PORTS}, output wire qa, output wire qb, output reg signed [15:0] done);\n"
        f"assign qa = a, qb = b; reg [15:0] seen = 0; initial done = 0;\n{behaviour}\nendmodule\n"
    )
    with opened(tmp_path, text, "icarus") as algorithm:
        assert ("every tick" in algorithm.note) == ("reg [9:0] n" not in behaviour)
        done = algorithm.play([stream("00 1us:r1 30us:end")])[0].completed
    assert len(done)
    assert done.times_ps[-1] > 5_000_000


@NEEDS["verilator"]
def test_a_design_that_reads_the_time_is_played_tick_by_tick(modes):
    assert "every tick" in modes("verilator").note
    done = modes("verilator").play([stream("00 1us:r5 99us:end")])[0].completed
    assert done.times_ps.tolist() == [90_020_000]


# --- what goes wrong while it runs ---
@pytest.mark.parametrize("simulator", BOTH)
def test_finish_is_a_break(modes, simulator):
    broken = modes(simulator).play([stream("00 1us:r1 9us:end")])[0].broken
    assert broken.reason == "the design called $finish or $stop"
    assert broken.time_ps == 1_020_000


@pytest.mark.parametrize("simulator", BOTH)
def test_endless_loop_and_what_comes_behind_it(modes, simulator, monkeypatch):
    monkeypatch.setattr(verilator, "SILENT_S", 1.0)
    monkeypatch.setattr(icarus, "SILENT_S", 1.0)
    looping, quiet = modes(simulator).play([stream("00 1us:r2 9us:end"), stream("00 1us:+ 9us:end")])
    assert looping.broken.reason.startswith("it never comes back")
    assert looping.broken.time_ps <= 1_020_000
    assert quiet.broken is None
    assert quiet.edges.times_ps.tolist() == [1_000_000]


@pytest.mark.parametrize("simulator", BOTH)
def test_logic_that_does_not_settle(modes, simulator, monkeypatch):
    monkeypatch.setattr(icarus, "SILENT_S", 1.0)
    broken = modes(simulator).play([stream("00 1us:r3 9us:end")])[0].broken
    assert ("does not settle" if simulator == "verilator" else "never comes back") in broken.reason
    assert broken.time_ps <= 1_000_000


@NEEDS["verilator"]
def test_outputs_that_depend_on_what_nothing_sets(modes):
    broken = modes("verilator").play([stream("00 1us:r4 9us:end")])[0].broken
    assert broken.time_ps == 1_020_000
    assert broken.reason.startswith("outputs depend on initial values of registers that nothing sets: done is 0 or 1")


@NEEDS["icarus"]
def test_unknown_output(modes):
    broken = modes("icarus").play([stream("00 1us:r4 9us:end")])[0].broken
    assert (broken.time_ps, broken.reason) == (1_020_000, "done: unknown (X) or floating (Z)")


@pytest.mark.parametrize("simulator", BOTH)
def test_a_refusal_has_its_code_and_time(modes, simulator):
    assert modes(simulator).play([stream("00 1us:r7 9us:end")])[0].refusals == ((1_000_000, "code 9"),)


@pytest.mark.parametrize("simulator", BOTH)
def test_total_that_the_bus_cannot_hold(modes, simulator):
    with pytest.raises(ArgumentError, match=r"pins.toml: requested: a total of 32768 .* from -32768 to 32767"):
        modes(simulator).play([stream("00 1us:r32768 9us:end")])
    assert modes(simulator).play([stream("00 1us:r-32768 9us:end")])[0].broken is None


# --- files that do not build ---
@pytest.mark.parametrize("simulator", BOTH)
def test_first_error_has_file_and_line(tmp_path, simulator):
    text = WIRES.replace("assign qb = b;", "assgn qb = b;")
    with pytest.raises(FileFormatError, match=r"module\.v, line 4: .*; use Verilog that (Verilator|Icarus)"):
        opened(tmp_path, text, simulator)


@pytest.mark.parametrize("simulator", BOTH)
def test_module_name_that_is_not_there(tmp_path, simulator):
    file, toml = written(tmp_path, WIRES)
    toml.write_text(pins_text("wirse"))
    with pytest.raises(ArgumentError, match=r"pins\.toml: top: 'wirse' .* wires; did you mean 'wires'\?"):
        VerilogAlgorithm(file, pins=Pins.read(toml), clock_ps=(20_000, 1), simulator=simulator)


@pytest.mark.parametrize("simulator", BOTH)
@pytest.mark.parametrize("text", ["", "// nothing\n", "\x00\x01\xff"])
def test_file_without_a_module(tmp_path, simulator, text):
    file, toml = written(tmp_path, WIRES)
    file.write_bytes(text.encode("latin-1"))
    with pytest.raises(RtecError, match=r"module\.v|a module"):
        VerilogAlgorithm(file, pins=Pins.read(toml), clock_ps=(20_000, 1), simulator=simulator)


@NEEDS["verilator"]
def test_delays_are_refused_with_their_line(tmp_path):
    with pytest.raises(FileFormatError, match=r"module\.v, line 4: a delay, .*--simulator icarus"):
        opened(tmp_path, WIRES.replace("assign qb = b;", "assign #5 qb = b;"), "verilator")


# --- forms of files ---
@pytest.mark.parametrize("simulator", BOTH)
def test_systemverilog_with_parameters_includes_and_a_module_beside_it(tmp_path, simulator):
    folder = tmp_path / "a folder's name"
    folder.mkdir()
    (folder / "widths.svh").write_text("localparam int WIDTH = 12;\n")
    (folder / "stage.sv").write_text(
        "module stage(input logic clk, rst_n, d, output logic q);\n"
        "always_ff @(posedge clk) if (!rst_n) q <= d; else q <= d;\nendmodule\n"
    )
    text = (
        '`include "widths.svh"\n'
        "module taps #(parameter int STAGES = 3)(input logic clk, rst_n, a, b,\n"
        "    input logic signed [WIDTH-1:0] asked, output logic qa, qb, output logic signed [WIDTH-1:0] done);\n"
        "logic [STAGES:0] pa, pb;\nassign pa[0] = a, pb[0] = b, qa = pa[STAGES], qb = pb[STAGES];\n"
        "for (genvar i = 0; i < STAGES; i++) begin : line\n"
        "    stage sa(.clk, .rst_n, .d(pa[i]), .q(pa[i+1]));\n    stage sb(.clk, .rst_n, .d(pb[i]), .q(pb[i+1]));\n"
        "end\n"
        "always_ff @(posedge clk or negedge rst_n) if (!rst_n) done <= 0; else done <= asked;\nendmodule\n"
    )
    with opened(folder, text, simulator, name="my taps.sv", reset="rst_n", reset_active="low") as algorithm:
        response = algorithm.play([stream("10 1us:+ 1.5us:r-2 300us:- 301us:end")])[0]
    # three ticks of 20 ns: a change with a tick is taken by the next one
    assert response.broken is None
    assert response.edges.times_ps.tolist() == [1_060_000, 300_060_000]
    assert (response.completed.times_ps.tolist(), response.completed.totals.tolist()) == ([1_520_000], [-2])


# --- the machine around it ---
def test_without_a_simulator_the_package_is_named(tmp_path, monkeypatch):
    file, toml = written(tmp_path, WIRES)
    monkeypatch.setenv("PATH", str(tmp_path))
    for simulator, package in (
        (None, r"verilator \(or iverilog\)"),
        ("verilator", "verilator"),
        ("icarus", "iverilog"),
    ):
        with pytest.raises(RtecError, match=rf"no simulator .*: apt install {package}$"):
            VerilogAlgorithm(file, pins=Pins.read(toml), clock_ps=(20_000, 1), simulator=simulator)


@NEEDS["verilator"]
def test_without_a_compiler_the_package_is_named(tmp_path, monkeypatch):
    file, toml = written(tmp_path, WIRES)
    programs = tmp_path / "programs"
    programs.mkdir()
    (programs / "verilator").symlink_to(str(shutil.which("verilator")))
    monkeypatch.setenv("PATH", str(programs))
    with pytest.raises(RtecError, match=r"needs make and g\+\+.*apt install g\+\+ make"):
        VerilogAlgorithm(file, pins=Pins.read(toml), clock_ps=(20_000, 1), simulator="verilator")


@NEEDS["icarus"]
def test_no_temporary_folder(tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "nowhere"))
    with pytest.raises(OutputError, match=r"no temporary folder: .*TMPDIR"):
        opened(tmp_path, WIRES, "icarus")


@NEEDS["icarus"]
def test_a_full_disk_is_no_verdict(tmp_path, monkeypatch):
    """A compiler that cannot write all it has to need not say so: here it writes half, and ends with 0."""
    programs = tmp_path / "programs"
    programs.mkdir()
    real = shutil.which("iverilog")
    half = programs / "iverilog"
    half.write_text(
        f'#!/bin/sh\n{real} "$@"\nfor last in "$@"; do case "$last" in *bench.vvp) cut=$last;; esac; done\n'
        '[ -z "$cut" ] || { head -c 9000 "$cut" > "$cut.half"; mv "$cut.half" "$cut"; }\n'
    )
    half.chmod(0o755)
    monkeypatch.setenv("PATH", f"{programs}{os.pathsep}{os.environ['PATH']}")
    with (
        opened(tmp_path, WIRES, "icarus") as algorithm,
        pytest.raises(RtecError, match=r"vvp cannot run what iverilog has built: .*bench\.vvp"),
    ):
        algorithm.play([stream("00 1us:+ 9us:end")])


@NEEDS["verilator"]
def test_a_temporary_folder_with_a_space(tmp_path, monkeypatch):
    folder = tmp_path / "a b"
    folder.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(folder))
    with pytest.raises(RtecError, match=r"cannot build in .*a b, a name with a space; TMPDIR"):
        opened(tmp_path, WIRES, "verilator")
    assert list(folder.iterdir()) == []


@NEEDS["icarus"]
def test_nothing_is_left(tmp_path, monkeypatch):
    made = tmp_path / "made"
    made.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(made))
    with opened(tmp_path, WIRES, "icarus") as algorithm:
        algorithm.play([stream("00 1us:+ 9us:end")])
        assert len(list(made.iterdir())) == 1
    assert list(made.iterdir()) == []
    with pytest.raises(ArgumentError):
        opened(tmp_path, WIRES, "icarus", a_in="nothing")
    assert list(made.iterdir()) == []
