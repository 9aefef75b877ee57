"""rtec train on the log of a warm machine: a table, a choice of sensors, a picture and a model file."""

import numpy as np
import pytest

from rtec.cli import main
from rtec.heat import Duty, warm_machine
from rtec.heat.duty import Piece
from rtec.predictors import read_predictor

VERB = "train"
QUICK = ["--budget", "1 ms"]
"""Only rows that look for nothing."""
SPEEDS = (3000.0, 0.0, 5000.0, 0.0, 4000.0, 0.0)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = tmp_path_factory.mktemp("warm")
    for name, speeds in (("log", SPEEDS), ("other", SPEEDS[::-1])):
        duty = Duty(tuple(Piece(duration_s=3000.0, spindle_rpm=rpm) for rpm in speeds))
        warm_machine(seed=2).run(duty, every_s=10.0).write_csv(made / f"{name}.csv", every_s=60.0, noise_um=0.2)
    return made


@pytest.fixture(scope="module")
def trained(folder):
    words = ["train", folder / "log.csv", "--observe", "z", "--budget", "4 s", "-o", folder / "z.toml"]
    assert main([*map(str, words), "--figure", str(folder / "z.png"), "--pick", "first-order-lags"]) == 0
    return folder


def test_one_document_with_all_that_is_relied_on(answer, folder):
    document = answer(folder / "log.csv", *QUICK)
    keys = {"name", "kind", "rms_train_um", "rms_heldout_um", "rms_blocks_um", "rms_rows_um", "train_s", "eval_ns",
            "parameters", "coverage", "reason"}  # fmt: skip
    assert all(keys <= set(row) for row in document["rows"])
    assert set(document["observe"]) == {"x1", "x2", "y1", "y2", "z"}
    assert document["blocks"]["names"] == [f"{rpm:.0f} rpm" for rpm in SPEEDS]
    assert {"mean", "persistence", "LS-SVM", "named effects"} <= {row["name"] for row in document["rows"]}
    assert all(row["reason"] for row in document["rows"] if row["rms_heldout_um"] is None)
    assert document["sensors"][0]["number"] == 1 and len(document["sensors"][0]["sensors"]) == 1


def test_the_model_file_says_what_the_row_says(trained, answer):
    known = read_predictor(trained / "z.toml")
    assert (known.name, known.predictor.observe, known.predictor.unit) == ("first-order lags", "z", "um")
    low, high = known.predictor.ranges["spindle_speed"]
    assert (low, high) == (0.0, 5000.0)
    heads = (trained / "log.csv").read_text().splitlines()[0].split(",")
    table = np.loadtxt(trained / "log.csv", delimiter=",", skiprows=1)
    columns = dict(zip(heads, table.T, strict=True))
    inputs = {name.removesuffix("_degc"): values for name, values in columns.items() if name.startswith("temp")}
    inputs["spindle_speed"] = columns["spindle_rpm"]
    said = known.predictor.predict(columns["time_s"], inputs)[0]
    row = next(row for row in answer(trained / "log.csv", "--observe", "z", "--budget", "4 s")["rows"]
               if row["name"] == "first-order lags")  # fmt: skip
    held = columns["time_s"] >= 12_000.0  # the step of 4000 rpm, and what follows
    left = np.sqrt(np.mean((columns["z_um"] - said)[held] ** 2))
    assert left == pytest.approx(row["rms_heldout_um"], rel=0.02)


def test_a_picture_is_drawn(trained):
    assert (trained / "z.png").read_bytes()[1:4] == b"PNG"


def test_a_shop_floor_engineer_reads_which_model_and_which_sensors(said, folder):
    code, out, err = said(folder / "log.csv", "--heldout", folder / "other.csv", *QUICK)
    assert code == 0
    assert "Chosen by left-out blocks: " in out and "other.csv" in out
    assert "the mean leaves" in out and "Three thermometers: " in out
    assert "It needs a probe that reads all the time" in out
    assert "feed in mm_s, force in n" in err and "z_um" not in err


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (["--observe", "ch9"], "--observe: 'ch9' is not a column of this file; use one of z, x1, x2, y1, y2"),
        (["-o", "m.toml"], "holds the model of one displacement; use --observe with one of z, x1, x2, y1, y2"),
        (["--blocks", "shift"], "--blocks: 'shift' is not a column of this file"),
        (["--pick", "table", "-o", "m.toml"], "--pick: 'table' is not a model of a warm machine"),
        (["--thesis"], "--thesis does not go with the log of a warm machine"),
        (["--heldout", "log.csv"], "--heldout: log.csv is the log itself"),
        (["--dynamic", "--blocks", "run"], "--blocks does not go with --dynamic"),
    ],
)
def test_what_does_not_fit_is_refused(refused, folder, monkeypatch, words, why):
    monkeypatch.chdir(folder)
    assert why in refused("log.csv", *words, *QUICK)


def test_blocks_mean_nothing_for_positions(refused, tmp_path):
    file = tmp_path / "x.csv"
    file.write_text("target_mm,deviation_um\n" + "\n".join(f"{i},{i % 3}" for i in range(12)) + "\n")
    assert "use it for the log of a warm machine" in refused(file, "--blocks", "run")
