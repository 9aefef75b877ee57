"""The Python interface: the process behind it, compiled and not, and what ends it."""

import sys
import textwrap
import time
from pathlib import Path

import numpy as np
import pytest

from rtec.errors import RtecError
from rtec.examples import designs, mutants
from rtec.verify.contract import _python_child, python_class
from rtec.verify.contract._python_child import load
from rtec.verify.contract._python_compiled import record_of
from rtec.verify.contract.python_class import PythonClass
from rtec.verify.contract.streams import Stream
from tests.played import InProcess

STEP = "\n    def step(self, t_ps, ab, requested):\n        pass\n"
MOTION = "00 1us:+ 2us:r1 3us:+ 3.2us:- 5us:r-1 9us:- 50us:end"


@pytest.fixture
def mine(tmp_path):
    """Write a file with a class X with these lines in its step, or a whole file."""

    def of(body, *, whole=False):
        file = tmp_path / "mine.py"
        head = "class X:\n    n = 0\n    def step(self, t_ps, ab, requested):\n"
        text = textwrap.dedent(body).strip("\n")
        file.write_text(text if whole else head + textwrap.indent(text, " " * 8))
        return file

    return of


@pytest.fixture
def algorithm(mine, monkeypatch):
    """Open such a file; the compiler takes seconds in each process."""
    opened = []

    def of(body, *, whole=False, compiled=False):
        monkeypatch.setenv("NUMBA_DISABLE_JIT", str(int(not compiled)))
        opened.append(PythonClass(mine(body, whole=whole), "X"))
        return opened[-1]

    yield of
    for one in opened:
        one.close()


@pytest.fixture
def loaded(mine, monkeypatch):
    """Load such a file into this process, as its own would: each takes half a second to start."""
    monkeypatch.setattr(sys, "path", [*sys.path])
    monkeypatch.setitem(sys.modules, "algorithm", None)
    return lambda body, *, whole=False: load(mine(body, whole=whole), "X")


def play(algorithm, *texts):
    return algorithm.play([Stream.read(text).stimulus() for text in texts])


def same(ours, theirs):
    return ours.edges == theirs.edges and all(
        np.array_equal(getattr(ours.completed, name), getattr(theirs.completed, name))
        for name in ("times_ps", "totals")
    )


@pytest.mark.parametrize("kind", [pytest.param(designs.Original, marks=pytest.mark.sweep), mutants.BCountsEdges])
def test_compiled_code_with_methods_gives_what_python_gives(kind):
    stimuli = [Stream.read(MOTION).stimulus(), Stream.read("10 400ns:r1 0.5us:- 0.7us:+ 20us:r0 90us:end").stimulus()]
    plain = InProcess(kind).play(stimuli)
    with PythonClass(mutants_file(kind), kind.__name__) as algorithm:
        compiled = algorithm.play(stimuli)
        assert algorithm.note == ""  # compiled, methods and all
    assert all(same(*pair) for pair in zip(compiled, plain, strict=True))
    assert len(plain[0].edges) > 4


def mutants_file(kind):
    return Path(mutants.__file__).with_name(kind.__module__.rpartition(".")[2] + ".py")


def test_a_batch_larger_than_the_pipes_comes_through_in_order(algorithm):
    """A thousand streams with two hundred edges each: megabytes both ways, more than a pipe holds."""
    wires = algorithm("return ab, 0, 0")
    edges = np.stack([500_000 * np.arange(1, 201), np.ones(200, int)], axis=1)
    stimuli = [Stream.of(k % 4, edges, [], 10**9 + k).stimulus() for k in range(1000)]
    assert [r.edges for r in wires.play(stimuli)] == [s.edges for s in stimuli]


def test_helpers_in_a_file_beside_it_are_compiled_too(tmp_path):
    (tmp_path / "beside.py").write_text("LIMIT = 3\n\n\ndef kept(x):\n    return x & LIMIT\n")
    file = tmp_path / "mine.py"
    file.write_text(
        "from beside import kept\n\n\nclass X:\n    n = 0\n    def step(self, t_ps, ab, requested):\n"
        "        return self.same(ab, 0), 0, 0\n    def same(self, x, y):\n        return kept(x) + y\n"
    )
    with PythonClass(file, "X") as algorithm:
        (response,) = play(algorithm, MOTION)
        assert algorithm.note == ""
    assert response.edges == Stream.read(MOTION).stimulus().edges
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "beside.py",
        "mine.py",
    ]  # and nothing is written there


