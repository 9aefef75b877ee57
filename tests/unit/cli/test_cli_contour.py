"""rtec contour: the document, the report, a log that rtec diagnose reads, and what it refuses."""

import json

import pytest

from rtec.cli import main

VERB = "contour"


@pytest.fixture
def program(tmp_path):
    file = tmp_path / "part.ngc"
    file.write_text("G21 G90 G0 X0 Y0\nG1 X30 F3000\nG2 X40 Y-10 I0 J-10\nG1 Y-25\n")
    return file


def test_the_report_holds_a_log_of_both_axes(answer, program, tmp_path, capsys):
    document = answer("--path", program, "--drive", "linear-motor", "-o", tmp_path / "out")
    assert document["limits_held"]
    assert document["limit_um"] is None
    report = (tmp_path / "out" / "report.html").read_text()
    assert "following error" in report
    assert json.loads((tmp_path / "out" / "result.json").read_text())["time_s"] == document["time_s"]
    log = tmp_path / "out" / "log.csv"
    heading = log.read_text().splitlines()[0].split(",")
    assert {"time_s", "target_x_mm", "actual_y_mm", "current_y_a"} <= set(heading)
    assert main(["compare", str(log), "--axis", "y", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["rms"] > 0.0


def test_it_exits_with_1_where_a_limit_is_not_kept(said, program):
    code, out, _ = said("--path", program, "--drive", "ball-screw", "--limit", "1 nm")
    assert code == 1
    assert "does not keep the limit" in out


def test_a_box_between_drives_and_controller(answer, program, tmp_path):
    table = tmp_path / "scale.csv"
    table.write_text("# backlash: 0 um\nposition_mm,forward_mm\n-100,-0.01\n100,0.01\n")
    given = ("--path", program, "--drive", "ball-screw", "--count", "1um", "--scale-error", f"x={table}")
    found = answer(*given, "--design", "c")["pulses"]
    assert (found["design"], found["axes"]["x"]["step_counts"]) == ("c", 2)
    assert found["axes"]["x"]["corrections_inserted"] > 0 == found["axes"]["y"]["corrections_inserted"]
    assert found["axes"]["x"]["audit"]
    assert answer(*given)["pulses"]["design"] is None


def test_what_it_refuses(refused, program, tmp_path):
    assert "no such" in refused("--path", tmp_path / "gone.ngc", "--drive", "ball-screw")
    assert "linear-motor" in refused("--path", "circle", "--drive", "belt")
    program.write_text("G21 G1 X10 F100\nM8\nG33 X20 K1\n")
    assert "line" in refused("--path", program, "--drive", "ball-screw")
    program.write_text('{"degree": 3, "knots": [0, 1], "control_points": [[0, 0]]}')
    assert refused("--path", program, "--drive", "ball-screw")
    circle = ("--path", "circle", "--drive", "ball-screw")
    assert "--design needs --count" in refused(*circle, "--design", "c")
    assert "x, y or z" in refused(*circle, "--count", "1um", "--scale-error", "w=scale.csv")
    assert "wide in x" in refused(*circle, "--travel", "20cm")
