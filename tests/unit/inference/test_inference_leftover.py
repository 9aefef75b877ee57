"""What is left that nothing explains: what it depends on, and its strongest line."""

from dataclasses import replace

import numpy as np
import pytest
from inference_oracle import SIGMA, measured

from rtec.effects import Shape, effect_named
from rtec.inference.leftover import MATTERS, SIGNIFICANT, unknown_structure
from rtec.inference.probes import probes_of
from rtec.inference.scored import Judge
from rtec.inference.space import Space

SCALE, BACKLASH = effect_named("scale"), effect_named("backlash")
BOTH = [(SCALE, Shape()), (BACKLASH, Shape())]
TILTED = lambda x, way, t, run: 5e-5 * x + 0.004 * way


def left(data, choices=()):
    judge = Judge(Space(data))
    model = judge.score(choices)
    return unknown_structure(judge, model)


def bump(x, way, t, run):
    """Too narrow for a map of these targets."""
    return 0.02 * np.exp(-(((x - 140.0) / 8.0) ** 2))


def test_noise_leaves_nothing():
    for seed in range(6):
        found, p = left(measured(seed=seed))
        assert (found is None) or p < SIGNIFICANT
    assert left(measured())[0] is None
    assert left(measured(runs=1))[0] is None
    assert left(measured(runs=1, bidirectional=False)) == (None, None)


def test_a_bump_depends_on_position():
    found, p = left(measured(bump))
    assert p < 1e-6
    assert found.depends_on == ("position",)
    assert "repeats from run to run" in found.description
    assert found.frequency_hz is None


def test_a_bump_that_only_one_direction_shows_depends_on_both():
    assert left(measured(lambda x, way, t, run: bump(x, way, t, run) * (way > 0)))[0].depends_on == (
        "position",
        "direction",
    )


def test_the_strongest_line_is_that_of_a_dense_scan():
    wave = lambda x, way, t, run: 0.006 * np.sin(2 * np.pi * x / 41.0) + bump(x, way, t, run) / 20
    data = measured(wave)
    found, _ = left(data)
    mean = data.observed.reshape(5, 42).mean(axis=0)
    mean, x = mean - mean.mean(), data.conditions.position[:42]
    trial = 1.0 / np.linspace(1 / 120, 1 / 16, 4000)
    falls = []
    for period in trial:
        table = np.array([np.sin(2 * np.pi * x / period), np.cos(2 * np.pi * x / period)]).T
        falls.append(np.linalg.norm(table @ np.linalg.lstsq(table, mean)[0]))
    # within half of the spacing of the grid: three tenths of a cycle over the span
    assert 1 / found.period == pytest.approx(1 / trial[np.argmax(falls)], abs=0.16 / 300)
    assert f"{found.period:.4g} mm" in found.description


def test_where_time_is_the_coordinate_the_line_has_a_frequency():
    at = np.arange(0.0, 300.0, 7.0) + np.random.default_rng(0).uniform(-1, 1, 43)
    found, _ = left(
        measured(lambda x, way, t, run: 0.01 * np.sin(2 * np.pi * x / 41.0), at=at, unit="s", bidirectional=False)
    )
    assert found.frequency_hz == pytest.approx(1 / 41.0, rel=0.05)
    assert found.frequency_hz == pytest.approx(1 / found.period)


def test_a_line_that_noise_could_make_is_not_told():
    jagged = np.random.default_rng(5).normal(0, 0.004, 42)
    found, p = left(measured(lambda x, way, t, run: np.tile(jagged, 5)))
    assert p < 1e-6
    assert found.period is None


def test_structure_far_below_the_noise_is_of_no_interest():
    for size, told in ((0.4 * MATTERS, False), (2.5 * MATTERS, True)):
        rows = lambda x, way, t, run, s=size: s * SIGMA * np.sqrt(2.0) * np.sin(x / 9.0)
        found, p = left(measured(rows, runs=300, targets=6))
        assert p < SIGNIFICANT
        assert (found is not None) is told


def test_beside_a_large_effect_a_hair_is_of_no_interest():
    """No effect has exactly the form of a formula: one part in a hundred of 200 um, one noise floor, is a hair."""
    for large, told in ((0.004, True), (0.2, False)):
        error = lambda x, way, t, run, a=large: a * way + 0.7 * SIGMA * np.sin(x / 9.0)
        found, p = left(measured(error, runs=10), [(BACKLASH, Shape())])
        assert p < SIGNIFICANT
        assert (found is not None) is told


def test_what_the_model_explains_is_not_left():
    data = measured(TILTED)
    assert left(data, BOTH)[0] is None
    assert left(data, [(BACKLASH, Shape())])[0].depends_on == ("position",)


def test_a_probe_in_the_model_is_structure_without_a_name():
    data = measured(runs=4)
    humid = np.random.default_rng(3).normal(size=data.rows)
    data = replace(data, unknown=(("humidity", humid),), observed=data.observed + 0.003 * humid)
    judge = Judge(Space(data))
    (probe,) = [p for p in probes_of(data) if p.depends_on == ("humidity",)]
    model = judge.score([(next(e for e in judge.space.library if e.name == probe.name), Shape())])
    found, _ = unknown_structure(judge, model)
    assert found.depends_on == ("humidity",)
    assert "is explained by no effect of the library" in found.description
    once = measured(runs=1, targets=60)
    humid = np.random.default_rng(3).normal(size=once.rows)
    once = replace(once, unknown=(("humidity", humid),), observed=once.observed + 0.003 * humid)
    judge = Judge(Space(once))
    model = judge.score([(next(e for e in judge.space.library if e.name == probe.name), Shape())])
    assert unknown_structure(judge, model)[0].depends_on == ("humidity",), "without repeats, too"
