"""``rtec check top.v``: the verdict on one stream, what it asks for, and what is left when it is interrupted."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from verilog_modules import WIRES, pins_text

import rtec.verify.contract
from rtec.cli import main

EXAMPLES = Path(rtec.verify.contract.__file__).parents[2] / "examples"
needs_verilator = pytest.mark.skipif(
    not all(map(shutil.which, ("verilator", "make", "g++"))), reason="verilator, make or g++ is not installed"
)
BUG = [str(EXAMPLES / "design_c_bug.v"), "--pins", str(EXAMPLES / "design_c_bug.toml"), "--clock", "50MHz"]
STREAM = "00 500ns:r1 500ns:- 20.8us:end"
# a shell that starts pytest in the background lets its children ignore the signal
HEEDING = "import signal, sys; signal.signal(signal.SIGINT, signal.default_int_handler)"
RTEC = [sys.executable, "-c", f"{HEEDING}; from rtec.cli import main; sys.exit(main())"]


def said(capsys, words):
    code = main(["check", *words])
    out, err = capsys.readouterr()
    return code, out + err


@needs_verilator
def test_one_stream(capsys):
    code, text = said(capsys, [*BUG, "--design", "c", "--stream", STREAM, "--json"])
    seen = json.loads(text)
    assert code == 1
    assert seen["passed"] is False
    # one count back, one step of two counts forward: the bug takes two instead
    assert "counts -3 where +1 is right" in seen["checks"][0]["reason"]
    assert STREAM in seen["worst_case"]


@pytest.mark.parametrize(
    ("words", "wanted"),
    [
        ([*BUG[:3], "--design", "c"], "--clock is missing"),
        ([BUG[0], "--clock", "50MHz", "--design", "c"], "--pins is missing"),
        ([*BUG[:3], "--clock", "50", "--design", "c"], "--clock"),
        ([*BUG[:3], "--clock", "0 Hz", "--design", "c"], "--clock: '0 Hz' is not valid"),
        ([*BUG, "--design", "c", "--part", "8051"], "--part means nothing for Verilog"),
        ([*BUG], "--design is missing"),
        (["nothing.v", *BUG[1:], "--design", "c"], "nothing.v: there is no such file"),
        ([BUG[0], "--pins", "nothing.toml", "--clock", "50MHz", "--design", "c"], "nothing.toml"),
    ],
)
def test_bad_input_is_one_line_and_exit_code_2(capsys, words, wanted):
    code, text = said(capsys, words)
    assert code == 2
    assert wanted in text
    assert len(text.strip().splitlines()) == 1
    assert "Traceback" not in text


def alive_with(folder: Path) -> list[list[str]]:
    """Return the words of the processes that have a folder in their arguments."""
    found = []
    for process in Path("/proc").glob("[0-9]*"):
        try:
            words = (process / "cmdline").read_bytes().decode(errors="replace").split("\0")
        except OSError:
            continue
        if any(str(folder) in word for word in words):
            found.append(words)
    return found


def compiles(folder: Path) -> bool:
    """Tell whether a compiler works for a folder."""
    return any(Path(words[0]).name == "cc1plus" for words in alive_with(folder))


@needs_verilator
@pytest.mark.skipif(not Path("/proc/self/cmdline").exists(), reason="the system does not show its processes in /proc")
@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_an_interrupted_check_leaves_no_folder_and_no_process(tmp_path, number, code):
    """Interrupted while the design is compiled."""
    made = tmp_path / "made"
    made.mkdir()
    file, pins = tmp_path / "w.v", tmp_path / "w.toml"
    file.write_text(WIRES)
    pins.write_text(pins_text("wires"))
    words = ["check", str(file), "--pins", str(pins), "--clock", "50MHz"]
    words += ["--design", "c", "--stream", "00 1us:+ 9us:end"]
    with subprocess.Popen(
        [*RTEC, *words], env=os.environ | {"TMPDIR": str(made)}, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    ) as process:
        until = time.monotonic() + 60
        while not (begun := compiles(made)) and process.poll() is None and time.monotonic() < until:
            time.sleep(0.05)  # a process of its own, at its own pace
        process.send_signal(number)
        process.communicate(timeout=60)
    assert begun
    assert process.returncode == code
    assert list(made.iterdir()) == []
    assert alive_with(made) == []
