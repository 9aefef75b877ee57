"""The Verilog interface: exact ticks, and everything that can be wrong."""

import shutil
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from verilog_modules import MODES, SAMPLER, WIRES, pins_text

from rtec.errors import ArgumentError, FileFormatError, OutputError, RtecError
from rtec.injector import Stimulus, Totals
from rtec.signal import EdgeStream
from rtec.verify.contract import verilog
from rtec.verify.contract.streams import Stream
from rtec.verify.contract.verilog import VerilogAlgorithm, clock_of
from rtec.verify.contract.verilog_pins import Pins

pytestmark = pytest.mark.skipif(
    not all(map(shutil.which, ("verilator", "make", "g++"))), reason="verilator, make or g++ is not installed"
)


def written(folder: Path, text: str, *, name: str = "module.v", **pins: str) -> tuple[Path, Path]:
    """Write a module and its pins file."""
    file = folder / name
    file.write_text(text)
    top = text.partition("module ")[2].partition("(")[0].partition("#")[0].strip()
    (folder / "pins.toml").write_text(pins_text(top, **pins))
    return file, folder / "pins.toml"


def opened(folder: Path, text: str, *, clock: str = "50MHz", name: str = "module.v", **pins: str):
    """Build a module."""
    file, toml = written(folder, text, name=name, **pins)
    return VerilogAlgorithm(file, pins=Pins.read(toml), clock_ps=clock_of(clock))


def stream(text: str) -> Stimulus:
    """Return what goes in."""
    return Stream.read(text).stimulus()


@pytest.fixture(scope="module")
def modes(tmp_path_factory):
    """Return the module in which what is asked for goes wrong."""
    with opened(tmp_path_factory.mktemp("modes"), MODES, refused="no") as module:
        yield module


# --- ticks ---
@pytest.fixture(scope="module")
def sampler(tmp_path_factory):
    """Return the module that counts ticks, at 33.333 MHz."""
    with opened(tmp_path_factory.mktemp("sampler"), SAMPLER, clock="33.333 MHz") as module:
        yield module


