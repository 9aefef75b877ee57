"""Progress and the word of a first compilation: on stderr, where they belong."""

import importlib
import io
import logging
import sys

import pytest

from rtec.cli import main
from rtec.cli._console import LONG, progress

WORDS = ["simulate", "--design", "c", "--frequency", "500kHz", "--cycles", "200000", "--corrections", "4"]


class Terminal(io.StringIO):
    def isatty(self):
        return True


@pytest.mark.parametrize(("longest_s", "shown"), [(-1.0, True), (1e9, False)], ids=["long work", "short work"])
def test_long_work_shows_progress_on_a_terminal(monkeypatch, longest_s, shown):
    monkeypatch.setattr("rtec.cli._console._PATIENCE_S", longest_s)
    monkeypatch.setattr(sys, "stderr", terminal := Terminal())
    assert main(WORDS) == 0
    assert ("%" in terminal.getvalue()) is shown


def test_lines_now_and_then_where_there_is_no_terminal(monkeypatch, capsys):
    seconds = iter([0.0, 10.0, 31.0, 40.0, 70.0])
    monkeypatch.setattr("rtec.cli._console.time.monotonic", lambda: next(seconds))
    with progress("check", lines="; Verilator is faster") as show:
        for share in (0.1, 0.2, 0.3, 0.4):
            show(share)
    assert capsys.readouterr().err == (
        "rtec: check: 20% after 31 s; Verilator is faster\nrtec: check: 40% after 70 s; Verilator is faster\n"
    )


def test_no_progress_in_a_file(monkeypatch, capsys):
    monkeypatch.setattr("rtec.cli._console._PATIENCE_S", -1.0)
    assert main(WORDS) == 0
    assert capsys.readouterr().err == ""


def test_what_is_compiled_is_said(monkeypatch, capsys):
    monkeypatch.setattr("rtec.cli._console.LONG", {"rtec.a": ("the closed loop", 10)})
    assert main(["--version"]) == 0
    log = logging.getLogger("rtec.machine_code")
    log.info("-", extra={"kernel": "rtec.a"})
    log.info("-", extra={"kernel": "rtec.a", "seconds": 8.6})
    log.info("-", extra={"kernel": "rtec.a", "waits": True})
    log.info("-", extra={"kernel": "a small one"})
    log.warning("not kept")
    assert capsys.readouterr().err.splitlines() == [
        "rtec: compiling the closed loop for this machine, once (about 10 s) ...",
        "rtec: compiled the closed loop in 9 s",
        "rtec: waiting for another program that compiles the closed loop ...",
        "rtec: not kept",
    ]


def test_what_is_said_to_take_long_is_a_kernel():
    for name in LONG:
        module, _, function = name.rpartition(".")
        assert callable(getattr(importlib.import_module(module), function))
