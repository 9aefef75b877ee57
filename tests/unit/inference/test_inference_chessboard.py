"""What is held out, and by how much a model foretells it better."""

from dataclasses import replace

import numpy as np
import pytest
from inference_oracle import SIGMA, covariance, left_out_residual, measured, one_chain, whitened

from rtec.effects import BuildUpShape, Observable, Shape, effect_named
from rtec.effects.viscous import ViscousShape
from rtec.inference.chessboard import FOLDS, board_of, gain_between, held_out_residual, passes_of
from rtec.inference.evidence import SCALES
from rtec.inference.scored import Judge
from rtec.inference.space import Space, blocks_of

SCALE, BACKLASH = (effect_named(n) for n in ("scale", "backlash"))
BOTH = [(SCALE, Shape()), (BACKLASH, Shape())]
TILTED = lambda x, way, t, run: 5e-5 * x + 0.004 * way


def judge_of(data):
    return Judge(Space(data))


def test_a_pass_goes_one_way_in_one_run():
    data = measured(runs=2, targets=3)
    assert passes_of(data).tolist() == [0, 0, 0, 1, 1, 1, 2, 2, 2, 3, 3, 3]
    rest = data.conditions.direction.copy()
    rest[[1, 3]] = 0.0  # at rest the way is that of before
    halted = replace(data, conditions=replace(data.conditions, direction=rest))
    assert passes_of(halted).tolist() == [0, 0, 0, 0, 1, 1, 2, 2, 2, 3, 3, 3]
    one_way = replace(data, conditions=replace(data.conditions, direction=None))
    assert passes_of(one_way).tolist() == [0] * 6 + [1] * 6


@pytest.mark.parametrize(
    "plan",
    [
        {"runs": 2, "targets": 8},
        {"runs": 5, "targets": 21},
        {"runs": 3, "targets": 50, "bidirectional": False},
        {"runs": 40, "targets": 9},
    ],
)
def test_every_place_that_is_held_out_in_one_pass_is_seen_in_another(plan):
    data = measured(**plan)
    board = board_of(data)
    assert board.fold.min() >= 0
    assert board.fold.max() < FOLDS
    for fold in np.unique(board.fold):
        seen = set(data.conditions.position[board.fold != fold].tolist())
        assert set(data.conditions.position[board.fold == fold].tolist()) <= seen
    if plan.get("bidirectional", True) and plan["runs"] > 2:  # in the same direction, too
        places = data.conditions.position * data.conditions.direction
        for fold in np.unique(board.fold):
            assert set(places[board.fold == fold].tolist()) <= set(places[board.fold != fold].tolist())


@pytest.mark.parametrize(
    "plan", [{"runs": 1, "targets": 40, "bidirectional": False}, {"runs": 3, "at": np.array([5.0])}, {"runs": 7}]
)
def test_a_cell_is_held_out_as_a_whole_and_folds_are_of_a_size(plan):
    board = board_of(measured(**plan))
    assert all(np.unique(board.fold[board.cell == k]).size == 1 for k in range(board.cells))
    sizes = np.unique(board.fold, return_counts=True)[1]
    assert sizes.size > 1
    assert sizes.max() <= 3 * sizes.min()
    assert (np.unique(board.cell) == np.arange(board.cells)).all()


def test_a_single_pass_is_held_out_by_its_stretches():
    board = board_of(measured(runs=1, targets=64, bidirectional=False))
    assert board.cells == 16
    assert (np.diff(board.cell) >= 0).all()
    assert np.bincount(board.fold).tolist() == [8] * 8
    few = board_of(measured(runs=1, targets=3, bidirectional=False))
    assert few.cells == 3
    assert few.fold.tolist() == [0, 1, 2]


def test_a_log_that_turns_often_has_cells_of_some_size():
    data = measured(runs=1, at=np.tile([0.0, 1.0, 2.0], 400), bidirectional=False)
    way = np.repeat(np.tile([1.0, -1.0], 200), 3)
    board = board_of(replace(data, conditions=replace(data.conditions, direction=way)))
    assert board.cells <= 32 * 8


