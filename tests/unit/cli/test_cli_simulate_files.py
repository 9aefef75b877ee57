"""The files of rtec simulate: pictures, and waveform files that are large."""

import json
import os
import signal
import subprocess
import sys
import time

import pytest

from rtec.cli import main

BASE = ["simulate", "--design", "c", "--frequency", "500kHz", "--cycles", "100", "--corrections", "7"]
HUGE = ["simulate", "--design", "c", "--frequency", "500kHz", "--cycles", "10000000", "--corrections", "100"]
MAGIC = {"png": b"\x89PNG", "svg": b"<?xml", "pdf": b"%PDF-"}


def said(capsys, *words):
    code = main([str(word) for word in words])
    out, err = capsys.readouterr()
    return code, out, err.splitlines()


@pytest.mark.parametrize("ending", list(MAGIC))
def test_picture_of_each_kind(capsys, tmp_path, ending):
    file = tmp_path / f"insertion.{ending}"
    code, out, err = said(capsys, *BASE, "--figure", file, "--json")
    assert (code, err, json.loads(out)["figure"]) == (0, [], str(file))
    assert file.read_bytes().startswith(MAGIC[ending])
    assert [path.name for path in tmp_path.iterdir()] == [file.name]
    assert said(capsys, *BASE, "--figure", file)[0] == 2  # it exists
    code, out, _ = said(capsys, *BASE, "--figure", file, "--force")
    assert (code, out.splitlines()[-1]) == (0, f"figure: {file}")


@pytest.mark.one_in(5)
@pytest.mark.parametrize("timing", ["fast", "8051", "firmware"])
@pytest.mark.parametrize("edges", ["merge", "hold"])
@pytest.mark.parametrize("design", ["original", "a", "b", "c"])
def test_picture_of_each_design(capsys, tmp_path, design, edges, timing):
    file = tmp_path / "insertion.svg"
    words = ["simulate", "--design", design, "--frequency", "3kHz", "--cycles", "90", "--corrections", "5", "--sign"]
    words += ["-", "--timing", timing, "--real-edges", edges, "--figure", file]
    code, _, err = said(capsys, *words)
    assert (code, err, file.is_file()) == (0, [], True)


def test_state_of_the_insertion_is_chosen(capsys, tmp_path, monkeypatch):
    titles = []
    monkeypatch.setattr(
        "rtec.report.figures_simulate.waveform", lambda *_, title, **__: titles.append(title) or _empty_figure()
    )
    for levels, state in (("00", 1), ("10", 2), ("11", 3), ("01", 4)):
        words = [*BASE, "--figure", tmp_path / f"{levels}.png", "--figure-state", levels, "--sign", "-"]
        assert said(capsys, *words)[0] == 0
        assert titles.pop() == f"Design C, 500 kHz: −2 from state {state} ({levels})"


def _empty_figure():
    from matplotlib.figure import Figure

    return Figure()


def test_state_in_which_nothing_begins(capsys, tmp_path):
    file = tmp_path / "f.png"
    words = ["simulate", "--design", "c", "--frequency", "100kHz", "--cycles", "100", "--corrections", "10"]
    code, out, err = said(capsys, *words, "--figure", file, "--figure-state", "00", "--json")
    assert (code, json.loads(out)["figure"], file.exists()) == (0, None, False)
    assert err[0].startswith(f"rtec: {file} not written: no insertion began in state 00 but in ")
    home = err[0].split("--home-state ")[1][0]
    code, _, err = said(capsys, *words, "--figure", file, "--figure-state", "00", "--home-state", home)
    assert (code, err, file.exists()) == (0, [], True)


