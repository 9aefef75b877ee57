"""rtec compare: what it prints and writes, and what it refuses."""

import json

import numpy as np
import pytest

VERB = "compare"

KNOWN = 'observe = "deviation"\n[[effect]]\nname = "backlash"\nbacklash = "12 um"\n'
OPEN = 'observe = "deviation"\n[[effect]]\nname = "backlash"\n'


def lines_of(error, seed=1, sigma=1.0, facts=(), extra=None):
    """Five bidirectional runs of 11 targets; errors and noise in um."""
    rng = np.random.default_rng(seed)
    up = np.linspace(0.0, 200.0, 11) + rng.uniform(-2, 2, 11)
    heading = "run,direction,target_mm,deviation_um" + ("" if extra is None else f",{extra[0]}")
    lines = [*(f"# {fact}" for fact in facts), heading]
    for run in range(1, 6):
        for way, places in ((1, up), (-1, up[::-1])):
            for x in places:
                more = "" if extra is None else f",{extra[1]}"
                lines.append(f"{run},{way},{x:.4f},{error(x, way) + rng.normal(0, sigma):.5f}{more}")
    return "\n".join(lines) + "\n"


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "z.csv").write_text(lines_of(lambda x, way: 6.0 * way))
    (tmp_path / "other.csv").write_text(lines_of(lambda x, way: 8.0 * way, seed=2))
    (tmp_path / "known.toml").write_text(KNOWN)
    (tmp_path / "open.toml").write_text(OPEN)
    return tmp_path


def residual(folder, half_um, file="z.csv"):
    rows = np.loadtxt(folder / file, delimiter=",", skiprows=1)
    return rows[:, 3] - half_um * rows[:, 1]


def rms(values):
    return float(np.sqrt(np.mean(values**2)))


# what it says


def test_a_stated_model_against_the_measurement(here, answer):
    document = answer("z.csv", "--model", "known.toml")
    assert document["rms"] == pytest.approx(rms(residual(here, 6.0)), rel=1e-9)
    assert document["unit"] == "um"
    assert document["rows"] == 110
    assert document["rms_heldout"] == pytest.approx(document["rms"])
    assert document["noise_floor"] == pytest.approx(1.0, rel=0.2)


def test_a_locked_run_is_judged_by_what_was_fitted_without_it(here, answer):
    document = answer("z.csv", "--model", "open.toml", "--lock")
    rows = np.loadtxt(here / "z.csv", delimiter=",", skiprows=1)
    last = rows[:, 0] == rows[:, 0].max()
    columns = np.stack([rows[:, 1], np.ones(110)], axis=1)
    fitted = np.linalg.lstsq(columns[~last], rows[~last, 3], rcond=None)[0]
    assert document["rows"] == int((~last).sum())
    assert document["rms_heldout"] == pytest.approx(rms(rows[last, 3] - columns[last] @ fitted), rel=1e-3)
    assert document["heldout_by"] == "the last run of z.csv"
    assert answer("z.csv", "--model", "known.toml", "--lock")["rows"] == document["rows"]


def test_the_terminal_shows_the_same(here, said):
    code, out, err = said("z.csv", "--model", "known.toml")
    assert code == 0
    assert f"{rms(residual(here, 6.0)):.3f} µm RMS" in out
    assert "what is left goes with" in out
    assert "row order counts as time" in err


def test_facts_of_the_axis_come_from_options(here, answer):
    assert answer("z.csv", "--screw-pitch", "5 mm", "--signal-period", "20 um")["rows"] == 110
    assert answer("z.csv", "--counts-per-rev", "8192", "--reference-temperature", "68 degF")["rows"] == 110


# what it writes


def test_a_report_is_written_into_a_folder(here, said, answer):
    document = answer("z.csv", "--model", "known.toml", "-o", "report")
    page = here / document["report"]
    assert "RMS" in page.read_text(encoding="utf-8")
    written = json.loads((here / "report" / "result.json").read_text())
    assert written["rms"] == document["rms"]
    code, out, err = said("z.csv", "-o", "report")
    assert (code, out) == (2, "")
    assert "--force" in err
    assert json.loads((here / "report" / "result.json").read_text()) == written
    assert answer("z.csv", "-o", "report", "--force")["rms"] > document["rms"]


# what it refuses


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["nowhere.csv"], ["nowhere.csv", "no such file"]),
        (["z.csv", "--model", "z.csv"], ["z.csv", "TOML"]),
        (["z.csv", "--heldout", "other.csv", "--lock"], ["--lock", "--heldout", "one of the two"]),
        (["z.csv", "--observe", "force"], ["--observe: 'force'", "deviation"]),
        (["z.csv", "--observe", "deviatio"], ["--observe", "did you mean 'deviation'?"]),
        (["z.csv", "--model", "force.toml"], ["force.toml: observe: 'force'"]),
        (["z.csv", "--model", "hot.toml"], ["thermal_growth", "no temperature column"]),
        (["z.csv", "--model", "wrong.toml"], ["wrong.toml: effect 1 (backlash): backlash", "write the unit"]),
        (["z.csv", "--screw-pitch", "5 deg"], ["--screw-pitch", "6.35 mm"]),
        (["z.csv", "--signal-period", "-1 um"], ["--signal-period", "above zero"]),
        (["z.csv", "--counts-per-rev", "many"], ["--counts-per-rev", "8192"]),
        (["z.csv", "--reference-temperature", "20"], ["--reference-temperature", "20 degC"]),
        (["two.csv"], ["two.csv", "3 readings"]),
        (["nan.csv"], ["nan.csv", "line 2"]),
    ],
)
def test_bad_words_and_files_are_one_line_and_2(here, refused, words, says):
    (here / "force.toml").write_text('observe = "force"')
    (here / "hot.toml").write_text('observe = "deviation"\n[[effect]]\nname = "thermal_growth"\n')
    (here / "wrong.toml").write_text(KNOWN.replace("12 um", "12"))
    (here / "two.csv").write_text("target_mm,deviation_um\n1,2\n2,3\n")
    (here / "nan.csv").write_text("target_mm,deviation_um\n1,nan\n2,3\n3,4\n")
    err = refused(*words)
    for part in says:
        assert part in err


def test_strange_names_in_a_file_do_no_harm(here, said):
    text = lines_of(lambda x, way: way, facts=("axis: [bold]x[/bold] <script>",), extra=("[red]odd[/red]", 3.5))
    (here / "odd.csv").write_text(text)
    code, out, err = said("odd.csv")
    assert code == 0
    assert "[red]odd[/red]" in out + err
