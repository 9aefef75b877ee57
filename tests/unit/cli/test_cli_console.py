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


def test_lines_now_and_then_where_there_is_no_terminal(monkeypatch, capsys):
    monkeypatch.setattr(_console.sys.stderr, "isatty", lambda: False, raising=False)
    seconds = iter([0.0, 10.0, 31.0, 40.0, 70.0])
    monkeypatch.setattr(_console.time, "monotonic", lambda: next(seconds))
    with _console.progress("check", lines="; Verilator is faster") as show:
        for share in (0.1, 0.2, 0.3, 0.4):
            show(share)
    assert capsys.readouterr().err == (
        "rtec: check: 20% after 31 s; Verilator is faster\nrtec: check: 40% after 70 s; Verilator is faster\n"
    )


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
