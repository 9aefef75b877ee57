"""Corrected programs, run on a machine with the errors that they are corrected for (`gcode_oracle`)."""

import itertools
import tracemalloc

import numpy as np
import pytest
from gcode_oracle import commands, farthest, tool

from rtec.errors import ArgumentError, FileFormatError, OutputError
from rtec.predictors import BidirectionalTable
from rtec.study.compensation import compensation_of
from rtec.study.gcode.program import correct_program

PLAY_MM = 0.012
PLACES = np.linspace(-150.0, 150.0, 3001)


def curve(x):
    """Error of the axis beside its play, in mm."""
    return 0.006 * np.sin(2.0 * np.pi * np.asarray(x) / 17.0) + 1.5e-4 * np.asarray(x) + 0.02


ERRORS = BidirectionalTable.on_grid(PLACES, curve(PLACES) - PLAY_MM / 2.0, curve(PLACES) + PLAY_MM / 2.0)
WITHIN_MM = 5e-4
TABLE = compensation_of(ERRORS, -150.0, 150.0, within_mm=WITHIN_MM, most=5000)


def corrected(folder, program, **more):
    source, target = folder / "part.nc", folder / "out.nc"
    source.write_bytes(program.encode("latin-1"))
    done = correct_program(source, target, table=TABLE, predictor=ERRORS, within_mm=WITHIN_MM, **more)
    return target.read_bytes().decode("latin-1"), done


def judged(program, text, axis=0):
    """Return how far the tool is from the programmed path, without a correction and with it, in feed moves."""
    wanted = commands(program, steps=2000)
    return [farthest(tool(commands(one, steps=10), axis, curve, PLAY_MM), wanted) for one in (program, text)]


SHAPES = {
    "lines": "G90 G21\nG0 X-60 Y0 Z0\nG1 X40 Y20 F500\nX10 Y50\nX-30\nY10\nX-60 Y0\n",
    "steps back and forth": "G0 X0 Y0 Z0\nG91\nG1 X12 F100\nX-5\nX5 Y3\nX-0.01\nX.01\nX-30 Y-1\nG90\nX80\n",
    "inches": "G20\nG0 X0 Y0 Z0\nG1 X2.5 Y1 F10\nX-3\nG91 X.5 Y.25\nG21 G90 X10\nX-10\n",
    "circles": "G0 X10 Y0 Z0\nG2 X10 Y0 I-25 J0 F300\nG3 I20 J0\nG3 X-40 Y50 I-50\nG2 X0 Y90 R40\nG3 X-10 Y80 R-10\n",
    "arcs in increments": "G0 X0 Y0 Z0\nG1 X5 F99\nG91\nG3 X30 Y30 I0 J30\nG2 X-20 Y-5 R14\nG1 X-8\nG3 X0 Y0 I9 J2\n",
    "arcs in inches": "G20 G0 X0 Y0 Z0\nG1 X.1 F9\nG3 X1 Y1 I0.45 J.5\nG2 X0.1 Y0 R.8\n",
    "a helix": "G0 X30 Y0 Z0\nG3 X30 Y0 Z-4 I-30 J0 F100\nG1 Z0\n",
    "other planes": "G0 X0 Y0 Z0\nG18 G2 X30 Z0 I15 K0 F99\nG3 X0 Z0 I-15 K0\nG19 G2 Y9 Z9 J9\nG17 G1 X4\n",
}  # fmt: skip


@pytest.mark.parametrize("name", SHAPES)
def test_the_tool_goes_where_the_program_says(tmp_path, name):
    program = SHAPES[name]
    text, done = corrected(tmp_path, program)
    before_mm, left_mm = judged(program, text)
    assert before_mm > 0.015
    assert left_mm < 0.0012  # lines, arcs and rounding, each within half a micrometre, and the chords of the oracle
    assert done.points_max_mm < 6e-4 and done.between_max_mm < 1.2e-3
    assert done.before_max_mm > 0.015


