"""Progress and the word of a first compilation: on stderr, where they belong."""

import io
import sys

import pytest

from rtec.cli import main

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


def test_no_progress_in_a_file(monkeypatch, capsys):
    monkeypatch.setattr("rtec.cli._console._PATIENCE_S", -1.0)
    assert main(WORDS) == 0
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize(("first", "disabled"), [(True, 0), (False, 0), (True, 1)])
def test_a_first_compilation_is_announced(monkeypatch, capsys, first, disabled):
    monkeypatch.setattr("rtec._jit.FIRST_RUN", first)
    monkeypatch.setattr("rtec._jit.config.DISABLE_JIT", disabled)
    assert main(["tables", "--design", "c"]) == 0
    assert ("compiling" in capsys.readouterr().err) is (first and not disabled)