def test_held_out_residuals_of_a_force_are_those_of_literal_refits():
    data = measured(TILTED, runs=3, targets=9, rho=0.9, white=0.3)
    moving = replace(data.conditions, velocity=20.0 * data.conditions.direction)
    data = replace(data, observable=Observable.DRIVE, conditions=moving)
    choices = [(effect_named("viscous"), ViscousShape()), (effect_named("coulomb"), BuildUpShape())]
    judge, board = judge_of(data), board_of(data)
    model = judge.score(choices)
    parts = judge.space.parts_of(choices)
    raw = np.vstack([part.raw * part.unit for part in parts])
    deviations = np.append(SCALES, 0.0)[model.places][blocks_of(parts)]
    raw, precision = raw[deviations > 0], deviations[deviations > 0] ** -2.0
    colour = model.colour.bounded
    matrix = covariance(colour.rho, colour.white, one_chain(data.rows))
    white = whitened(np.vstack([raw, data.observed]), matrix)
    expected = left_out_residual(white[:-1].T, raw.T, white[-1], data.observed, board.fold, precision)
    assert held_out_residual(judge, model, board) == pytest.approx(expected, abs=1e-8)


@pytest.mark.parametrize("rho", [0.0, 0.9])
def test_a_gain_is_that_of_dense_densities_cell_by_cell(rho):
    data = measured(TILTED, runs=3, targets=16, rho=rho, white=0.3)
    judge, board = judge_of(data), board_of(data)
    model = judge.score(BOTH)
    before = held_out_residual(judge, judge.score(BOTH[:1]), board)
    after = held_out_residual(judge, model, board)
    found = gain_between(judge, before, after, model, board)
    colour = model.colour.bounded
    variance, nats, squares = judge.fit(model, colour).variance, [], []
    for cell in range(board.cells):
        rows = np.flatnonzero(board.cell == cell)
        inverse = np.linalg.inv(covariance(colour.rho, colour.white, one_chain(rows.size)))
        nats.append((before[rows] @ inverse @ before[rows] - after[rows] @ inverse @ after[rows]) / 2 / variance)
        squares.append(float((before[rows] ** 2 - after[rows] ** 2).sum()))
    assert found.nats == pytest.approx(sum(nats), rel=1e-6)
    assert found.without_best == pytest.approx(sum(nats) - max(nats), rel=1e-6)
    assert found.gain == pytest.approx(np.mean(before**2 - after**2))
    assert found.error == pytest.approx(np.std(squares, ddof=1) * np.sqrt(board.cells) / data.rows)
    assert found.passes


def test_what_helps_in_one_cell_only_is_no_gain():
    """A dip in one section of one pass, which a map of all passes draws a little of."""
    data = measured(runs=4, targets=40)
    board = board_of(data)
    cell = int(board.cell[data.conditions.run == 2][15])
    judge = judge_of(replace(data, observed=data.observed + np.where(board.cell == cell, 0.01, 0.0)))
    nothing = judge.score([])
    before = held_out_residual(judge, nothing, board)
    after = before - np.where(board.cell == cell, 0.005, 0.0)
    found = gain_between(judge, before, after, nothing, board)
    assert found.nats > 5.0
    assert found.gain > 0.0
    assert not found.passes


def test_what_is_there_gains_and_what_is_not_does_not():
    gains = {True: [], False: []}
    for seed in range(10):
        for there in (True, False):
            data = measured(lambda x, way, t, run, s=there: s * SIGMA * way, seed=seed, runs=3)
            judge, board = judge_of(data), board_of(data)
            without, having = judge.score([]), judge.score([(BACKLASH, Shape())])
            left = [held_out_residual(judge, model, board) for model in (without, having)]
            gains[there].append(gain_between(judge, *left, having, board).passes)
    assert sum(gains[True]) == 10
    assert sum(gains[False]) <= 7  # alone this is a weak test: it has its say beside the score
