"""What is left that nothing explains: what it depends on, and its strongest line."""

from dataclasses import replace

import numpy as np
import pytest
from inference_oracle import SIGMA, measured

from rtec.effects import Shape, effect_named
from rtec.inference.leftover import describe_leftover
from rtec.inference.noise import noise_from_repeats
from rtec.inference.structure import changes_left, lack_of_fit_of_means
from rtec.inference.workspace import Workspace

SCALE, BACKLASH = effect_named("scale"), effect_named("backlash")


def left(data, choices=(), **given):
    work = Workspace(data, noise_from_repeats(data, choices))
    p_means = given.get("p_means", lack_of_fit_of_means(work, choices))
    changes = given.get("changes", changes_left(data, choices, np.random.default_rng(0)))
    return describe_leftover(work, choices, p_means, changes)


def bump(x, way, t, run):
    return 0.02 * np.exp(-(((x - 140.0) / 8.0) ** 2))


def test_noise_leaves_nothing():
    assert left(measured(), p_means=0.3, changes={"time": 0.2}) is None
    assert left(measured(), p_means=None, changes={}) is None
    assert left(measured(runs=3, seed=2)) is None


def test_a_bump_depends_on_position():
    found = left(measured(bump))
    assert found.depends_on == ("position",)
    assert "repeats from run to run" in found.description
    assert found.frequency_hz is None


def test_a_bump_that_only_one_direction_shows_depends_on_both():
    found = left(measured(lambda x, way, t, run: bump(x, way, t, run) * (way > 0)))
    assert found.depends_on == ("position", "direction")


def test_the_strongest_line_is_that_of_a_dense_scan():
    wave = lambda x, way, t, run: 0.006 * np.sin(2 * np.pi * x / 41.0) + bump(x, way, t, run) / 20
    data = measured(wave)
    found = left(data)
    mean = data.observed.reshape(5, 42).mean(axis=0)
    mean, x = mean - mean.mean(), data.conditions.position[:42]
    trial = 1.0 / np.linspace(1 / 120, 1 / 16, 4000)
    falls = []
    for period in trial:
        table = np.array([np.sin(2 * np.pi * x / period), np.cos(2 * np.pi * x / period)]).T
        falls.append(np.linalg.norm(table @ np.linalg.lstsq(table, mean)[0]))
    # within the spacing of the grid: a fifth of a cycle over the span
    assert 1 / found.period == pytest.approx(1 / trial[np.argmax(falls)], abs=0.11 / 300)
    assert f"{found.period:.4g} mm" in found.description


def test_where_time_is_the_coordinate_the_line_has_a_frequency():
    at = np.arange(0.0, 300.0, 7.0) + np.random.default_rng(0).uniform(-1, 1, 43)
    wave = lambda x, way, t, run: 0.01 * np.sin(2 * np.pi * x / 41.0)
    data = measured(wave, at=at, unit="s", bidirectional=False)
    found = left(data)
    assert found.frequency_hz == pytest.approx(1 / 41.0, rel=0.05)
    assert found.frequency_hz == pytest.approx(1 / found.period)


def test_a_line_that_noise_could_make_is_not_told():
    for size, told in ((0.35, False), (1.5, True)):
        data = measured(lambda x, way, t, run, a=size * SIGMA: a * np.sin(2 * np.pi * x / 41.0))
        assert (left(data, p_means=1e-9).period is not None) is told


def test_a_reversal_error_that_changes_depends_on_direction_and_run():
    sizes = np.array([0.0, 0.004, -0.003, 0.006, 0.001])
    data = measured(lambda x, way, t, run: (sizes[run - 1] - sizes.mean()) * way)
    found = left(data)
    assert found.depends_on[:2] == ("direction", "run")
    assert "changes from run to run" in found.description
    assert found.period is None


def test_what_partly_repeats_and_partly_changes_is_called_so():
    sizes = np.array([0.0, 0.004, -0.003, 0.006, 0.001])
    found = left(measured(lambda x, way, t, run: sizes[run - 1] * way + bump(x, way, t, run)))
    assert "partly repeats and partly changes" in found.description
    assert {"position", "direction", "run"} <= set(found.depends_on)
    assert len(set(found.depends_on)) == len(found.depends_on)


@pytest.mark.parametrize(
    ("name", "depends"), [("time", ("time",)), ("direction", ("direction", "run")), ("position", ("position", "run"))]
)
def test_changes_are_called_by_what_they_depend_on(name, depends):
    assert left(measured(), p_means=0.5, changes={name: 0.001}).depends_on == depends
    assert left(measured(), p_means=0.5, changes={name: 0.02}) is None


def test_structure_far_below_the_noise_is_of_no_interest():
    rng_free = measured(lambda x, way, t, run: 0.05 * SIGMA * np.sin(x / 9.0), runs=400, targets=6)
    assert left(rng_free, p_means=1e-9, changes={}) is None
    loud = measured(lambda x, way, t, run: 0.3 * SIGMA * np.sin(x / 9.0), runs=400, targets=6)
    assert left(loud, p_means=1e-9, changes={}) is not None


def test_a_column_that_goes_with_what_is_left_is_named():
    dwell = np.random.default_rng(3).uniform(1, 20, 210)
    plain = measured(lambda x, way, t, run: bump(x, way, t, run) + 0.0005 * dwell)
    turned = measured(lambda x, way, t, run: bump(x, way, t, run) + 0.0005 * dwell * way)
    columns = (
        ("dwell_s", dwell),
        ("idle_s", np.full(210, 3.0)),
        ("noise", np.random.default_rng(4).normal(size=210)),
    )
    for data in (plain, turned):
        found = left(replace(data, unknown=columns), p_means=1e-9)
        assert "dwell_s" in found.depends_on
        assert not {"idle_s", "noise"} & set(found.depends_on)


def test_what_the_model_explains_is_not_left():
    data = measured(lambda x, way, t, run: 5e-5 * x + 0.004 * way)
    assert left(data).depends_on == ("position", "direction")
    assert left(data, [(SCALE, Shape()), (BACKLASH, Shape())]) is None
    assert left(data, [(BACKLASH, Shape())]).depends_on == ("position",)
