"""VCD files as other programs read them."""

import shutil
import subprocess

import numpy as np
import pytest
from signal_oracle import read_vcd

from rtec.signal import EdgeStream, write_vcd


def needs(*programs):
    missing = [program for program in programs if shutil.which(program) is None]
    return pytest.mark.skipif(bool(missing), reason=f"not on the PATH: {', '.join(missing)}")


def wandering(edges, seed):
    rng = np.random.default_rng(seed)
    times = 1000 * np.cumsum(rng.integers(1, 40, edges))
    states = np.cumsum(rng.choice([1, -1, 2], edges, p=[0.6, 0.3, 0.1])) % 4
    return EdgeStream.from_states(times, states, 0)


def run(*words):
    return subprocess.run(words, check=True, capture_output=True, timeout=60)


@needs("vcd2fst", "fst2vcd")
def test_gtkwaves_converter_reads_the_same_waves(tmp_path):
    path = tmp_path / "f.vcd"
    waveforms = {"encoder": wandering(500, 1), "controller": wandering(400, 2)}
    write_vcd(path, waveforms, end_ps=30_000_000, timescale="1 ns")
    run("vcd2fst", str(path), str(tmp_path / "f.fst"))
    theirs = read_vcd(run("fst2vcd", str(tmp_path / "f.fst")).stdout)
    ours = read_vcd(path.read_bytes())
    assert theirs.timescale.replace(" ", "") == "1ns"
    assert (theirs.widths, theirs.initial) == (ours.widths, ours.initial)
    assert theirs.changes == ours.changes
    assert theirs.end == ours.end == 30_000


@needs("sigrok-cli")
def test_sigrok_samples_the_same_levels(tmp_path):
    path = tmp_path / "f.vcd"
    encoder = wandering(300, 3)
    samples = 8_000
    write_vcd(path, {"encoder": encoder}, end_ps=1000 * samples, timescale="1 ns")
    lines = run("sigrok-cli", "-I", "vcd", "-i", str(path), "-O", "csv").stdout.decode().splitlines()
    assert any(line.startswith("; Channels (2/2): A, B") for line in lines)
    rows = np.array([line.split(",") for line in lines if line[:2] in ("0,", "1,")], dtype=int)
    moments = 1000 * np.arange(samples)
    ab = encoder.levels_at(moments)
    assert rows.shape == (samples, 2)
    assert np.array_equal(rows, np.column_stack([ab & 1, ab >> 1]))
