"""Several measurements at once: before and after, or axis by axis."""

import numpy as np
import pytest

from rtec.cli import main

VERB = "diagnose"


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


def test_compare_shows_them_beside_each_other_and_writes_a_page_of_all(files, tmp_path, capsys):
    (tmp_path / "m.toml").write_text('observe = "deviation"\n[[effect]]\nname = "backlash"\n')
    report = tmp_path / "report"
    assert main(["compare", *map(str, files), "--model", str(tmp_path / "m.toml"), "-o", str(report)]) == 0
    out = capsys.readouterr().out
    assert "after.csv against before.csv" in out and "differs" in out
    names = {"report.html", "result.json", "figures", "1-before", "2-after"}
    assert {path.name for path in report.iterdir()} == names
    page = (report / "report.html").read_text()
    assert 'href="1-before/report.html"' in page and "backlash" in page
    assert (report / "2-after" / "report.html").is_file()


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (["--save", "m.toml"], "--save does not go with several measurements"),
        (["--lock"], "--lock"),
    ],
)
def test_options_of_a_single_measurement_are_refused(refused, files, more, words):
    assert words in refused(*files, *more)


def test_the_same_file_twice_and_another_quantity_are_refused(refused, files, tmp_path):
    assert "given twice" in refused(files[0], files[0])
    rows = "\n".join(f"{k},{k % 7},{0.1 * k}" for k in range(30))
    (tmp_path / "force.csv").write_text("time_s,actual_mm,force_n\n" + rows + "\n")
    assert "force in n" in refused(files[0], tmp_path / "force.csv").lower()