def tick_at(k: int, period: Fraction) -> int:
    """Return when tick k is, in whole picoseconds: not before its exact time."""
    return -(-k * period.numerator // period.denominator)


def test_ticks_stay_exact_over_many(sampler):
    period = Fraction(10**12, 33_333_000)
    until = tick_at(200_100, period)
    stimulus = Stimulus(
        edges=EdgeStream.from_states([], [], 0), requests=Totals([1], [1]), until_ps=until
    )  # fmt: skip
    done = sampler.play([stimulus])[0].completed
    # asked for between ticks 0 and 1: tick 1 takes 0, and begins to count 4096 at a time
    assert done.times_ps.tolist() == [tick_at(1 + 4096 * k, period) for k in range(200_099 // 4096 + 1)]
    assert done.totals.tolist() == list(range(1, len(done) + 1))
    assert done.times_ps[-1] - int((1 + 4096 * 48) * period) in (0, 1)


def test_a_level_is_taken_over_by_the_first_tick_behind_it(sampler):
    period = Fraction(10**12, 33_333_000)
    rng = np.random.default_rng(7)
    # far apart and close, on ticks, a picosecond before them and behind them, and on the falls of the clock between
    ticks = np.cumsum(rng.choice([1, 2, 3, 9, 40, 12_345], 300)) + 1
    times = sorted({tick_at(int(k), period) + int(rng.choice([-1, 0, 1, 9_000, 15_000])) for k in ticks})
    edges = EdgeStream.from_states(times, np.arange(1, len(times) + 1) % 4, 0)
    stimulus = Stimulus(edges=edges, requests=Totals(), until_ps=times[-1] + 100_000)
    seen = sampler.play([stimulus])[0].edges
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
def test_a_design_that_reads_the_time_is_played_tick_by_tick(modes):
    assert "every tick" in modes.note
    done = modes.play([stream("00 1us:r5 99us:end")])[0].completed
    assert done.times_ps.tolist() == [90_020_000]


# --- what goes wrong while it runs ---
def test_finish_is_a_break(modes):
    broken = modes.play([stream("00 1us:r1 9us:end")])[0].broken
    assert broken.reason == "the design called $finish or $stop"
    assert broken.time_ps == 1_020_000


def test_endless_loop_and_what_comes_behind_it(modes, monkeypatch):
    monkeypatch.setattr(verilog, "SILENT_S", 1.0)
    looping, quiet = modes.play([stream("00 1us:r2 9us:end"), stream("00 1us:+ 9us:end")])
    assert looping.broken.reason.startswith("it never comes back")
    assert looping.broken.time_ps <= 1_020_000
    assert quiet.broken is None
    assert quiet.edges.times_ps.tolist() == [1_000_000]


def test_logic_that_does_not_settle(modes):
    broken = modes.play([stream("00 1us:r3 9us:end")])[0].broken
    assert "does not settle" in broken.reason
    assert broken.time_ps <= 1_000_000


def test_outputs_that_depend_on_what_nothing_sets(modes):
    broken = modes.play([stream("00 1us:r4 9us:end")])[0].broken
    assert broken.time_ps == 1_020_000
    assert broken.reason.startswith("outputs depend on initial values of registers that nothing sets: done is 0 or 1")


def test_a_refusal_has_its_code_and_time(modes):
    assert modes.play([stream("00 1us:r7 9us:end")])[0].refusals == ((1_000_000, "code 9"),)


def test_total_that_the_bus_cannot_hold(modes):
    with pytest.raises(ArgumentError, match=r"pins.toml: requested: a total of 32768 .* from -32768 to 32767"):
        modes.play([stream("00 1us:r32768 9us:end")])
    assert modes.play([stream("00 1us:r-32768 9us:end")])[0].broken is None


# --- files that do not build ---
def test_first_error_has_file_and_line(tmp_path):
    text = WIRES.replace("assign qb = b;", "assgn qb = b;")
    with pytest.raises(FileFormatError, match=r"module\.v, line 4: .*; use Verilog that Verilator"):
        opened(tmp_path, text)


def test_module_name_that_is_not_there(tmp_path):
    file, toml = written(tmp_path, WIRES)
    toml.write_text(pins_text("wirse"))
    with pytest.raises(ArgumentError, match=r"pins\.toml: top: 'wirse' .* wires; did you mean 'wires'\?"):
        VerilogAlgorithm(file, pins=Pins.read(toml), clock_ps=(20_000, 1))


@pytest.mark.parametrize("text", ["", "// nothing\n", "\x00\x01\xff"])
def test_file_without_a_module(tmp_path, text):
    file, toml = written(tmp_path, WIRES)
    file.write_bytes(text.encode("latin-1"))
    with pytest.raises(RtecError, match=r"module\.v|a module"):
        VerilogAlgorithm(file, pins=Pins.read(toml), clock_ps=(20_000, 1))


def test_delays_are_refused_with_their_line(tmp_path):
    with pytest.raises(FileFormatError, match=r"module\.v, line 4: a delay: "):
        opened(tmp_path, WIRES.replace("assign qb = b;", "assign #5 qb = b;"))


# --- forms of files ---
def test_systemverilog_with_parameters_includes_and_a_module_beside_it(tmp_path):
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
    with opened(folder, text, name="my taps.sv", reset="rst_n", reset_active="low") as algorithm:
        response = algorithm.play([stream("10 1us:+ 1.5us:r-2 300us:- 301us:end")])[0]
    # three ticks of 20 ns: a change with a tick is taken by the next one
    assert response.broken is None
    assert response.edges.times_ps.tolist() == [1_060_000, 300_060_000]
    assert (response.completed.times_ps.tolist(), response.completed.totals.tolist()) == ([1_520_000], [-2])


# --- the machine around it ---
@pytest.mark.parametrize("there", [(), ("verilator",)])
def test_the_packages_that_are_missing_are_named(tmp_path, monkeypatch, there):
    file, toml = written(tmp_path, WIRES)
    for program in there:
        (tmp_path / program).symlink_to(str(shutil.which(program)))
    monkeypatch.setenv("PATH", str(tmp_path))
    missing = "make g\\+\\+" if there else "verilator make g\\+\\+"
    with pytest.raises(RtecError, match=rf"needs {' and '.join(missing.split())}, .*apt install {missing}$"):
        VerilogAlgorithm(file, pins=Pins.read(toml), clock_ps=(20_000, 1))


def test_no_temporary_folder(tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "nowhere"))
    with pytest.raises(OutputError, match=r"no temporary folder: .*TMPDIR"):
        opened(tmp_path, WIRES)


def test_a_temporary_folder_with_a_space(tmp_path, monkeypatch):
    folder = tmp_path / "a b"
    folder.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(folder))
    with pytest.raises(RtecError, match=r"cannot build in .*a b, a name with a space; TMPDIR"):
        opened(tmp_path, WIRES)
    assert list(folder.iterdir()) == []


def test_nothing_is_left(tmp_path, monkeypatch):
    made = tmp_path / "made"
    made.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(made))
    with pytest.raises(ArgumentError):
        opened(tmp_path, WIRES, a_in="nothing")
    assert list(made.iterdir()) == []
