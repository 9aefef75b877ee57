"""rtec compare with a model of a warm machine: what it leaves of another log."""

import numpy as np
import pytest

from rtec.predictors import KnownPredictor, write_predictor
from rtec.predictors.warm.features import Feature
from rtec.predictors.warm.linear import Linear
from rtec.predictors.warm.warm_model import WarmModel

VERB = "compare"
ROWS = 200


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    rng = np.random.default_rng(2)
    nose = 20.0 + 8.0 * np.sin(np.linspace(0.0, 9.0, ROWS))
    noise = rng.normal(0.0, 0.5, ROWS)
    columns = np.column_stack([60.0 * np.arange(ROWS), nose, 3.0 * (nose - 20.0) + 2.0 + noise])
    for name in ("log.csv", "trained.csv"):
        np.savetxt(name, columns, delimiter=",", header="time_s,temperature_nose_degc,ch1_um", comments="")
    write()
    return noise


def write(**changes):
    given = {
        "features": (Feature(of="temperature_nose"),),
        "regressor": Linear(centre=[20.0], intercept=0.0, slopes=[3.0]),
        "observe": "ch1",
        "ranges": {"temperature_nose": (10.0, 25.0)},
        "interval": 2.5,
    }
    known = KnownPredictor(predictor=WarmModel(**(given | changes)), name="nose", source="trained.csv")
    write_predictor("m.toml", known)


def test_the_residual_of_another_log(here, answer, said):
    found = answer("log.csv", "--model", "m.toml")
    left = here + 2.0
    assert found["rms"] == pytest.approx(np.sqrt(np.mean(left**2)), rel=1e-6)
    assert found["rms_heldout"] == found["rms"] and found["unit"] == "um" and found["rows"] == ROWS
    assert found["mean"] == pytest.approx(left.mean(), rel=1e-6)
    assert found["coverage"] == pytest.approx(np.mean(np.abs(left) <= 2.5))
    assert 0 < found["rows_outside"] < ROWS
    code, out, err = said("log.csv", "--model", "m.toml")
    assert code == 0 and out.startswith("nose leaves 2.0") and "which held 90 % in training" in out
    assert f"{found['rows_outside']} rows are outside of what the model was trained for" in err


def test_the_log_that_trained_it_says_nothing_of_another(here, answer):
    found = answer("trained.csv", "--model", "m.toml")
    assert found["rms_heldout"] is None and any("says nothing of another" in one for one in found["notes"])


def test_a_model_in_millimetres_leaves_the_same(here, answer):
    write(regressor=Linear(centre=[20.0], intercept=0.0, slopes=[0.003]), unit="mm", interval=0.0025)
    found = answer("log.csv", "--model", "m.toml")
    assert found["rms"] == pytest.approx(np.sqrt(np.mean((here + 2.0) ** 2)), rel=1e-6)
    assert found["coverage"] == pytest.approx(np.mean(np.abs(here + 2.0) <= 2.5))


@pytest.mark.parametrize(
    ("changes", "words", "says"),
    [
        ({}, ["log.csv", "trained.csv"], "one log with a model of a warm machine"),
        ({}, ["log.csv", "--heldout", "trained.csv"], "--heldout does not go with a model of a warm machine"),
        ({}, ["log.csv", "--blocks", "run"], "--blocks does not go with a model of a warm machine"),
        ({"observe": "ch2"}, ["log.csv"], "ch2"),
        ({"unit": "N"}, ["log.csv"], "of ch1 in N"),
        (
            {"features": (Feature(of="temperature_nase"),), "ranges": {}},
            ["log.csv"],
            "no temperature_nase here, which the model follows; use the same sensors; did you mean 'temperature_n",
        ),
    ],
)
def test_what_cannot_be_compared_is_one_line(here, said, changes, words, says):
    write(**changes)
    code, out, err = said(*words, "--model", "m.toml")
    assert (code, out) == (2, "")
    assert err.count("\n") == 1 and says in err
