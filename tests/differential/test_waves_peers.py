"""Waveform files of rtec simulate and rtec check as sigrok (PulseView) and GTKWave's converter read them."""

import re
import shutil
import subprocess

import numpy as np
import pytest
from signal_oracle import read_vcd

from rtec.cli import main


def needs(*programs):
    missing = [program for program in programs if shutil.which(program) is None]
    return pytest.mark.skipif(bool(missing), reason=f"not on the PATH: {', '.join(missing)}")


def run(*words):
    return subprocess.run(words, check=True, capture_output=True, timeout=60).stdout.decode()


def simulated(tmp_path, design, **changes):
    file = tmp_path / "run.vcd"
    options = {"frequency": "500kHz", "cycles": "50", "corrections": "9"} | changes
    words = [word for key, value in options.items() for word in (f"--{key}", value)]
    assert main(["simulate", "--design", design, *words, "--vcd", str(file), "--json"]) in (0, 1)
    return file


def sampled(file, channels=None):
    """Channels and samples as sigrok has them."""
    kind = "vcd" if channels is None else f"vcd:numchannels={channels}"
    lines = run("sigrok-cli", "-I", kind, "-i", str(file), "-O", "csv").splitlines()
    head = next(line for line in lines if line.startswith("; Channels"))
    names = head.split("): ", 1)[1].split(", ")
    rows = np.array([[int(cell) for cell in line.split(",")] for line in lines if re.match("[01],", line)], np.uint8)
    return names, rows


def value_at(changes, initial, end):
    """Values of a signal at each tick, from its changes."""
    values = np.full(end, initial, np.int64)
    for t, value in changes:
        values[t:] = value
    return values


@needs("sigrok-cli")
@pytest.mark.parametrize("design", ["original", "a", "b", "c"])
def test_sigrok_tells_all_channels_apart_and_reads_what_was_written(tmp_path, capsys, design):
    file = simulated(tmp_path, design)
    names, rows = sampled(file)
    waves = read_vcd(file.read_bytes())
    assert len(set(names)) == len(names) == sum(waves.widths.values())
    assert names[:6] == ["enc_A", "enc_B", "ctl_A", "ctl_B", "inserting", "illegal"]
    assert rows.shape == (waves.end, len(names))
    for full, width in waves.widths.items():
        short = full.split(".")[1]
        theirs = sum(
            rows[:, names.index(f"{short}[{bit}]" if width > 1 else short)].astype(np.int64) << bit
            for bit in range(width)
        )
        assert np.array_equal(theirs, value_at(waves.changes[full], waves.initial[full], waves.end)), full


@needs("sigrok-cli")
def test_the_lines_alone_are_the_first_channels(tmp_path, capsys):
    names, _ = sampled(simulated(tmp_path, "c"), channels=6)
    assert names == ["enc_A", "enc_B", "ctl_A", "ctl_B", "inserting", "illegal"]


@needs("sigrok-cli")
def test_sigrok_reads_a_check(tmp_path, capsys):
    file = tmp_path / "check.vcd"
    stream = "00 1us:+ 1.5us:r1 1.62us:- 3us:end"
    main(["check", "c", "--stream", stream, "--vcd", str(file), "--json"])
    names, rows = sampled(file)
    waves = read_vcd(file.read_bytes())
    assert (len(set(names)), rows.shape[0]) == (len(names), waves.end)
    assert "failed" in names
    assert np.array_equal(rows[:, names.index("ctl_A")], value_at(waves.changes["controller.ctl_A"], 0, waves.end))


@needs("vcd2fst", "fst2vcd")
@pytest.mark.parametrize("design", ["original", "a", "b", "c"])
def test_gtkwaves_converter_reads_the_same_waves(tmp_path, capsys, design):
    file = simulated(tmp_path, design)
    run("vcd2fst", str(file), str(tmp_path / "run.fst"))
    theirs, ours = read_vcd(run("fst2vcd", str(tmp_path / "run.fst")).encode()), read_vcd(file.read_bytes())
    assert (theirs.widths, theirs.initial, theirs.also) == (ours.widths, ours.initial, ours.also)
    assert theirs.changes == ours.changes
    assert theirs.end == ours.end
