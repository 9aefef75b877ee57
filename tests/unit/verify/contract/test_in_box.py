"""A user's class in the boxes of a machine: it inserts as the design that it is, and what ends it is said."""

import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

import rtec.examples
from rtec.board import Microcontroller
from rtec.errors import ArgumentError, RtecError
from rtec.injector import Design, InjectorSettings, Timing
from rtec.machine.cell import Cell
from rtec.machine.fault_kinds import INSIDE_BOX, FaultKind
from rtec.machine.station import Move, Station, StationSettings
from rtec.verify.contract import in_box
from rtec.verify.contract.contract import design_with
from rtec.verify.contract.in_box import PythonInBox
from rtec.verify.safety.matrix import MatrixPlan, run_matrix
from rtec.verify.safety.monitor import sinusoidal_table
from rtec.verify.safety.phases import Phase
from rtec.verify.safety.variants import VARIANTS

HERE = Path(rtec.examples.__file__).parent
S = 10**12


@pytest.fixture(scope="module")
def design_c():
    return PythonInBox(HERE / "design_c.py", "DesignC")


def written(folder, step, after=""):
    """Return a file with a class that plain Python runs, which takes no compiler."""
    body = textwrap.indent(textwrap.dedent(step), 8 * " ")
    file = folder / "mine.py"
    file.write_text(f"class Mine:\n    kept = {{}}\n    def step(self, t_ps, ab, requested):\n{body}\n{after}")
    return file


def axis_of(algorithm):
    box = InjectorSettings(design=Design.C, timing=Timing())
    return StationSettings(injector=box, algorithm=algorithm)


def test_outcomes_are_those_of_the_design_that_it_is(design_c):
    """The design built in is another implementation; spikes are left out, which only the class's latch swallows."""
    variants = tuple(one for one in VARIANTS if one.kind not in (FaultKind.GLITCHES, *INSIDE_BOX))
    some = {"designs": (Design.C,), "phases": (Phase.INSERTION,), "variants": variants, "seeds": 1}
    own, built_in = (run_matrix(MatrixPlan(**some, algorithm=one)).trials for one in (design_c, None))
    assert len(own) == 62
    assert [(one.variant.name, one.outcome, one.fired > 0) for one in own] == [
        (one.variant.name, one.outcome, one.fired > 0) for one in built_in
    ]
    assert all(one.sound for one in own)


def test_a_class_that_books_what_is_asked_for_is_right_until_it_is_disturbed():
    wrong = PythonInBox(HERE / "mutants.py", "BBooksRequest")
    stale = tuple(one for one in VARIANTS if one.name == "stale data valid, for 20 ms")
    some = {"designs": (Design.B,), "phases": (Phase.CUTTING,), "variants": stale, "seeds": 1}
    found, right = (run_matrix(MatrixPlan(**some, algorithm=one)) for one in (wrong, None))
    assert (len(found.avoidable), found.unsound) == (1, ())
    assert right.good


def test_plain_python_does_what_compiled_code_does(design_c, tmp_path):
    (tmp_path / "plain.py").write_text(
        (HERE / "design_c.py").read_text().replace("    held =", "    kept = {}\n    held =")
    )
    plain = PythonInBox(tmp_path / "plain.py", "DesignC")
    assert (design_c.note, plain.note) == ("", "attribute kept is no number and no list of numbers")
    seen = []
    for algorithm in (design_c, plain):
        cell = Cell([axis_of(algorithm)], [[Move(target_mm=3.0, speed_mm_s=5.0, rest_s=9.0)]], sinusoidal_table())
        cell.run(until_ps=S)
        cell.settle()
        seen.append(cell.axes[0].view)
    assert seen[0] == seen[1]
    assert (seen[0].completed > 0, seen[0].inserted_counts) == (True, 2 * seen[0].completed)


