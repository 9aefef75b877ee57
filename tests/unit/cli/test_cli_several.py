"""Several measurements at once: before and after, or axis by axis."""

import json

import numpy as np
import pytest

from rtec.cli import main


@pytest.fixture
def files(tmp_path):
    rng = np.random.default_rng(3)
    for name, backlash in (("before.csv", 12.0), ("after.csv", 3.0)):
        lines = ["run,direction,target_mm,deviation_um"]
        for run in range(1, 5):
            for way in (1, -1):
                for target in np.linspace(0.0, 300.0, 13)[::way]:
                    error = 0.02 * target - (backlash if way < 0 else 0.0) + rng.normal(0.0, 0.3)
                    lines.append(f"{run},{way},{target},{error:.4f}")
        (tmp_path / name).write_text("\n".join(lines) + "\n")
    return tmp_path / "before.csv", tmp_path / "after.csv"


@pytest.fixture
def rtec(capsys):
    def run(*arguments):
        code = main([*map(str, arguments)])
        said = capsys.readouterr()
        return code, said.out, said.err

    return run


def test_diagnose_says_what_differs(rtec, files):
    code, out, _ = rtec("diagnose", *files, "--json")
    assert code == 0
    document = json.loads(out)
    assert [one["file"] for one in document["files"]] == ["before.csv", "after.csv"]
    (backlash,) = [one for one in document["changes"] if one["effect"] == "backlash"]
    assert backlash["outcome"] == "differs"
    assert abs(backlash["difference"]) == pytest.approx(9.0, abs=0.3)
    assert {one["outcome"] for one in document["changes"] if one["effect"] == "scale"} == {"same"}


def test_compare_shows_them_beside_each_other_and_writes_a_page_of_all(rtec, files, tmp_path):
    (tmp_path / "m.toml").write_text('observe = "deviation"\n[[effect]]\nname = "backlash"\n')
    report = tmp_path / "report"
    code, out, _ = rtec("compare", *files, "--model", tmp_path / "m.toml", "-o", report)
    assert code == 0
    assert "after.csv against before.csv" in out
    assert "differs" in out
    assert {path.name for path in report.iterdir()} == {
        "report.html",
        "result.json",
        "figures",
        "1-before",
        "2-after",
    }
    page = (report / "report.html").read_text()
    assert 'href="1-before/report.html"' in page
    assert "backlash" in page
    assert (report / "2-after" / "report.html").is_file()


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (["--save", "m.toml"], "--save does not go with several measurements"),
        (["--lock"], "--lock"),
    ],
)
def test_options_of_a_single_measurement_are_refused(rtec, files, more, words):
    code, _, err = rtec("diagnose", *files, *more)
    assert code == 2
    assert words in err


def test_the_same_file_twice_and_another_quantity_are_refused(rtec, files, tmp_path):
    code, _, err = rtec("compare", files[0], files[0])
    assert (code, "given twice" in err) == (2, True)
    rows = "\n".join(f"{k},{k % 7},{0.1 * k}" for k in range(30))
    (tmp_path / "force.csv").write_text("time_s,actual_mm,force_n\n" + rows + "\n")
    code, _, err = rtec("compare", files[0], tmp_path / "force.csv")
    assert (code, "force in n" in err.lower()) == (2, True)
    assert "\n" not in err.strip()
