"""rtec train --dynamic: from the log of a drive to the table of models of motion, and one of them to work."""

import contextlib
import io
import json

import numpy as np
import pytest

from rtec.cli import main
from rtec.predictors.motion_file import read_motion

QUICK = ["--budget", "2 s", "--starts", "1"]
ROWS = {"mean", "persistence", "servo lag", "ARX", "physical", "NARX", "hybrid"}


def written(path, seed, samples=1200, voltage=0.0):
    """An axis that lags 16 ms behind its velocity, 0.2 ms² behind its acceleration; y as large again."""
    rng = np.random.default_rng(seed)
    t = 1e-3 * np.arange(samples)
    path_mm, error = np.zeros(samples), np.zeros(samples)
    for w, size in zip(rng.uniform(5.0, 40.0, 4), rng.uniform(0.5, 2.0, 4), strict=True):
        path_mm += size * np.sin(w * t)
        error += size * w * (0.016 * np.cos(w * t) - 2e-4 * w * np.sin(w * t))
    error += 1e-3 * rng.normal(size=samples) + voltage * np.sin(90.0 * t)
    rows = np.stack([t, path_mm, path_mm - error, 2.0 * path_mm, 2.0 * (path_mm - error)], axis=1)
    head = "time_s,target_x_mm,actual_x_mm,target_y_mm,actual_y_mm"
    path.write_text("\n".join([head, *(",".join(f"{x:.7f}" for x in row) for row in rows)]) + "\n")
    return path


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("dynamic")
    written(folder / "log.csv", 1)
    written(folder / "check.csv", 2, 800)
    written(folder / "shaken.csv", 3, 800, voltage=1.0)
    return folder


def said(*words):
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = main([*map(str, words)])
    return code, out.getvalue(), err.getvalue()


@pytest.fixture(scope="module")
def trained(files):
    words = ["train", "--dynamic", files / "log.csv", "--axis", "x", "-o", files / "m.toml", "--pick", "hybrid"]
    code, out, _ = said(*words, *QUICK, "--json")
    return code, json.loads(out)


def test_every_row_has_figures_or_a_reason(trained):
    code, document = trained
    assert code == 0
    assert {row["name"] for row in document["rows"]} == ROWS
    assert document["chosen"] in ROWS - {"mean", "persistence"}
    assert (document["unit"], document["observe"], document["period_s"]) == ("um", "following_error", 0.001)
    for row in document["rows"]:
        assert row["rms_heldout_um"] is not None or row["reason"]
        keys = ("rms_train_um", "train_s", "eval_ns", "parameters", "coverage", "rms_first_tenth", "rms_last_tenth")
        assert all(key in row for key in (*keys, "kind", "stable", "free_run_rms"))
        assert row["unit"] == "um"
        assert row["free_run_rms"] == row["rms_heldout_um"]
    lag = next(row for row in document["rows"] if row["name"] == "servo lag")
    assert lag["rms_heldout_um"] == pytest.approx(1.0, rel=0.2)


def test_the_picked_model_is_written_and_taken_to_another_log(trained, files):
    assert trained[1]["written"] == "hybrid"
    known = read_motion(files / "m.toml")
    assert (known.name, known.source, known.head.observe) == ("hybrid", "log.csv", "following_error")
    code, out, _ = said("compare", files / "check.csv", "--axis", "x", "--model", files / "m.toml", "--json")
    found = json.loads(out)
    assert code == 0
    assert found["rms"] == found["rms_heldout"] < 10.0
    assert found["rows"] == 800 - known.model.lags
    code, out, err = said("compare", files / "log.csv", "--axis", "x", "--model", files / "m.toml")
    assert code == 0
    assert "in free run over" in out
    assert "only its second half" in err


def test_another_log_judges_and_what_is_no_input_is_suspected(files):
    words = ["train", "--dynamic", files / "log.csv", "--axis", "x", "--heldout", files / "shaken.csv", *QUICK]
    code, out, _ = said(*words, "--observe", "deviation")
    assert code == 0
    assert "times worse than the trained one" in out
    assert "Chosen by the training part" in out
    assert "On this log" in out


def test_a_voltage_in_and_a_level_out(tmp_path):
    u = np.repeat(np.random.default_rng(0).uniform(0.0, 5.0, 20), 20)
    y = np.zeros(400)
    for t in range(1, 400):
        y[t] = 0.9 * y[t - 1] + 0.1 * u[t - 1]
    rows = [f"{4 * t},{a:.6f},{b:.6f}" for t, (a, b) in enumerate(zip(u, y, strict=True))]
    (tmp_path / "tank.csv").write_text("\n".join(["time_s,command_v,level_v", *rows]) + "\n")
    code, out, _ = said("train", "--dynamic", tmp_path / "tank.csv", "--observe", "level", *QUICK, "--json")
    document = json.loads(out)
    assert code == 0
    assert (document["inputs"], document["unit"]) == (["command"], "V")
    figures = {row["name"]: row for row in document["rows"]}
    assert figures["ARX"]["rms_heldout_um"] < 1e-3
    assert figures["physical"]["rms_heldout_um"] is None
    assert "no error of an axis" in figures["physical"]["reason"]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--axis", "z"], "--axis"),
        ([], "--axis is needed"),
        (["--axis", "x", "--observe", "force"], "--observe"),
        (["--axis", "x", "--pick", "effects", "-o", "x.toml"], "is not a model of motion"),
        (["--axis", "x", "--pick", "ARX"], "--pick needs -o"),
        (["--axis", "x", "--thesis"], "--thesis does not go with --dynamic"),
        (["--axis", "x", "--screw-pitch", "5 mm"], "--screw-pitch does not go with --dynamic"),
        (["--axis", "x", "--heldout", "log.csv"], "is the log itself"),
    ],
)
def test_bad_words_are_one_line(files, monkeypatch, words, message):
    monkeypatch.chdir(files)
    code, out, err = said("train", "--dynamic", "log.csv", *words)
    assert (code, out) == (2, "")
    assert message in err
    assert len(err.strip().splitlines()) == 1


def test_models_of_motion_and_of_positions_are_not_mixed_up(trained, files, monkeypatch):
    monkeypatch.chdir(files)
    for words, message in (
        (["train", "log.csv", "--axis", "x", "--observe", "force"], "--observe needs --dynamic"),
        (["compare", "check.csv", "--axis", "x", "--model", "m.toml", "--lock"], "--lock does not go with"),
        (["compare", "check.csv", "log.csv", "--axis", "x", "--model", "m.toml"], "one log"),
        (["export", "m.toml", "--csv", "x.csv"], "a model of motion predicts sample by sample"),
    ):
        code, _, err = said(*words)
        assert (code, message in err) == (2, True), err


def test_a_static_measurement_says_what_is_missing(tmp_path):
    (tmp_path / "x.csv").write_text("target_mm,deviation_um\n" + "".join(f"{i},{i % 3}\n" for i in range(90)))
    code, _, err = said("train", "--dynamic", tmp_path / "x.csv")
    assert code == 2
    assert "no time" in err
