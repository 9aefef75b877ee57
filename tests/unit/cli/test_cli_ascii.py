"""Terminals that know ASCII only, and narrow ones."""

import json
import os
import subprocess
import sys

import pytest

DATA = """# axis: z, 20 °C
run,direction,target_mm,deviation_um
"""


def said(*words, columns=60, **env):
    done = subprocess.run(
        [sys.executable, "-m", "rtec", *words],
        capture_output=True,
        env=os.environ | {"COLUMNS": str(columns), "PYTHONPATH": os.pathsep.join(sys.path)} | env,
        check=False,
    )
    return done.returncode, done.stdout.decode("ascii"), done.stderr.decode("ascii")


ASCII = [{"PYTHONIOENCODING": "ascii"}, {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}]


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    rows = [
        f"{run},{way},{25 * k},{6 * (way < 0) + 0.1 * ((7 * k + run) % 5)}"
        for run in range(1, 6)
        for way in (1, -1)
        for k in range(9)
    ]
    file = tmp_path_factory.mktemp("ascii") / "z.csv"
    file.write_text(DATA + "\n".join(rows) + "\n", encoding="utf-8")
    return str(file)


@pytest.mark.parametrize("env", ASCII, ids=["io", "locale"])
def test_nothing_is_unprintable_and_no_escape_is_left(env, data):
    for words in (["--help"], ["simulate", "--help"], ["tables"], ["effects", "backlash"], ["iso230", data]):
        code, out, err = said(*words, **env)
        assert (code, err) == (0, ""), words
        assert "\\x" not in out, words
        assert "\\u" not in out, words


@pytest.mark.parametrize("env", ASCII, ids=["io", "locale"])
def test_a_json_document_is_one_on_every_terminal(env, data):
    code, out, _ = said("compare", data, "--json", **env)
    assert code == 0
    json.loads(out)
    code, out, _ = said("effects", "thermal_growth", "--json", **env)
    assert (code, json.loads(out)["name"]) == (0, "thermal_growth")


def test_signs_of_the_field_are_spelled():
    script = (
        "import sys; from rtec.cli._outcome import exit_code\n"
        "exit_code(lambda: print('3 \u00b5m \u00b1 1 \u2264 2 \u00d7 4 \u2192 \u2713'))"
    )
    env = os.environ | {"PYTHONIOENCODING": "ascii", "PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, env=env, check=True)
    assert done.stdout == b"3 um +- 1 <= 2 x 4 -> \\u2713\n"


def test_tables_keep_their_words_at_60_columns(data):
    for words, wanted in (
        (["tables", "--design", "c"], ["encoder", "changes", "1 (00)"]),
        (["effects"], ["thermal_growth", "asymmetric_friction", "needs"]),
        (["iso230", data], ["repeatability", "forward", "backward"]),
        (["compare", data], ["noise floor"]),
    ):
        code, out, _ = said(*words, columns=60, PYTHONIOENCODING="ascii")
        assert code == 0
        assert all(word in out for word in wanted), (words, out)