@pytest.mark.parametrize("seed", range(6))
def test_and_so_it_does_in_programs_by_chance(tmp_path, seed):
    rng = np.random.default_rng(seed)
    lines, at = ["G0 X0 Y0 Z0", "G1 F100"], np.zeros(2)
    for _ in range(15):
        to = rng.uniform(-90.0, 90.0, 2).round(3)
        kind = rng.integers(0, 4)
        if kind == 0:
            lines.append(f"G90 G0 X{to[0]} Y{to[1]}")
        elif kind == 1:
            lines.append(f"G90 G1 X{to[0]} Y{to[1]}")
        elif kind == 2:
            step = (to - at).round(3)
            lines.append(f"G91 G1 X{step[0]:.3f} Y{step[1]:.3f}")
        else:
            radius = max(np.hypot(*(to - at)) * rng.uniform(0.51, 2.0), 1.0)
            lines.append(f"G90 G{rng.integers(2, 4)} X{to[0]} Y{to[1]} R{radius:.4f}")
        at = to
    program = "\n".join(lines)
    text, done = corrected(tmp_path, program)
    before_mm, left_mm = judged(program, text)
    assert before_mm > 0.015 and left_mm < 0.0013
    assert max(done.points_max_mm, done.between_max_mm) < 1.3e-3


def test_the_axis_may_be_another_one_and_lie_elsewhere(tmp_path):
    program = "G0 X0 Y0 Z0\nG1 Z-5 Y10 F80\nY-20\nG2 X10 Y-30 J-10 I0\n"
    text, _ = corrected(tmp_path, program, axis="Y", zero_mm=30.0)
    wanted = commands(program, steps=2000)
    actual = tool(commands(text, steps=10), 1, lambda y: curve(y + 30.0), PLAY_MM)
    assert farthest(actual, wanted) < 0.0012


# what stays as it is


def test_all_else_stays_as_it_is_written(tmp_path):
    program = (
        "%\r\nO0001 (X10 in a comment)\r\n\r\nN10 g21 G90 t1 m6\r\nN20 G0 x 0. Y5 S900 M3 (to the start)\r\n"
        "N30 G1 X+01.5 Y7 F80 ; X77\r\nG43 H1 Z3\r\nG123 Y4\r\nM8\r\nN40 M30\r\n%\r\nX99\r\n"
    )
    text, done = corrected(tmp_path, program, head=("a (b)", "c"))
    x0, x1 = -float(curve(0.0) - PLAY_MM / 2), 1.5 - float(curve(1.5) - PLAY_MM / 2)
    lines = text.split("\r\n")
    assert lines[:5] == ["%", "(a -b-)", "(c)", "O0001 (X10 in a comment)", ""]
    assert lines[6].startswith("N20 G0 x -0.01") and lines[6].endswith(" Y5 S900 M3 (to the start)")
    assert lines[-8:] == ["G43 H1 Z3", "G123 Y4", "M8", "N40 M30", "%", "X99", ""][-8:] or lines[-7] == "G43 H1 Z3"
    found = [float(line.lower().split("x")[1].split()[0]) for line in lines[6:8]]
    assert found == pytest.approx([x0, x1], abs=6e-4)
    notes = dict(done.notes)
    assert "G123 is not known, and left as it is" in notes and any("length of the tool" in one for one in notes)
    assert notes["X comes from an unknown place: taken as forward"] == 5


def test_words_that_act_at_the_end_stay_there_where_a_move_is_split(tmp_path):
    text, _ = corrected(tmp_path, "G0 X0 Y0\nN7 G1 X100 F50 M3 S5 M0 (go)\nG90 M2\n")
    lines = text.splitlines()
    assert lines[1].startswith("N7 F50 M3 S5 (go) G1 X") and lines[-2:] == ["M0", "G90 M2"]
    assert all(line.startswith("G1 X") for line in lines[2:-2]) and len(lines) > 9


def test_numbers_have_the_resolution_that_is_asked_for(tmp_path):
    for resolution_mm, digits, unit in ((1e-4, 4, 1.0), (1e-3, 3, 1.0), (1e-4, 6, 25.4)):
        text, _ = corrected(tmp_path, "G0 X1\nX2\nX30\nX-4\n", resolution_mm=resolution_mm, unit_mm=unit)
        told = [len(line.split(".")[1]) for line in text.splitlines()]
        assert max(told) == digits


