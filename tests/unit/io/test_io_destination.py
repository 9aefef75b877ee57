"""Whether a result can be written is told before the work begins."""

import os
from pathlib import Path

import pytest

from rtec.cli import main
from rtec.errors import ArgumentError, OutputError
from rtec.io import FIGURES, check_file, check_folder

NOWHERE = pytest.mark.skipif(not os.path.isdir("/proc/self"), reason="no folder in which not even root can write")


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "old.toml").write_text("x")
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "mine").write_text("x")
    (tmp_path / "empty").mkdir()
    return tmp_path


@pytest.mark.parametrize(
    ("file", "force", "says"),
    [
        ("old.toml", False, "--x: old.toml exists; .*--force"),
        ("no/such.toml", True, "no folder no for such.toml"),
        ("full", True, "full is a folder"),
        pytest.param("/proc/x.toml", False, "/proc/x.toml cannot be written", marks=NOWHERE),
    ],
)
def test_files_that_cannot_be_written(here, file, force, says):
    with pytest.raises(OutputError, match=says):
        check_file("--x", Path(file), force=force)


def test_files_that_can(here):
    check_file("--x", Path("new.toml"), force=False)
    check_file("--x", Path("old.toml"), force=True)
    check_file("--x", Path("new.PNG"), force=False, endings=FIGURES)
    os.mkfifo("pipe")
    check_file("--x", Path("pipe"), force=False)
    assert sorted(os.listdir()) == ["empty", "full", "old.toml", "pipe"]


@pytest.mark.parametrize(
    ("endings", "says"),
    [((".toml",), "ends in .toml"), ((".png", ".svg", ".pdf"), "ends in .png, .svg or .pdf")],
)
def test_a_name_says_what_a_file_is(here, endings, says):
    with pytest.raises(ArgumentError, match=f"--x: new.bmp has another ending; use a name that {says}"):
        check_file("--x", Path("new.bmp"), force=False, endings=endings)


@pytest.mark.parametrize(
    ("folder", "force", "says"),
    [
        ("full", False, "-o: full is not empty"),
        ("old.toml", True, "old.toml is a file"),
        ("old.toml/below", True, "old.toml is a file"),
        pytest.param("/proc/report", True, "cannot be written", marks=NOWHERE),
    ],
)
def test_folders_that_cannot_be_filled(here, folder, force, says):
    with pytest.raises((ArgumentError, OutputError), match=says):
        check_folder("-o", Path(folder), force=force)


def test_folders_that_can(here):
    for folder, force in (("full", True), ("empty", False), ("new", False), ("new/below/it", False)):
        check_folder("-o", Path(folder), force=force)
    assert sorted(os.listdir()) == ["empty", "full", "old.toml"]


SIMULATED = ["simulate", "--design", "c", "--frequency", "100kHz", "--cycles", "9", "--corrections", "1"]


@NOWHERE
@pytest.mark.parametrize(
    ("words", "option"),
    [
        (["run", "-o", "/proc/x"], "-o"),
        (["run", "--write-study", "/proc/x"], "--write-study"),
        (["compare", "no.csv", "-o", "/proc/x"], "-o"),
        (["diagnose", "no.csv", "-o", "/proc/x"], "-o"),
        (["diagnose", "no.csv", "--save", "/proc/x"], "--save"),
        (["diagnose", "no.csv", "--suggest", "/proc/x"], "--suggest"),
        (["add", "backlash", "no.csv", "-o", "/proc/x"], "-o"),
        (["train", "no.csv", "-o", "/proc/x.toml"], "-o"),
        (["train", "no.csv", "--figure", "/proc/x.png"], "--figure"),
        (["export", "no.toml", "--linuxcnc", "/proc/x"], "--linuxcnc"),
        (["export", "no.toml", "--csv", "/proc/x"], "--csv"),
        (["export", "no.toml", "--c", "/proc/x"], "--c"),
        ([*SIMULATED, "--figure", "/proc/x.png"], "--figure"),
        ([*SIMULATED, "--vcd", "/proc/x"], "--vcd"),
        (["check", "c", "--figure", "/proc/x.png"], "--figure"),
        (["check", "c", "--margin-figure", "/proc/x.png"], "--margin-figure"),
        (["check", "c", "--vcd", "/proc/x"], "--vcd"),
        (["envelope", "--figure", "/proc/x.png"], "--figure"),
        (["safety", "-o", "/proc/x.md"], "-o"),
        (["box", "--log", "/proc/x.log"], "--log"),
        (["pc", "--log", "/proc/x.log"], "--log"),
        (["blind", "new", "-o", "/proc/x"], "-o"),
        (["blind", "score", "-o", "/proc/x"], "-o"),
        (["firmware", "trace", "no.hex", "--vcd", "/proc/x"], "--vcd"),
        (["firmware", "copy", "c", "/proc/x.asm"], "MINE.asm"),
        (["firmware", "check", "no.hex", "--design", "c", "--figure", "/proc/x.png"], "--figure"),
        (["firmware", "check", "no.hex", "--design", "c", "--vcd", "/proc/x"], "--vcd"),
    ],
)
def test_every_verb_looks_first_at_where_it_writes(here, capsys, words, option):
    # what it would read is not even there
    assert main(words) == 2
    out, err = capsys.readouterr()
    assert (out, err.count("\n")) == ("", 1)
    assert err.startswith(f"rtec: {option}: /proc/x")
    assert "cannot be written" in err
