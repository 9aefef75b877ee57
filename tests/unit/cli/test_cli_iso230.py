"""rtec iso230: warnings and --strict, several files, the report's folder, and what is stated for the uncertainty."""

from __future__ import annotations

import json

import pytest

from rtec.cli import main
from rtec.metrology import read_measurement, write_laser_file

PLACES = (0.0, 8.0, 17.0, 30.0, 41.0, 55.0)
NOISE = (0.11, -0.23, 0.31, 0.02, -0.17, 0.19, -0.05, 0.27, -0.29, 0.07, 0.13)


def lines_of(*, scale=1.0, runs=5, facts=(), column="deviation_um"):
    """Return a good test on uneven targets: facts, header, rows."""
    rows = []
    for run in range(1, runs + 1):
        for way, places in ((1, PLACES), (-1, PLACES[::-1])):
            for place in places:
                value = scale * (20.0 + 0.2 * place - 3.0 * way) + NOISE[(7 * len(rows)) % 11] + 0.01 * run
                rows.append(f"{run},{way},{place},{value:.4f}")
    return [*facts, f"run,direction,target_mm,{column}", *rows]


@pytest.fixture
def written(tmp_path):
    def write(name, lines):
        file = tmp_path / name
        file.write_text("\n".join(lines) + "\n")
        return str(file)

    return write


def run(capsys, *arguments):
    """Return exit code, stdout and stderr of ``rtec iso230``."""
    code = main(["iso230", *arguments])
    said = capsys.readouterr()
    return code, said.out, said.err


def with_outlier():
    lines = lines_of()
    run, way, place, _ = lines[19].split(",")
    lines[19] = f"{run},{way},{place},95.5"
    return lines


def test_good_file_has_no_warnings(written, capsys):
    code, out, err = run(capsys, written("x.csv", lines_of()), "--strict")
    assert (code, err) == (0, "")
    assert "x.csv: 6 targets, 5 runs, in um" in out


def test_warning_names_line_and_column(written, capsys):
    file = written("x.csv", with_outlier())
    code, out, err = run(capsys, file)
    assert code == 0
    assert err.startswith("warning: line 20, column deviation: 95.5 µm")
    assert "accuracy" in out
    code, out, err = run(capsys, file, "--json")
    assert (code, err) == (0, "")
    (text,) = json.loads(out)["warnings"]
    assert text.startswith("line 20, column deviation: 95.5 µm")


def test_strict_makes_warnings_errors_and_writes_nothing(written, capsys, tmp_path):
    for more in ([], ["--json"], ["-o", str(tmp_path / "report")]):
        code, out, err = run(capsys, written("x.csv", with_outlier()), "--strict", *more)
        assert (code, out) == (2, "")
        first, last = err.splitlines()
        assert first.startswith("error: line 20, column deviation: ")
        assert last.startswith("rtec: x.csv: 1 warning is an error with --strict")
    assert not (tmp_path / "report").exists()


def test_what_the_standard_asks_for_is_said_too(written, capsys):
    code, out, err = run(capsys, written("x.csv", lines_of(runs=4)), "--strict")
    assert (code, out) == (2, "")
    asked = "column target: a target was read only 4 times from a direction, the first at 0 mm forward"
    assert f"error: {asked}; ISO 230-2 asks for 5 runs each way" in err


def test_several_files_have_a_column_each(written, capsys):
    before, after = written("before.csv", lines_of()), written("after.csv", lines_of(scale=0.1))
    code, out, err = run(capsys, before, after)
    assert (code, err) == (0, "")
    a = next(line for line in out.splitlines() if "accuracy" in line)
    numbers = [float(cell) for cell in a.replace("│", " ").split()[2:]]
    assert len(numbers) == 2
    assert numbers[0] > 5 * numbers[1]
    code, out, err = run(capsys, before, after, "--json")
    files = json.loads(out)["files"]
    assert [file["name"] for file in files] == ["before.csv", "after.csv"]
    assert [round(file["A"], 2) for file in files] == numbers
    assert json.loads(out).keys() == {"files"}


def test_files_of_one_name_are_told_by_their_paths(written, capsys, tmp_path):
    (tmp_path / "a").mkdir()
    code, out, _ = run(capsys, written("x.csv", lines_of()), written("a/x.csv", with_outlier()), "--json")
    assert [file["name"] for file in json.loads(out)["files"]] == [str(tmp_path / "x.csv"), str(tmp_path / "a/x.csv")]
    assert code == 0


def test_report_goes_into_a_new_folder(written, capsys, tmp_path):
    place = tmp_path / "new" / "report"
    code, out, _ = run(capsys, written("x.csv", lines_of()), "-o", str(place), "--json")
    assert code == 0
    assert json.loads(out)["report"] == str(place / "report.html")
    assert (place / "report.pdf").stat().st_size > 1000