@pytest.mark.parametrize("program", ["", "\n", "%\n%\n", "(nothing)", "; nothing\n", "G21 G90"])
def test_a_program_without_moves_stays_whole(tmp_path, program):
    text, done = corrected(tmp_path, program)
    assert (text, done.moves, done.points_max_mm) == (program, 0, 0.0)


def test_rapids_are_not_split_and_holes_are_drilled_where_they_belong(tmp_path):
    program = "G0 X-100 Y0 Z9\nX100\nG81 X50 Y3 Z-5 R2 F90\nX-50\nG80\nG0 Y0\n"
    text, done = corrected(tmp_path, program)
    assert len(text.splitlines()) == 6 and done.moves == 4
    points = commands(text.replace("G81", "G0").replace("Z-5 R2", ""), steps=10)
    actual = tool(points, 0, curve, PLAY_MM)[:4, 0]
    assert actual == pytest.approx([-100.0, 100.0, 50.0, -50.0], abs=6e-4)


def test_beyond_the_table_the_error_of_its_end_is_held_and_counted(tmp_path):
    text, done = corrected(tmp_path, "G0 X0\nX400\nX-400\n")
    sent = [float(line.split("X")[1]) for line in text.splitlines()]
    assert sent[1:] == pytest.approx(
        [400.0 - float(ERRORS.error_mm(150.0, 1)), -400.0 - float(ERRORS.error_mm(-150.0, -1))], abs=1e-4
    )
    assert done.outside == 2


# what cannot be followed


@pytest.mark.parametrize(
    ("program", "says"),
    [
        ("G1 X[#1+2]", "line 1: a move with something computed"),
        ("G1 X#1", "computed"),
        ("G1 X=R1", "computed"),
        ("G0 X1\nM98 P100", "line 2: a call of a subprogram"),
        ("G65 P9", "a macro"),
        ("o100 sub\nG1 X1", "SUB"),
        ("IF [#1 EQ 2] GOTO 10", "IF is not followed"),
        ("TRANS X10", "TRANS"),
        ("G92 X0", "G92 moves the zero of X"),
        ("G10 L2 P1 X5", "G10 moves the zero"),
        ("G54\nG0 X1\nG55\nX2", "line 3: G55 after G54"),
        ("G91 G1 X1", "from an unknown place"),
        ("X5", "before G0"),
        ("G68 X0 Y0 R30", "turned"),
        ("G76 P1 X5", "a thread"),
        ("G7\nG1 X4", "diameters"),
        ("G3 X4 I2", "unknown place"),
        ("G0 X0 Y0\nG2 X4 Y0 I3", "begins with radius 3 mm"),
        ("G0 X0 Y0\nG2 X4 Y0 R1", "radius 1 mm"),
        ("G0 X0 Y0\nG2 X4 Y0 I2 P2", "several turns"),
        ("/G1 X4", "may be skipped"),
        ("G1 X4 X5", "X stands twice"),
        ("G0 X4\nG1 U-2", "U, which may be a step of X"),
        ("G0 X0\nG1 X90 ,R2", "computed"),
        ("G0 X0\nG1 X90 R2", "R in a move that has to be split"),
        ("G0 X0\nG1 X90 E5", "E in a move that has to be split"),
        ("O1\nG0 X4\nM99\nO2\nX5", "line 4: a second program"),
        ("(note (a) X20)", "something computed"),
        ("G123 X4", "G123 with X is not known"),
        ("G0 X0\nG93 G1 X100 F2", "inverse time"),
        ("G0 X0\nG91 G81 X3 Z-1 L4", "repeated in increments"),
        ("G1 X\x00", "a byte of 0"),
        ("G1 X1" + " " * 20000, "a line of 16384 characters"),
    ],
)
def test_what_cannot_be_followed_is_refused_with_its_line(tmp_path, program, says):
    with pytest.raises(FileFormatError, match=says):
        corrected(tmp_path, program)
    assert not (tmp_path / "out.nc").exists()


