"""Learned curves: offered where nothing has a name, over the right quantity, and not on noise."""

import numpy as np
import pytest

from rtec.dataset.load import load_dataset
from rtec.inference.described import descriptions
from rtec.inference.diagnose import add, diagnose
from rtec.inference.model_file import read_model, write_model
from rtec.inference.results import Verdict
from rtec.metrology import measurement_of_columns


def positioning(error, seed=1, sigma=0.5, runs=3):
    rng = np.random.default_rng(seed)
    there = np.arange(0.0, 400.0, 5.0) + rng.uniform(-1.0, 1.0, 80)
    x = np.tile(np.concatenate([there, there[::-1]]), runs)
    way = np.tile(np.repeat([1.0, -1.0], 80), runs)
    run = np.repeat(np.arange(1, runs + 1), 160)
    t = 10.0 * np.arange(x.size)
    y = error(x, way, t, run) + rng.normal(0.0, sigma, x.size)
    return load_dataset(
        measurement_of_columns({"run": run, "direction": way, "target_mm": x, "deviation_um": y, "time_s": t})
    )


def bump(x):
    return np.exp(-(((x - 180.0) / 12.0) ** 2))


@pytest.fixture(scope="module")
def unknown():
    return diagnose(positioning(lambda x, way, t, run: 5.0 * bump(x) - 2.0 * way))


def test_what_has_no_name_ends_as_a_curve(unknown):
    assert unknown.verdict is Verdict.UNKNOWN
    curve = unknown.curve
    assert (curve.shape.over, curve.shape.across, curve.shape.by_direction) == ("position", "", False)
    assert curve.rms < 0.55e-3
    assert curve.rms_heldout < 0.6e-3
    truth = 5e-3 * bump(curve.at)
    off = curve.values[0, 0] - (truth - truth.mean())
    assert np.mean(np.abs(off) < 3.0 * curve.errors[0, 0] + 0.1e-3) > 0.95


def test_its_model_reads_back_and_predicts_the_same(unknown, tmp_path):
    write_model(tmp_path / "m.toml", unknown.curve.model)
    again = read_model(tmp_path / "m.toml")
    assert again.predict(unknown.dataset) == pytest.approx(unknown.curve.model.predict(unknown.dataset), abs=1e-9)


@pytest.mark.parametrize(
    ("error", "over"),
    [
        (
            lambda x, way, t, run: 4.0 * bump(x) * (way > 0) - 4.0 * bump(x - 120.0) * (way < 0),
            {"position", "direction"},
        ),
        (lambda x, way, t, run: 6.0 * bump(x) * (run - 2.0), {"position", "run"}),
    ],
)
def test_it_is_over_what_the_error_depends_on(error, over):
    found = diagnose(positioning(error, seed=4)).curve
    assert found is not None
    said = {found.shape.over, found.shape.across, "direction" if found.shape.by_direction else ""} - {""}
    assert said == over


def test_nothing_is_learned_from_noise():
    for seed in range(5):
        result = diagnose(positioning(lambda x, way, t, run: 0.0 * x, seed=seed))
        assert result.curve is None


def test_a_curve_is_added_where_one_is_asked_for():
    data = positioning(lambda x, way, t, run: 3.0 * np.sin(x / 50.0) ** 3)
    added = add("curve:position", data)
    assert added.rms_after < 0.6e-3 < added.rms_before
    assert added.model.terms[0].shape.over == "position"


@pytest.mark.parametrize(
    ("function", "says"),
    [
        (lambda x: 0.04 * x, "a straight line: 4 µm over 100 mm"),
        (lambda x: 0.001 * (x - 30.0) ** 2, "a parabola about 30 mm"),
        (lambda x: 6.0 * np.exp(-x / 8.0), "decays over 8 mm"),
        (lambda x: 3.0 * np.sin(2.0 * np.pi * x / 40.0 + 1.0), "a wave of 3 µm with a period of 40 mm"),
        (lambda x: 2.0 * np.tanh((x - 60.0) / 3.0), "a step of 4 µm at 60 mm"),
        (lambda x: 5.0 * bump(x + 130.0) + 0.05 * x, "a bump of 5 µm at 50 mm"),
    ],
)
def test_a_curve_is_like_the_function_that_made_it(function, says):
    x = np.linspace(0.0, 100.0, 161)
    found = descriptions(x, function(x), np.full(161, 0.05), np.full(161, 1 / 161), ("mm", "um"))
    assert says in " / ".join(found)


def test_what_is_like_nothing_is_not_described():
    x = np.linspace(0.0, 100.0, 161)
    ragged = np.interp(x, np.linspace(0, 100, 12), np.random.default_rng(1).normal(0.0, 3.0, 12))
    assert descriptions(x, ragged, np.full(161, 0.05), np.full(161, 1 / 161), ("mm", "um")) == ()