def test_a_table_that_stands_as_a_list_in_the_file_is_compiled(algorithm):
    text = """
    RING = [[0, 1], [3, 2]]
    class X:
        def step(self, t_ps, ab, requested):
            return RING[ab >> 1][(ab >> 1) ^ (ab & 1)], 0, 0
    """
    listing = algorithm(text, whole=True, compiled=True)
    (response,) = play(listing, MOTION)
    assert listing.note == ""
    assert response.edges == Stream.read(MOTION).stimulus().edges


def test_state_that_is_no_number_runs_as_plain_python_and_says_so(algorithm):
    text = """
    class X:
        def __init__(self):
            self.seen = []
        def step(self, t_ps, ab, requested):
            self.seen.append(ab)
            return self.seen[-1], 0, 0
    """
    listing = algorithm(text, whole=True)
    assert play(listing, MOTION)[0].broken is None
    assert listing.note == "runs as plain Python, slower: attribute seen is no number and no list of numbers"


def test_the_state_of_a_class_is_its_own_over_those_of_its_bases():
    class Base:
        REASONS = ("", "no")
        gap = 5
        table = (1, 2)

    class Own(Base):
        gap = 7

        def __init__(self):
            self.speed = 0.5

    record = record_of(Own())
    assert (record["gap"], record["speed"], record["table"].tolist()) == (7, 0.5, [1, 2])
    assert set(record.dtype.names) == {"gap", "speed", "table"}


@pytest.mark.parametrize(
    ("body", "reason"),
    [
        ("raise ValueError('two\\nlines')", "step raised ValueError: two lines in mine.py, line 4"),
        ("pass", "step returned nothing; it has to return (levels, completed, wake_ps)"),
        ("return ab, 0", "step returned (0, 0); it has to return (levels, completed, wake_ps)"),
        ("return ab * 1.0, 0, 0", "step returned 0.0 for levels; a whole number is wanted"),
        ("return ab, 'x', 0", "step returned 'x' for completed; a whole number is wanted"),
        ("return 7, 0, 0", "step returned levels 7; A + 2 * B is 0 to 3"),
        ("return -1, 0, 0", "step returned levels -1; A + 2 * B is 0 to 3"),
        ("return ab, 10**30, 0", f"step returned completed = {10**30}; totals stay below 2^31"),
        ("return ab, 0, t_ps - 5 if t_ps else 0", "wake_ps = 999995, which is not after its own time 1000000 ps"),
        ("return self.step(t_ps, ab, requested)", "step raised RecursionError"),
        ("return (1, 2)[ab + 5], 0, 0", "step raised IndexError: tuple index out of range in mine.py, line 4"),
        ("self.n = self.n // ab\nreturn ab, 0, 0", "step raised ZeroDivisionError"),
        ("raise KeyboardInterrupt", "step raised KeyboardInterrupt in mine.py, line 4"),
    ],
)
def test_what_no_algorithm_may_do_is_a_break_with_the_reason(loaded, body, reason):
    algorithm = InProcess(loaded(body))
    if any(part in body for part in ("10**30", "[ab + 5]", "// ab", "return 7")):
        algorithm.player.compile()
    (response,) = play(algorithm, MOTION)
    assert reason in response.broken.reason
    assert "\n" not in response.broken.reason
    assert not response.broken.ended


def test_it_cannot_ask_whoever_started_it(algorithm):
    (response,) = play(algorithm("return input(), 0, 0"), MOTION)
    assert "step raised EOFError" in response.broken.reason


@pytest.mark.parametrize(
    ("body", "reason"),
    [
        ("import os\nos._exit(3)", "it ended its process with code 3"),
        ("import sys\nsys.exit(4)", "it ended its process with code 4"),
        ("import os\nos.kill(os.getpid(), 9)", "its process was ended by signal 9"),
    ],
)
def test_what_ends_its_process_is_a_break_and_no_more_is_played(algorithm, body, reason):
    dying = algorithm(f"if t_ps == 3_000_000:\n{textwrap.indent(body, '    ')}\nreturn ab, 0, 0")
    first, broken, other = play(dying, "00 1us:+ 2us:end", MOTION, MOTION)
    assert first.broken is None
    assert (broken.broken.reason, broken.broken.time_ps, broken.broken.ended) == (reason, 3_000_000, True)
    assert "not played" in other.broken.reason
    # the next ones have a process again
    assert play(dying, "00 1us:+ 2us:end")[0].edges == first.edges


def test_what_never_returns_is_ended(algorithm, monkeypatch):
    monkeypatch.setattr(python_class, "SILENT_S", 2.0)
    endless = algorithm("while t_ps > 1_000_000:\n    self.n += 1\nreturn ab, 0, 0")
    process = endless._process
    began = time.monotonic()
    broken, other = play(endless, MOTION, MOTION)
    assert broken.broken.reason == "step did not return within 2 s"
    assert broken.broken.time_ps == 2_000_000
    assert other.broken.ended
    assert time.monotonic() - began < 60.0
    assert process.poll() is not None