def test_along_the_drill_a_cycle_is_refused(tmp_path):
    with pytest.raises(FileFormatError, match="a cycle along Z"):
        corrected(tmp_path, "G0 X0 Z5\nG81 X1 Z-4 R1\n", axis="Z")


@pytest.mark.parametrize("code", ["G28 X0", "G53 G0 X-10", "G31 X40 F9", "G38.2 X40 F9"])
def test_after_a_move_to_nowhere_the_axis_comes_from_an_unknown_place(tmp_path, code):
    text, done = corrected(tmp_path, f"G0 X0\nG1 X5 F9\n{code}\nG90 G1 X100\n")
    assert text.splitlines()[-2] == code and text.splitlines()[-1].startswith("G90 G1 X")
    assert any(code.split()[0] in sentence for sentence, _ in done.notes)


def test_the_other_axes_go_away_alone(tmp_path):
    text, done = corrected(tmp_path, "G0 X0 Z9\nG28 Z0\nG28 W0\nG91 G1 X100 F9\n")
    _, other = corrected(tmp_path, "G0 X0 A5\nG92 A0\nG91 G1 X100 A7 F9\n")  # A is known no more
    assert [one for one, _ in other.notes][-1] == "another axis comes from an unknown place: the move is not split"
    assert len(text.splitlines()) > 9 and all("unknown" not in one or "forward" in one for one, _ in done.notes)


def test_texts_and_what_follows_the_end_are_no_moves(tmp_path):
    program = 'MSG("X axis, G1 X5")\n%\nG0 X1\n%\nX5\n'
    text, done = corrected(tmp_path, program)
    assert text.splitlines()[0] == program.splitlines()[0] and text.splitlines()[-1] == "X5" and done.moves == 1


def test_what_is_computed_beside_the_axis_is_left(tmp_path):
    text, done = corrected(tmp_path, "#1=5\nG0 X1\nG4 P#1\nG10 L20 P1 Z3\nM99\n")
    assert text.splitlines()[0] == "#1=5" and text.splitlines()[2:] == ["G4 P#1", "G10 L20 P1 Z3", "M99"]
    assert dict(done.notes)["what is computed is left as it is"] == 1


# files


def test_files_that_cannot_be(tmp_path):
    source = tmp_path / "part.nc"
    source.write_text("G0 X1\n")
    given = {"table": TABLE, "predictor": ERRORS}
    (tmp_path / "link.nc").symlink_to(source)
    for same in (source, tmp_path / "." / "part.nc", tmp_path / "link.nc"):
        with pytest.raises(ArgumentError, match="another file than the program"):
            correct_program(source, same, **given)
    with pytest.raises(OutputError):
        correct_program(source, tmp_path / "no" / "out.nc", **given)
    with pytest.raises(FileFormatError, match="no such file"):
        correct_program(tmp_path / "none.nc", tmp_path / "out.nc", **given)
    with pytest.raises(FileFormatError, match="cannot be read"):
        correct_program(tmp_path, tmp_path / "out.nc", **given)
    with pytest.raises(ArgumentError, match="axis"):
        correct_program(source, tmp_path / "out.nc", axis="A", **given)
    assert source.read_text() == "G0 X1\n"


@pytest.mark.sweep
def test_memory_does_not_grow_with_the_program(tmp_path):
    source, peaks = tmp_path / "long.nc", []
    for lines in (20_000, 80_000):
        numbers = itertools.cycle(np.linspace(-9.0, 9.0, 37).round(3).tolist())
        source.write_text("G0 X0 Y0\nG1 F9\n" + "".join(f"X{next(numbers)} Y1\n" for _ in range(lines)))
        tracemalloc.start()
        done = correct_program(source, tmp_path / f"{lines}.nc", table=TABLE, predictor=ERRORS)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
        assert done.moves == lines + 1
    assert peaks[1] < 1.2 * peaks[0]
