"""rtec train: from a measurement to the table of predictors, and the best of them to work."""

import contextlib
import io
import json

import numpy as np
import pytest

from rtec.cli import main
from rtec.errors import ArgumentError
from rtec.inference.static_predictor import predictor_of_file
from rtec.predictors import read_predictor
from rtec.study.definition import read_study

PITCH = 5.0
PICKED = "table bi-directional linear"
QUICK = ["--budget", "1 ms", "--starts", "1"]


def measured(path, step, runs, *, seed, top=80.0):
    """An axis on a screw: slope, backlash, and a wave every turn; 1 um of noise."""
    rng = np.random.default_rng(seed)
    x = np.arange(0.0, top + 1e-9, step)
    lines = ["# screw_pitch: 5 mm", "run,direction,target_mm,deviation_um"]
    for run in range(1, runs + 1):
        for way, places in ((1, x), (-1, x[::-1])):
            error = 0.2 * places + 20.0 * (way < 0) + 6.0 * np.sin(2.0 * np.pi * places / PITCH)
            error += rng.normal(0.0, 1.0, places.size)
            lines += [f"{run},{way},{p:.6f},{e:.6f}" for p, e in zip(places, error, strict=True)]
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("train")
    measured(folder / "axis.csv", 0.8, 3, seed=1)
    measured(folder / "check.csv", 1.3, 2, seed=2)
    return folder


@pytest.fixture(scope="module")
def trained(files):
    """One training for all: its exit code and document, with the file of a picked predictor."""
    words = [str(files / "axis.csv"), "--heldout", str(files / "check.csv"), "-o", str(files / "table.toml")]
    words += ["--pick", PICKED, "--figure", str(files / "t.png"), "--budget", "2 s"]
    out = io.StringIO()
    with contextlib.redirect_stdout(out):
        code = main(["train", *words, "--json"])
    return code, json.loads(out.getvalue())


def test_every_row_has_figures_or_a_reason(trained):
    code, document = trained
    assert code == 0
    rows = document["rows"]
    assert {row["kind"] for row in rows} == {"none", "table", "model", "network"}
    assert len(rows) == 18
    for row in rows:
        assert row["rms_heldout_um"] is not None or row["reason"]
        for key in ("rms_train_um", "train_s", "eval_ns", "parameters", "coverage"):
            assert key in row


def test_the_picked_row_is_written_and_the_figure_is_there(trained, files):
    assert trained[1]["written"] == PICKED
    known = read_predictor(files / "table.toml")
    assert (known.name, known.source) == (PICKED, "axis.csv")
    assert known.predictor.range_mm == (0.0, 80.0)
    assert 0.0 < known.interval_mm < 0.02
    assert (files / "t.png").stat().st_size > 50_000


def test_the_written_predictor_drives_a_study_with_caution(trained, files):
    (files / "s.toml").write_text(
        'name = "mine"\n[program]\nstart = "1 inch"\nend = "3 inch"\nincrement = "0.5 inch"\n'
        '[predictor]\nmodel = "table.toml"\ncautious = true\n'
    )
    belief = read_study(files / "s.toml").model
    known = read_predictor(files / "table.toml")
    bold = known.predictor.error_mm(40.0, +1)
    assert bold > 0.005
    assert belief.error_mm(40.0, +1) == pytest.approx(bold - known.interval_mm)


def test_named_effects_are_written_with_how_sure_they_are(files):
    file = files / "effects.toml"
    words = ["--heldout", str(files / "check.csv"), "-o", str(file), "--pick", "effects", "--budget", "1 s"]
    assert main(["train", str(files / "axis.csv"), *words, "--starts", "1"]) == 0
    bold, careful = (predictor_of_file(file, 0.0, 80.0, cautious=cautious)[0] for cautious in (False, True))
    assert 1e3 * (bold.error_mm(40.0, +1) - careful.error_mm(40.0, +1)) == pytest.approx(1.645, abs=0.5)


