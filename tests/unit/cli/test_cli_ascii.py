"""Terminals that know ASCII only, and narrow ones."""

import io
import json
import os
import subprocess
import sys

import pytest

from rtec.cli import main

DATA = """# axis: z, 20 °C
run,direction,target_mm,deviation_um
"""


ASCII = [{"PYTHONIOENCODING": "ascii"}, {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}]


@pytest.fixture
def said(monkeypatch):
    """Run a command on a terminal of 60 columns that knows ASCII only."""

    def run(*words):
        out, err = (io.TextIOWrapper(io.BytesIO(), encoding="ascii") for _ in range(2))
        with monkeypatch.context() as patch:
            patch.setenv("COLUMNS", "60")
            patch.setattr(sys, "stdout", out)
            patch.setattr(sys, "stderr", err)
            code = main(list(words))
            out.flush()
            err.flush()
        return code, *(stream.buffer.getvalue().decode("ascii") for stream in (out, err))

    return run


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    rows = [
        f"{run},{way},{25 * k},{6 * (way < 0) + 0.37 * k + 0.1 * ((7 * k + run * run) % 5):.2f}"
        for run in range(1, 6)
        for way in (1, -1)
        for k in range(9)
    ]
    file = tmp_path_factory.mktemp("ascii") / "z.csv"
    file.write_text(DATA + "\n".join(rows) + "\n", encoding="utf-8")
    return str(file)


def test_nothing_is_unprintable_and_no_escape_is_left(said, data):
    for words in (["--help"], ["simulate", "--help"], ["tables"], ["effects", "backlash"], ["iso230", data]):
        code, out, err = said(*words)
        assert code == 0, words
        assert "\\x" not in out + err, words
        assert "\\u" not in out + err, words


@pytest.mark.parametrize("env", ASCII, ids=["io", "locale"])
def test_a_program_of_its_own_sees_what_the_terminal_knows(env):
    env = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)} | env
    words = [sys.executable, "-m", "rtec", "effects", "thermal_growth"]
    text, document = (
        subprocess.run(words + more, capture_output=True, env=env, check=True).stdout.decode("ascii")
        for more in ([], ["--json"])
    )
    assert "um" in text and "\\" not in text
    assert json.loads(document)["name"] == "thermal_growth"


def test_signs_of_the_field_are_spelled():
    script = (
        "import sys; from rtec.cli._outcome import exit_code\n"
        "exit_code(lambda: print('3 \u00b5m \u00b1 1 \u2264 2 \u00d7 4 \u2192 \u2713'))"
    )
    env = os.environ | {"PYTHONIOENCODING": "ascii", "PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, env=env, check=True)
    assert done.stdout == b"3 um +- 1 <= 2 x 4 -> \\u2713\n"
