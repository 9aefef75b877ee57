"""What a scan proposes: falls against full least squares, refined shapes, the golden section."""

from dataclasses import replace

import numpy as np
import pytest
from inference_oracle import covariance, fall, measured, one_chain, whitened

from rtec.dataset.load import load_dataset
from rtec.effects import Shape, effect_named
from rtec.inference.colour import Colour
from rtec.inference.probes import Probe
from rtec.inference.proposals import SLOW, Beside, beside, falls, golden, orthonormal, proposals, refine
from rtec.inference.scored import Judge
from rtec.inference.space import Space
from rtec.metrology import Column, Measurement

SCALE, CYCLIC = (effect_named(n) for n in ("scale", "cyclic"))
TILTED = lambda x, way, t, run: 5e-5 * x + 0.004 * way


def wave(period=41.0, size=0.006):
    return lambda x, way, t, run: size * np.sin(2 * np.pi * x / period + 0.4)


def judge_of(data):
    return Judge(Space(data))


def beside_table(model, y):
    basis = orthonormal(model)
    residual = y - (basis @ y) @ basis
    return Beside(basis, residual, float(residual @ residual))


@pytest.mark.parametrize("cycles", [1, 3, 3.0000001])
def test_sine_and_cosine_of_whole_cycles_explain_no_more_than_there_is(cycles):
    x = np.arange(36) / 36.0
    both = np.vstack([np.sin(2 * np.pi * cycles * x), np.cos(2 * np.pi * cycles * x)])
    y = np.array([0.8, -0.3]) @ both + 0.05 * np.random.default_rng(2).normal(size=36)
    nothing = np.empty((0, 36))
    assert falls(both[None], beside_table(nothing, y))[0] == pytest.approx(fall(nothing, both, y), rel=1e-6)


def test_what_the_model_holds_already_explains_nothing_more():
    rng = np.random.default_rng(1)
    model, y = rng.normal(size=(3, 60)), rng.normal(size=60)
    mixed = rng.normal(size=(1, 3)) @ model
    fresh = rng.normal(size=(1, 60))
    back = beside_table(model, y)
    assert falls(mixed[None], back)[0] == 0.0
    assert falls(np.zeros((1, 1, 60)), back)[0] == 0.0
    both = falls(np.vstack([fresh, mixed])[None], back)[0]
    assert both == pytest.approx(falls(fresh[None], back)[0])


def test_a_basis_spans_what_the_rows_span():
    rng = np.random.default_rng(2)
    rows = rng.normal(size=(4, 30)) * np.array([1e-9, 1.0, 1e6, 1.0])[:, None]
    rows = np.vstack([rows, rows[1] + rows[3], np.zeros(30)])
    basis = orthonormal(rows)
    assert basis @ basis.T == pytest.approx(np.eye(4), abs=1e-9)
    for row in rows[:5]:
        assert (basis @ row) @ basis == pytest.approx(row, rel=1e-6, abs=1e-6 * np.linalg.norm(row))
    assert orthonormal(np.zeros((2, 30))).shape == (0, 30)
    assert orthonormal(np.empty((0, 30))).shape == (0, 30)


@pytest.mark.parametrize("colour", [Colour(), Colour(0.9, 0.3)])
def test_what_a_model_leaves_is_that_of_generalised_least_squares(colour):
    data = measured(TILTED, runs=3, targets=8)
    judge = judge_of(data)
    back = beside(judge.space, [(SCALE, Shape())], colour)
    columns = [np.ones(data.rows), data.conditions.position]
    matrix = covariance(colour.rho, colour.white, one_chain(data.rows))
    table = whitened(np.vstack([*columns, data.observed]), matrix)
    left = table[-1] - np.linalg.lstsq(table[:-1].T, table[-1])[0] @ table[:-1]
    assert back.residual == pytest.approx(left, abs=1e-9)
    assert back.rss == pytest.approx(float(left @ left))
    assert back.basis.shape[0] == len(columns)


@pytest.mark.parametrize(("error", "name"), [(wave(), "cyclic"), (lambda x, way, t, run: 0.005 * way, "backlash")])
def test_what_is_there_is_proposed_first(error, name):
    judge = judge_of(measured(error))
    found = proposals(judge, judge.score([]), judge.space.library)
    assert found[0].choice[0].name == name
    worth = [p.worth for p in found]
    assert worth == sorted(worth, reverse=True)
    named = [p for p in found if not isinstance(p.choice[0], Probe)]
    assert min(p.worth + (SLOW if p.choice[0].in_time else 0.0) for p in named) > 0.0
    assert len({p.choice for p in found}) == len(found)


def test_noise_proposes_nothing_that_is_worth_five_nats():
    for seed in range(5):
        judge = judge_of(measured(seed=seed, runs=3))
        found = proposals(judge, judge.score([]), judge.space.library)
        assert all(p.worth < 5.0 for p in found)