def test_nothing_inserted_nothing_drawn(capsys, tmp_path):
    file = tmp_path / "f.png"
    words = ["simulate", "--design", "c", "--timing", "8051", "--frequency", "200kHz", "--cycles", "100"]
    code, _, err = said(capsys, *words, "--corrections", "3", "--figure", file)
    assert (code, file.exists()) == (1, False)
    assert err == [f"rtec: {file} not written: the box has inserted nothing"]


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["--figure", "f.gif"], "--figure: f.gif has another ending; use a name that ends in .png, .svg or .pdf"),
        (["--figure", "no/f.png"], "--figure: there is no folder no for f.png"),
        (["--figure", "f.png", "--figure-state", "12"], "--figure-state: '12' is not valid"),
        (["--figure-state", "10"], "--figure-state needs --figure; use both"),
        (["--figure", "f.png", "--corrections", "0"], "--figure needs --corrections above 0"),
    ],
)
def test_bad_words_are_one_line(capsys, tmp_path, monkeypatch, words, says):
    monkeypatch.chdir(tmp_path)
    code, out, err = said(capsys, *BASE, *words)
    assert (code, out, len(err)) == (2, "", 1)
    assert err[0].startswith(f"rtec: {says}")
    assert list(tmp_path.iterdir()) == []


def test_large_file_is_refused_with_its_size(capsys, tmp_path):
    code, out, err = said(capsys, *HUGE, "--vcd", tmp_path / "run.vcd")
    assert (code, out, len(err), list(tmp_path.iterdir())) == (2, "", 1, [])
    for part in ("about 1.7", "GB long", "GB are free", "--force", "--cycles"):
        assert part in err[0]


@pytest.mark.parametrize("agreed", [True, False])
def test_on_a_terminal_the_user_is_asked(capsys, tmp_path, monkeypatch, agreed):
    asked = []

    class Terminal:
        def isatty(self):
            return True

    monkeypatch.setattr("rtec.cli.simulate.sys", type("Sys", (), {"stdin": Terminal(), "stderr": Terminal()}))
    monkeypatch.setattr("rtec.cli.simulate.LARGE_BYTES", 1_000)
    monkeypatch.setattr("rtec.cli.simulate.typer.confirm", lambda text, err: asked.append((text, err)) or agreed)
    code, _, _ = said(capsys, *BASE, "--vcd", tmp_path / "run.vcd")
    assert (code, len(asked)) == (0 if agreed else 2, 1)
    assert (tmp_path / "run.vcd").exists() is agreed
    assert asked[0][0].endswith("GB are free there. Write it?")
    assert asked[0][1] is True


def test_force_writes_it_and_a_pipe_is_not_asked_about(capsys, tmp_path, monkeypatch):
    monkeypatch.setattr("rtec.cli.simulate.LARGE_BYTES", 1_000)
    assert said(capsys, *BASE, "--vcd", tmp_path / "run.vcd")[0] == 2
    assert said(capsys, *BASE, "--vcd", tmp_path / "run.vcd", "--force")[0] == 0
    assert said(capsys, *BASE, "--vcd", "/dev/null")[0] == 0


@pytest.mark.skipif(not hasattr(os, "kill"), reason="no signals on this system")
def test_sigterm_in_the_middle_of_a_large_file_leaves_nothing(tmp_path):
    heeding = "import signal, sys; signal.signal(signal.SIGTERM, signal.SIG_DFL); from rtec.cli import main"
    words = [*HUGE, "--vcd", str(tmp_path / "run.vcd"), "--force"]
    process = subprocess.Popen(
        [sys.executable, "-c", f"{heeding}; sys.exit(main())", *words], stderr=subprocess.PIPE, text=True
    )
    until = time.monotonic() + 120
    while sum(path.stat().st_size for path in tmp_path.iterdir()) < 20e6:
        assert process.poll() is None
        assert time.monotonic() < until
        time.sleep(0.02)
    process.send_signal(signal.SIGTERM)
    _, err = process.communicate(timeout=60)
    assert process.returncode == 143
    assert err.splitlines()[-1] == "rtec: terminated; nothing half-written is left"
    assert list(tmp_path.iterdir()) == []
