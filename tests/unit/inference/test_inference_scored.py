"""What speaks for a model: averages over noise against dense likelihoods, prices, signs."""

from dataclasses import replace

import numpy as np
import pytest
from inference_oracle import SIGMA, covariance, log_marginal, measured, one_chain

from rtec.effects import Observable, Shape, effect_named
from rtec.effects.viscous import ViscousShape
from rtec.inference.colour import COLOURS
from rtec.inference.evidence import SCALES, best_scales
from rtec.inference.scored import Judge
from rtec.inference.space import Space, blocks_of

SCALE, BACKLASH, CYCLIC = (effect_named(n) for n in ("scale", "backlash", "cyclic"))
BOTH = [(SCALE, Shape()), (BACKLASH, Shape())]
TILTED = lambda x, way, t, run: 5e-5 * x + 0.004 * way


def judge_of(data):
    return Judge(Space(data))


def dense(judge, model, colour, shift=0):
    """Log marginal likelihood of a model's readings at its scales, written out; all of them ``shift`` steps away."""
    data, space = judge.space.dataset, judge.space
    parts = space.parts_of(model.choices)
    columns = np.vstack([part.raw * part.unit for part in parts]) if parts else np.empty((0, data.rows))
    deviations = SCALES[model.places + shift][blocks_of(parts)] if parts else np.empty(0)
    gap = one_chain(data.rows)
    if data.conditions.moving:
        gap[1:][np.diff(data.conditions.run) != 0] = np.inf
    matrix = covariance(colour.rho, colour.white, gap)
    found = log_marginal(data.observed, columns, deviations, matrix, datum=space.has_datum)
    return found - colour.rarity


@pytest.mark.parametrize("rho", [0.0, 0.9])
@pytest.mark.parametrize("choices", [[], BOTH], ids=["nothing", "both"])
def test_a_score_is_the_average_over_every_colour_less_the_price(rho, choices):
    judge = judge_of(measured(TILTED, runs=2, targets=8, rho=rho, white=0.3))
    model = judge.score(choices)
    # contributions of one size have other places where the noise has another variance
    each = np.array([max(dense(judge, model, colour, shift) for shift in range(-2, 3)) for colour in COLOURS])
    price = sum(judge.price(choice) for choice in choices)
    assert model.score == pytest.approx(np.log(np.mean(np.exp(each - each.max()))) + each.max() - price, abs=0.05)
    assert model.colour == COLOURS[int(np.argmax(each))]  # on the way scales were a little others
    assert dict(model.colours)[model.colour] == pytest.approx(each.max(), abs=1e-4)


def test_a_force_has_no_datum_and_a_log_begins_anew_with_each_run():
    data = measured(TILTED, runs=2, targets=8, rho=0.9, white=0.3)
    moving = replace(data.conditions, moving=True, velocity=20.0 * data.conditions.direction)
    judge = judge_of(replace(data, observable=Observable.DRIVE, conditions=moving))
    viscous = [(effect_named("viscous"), ViscousShape())]
    model = judge.score(viscous)
    assert dict(model.colours)[model.colour] == pytest.approx(dense(judge, model, model.colour), abs=1e-4)
    assert model.colour.white >= 0.3


@pytest.mark.parametrize(("rho", "seed"), [(0.0, 1), (0.95, 3)])
def test_the_likeliest_noise_and_scales_are_those_of_all(rho, seed):
    """Hill climbing against 46 colours with all their best scales."""
    data = measured(TILTED, runs=3, targets=12, seed=seed, rho=rho, white=0.1)
    judge = judge_of(data)
    model = judge.score(BOTH)
    parts = judge.space.parts_of(BOTH)
    best = -np.inf
    for colour in COLOURS:
        _, value = best_scales(judge.space.sums(parts, colour), blocks_of(parts), np.array([4, 4]))
        best = max(best, value - 0.5 * judge.space.view(colour).log_determinant - colour.rarity)
    assert model.colours[0][1] >= best - 1.0  # of the five that an effect has to be worth


def test_a_long_measurement_weighs_only_the_colours_that_count(monkeypatch):
    data = measured(TILTED, runs=4, targets=16, rho=0.9, white=0.3)
    monkeypatch.setattr("rtec.inference.scored.EVERY_COLOUR", data.rows)
    every = judge_of(data).score(BOTH)
    assert len(every.colours) == len(COLOURS)
    monkeypatch.setattr("rtec.inference.scored.EVERY_COLOUR", data.rows - 2)
    some = judge_of(data).score(BOTH)
    assert len(some.colours) < 0.8 * len(COLOURS)
    assert some.score == pytest.approx(every.score, abs=0.15)
    assert some.colour == every.colour


def test_the_order_of_effects_and_where_a_search_comes_from_hardly_matter():
    data = measured(TILTED, runs=3, targets=12, rho=0.9)
    one = judge_of(data).score(BOTH)
    other = judge_of(data)
    near = other.score([(CYCLIC, CYCLIC.shape_type(41.0))])
    again = other.score(BOTH[::-1], near)
    assert again.key == one.key
    assert again.score == pytest.approx(one.score, abs=0.1)
    assert other.score(BOTH) is again, "one model, whatever the order"


def test_a_shape_costs_what_it_was_chosen_from():
    judge = judge_of(measured(runs=2, screw_pitch=20.0))
    families = len(judge.space.library)
    shapes, _ = judge.space.shapes(CYCLIC)
    stated = [shape.period for shape in shapes if 20.0 / shape.period == pytest.approx(round(20.0 / shape.period))]
    assert judge.price((SCALE, Shape())) == pytest.approx(np.log(families))
    assert judge.price((CYCLIC, CYCLIC.shape_type(33.3))) == pytest.approx(
        np.log(families * CYCLIC.tried(judge.space.dataset.conditions, CYCLIC.shape_type(33.3)))
    )
    assert judge.price((CYCLIC, CYCLIC.shape_type(33.3))) >= np.log(families * (len(shapes) - len(stated)))
    assert judge.price((CYCLIC, CYCLIC.shape_type(20.0))) == pytest.approx(np.log(families * len(stated)))


def test_amplitudes_in_a_log_are_those_of_plain_least_squares_whatever_the_noise():
    data = measured(lambda x, way, t, run: TILTED(x, way, t, run) + 0.03 * (t / t[-1]) ** 2, targets=161, runs=1)
    judge = judge_of(replace(data, conditions=replace(data.conditions, moving=True)))
    model = judge.score(BOTH)
    assert model.colour.rho > 0.5
    table = np.vstack([np.ones(data.rows), data.conditions.position, data.conditions.direction])
    least = data.observed - table.T @ np.linalg.lstsq(table.T, data.observed, rcond=None)[0]
    assert judge.left(model) == pytest.approx(least, abs=0.1 * SIGMA)