def test_the_best_of_the_scan_is_the_best_of_full_fits():
    """The strongest line by least squares at every frequency of the grid."""
    data = measured(wave(), targets=41, runs=2)
    judge = judge_of(data)
    constant = np.ones((1, data.rows))
    shapes, _ = judge.space.shapes(CYCLIC)
    gains = [fall(constant, data.columns(CYCLIC, shape).T, data.observed) for shape in shapes]
    best = shapes[int(np.argmax(gains))].period
    found = [p for p in proposals(judge, judge.score([]), [CYCLIC]) if p.choice[1].harmonics == 1]
    assert min(abs(1 / p.choice[1].period - 1 / best) for p in found) < 0.31 / data.conditions.span


def test_refining_finds_the_period_between_two_of_the_grid():
    """Against a dense scan of full fits."""
    data = measured(wave(47.3, 0.01), targets=41, runs=2)
    judge = judge_of(data)
    back = beside(judge.space, [], Colour())
    start = min(judge.space.shapes(CYCLIC)[0], key=lambda shape: abs(1 / shape.period - 1 / 47.3))
    (_, found) = refine(judge, (CYCLIC, start), back, Colour())
    constant = np.ones((1, data.rows))
    trial = np.linspace(45.5, 49.0, 3501)
    gains = [fall(constant, data.columns(CYCLIC, CYCLIC.shape_type(p)).T, data.observed) for p in trial]
    assert found.period == pytest.approx(trial[int(np.argmax(gains))], abs=0.02)
    assert abs(found.period - start.period) > 0.05


def test_the_golden_section_finds_the_hump():
    for top in (0.02, 0.5, 0.97):
        assert golden(lambda x, top=top: -((x - top) ** 2), 0.0, 1.0) == pytest.approx(top, abs=1e-3)
        assert golden(lambda x, top=top: -abs(x - top), 0.0, 1.0, steps=40) == pytest.approx(top, abs=1e-8)
    assert golden(lambda x: x, 2.0, 3.0) == pytest.approx(3.0, abs=2e-3)


def test_a_family_without_a_first_wave_is_not_proposed():
    """Second and third wave of 50 mm, together in one family of which nothing is the first: that cannot stay."""
    both = lambda x, way, t, run: wave(25.0, 0.02)(x, way, t, run) + wave(50.0 / 3.0, 0.018)(x, way, t, run)
    judge = judge_of(measured(both, targets=61, runs=2))
    found = [p.choice[1].period for p in proposals(judge, judge.score([]), [CYCLIC])]
    assert min(abs(period - 25.0) for period in found) < 0.5
    assert min(abs(period - 50.0) for period in found) > 5.0


@pytest.mark.parametrize("revolution", [None, 300.0])
def test_waves_are_proposed_one_by_one_where_asked(revolution):
    two = lambda x, way, t, run: wave(60.0, 0.02)(x, way, t, run) + wave(30.0, 0.015)(x, way, t, run) * (2 + way)
    data = measured(two, targets=61, runs=2)
    data = replace(data, conditions=replace(data.conditions, revolution=revolution))
    judge = judge_of(data)
    families, single = (
        [p.choice[1] for p in proposals(judge, judge.score([]), [CYCLIC], families=asked)] for asked in (True, False)
    )
    assert max(shape.harmonics for shape in families) > 1
    assert {(shape.harmonics, shape.by_direction) for shape in single} == {(1, False)}


def test_play_seen_by_one_grid_of_targets_is_no_harmonic_of_the_screw():
    """Four runs with targets every tenth of a turn, one at others: the tenth harmonic is constant in the four."""
    up = [10.0 * np.arange(161) / 16.0] * 4 + [10.44 * np.arange(153) / 16.0]
    x = np.concatenate([np.concatenate([one, one[::-1]]) for one in up])
    way = np.concatenate([np.repeat([1.0, -1.0], one.size) for one in up])
    run = np.repeat(np.arange(1, 6), [2 * one.size for one in up])
    turn = 2.0 * np.pi * x / 6.25
    error = 0.02 * way + 0.006 * np.sin(2.0 * turn) + 0.004 * way * np.cos(3.0 * turn)
    noise = np.random.default_rng(0).normal(0.0, 0.001, x.size)
    named = {"run": (run, ""), "direction": (way, ""), "target": (x, "mm"), "deviation": (error + noise, "mm")}
    columns = {name: Column(name, unit, values) for name, (values, unit) in named.items()}
    facts = {"screw_pitch": "6.25 mm"}
    judge = judge_of(load_dataset(Measurement(source="two rounds", facts=facts, columns=columns, unknown={})))
    shapes = [p.choice[1] for p in proposals(judge, judge.score([]), [CYCLIC])]
    assert {round(shape.period, 2) for shape in shapes} == {6.25}
    assert all(shape.by_direction and 3 <= shape.harmonics < 10 for shape in shapes)
