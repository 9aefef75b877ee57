"""rtec check with a user's own Python: verdict, worst case played again, and every bad input in one line."""

import json
import os
import shlex
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from rtec import examples
from rtec.cli import main

EXAMPLES = Path(examples.__file__).parent
ROOT = EXAMPLES.parents[1]
STEP = "class X:\n    n = 0\n    def step(self, t_ps, ab, requested):\n        "
STREAM = "00 1us:+ 2us:r1 3us:- 50us:end"
RTEC = (sys.executable, "-m", "rtec")
ENVIRONMENT = os.environ | {"PYTHONPATH": str(ROOT)}


@pytest.fixture
def mine(tmp_path):
    """A file with a space in its path."""
    folder = tmp_path / "my algorithms"
    folder.mkdir()

    def written(text):
        (folder / "mine.py").write_text(text)
        return f"{folder / 'mine.py'}:X"

    return written


@pytest.fixture
def plainly(monkeypatch):
    """Leave out the compiler, which takes seconds in each process, where a class plays a stream or none."""
    monkeypatch.setenv("NUMBA_DISABLE_JIT", "1")


def said(capfd, *words):
    code = main(["check", *(str(word) for word in words)])
    return code, *capfd.readouterr()


@pytest.mark.usefixtures("plainly")
@pytest.mark.parametrize(("example", "ends"), [("design_c", 0), ("design_c_bug", 1)])
def test_the_planted_bug_breaks_what_the_right_design_stands(capfd, example, ends):
    words = (f"{EXAMPLES / example}.py:DesignC", "--design", "c", "--stream", "10 200ns:r-1 400ns:- 20.8us:end")
    assert said(capfd, *words)[0] == ends


def test_the_step_of_the_example_is_at_most_fifteen_lines():
    lines = (EXAMPLES / "design_c.py").read_text().split('(0: at the next input)."""\n')[1].splitlines()
    assert len([line for line in lines if line.strip()]) <= 15


# --- what the algorithm does is a failed check ---
@pytest.mark.usefixtures("plainly")
def test_a_failed_check_tells_the_moment(capfd, mine):
    body = "print('hello')\n        raise ValueError('boom')"
    code, out, _ = said(capfd, mine(STEP + body), "--design", "c", "--stream", STREAM, "--json")
    answer = json.loads(out)  # nothing else on stdout, whatever the algorithm prints
    assert code == 1
    assert answer["passed"] is False
    assert answer["checks"][0]["reason"] == "step raised ValueError: boom in mine.py, line 5, at 0 ps"


@pytest.mark.usefixtures("no_speeds")
def test_an_algorithm_that_is_not_the_same_twice_gets_a_verdict(capfd, mine):
    text = "import random\n\n\n" + STEP + "return (ab if random.random() < 0.8 else ab ^ 1), 0, 0"
    code, out, err = said(capfd, mine(text), "--design", "c", "--tries", "16", "--json")
    assert (code, err) == (1, "")
    assert json.loads(out)["passed"] is False


@pytest.mark.usefixtures("plainly")
def test_a_stream_comes_from_a_file_and_one_that_no_encoder_sends_is_not_the_algorithms_fault(capfd, mine, tmp_path):
    algorithm, file = mine(STEP + "return ab, 0, 0"), tmp_path / "stream.txt"
    for text, wanted in (
        ("00 500ns:+ 1us:+ 9us:end", (0, "mine.py:X: passed: every count right\n", "")),
        (
            "00 500ns:+ 700ns:+ 9us:end",
            (2, "", "rtec: --stream is nothing that an encoder sends: the edge at 700ns "),
        ),
    ):
        file.write_text(text + "\n")
        for given in (text, file):
            code, out, err = said(capfd, algorithm, "--design", "c", "--stream", given)
            assert (code, out) == wanted[:2]
            assert err.startswith(wanted[2])
            assert err.count("\n") == (code == 2)


def test_a_total_that_the_word_of_an_image_cannot_hold(capfd):
    image = ROOT / "firmware_model" / "images" / "c.ihx"
    code, out, err = said(capfd, image, "--design", "c", "--stream", "00 1ms:r128 9ms:end")
    assert (code, out) == (2, "")
    assert (
        "a requested total: 128 is not valid; use what fits into the request's word of Design C: -127 to 127" in err
    )


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("none.py:X", "--design", "c"), "none.py: no such file"),
        (("none.py", "--design", "c"), "none.py:Name, the name of the class"),
        (("mine.txt:X", "--design", "c"), "ALGORITHM"),
        (("none.py:X",), "--design is missing"),
        (("none.py:X", "--design", "d"), "--design"),
        (("none.py:X", "--design", "c", "--step", "2"), "--step"),
        (("none.py:X", "--step", "2", "--states", "02"), "--states"),
        (("none.py:X", "--step", "0"), "--step"),
        (("none.py:X", "--design", "c", "--frequency", "500"), "--frequency"),
        (("none.py:X", "--design", "c", "--delay", "0us"), "--delay"),
        (("none.py:X", "--design", "c", "--pins", "p.toml"), "--pins"),
        (("none.py:X", "--design", "c", "--stream", "00 1us"), "--stream"),
        (("c", "--design", "c"), "--design"),
    ],
)
def test_words_that_are_wrong(capfd, tmp_path, monkeypatch, words, message):
    monkeypatch.chdir(tmp_path)
    code, out, err = said(capfd, *words)
    assert (code, out) == (2, "")
    assert message in err
    assert err.count("\n") == 1


@pytest.mark.usefixtures("plainly")
def test_the_printed_command_plays_a_file_whose_name_begins_with_a_dash_and_has_a_space(capfd, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("-x y.py").write_text(STEP + "return ab, 0, 0\n")
    _, out, _ = said(capfd, "--design", "c", "--stream", STREAM, "--json", "--", "-x y.py:X")
    first = json.loads(out)
    _, out, _ = said(capfd, *shlex.split(first["worst_case"])[2:], "--json")
    assert json.loads(out)["checks"] == first["checks"]
    assert [path.name for path in tmp_path.iterdir()] == ["-x y.py"]  # nothing is written beside it


# --- processes ---
def children(process):
    """Return the processes below one, with what they are."""
    listed = subprocess.run(["ps", "-eo", "pid=,ppid="], capture_output=True, text=True, check=True).stdout
    pairs = [tuple(map(int, line.split())) for line in listed.splitlines()]
    return [pid for pid, parent in pairs if parent == process.pid]


def alive(pid):
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_ctrl_c_leaves_no_process_behind(mine, number, code):
    algorithm = mine(STEP + "while t_ps:\n            self.n += 1\n        return ab, 0, 0")
    check = subprocess.Popen(
        [*RTEC, "check", algorithm, "--design", "c"],
        env=ENVIRONMENT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    deadline = time.monotonic() + 60.0
    while not (below := children(check)) and time.monotonic() < deadline:
        time.sleep(0.1)
    assert below
    time.sleep(0.5)
    check.send_signal(number)
    _, err = check.communicate(timeout=60.0)
    assert check.returncode == code
    assert "Traceback" not in err
    deadline = time.monotonic() + 10.0  # a process that has ended is there until somebody has taken its exit code
    while any(map(alive, below)) and time.monotonic() < deadline:
        time.sleep(0.1)
    assert not any(map(alive, below))