def test_nothing_that_exists_is_overwritten(written, capsys, tmp_path):
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "report.html").write_text("mine")
    # the folder is looked at before the work begins: the file is not even there
    code, out, err = run(capsys, str(tmp_path / "nowhere.csv"), "-o", str(tmp_path / "full"))
    assert (code, out) == (2, "")
    assert "not empty" in err
    code, _, _ = run(capsys, written("x.csv", lines_of()), "-o", str(tmp_path / "full"), "--force")
    assert code == 0
    assert (tmp_path / "full" / "report.html").read_text() != "mine"


def test_linear_and_rotary_axes_are_not_compared(written, capsys):
    rotary = [line.replace("target_mm", "target_deg") for line in lines_of(column="deviation_arcsec")]
    code, out, err = run(capsys, written("x.csv", lines_of()), written("c.csv", rotary))
    assert (code, out) == (2, "")
    assert "x.csv of a linear axis and c.csv of a rotary one" in err


def test_uncertainty_is_stated_by_the_file_or_an_option(written, capsys):
    file = written("x.csv", lines_of(facts=["# EVE: 1.2 um", "# device_uncertainty: 0.5 um/m"]))
    _, out, _ = run(capsys, file, "--json")
    found = json.loads(out)["uncertainty"]
    assert found["contributions"] == pytest.approx({"device": 0.0275, "eve": 1.2 / 3**0.5})
    assert found["missing"] == ["misalignment", "thermometer", "expansion"]
    _, out, _ = run(capsys, file, "--json", "--eve", "2.4 um")
    assert json.loads(out)["uncertainty"]["U_B"] == pytest.approx(2.4 / 3**0.5 * (2 / 5) ** 0.5)
    _, out, _ = run(capsys, file)
    assert "U, k = 2" in out
    assert "Not included, because not stated: alignment (misalignment)" in out


def test_nothing_stated_is_said_plainly(written, capsys):
    _, out, _ = run(capsys, written("x.csv", lines_of()))
    assert "No measurement uncertainty can be given" in out
    assert "U, k = 2" not in out


@pytest.mark.parametrize(
    ("facts", "arguments", "words"),
    [
        ([], ["--eve", "1.2"], "rtec: --eve: '1.2' has no unit"),
        ([], ["--off-reference", "3 um"], "rtec: --off-reference: '3 um' is not valid"),
        (["# eve: much"], [], "x.csv: eve: 'much' is not valid"),
        (["# screw_pitch: 5 turns"], [], "x.csv: screw_pitch"),
        ([], ["--period", "-5 mm"], "rtec: --period: '-5 mm' is not valid; use a length above zero"),
        ([], ["--period", "5"], "rtec: --period: '5' has no unit; use a length with its unit, such as"),
        ([], ["--unit", "arcsec"], "rtec: --unit: 'arcsec'"),
    ],
)
def test_wrong_facts_and_options_are_one_line(written, capsys, facts, arguments, words):
    code, out, err = run(capsys, written("x.csv", lines_of(facts=facts)), *arguments)
    assert (code, out) == (2, "")
    assert words in err
    assert err.count("\n") == 1


@pytest.mark.parametrize(
    ("fact", "heading"),
    [("", "target_count,deviation_count"), ("", "actual_count,deviation_count"),
     ("# encoder: 8192 counts/rev", "target_count,deviation_count")],
)  # fmt: skip
def test_counts_of_unknown_size_are_refused(written, capsys, fact, heading):
    code, out, err = run(capsys, written("c.csv", [fact, f"{heading},direction,run", "100,3,1,1", "200,4,1,1"]))
    first = heading.partition(",")[0]
    assert (code, out) == (2, "")
    assert f"c.csv: {first} says nothing of length or angle; use a line '# counts_per_rev: 8192'" in err


def test_facts_of_a_linear_axis_are_left_alone_on_a_rotary_one(written, capsys):
    lines = lines_of(facts=["# misalignment: 1 mm", "# screw_pitch: 5 mm"], column="deviation_arcsec")
    file = written("c.csv", [line.replace("target_mm", "target_deg") for line in lines])
    code, out, _ = run(capsys, file, "--json")
    assert code == 0
    assert json.loads(out)["uncertainty"]["missing"] == ["device", "eve"]
    code, _, err = run(capsys, file, "--misalignment", "1 mm")
    assert code == 2
    assert "--misalignment" in err
    assert "rotary" in err


def test_readings_of_the_laser_system_have_numbers_where_lines_lack(written, capsys, tmp_path):
    read = read_measurement(written("x.csv", with_outlier())).to_readings()
    write_laser_file(tmp_path / "x.dat", read)
    code, _, err = run(capsys, str(tmp_path / "x.dat"))
    assert code == 0
    assert err.startswith("warning: reading 19, column deviation: 95.5 µm")


def test_two_readings_are_still_judged(written, capsys):
    file = written("x.csv", ["direction,target_mm,deviation_um", "1,0,1", "1,5,2"])
    code, out, _ = run(capsys, file, "--json")
    assert code == 0
    assert json.loads(out)["E_forward"] == pytest.approx(1)
