"""What the verbs show on stdout and stderr."""

import io
import json
import sys

import pytest

from rtec import _jit
from rtec.cli import _console


def test_json_has_no_number_that_json_lacks(capsys):
    _console.print_json({"a": float("inf"), "b": [float("nan"), -0.5], "c": {"d": (1, None, True)}, "e": "µm"})
    out = capsys.readouterr().out
    assert json.loads(out) == {"a": None, "b": [None, -0.5], "c": {"d": [1, None, True]}, "e": "µm"}
    assert out.endswith("}\n")


def test_json_refuses_what_it_cannot_say():
    with pytest.raises(TypeError):
        _console.print_json({"a": object()})


class Terminal(io.StringIO):
    def isatty(self):
        return True


def test_progress_on_a_terminal_after_a_while(monkeypatch):
    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    with _console.progress("quick") as show:
        show(0.5)
    assert terminal.getvalue() == ""
    monkeypatch.setattr(_console, "_PATIENCE_S", -1.0)
    with _console.progress("slow work") as show:
        show(0.25)
        show(0.75)
    assert "slow work" in terminal.getvalue()


def test_no_progress_in_a_file(monkeypatch, capsys):
    monkeypatch.setattr(_console, "_PATIENCE_S", -1.0)
    with _console.progress("slow work") as show:
        show(0.5)
    assert capsys.readouterr() == ("", "")


@pytest.mark.parametrize(("first", "disabled", "ahead"), [(True, 0, True), (False, 0, False), (True, 1, False)])
def test_compilation_is_announced_once(monkeypatch, capsys, first, disabled, ahead):
    monkeypatch.setattr(_jit, "FIRST_RUN", first)
    monkeypatch.setattr(_jit.config, "DISABLE_JIT", disabled)
    _console.announce_compilation()
    assert ("compiling" in capsys.readouterr().err) is ahead