@pytest.mark.parametrize(
    ("words", "part"),
    [
        (["axis.csv", "-o", "best.txt"], "ends in .toml"),
        (["axis.csv", "--pick", "effects"], "-o MODEL.toml"),
        (["axis.csv", "-o", "x.toml", "--pick", "network 41 lm"], "network 40 lm"),
        (["axis.csv", "--budget", "-3 s"], "above 0 s"),
        (["axis.csv", "--figure", "x.doc"], ".png"),
        (["few.csv"], "8 or more"),
        (["turning.csv"], "positions"),
        (["axis.csv", *QUICK, "--pick", "angles", "-o", "x.toml"], "columns such as position_2_mm"),
    ],
)
def test_bad_input_is_one_line_and_exit_code_2(files, monkeypatch, capsys, words, part):
    monkeypatch.chdir(files)
    measured(files / "few.csv", 40.0, 3, seed=3)
    text = (files / "axis.csv").read_text().replace("# screw_pitch: 5 mm\n", "")
    turning = text.replace("target_mm", "target_deg").replace("deviation_um", "deviation_arcsec")
    (files / "turning.csv").write_text(turning)
    assert main(["train", *words]) == 2
    error = capsys.readouterr().err.strip().splitlines()[-1]
    assert part in error
    assert not (files / "x.toml").exists()


def test_caution_with_a_model_of_a_diagnosis_is_refused(tmp_path):
    (tmp_path / "m.toml").write_text('observe = "deviation"\n[[effect]]\nname = "backlash"\nbacklash = "12 um"\n')
    with pytest.raises(ArgumentError, match="without an interval"):
        predictor_of_file(tmp_path / "m.toml", 0.0, 80.0, cautious=True)


def test_a_file_that_exists_is_not_written_over(files, capsys):
    (files / "mine.toml").write_text("keep me")
    assert main(["train", str(files / "axis.csv"), "-o", str(files / "mine.toml")]) == 2
    assert "exists" in capsys.readouterr().err
    assert (files / "mine.toml").read_text() == "keep me"


def test_the_figures_are_seen_where_the_predictor_cannot_be_written(files, capsys, monkeypatch):
    from rtec.errors import OutputError

    def full(path, known):
        raise OutputError(str(path), "No space left on device", "free some space")

    monkeypatch.setattr("rtec.predictors.write_predictor", full)
    words = [*QUICK, "--pick", PICKED, "-o", str(files / "full.toml")]
    assert main(["train", str(files / "axis.csv"), *words]) == 2
    out, err = capsys.readouterr()
    assert PICKED in out and "Best: " in out
    assert "No space left" in err


def test_a_file_that_appears_during_the_training_is_not_overwritten(files, capsys, monkeypatch):
    import rtec.training

    file, fit = files / "meanwhile.toml", rtec.training.compare_predictors

    def slow(*given, **more):
        file.write_text("of somebody else")
        return fit(*given, **more)

    monkeypatch.setattr("rtec.training.compare_predictors", slow)
    words = [*QUICK, "--pick", PICKED, "-o", str(file)]
    assert main(["train", str(files / "axis.csv"), *words]) == 2
    assert "exists" in capsys.readouterr().err
    assert file.read_text() == "of somebody else"


def test_of_heat_a_table_holds_the_mean_and_it_is_said_how_much_that_leaves(tmp_path, capsys):
    rng = np.random.default_rng(5)
    lines = ["run,direction,target_mm,temperature_screw_degc,deviation_um"]
    for run, degc in enumerate((20.0, 22.0, 24.0, 26.0), 1):
        for way, places in ((1, np.arange(0.0, 501.0, 25.0)), (-1, np.arange(500.0, -1.0, -25.0))):
            errors = 0.0115 * places * (degc - 20.0) + rng.normal(0.0, 0.5, places.size)
            lines += [f"{run},{way},{p},{degc},{e:.6f}" for p, e in zip(places, errors, strict=True)]
    (tmp_path / "hot.csv").write_text("\n".join(lines) + "\n")
    assert main(["train", str(tmp_path / "hot.csv"), *QUICK]) == 0
    out = " ".join(capsys.readouterr().out.split())
    assert (
        "Of effects, thermal_growth is left out: only its mean is in the table; over the readings it changes" in out
    )
