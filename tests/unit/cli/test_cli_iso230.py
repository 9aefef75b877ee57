"""rtec iso230: warnings and --strict, several files, the report's folder, and what is stated for the uncertainty."""

from __future__ import annotations

import pytest

VERB = "iso230"
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


def with_outlier():
    lines = lines_of()
    run, way, place, _ = lines[19].split(",")
    lines[19] = f"{run},{way},{place},95.5"
    return lines


def test_good_file_has_no_warnings(written, said):
    code, out, err = said(written("x.csv", lines_of()), "--strict")
    assert (code, err) == (0, "")
    assert "x.csv: 6 targets, 5 runs, in um" in out


def test_warning_names_line_and_column(written, said, answer):
    file = written("x.csv", with_outlier())
    code, out, err = said(file)
    assert code == 0
    assert err.startswith("warning: line 20, column deviation: 95.5 µm")
    assert "accuracy" in out
    (text,) = answer(file)["warnings"]
    assert text.startswith("line 20, column deviation: 95.5 µm")


def test_strict_makes_warnings_errors_and_writes_nothing(written, said, tmp_path):
    for more in ([], ["--json"], ["-o", tmp_path / "report"]):
        code, out, err = said(written("x.csv", with_outlier()), "--strict", *more)
        assert (code, out) == (2, "")
        first, last = err.splitlines()
        assert first.startswith("error: line 20, column deviation: ")
        assert last.startswith("rtec: x.csv: 1 warning is an error with --strict")
    assert not (tmp_path / "report").exists()


def test_several_files_have_a_column_each(written, said, answer):
    before, after = written("before.csv", lines_of()), written("after.csv", lines_of(scale=0.1))
    code, out, err = said(before, after)
    assert (code, err) == (0, "")
    accuracy = next(line for line in out.splitlines() if "accuracy" in line)
    document = answer(before, after)
    assert document.keys() == {"files"}
    assert [file["name"] for file in document["files"]] == ["before.csv", "after.csv"]
    assert [f"{file['A']:.2f}" for file in document["files"]] == accuracy.replace("│", " ").split()[2:]


def test_files_of_one_name_are_told_by_their_paths(written, answer, tmp_path):
    (tmp_path / "a").mkdir()
    files = [written(name, lines_of()) for name in ("x.csv", "a/x.csv")]
    assert [file["name"] for file in answer(*files)["files"]] == files


def test_report_goes_into_a_folder_that_is_new_or_meant(written, answer, refused, tmp_path):
    place, file = tmp_path / "new" / "report", written("x.csv", lines_of())
    assert answer(file, "-o", place)["report"] == str(place / "report.html")
    assert (place / "report.pdf").stat().st_size > 1000
    (place / "report.html").write_text("mine")
    # the folder is looked at before the work begins: the file is not even there
    assert "not empty" in refused(tmp_path / "nowhere.csv", "-o", place)
    answer(file, "-o", place, "--force")
    assert (place / "report.html").read_text() != "mine"


def test_uncertainty_is_stated_by_the_file_or_an_option(written, said, answer):
    file = written("x.csv", lines_of(facts=["# EVE: 1.2 um", "# device_uncertainty: 0.5 um/m"]))
    found = answer(file)["uncertainty"]
    assert found["contributions"] == pytest.approx({"device": 0.0275, "eve": 1.2 / 3**0.5})
    assert found["missing"] == ["misalignment", "thermometer", "expansion"]
    assert answer(file, "--eve", "2.4 um")["uncertainty"]["U_B"] == pytest.approx(2.4 / 3**0.5 * (2 / 5) ** 0.5)
    out = said(file)[1]
    assert "U, k = 2" in out
    assert "Not included, because not stated: alignment (misalignment)" in out
    out = said(written("bare.csv", lines_of()))[1]
    assert "No measurement uncertainty can be given" in out and "U, k = 2" not in out


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
def test_wrong_facts_and_options_are_one_line(written, refused, facts, arguments, words):
    assert words in refused(written("x.csv", lines_of(facts=facts)), *arguments)


@pytest.mark.parametrize("first", ["target_count", "actual_count"])
def test_counts_of_unknown_size_are_refused(written, refused, first):
    err = refused(written("c.csv", [f"{first},deviation_count,direction,run", "100,3,1,1", "200,4,1,1"]))
    assert f"c.csv: {first} says nothing of length or angle; use a line '# counts_per_rev: 8192'" in err


def test_an_option_of_a_linear_axis_is_refused_on_a_rotary_one(written, refused):
    lines = [line.replace("target_mm", "target_deg") for line in lines_of(column="deviation_arcsec")]
    err = refused(written("c.csv", lines), "--misalignment", "1 mm")
    assert "--misalignment" in err and "rotary" in err


def test_linear_and_rotary_axes_are_not_compared(written, refused):
    rotary = [line.replace("target_mm", "target_deg") for line in lines_of(column="deviation_arcsec")]
    err = refused(written("x.csv", lines_of()), written("c.csv", rotary))
    assert "x.csv of a linear axis and c.csv of a rotary one" in err