def test_memory_without_end_is_an_error_of_the_algorithm(algorithm):
    hungry = algorithm("kept = [0] * (1 << 40)\nreturn ab, len(kept), 0")
    (response,) = play(hungry, MOTION)
    assert "MemoryError" in response.broken.reason


def test_copies_that_an_algorithm_makes_of_its_process_do_not_play(algorithm, tmp_path):
    file = tmp_path / "pids"
    body = f"""
        import os
        if type(self).n < 3:  # no more than so many, should they play on
            type(self).n += 1
            os.fork()
            print(os.getpid(), file=open({str(file)!r}, "a"))
        return ab, 0, 0
    """
    first, second = play(algorithm(body), MOTION, MOTION)
    assert first.broken is second.broken is None
    assert len(set(file.read_text().split())) == 1


def test_what_an_algorithm_has_begun_ends_with_it(algorithm, tmp_path):
    file = tmp_path / "pid"
    body = f"""
        if t_ps == 0:
            import subprocess
            print(subprocess.Popen(["sleep", "99"]).pid, file=open({str(file)!r}, "w"))
        return ab, 0, 0
    """
    opened = algorithm(body)
    play(opened, "00 1us:+ 2us:end")
    begun = int(file.read_text().split()[-1])
    assert is_running(begun)
    opened.close()
    deadline = time.monotonic() + 10.0
    while is_running(begun) and time.monotonic() < deadline:
        time.sleep(0.01)
    assert not is_running(begun)


def is_running(process):
    """Return whether it is there, and no mere entry of one that has ended."""
    try:
        return Path(f"/proc/{process}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except OSError:
        return False


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("class X\n", "line 1: expected ':'"),
        ("import nonesuch\n", "line 1: ModuleNotFoundError: No module named 'nonesuch'"),
        (f"class Y:{STEP}", "there is no class X; its classes with a step: Y"),
        ("class Y:\n    pass\n", "there is no class X; it has no class with a step"),
        ("X = 3\n", "X is no class with a method step(self, t_ps, ab, requested)"),
        ("class X:\n    def step(self, ab):\n        pass\n", "X.step takes 1 arguments"),
        (f"class X:\n    def __init__(self, a):\n        pass{STEP}", "X() raised TypeError"),
        ("raise SystemExit(3)\n", "line 1: SystemExit: 3"),
        (f"class X:\n    def __init__(self):\n        raise SystemExit(3){STEP}", "X() raised SystemExit: 3"),
        ("\0", "source code string cannot contain null bytes"),
    ],
)  # fmt: skip
def test_a_file_that_cannot_be_used_is_an_error_in_one_line(loaded, text, reason):
    with pytest.raises(ImportError) as caught:
        loaded(text, whole=True)
    assert reason in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("class X\n", r"^mine.py: line 1: expected ':'$"),
        ("import os\nos._exit(5)\n", "it ended its process with code 5 while the file is loaded$"),
    ],
)
def test_what_its_process_says_of_the_file_is_told(algorithm, text, reason):
    with pytest.raises(RtecError, match=reason):
        algorithm(text, whole=True)


def test_closing_ends_the_process(algorithm):
    wires = algorithm("return ab, 0, 0")
    process = wires._process
    wires.close()
    assert process.poll() is not None


def test_compiled_integers_that_wrap_are_not_trusted(algorithm):
    wraps = algorithm("n = (ab + 3) ** 60\nreturn 1 if n > 10**20 else 0, 0, 0", compiled=True)
    (response,) = play(wraps, "10 1us:+ 2us:end")
    assert response.edges.initial == 1
    assert wraps.note


def test_calls_without_end_are_a_break(monkeypatch):
    class Often:
        def step(self, t_ps, ab, requested):
            return ab, 0, t_ps + 1

    monkeypatch.setattr(_python_child, "_MOST_CALLS", 100)
    (response,) = InProcess(Often).play([Stream.read(MOTION).stimulus()])
    assert response.broken.reason == "asks to be called more than 100 times in one run, sooner than every 10 ns"
    assert response.broken.time_ps == 100


def test_a_poll_may_last_long(monkeypatch):
    class Polls:
        def step(self, t_ps, ab, requested):
            return ab, 0, t_ps + 10_000

    monkeypatch.setattr(_python_child, "_MOST_CALLS", 100)
    (response,) = InProcess(Polls).play([Stream.read("00 1us:+ 9us:end").stimulus()])
    assert response.broken is None
