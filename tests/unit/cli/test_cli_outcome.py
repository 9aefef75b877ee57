"""Every ending of a command: its exit code, and one line on stderr without a traceback."""

import ast
import errno
import os
import subprocess
import sys
from pathlib import Path

import pytest

import rtec.machine
from rtec.cli import main
from rtec.errors import RtecError

GOOD = ["simulate", "--design", "c", "--frequency", "100kHz", "--cycles", "100", "--corrections", "2"]
RTEC = [sys.executable, "-m", "rtec"]


def ended(capsys, words):
    code = main(words)
    out, err = capsys.readouterr()
    return code, out, err


def one_line(err):
    return err.count("\n") == 1 and err.endswith("\n") and err.startswith("rtec: ") and "Traceback" not in err


@pytest.mark.parametrize("words", [[], ["--help"]])
def test_help_is_done(capsys, words):
    code, out, err = ended(capsys, words)
    assert (code, err) == (0, "")
    assert out.count("Example: rtec") >= 3


def test_version(capsys):
    assert ended(capsys, ["--version"]) == (0, f"rtec {rtec.__version__}\n", "")


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["simulat"], "no command 'simulat'; did you mean 'simulate'?"),
        (["qqq"], "no command 'qqq'; known: "),
        (["--versio"], "did you mean '--version'?"),
        (["simulate", "--desgin", "c"], "did you mean '--design'?"),
        (["simulate"], "'rtec simulate --help'"),
        ([*GOOD, "extra"], "extra"),
        ([*GOOD, "--jitter"], "--jitter"),
        (["iso230"], "'rtec iso230 --help'"),
        (["run", "--seed", "-1"], "--seed"),
        (["run", "--seed", "9" * 9000], "--seed"),
        (["run", "--forc"], "did you mean '--force'?"),
        (["iso230", "/nowhere/x.csv"], "/nowhere/x.csv"),
        (["\udcff"], "no command"),
        (["x" * 100_000], "no command"),
    ],
)
def test_bad_words_are_one_line_and_2(capsys, words, says):
    code, out, err = ended(capsys, words)
    assert (code, out) == (2, "")
    assert one_line(err)
    assert says in err
    assert len(err) < 400


def test_answer_fails_is_1(capsys):
    # the paper's Original cannot insert at 30 kHz: its gate ends at 27.8 kHz without any reserve
    words = ["simulate", "--design", "original", "--timing", "8051", "--frequency", "30kHz"]
    code, _, err = ended(capsys, [*words, "--cycles", "100", "--corrections", "10", "--json"])
    assert code == 1
    assert err == ""


def raising(error):
    def carry_out(*_, **__):
        raise error

    return carry_out


@pytest.mark.parametrize(
    ("error", "code", "says"),
    [
        (RtecError("x: 1 is not valid"), 2, "rtec: x: 1 is not valid\n"),
        (RtecError("two\nlines"), 2, "rtec: two lines\n"),
        (PermissionError(errno.EACCES, "Permission denied", "f.csv"), 2, "rtec: f.csv: Permission denied\n"),
        (OSError(errno.ENOSPC, "No space left on device"), 2, "rtec: output: No space left on device\n"),
        (MemoryError(), 2, "rtec: not enough memory for this; ask for less\n"),
        (KeyboardInterrupt(), 130, "rtec: interrupted; nothing half-written is left\n"),
        (BrokenPipeError(errno.EPIPE, "Broken pipe"), 141, ""),
    ],
)
def test_exceptions(capsys, monkeypatch, error, code, says):
    monkeypatch.delenv("RTEC_DEBUG", raising=False)
    monkeypatch.setattr(rtec.machine, "simulate", raising(error))
    assert main(GOOD) == code
    assert capsys.readouterr().err == says


@pytest.mark.parametrize("debug", [False, True])
def test_internal_error_is_a_bug_of_ours_with_its_traceback_on_demand(capsys, monkeypatch, debug):
    monkeypatch.setattr(rtec.machine, "simulate", raising(ZeroDivisionError("nothing to divide by")))
    monkeypatch.setenv("RTEC_DEBUG", "1" if debug else "")
    code, out, err = ended(capsys, GOOD)
    assert (code, out) == (70, "")
    *traceback, said = err.splitlines()
    assert said.startswith(
        "rtec: a bug in rtec, please report it: ZeroDivisionError: nothing to divide by; RTEC_DEBUG=1"
    )
    assert bool(traceback) is ("in carry_out" in err) is debug


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no /dev/full on this system")
@pytest.mark.parametrize("words", [["--help"], GOOD])
def test_full_output(words):
    with open("/dev/full", "w") as full:
        done = subprocess.run([*RTEC, *words], stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert done.returncode == 2
    assert [line for line in done.stderr.splitlines() if "compiling" not in line] == [
        "rtec: output: No space left on device"
    ]


@pytest.mark.parametrize("words", [["--help"], GOOD])
def test_nobody_reads(words):
    reader, writer = os.pipe()
    os.close(reader)
    done = subprocess.run([*RTEC, *words], stdout=writer, stderr=subprocess.PIPE, text=True, check=False)
    os.close(writer)
    assert done.returncode == 141
    assert [line for line in done.stderr.splitlines() if "compiling" not in line] == []


def test_closed_output():
    done = subprocess.run(["sh", "-c", '"$0" -m rtec --version >&- 2>&-', sys.executable], check=False)
    assert done.returncode == 0


VERBS = [
    path.stem
    for path in (Path(__file__).parents[3] / "rtec" / "cli").glob("[a-z]*.py")
    if path.stem != "firmware_check"
]
HEAVY = (
    "can", "cantools", "jinja2", "llvmlite", "matplotlib", "numba", "numpy", "openpyxl", "pint", "prompt_toolkit",
    "pydantic", "scipy",
)  # fmt: skip
OF_THE_COMPILER = ("llvmlite", "numba", "numpy", "scipy")
"""numba itself asks scipy for its BLAS when it loads a kernel."""


@pytest.mark.parametrize(
    ("lines", "needed"),
    [
        pytest.param([[], *([verb, "--help"] for verb in VERBS)], (), id="help"),
        pytest.param([["nonsense"], ["simulate", "--design", "q"], ["run", "--repeatability", "1"]], (), id="errors"),
        pytest.param([["tables", "--design", "c"]], (), id="tables"),
        pytest.param([["docs"], ["docs", "tutorial"]], (), id="docs"),
        pytest.param([["iso230", "readings.csv"]], ("numpy",), id="iso230"),
        pytest.param([GOOD], OF_THE_COMPILER, id="simulate"),
    ],
)
def test_nothing_heavy_is_loaded_that_is_not_needed(tmp_path, lines, needed):
    readings = [f"{run},{way},{x},{x % 7}" for run in range(5) for way in (1, -1) for x in range(0, 50, 10)]
    (tmp_path / "readings.csv").write_text("\n".join(["run,direction,target_mm,deviation_um", *readings]))
    script = (
        f"import sys; from rtec.cli import main\nfor line in {lines}: main(line)\n"
        f"print([m for m in {HEAVY} if m in sys.modules], file=sys.stderr)"
    )
    words, env = [sys.executable, "-c", script], os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run(words, capture_output=True, text=True, check=True, cwd=tmp_path, env=env)
    assert ast.literal_eval(done.stderr.splitlines()[-1]) == [name for name in HEAVY if name in needed]