def test_looking_at_what_is_under_way_changes_nothing(tmp_path):
    """Each call completes a step that nobody has asked for: one for a look would be seen."""
    step = """
    self.kept = {"n": self.kept.get("n", 0) + 1}
    return ab, self.kept["n"], t_ps + 10**9 if t_ps < 15 * 10**9 else 0
    """
    algorithm = PythonInBox(written(tmp_path, step), "Mine")
    looked, other = Station(axis_of(algorithm)), Station(axis_of(algorithm))
    for station in (looked, other):
        station.advance(until_ps=S // 100)
    assert looked.settled_view == looked.settled_view
    assert looked.settled_view.completed > looked.view.completed > 0
    for station in (looked, other):
        station.advance(until_ps=S // 50)
    assert looked.view == other.view


def test_with_its_power_it_begins_anew_at_time_0(tmp_path):
    step = "self.kept['starts'] = self.kept.get('starts', 0) + (t_ps == 0)\nreturn ab, self.kept['starts'], 0"
    station = Station(axis_of(PythonInBox(written(tmp_path, step), "Mine")))
    totals = []
    for way in (True, False, True):
        station.power(way)
        station.advance(until_ps=station.now_ps + S // 100)
        totals.append(station.view.completed)
    assert totals == [1, 1, 2]


@pytest.mark.parametrize(
    ("step", "said"),
    [
        ("raise ValueError('no more')", r"mine.py:Mine: step raised ValueError: no more in mine.py, line 4, 0\.0"),
        ("return ab", r"step returned 0; it has to return \(levels, completed, wake_ps\)"),
        ("return 4, 0, 0", r"step returned levels 4; A \+ 2 \* B is 0 to 3"),
        ("return ab, 2**31 + 1, 0", r"step returned completed = 2147483649; totals stay below 2\^31"),
        ("return ab, 0, t_ps - 5", r"step returned wake_ps = -5, not after its own time 0 ps; 0 stands for none"),
        ("import sys; sys.exit(3)", r"step raised SystemExit: 3 in mine.py, line 4"),
    ],
)
def test_what_ends_a_class_is_one_error(tmp_path, step, said):
    station = Station(axis_of(PythonInBox(written(tmp_path, step), "Mine")))
    with pytest.raises(RtecError, match=said):
        station.advance(until_ps=S // 100)


def test_compiled_code_that_raises_is_told_with_its_line(tmp_path):
    file = tmp_path / "mine.py"
    file.write_text(
        "class Mine:\n    n, table = 0, [1, 2]\n    def step(self, t_ps, ab, requested):\n"
        "        self.n += 1\n        return ab, 0 * self.table[self.n], t_ps + 5\n"
    )
    algorithm = PythonInBox(file, "Mine")
    assert algorithm.note == ""
    with pytest.raises(RtecError, match=r"step raised IndexError: list index out of range in mine.py, line 5"):
        Station(axis_of(algorithm)).advance(until_ps=S // 100)


def test_a_class_that_calls_itself_without_end_is_ended(tmp_path, monkeypatch):
    monkeypatch.setattr(in_box, "_MOST_CALLS", 2000)
    algorithm = PythonInBox(written(tmp_path, "return ab, 0, t_ps + 1"), "Mine")
    with pytest.raises(RtecError, match="asks to be called more than 2000 times, sooner than every 10 ns"):
        Station(axis_of(algorithm)).advance(until_ps=S // 100)


def test_a_step_that_does_not_return_ends_the_process_with_a_line(tmp_path):
    file = written(tmp_path, "while True: pass")
    program = f"""
    from pathlib import Path
    from rtec.machine.station import Station, StationSettings
    from rtec.verify.contract import in_box
    in_box.SILENT_S, in_box._LOOK_S = 0.3, 0.1
    Station(StationSettings(algorithm=in_box.PythonInBox(Path({str(file)!r}), "Mine"))).advance(until_ps=10**9)
    """
    ended = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(program)], capture_output=True, text=True, timeout=60, check=False
    )
    assert (ended.returncode, ended.stderr) == (2, "rtec: mine.py:Mine: step did not return within 0.3 s\n")


@pytest.mark.parametrize(
    ("text", "name", "said"),
    [
        (None, "Mine", "no such file"),
        ("class Other:\n    def step(self, t_ps, ab, requested): ...\n", "Mine", "there is no class Mine; .*: Other"),
        ("class Mine:\n    def step(self): ...\n", "Mine", "takes 0 arguments"),
        ("1 / 0", "Mine", "mine.py: line 1: ZeroDivisionError"),
    ],
)
def test_files_that_cannot_be_used(tmp_path, text, name, said):
    file = tmp_path / "mine.py"
    if text is not None:
        file.write_text(text)
    with pytest.raises(RtecError, match=said):
        PythonInBox(file, name)


def test_files_of_the_same_name_in_two_folders_are_two(tmp_path):
    answers = []
    for total in (1, 2):
        folder = tmp_path / str(total)
        folder.mkdir()
        (folder / "shared.py").write_text(f"TOTAL = {total}\n")
        file = written(folder, "return ab, TOTAL, 0", "from shared import TOTAL")
        station = Station(axis_of(PythonInBox(file, "Mine")))
        station.advance(until_ps=S // 1000)
        answers.append(station.view.completed)
    assert answers == [1, 2]
    assert "shared" not in sys.modules


def test_a_step_that_no_box_has_is_refused():
    with pytest.raises(ArgumentError, match="3 in 00,10,11,01 fits no box"):
        design_with(3, (0, 1, 2, 3))


def test_a_processor_beside_it_is_refused(design_c):
    with pytest.raises(ArgumentError, match="no microcontroller beside it"):
        axis_of(design_c).inserting_by(Microcontroller.named("8051-12mhz"))
