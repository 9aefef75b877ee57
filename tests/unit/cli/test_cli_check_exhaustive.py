"""rtec check --exhaustive: what it prints, its exit codes, and the command that plays a counterexample again."""

import json
import shlex
from pathlib import Path

import pytest

from rtec import examples
from rtec.cli import main

MUTANTS = Path(examples.__file__).parent / "mutants.py"


def said(capfd, *words):
    code = main(["check", *map(str, words)])
    return code, *capfd.readouterr()


def test_a_proof_exits_with_0_and_says_what_it_assumes(capfd):
    code, out, _ = said(capfd, "c", "--exhaustive", "--frequency", "600kHz")
    assert code == 0
    assert "proved for streams of any length" in out
    assert out.count("assumed: ") == 3


def test_a_counterexample_exits_with_1_and_its_command_fails_again(capfd, tmp_path):
    file = tmp_path / "worst.vcd"
    code, out, _ = said(capfd, "a", "--exhaustive", "--real-edges", "merge", "--json", "--vcd", file)
    found = json.loads(out)
    assert code == 1 and not found["passed"]
    assert found["exhaustive"]["ending"] == "broken" and found["exhaustive"]["states"] > 0
    assert file.read_text().startswith("$")
    words = shlex.split(found["worst_case"])[2:]
    code, out, _ = said(capfd, *words)
    assert code == 1 and "FAILED" in out


def test_a_class_is_searched_where_it_declares_its_state(capfd):
    code, out, _ = said(capfd, f"{MUTANTS}:COrder", "--design", "c", "--exhaustive")
    assert code == 1 and out.splitlines()[0].startswith("mutants.py:COrder: broken: ")


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        ((f"{MUTANTS.parent / 'design_c.py'}:DesignC", "--design", "c"), "does not declare its state"),
        ((f"{MUTANTS}:COrder", "--design", "c", "--clock", "50MHz"), "takes no --clock"),
        (("c", "--stream", "00 3us:end"), "--exhaustive"),
    ],
)
def test_bad_input_is_one_line(capfd, words, reason):
    code, _, err = said(capfd, *words, "--exhaustive")
    assert code == 2
    assert reason in err and err.count("\n") == 1
