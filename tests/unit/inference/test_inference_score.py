"""The score test against two full least-squares fits."""

import numpy as np
import pytest
from inference_oracle import fall, rss

from rtec.inference.score import INDEPENDENT, Background, background, gain_of_block, gains, least_squares, orthonormal

RNG = np.random.default_rng(0)
MODEL = RNG.normal(size=(4, 40))
OBSERVED = RNG.normal(size=40) + 2.0 * MODEL[1]


@pytest.mark.parametrize("amplitudes", [1, 2])
def test_gains_are_falls_of_two_full_fits(amplitudes):
    candidates = np.random.default_rng(amplitudes).normal(size=(7, amplitudes, 40))
    candidates[3] = candidates[3] * 1e-9 + MODEL[0]  # nearly in the model, but not quite
    found = gains(candidates, background(MODEL, OBSERVED))
    expected = [fall(MODEL, own, OBSERVED) for own in candidates]
    good = [0, 1, 2, 4, 5, 6]
    assert found[good] == pytest.approx(np.array(expected)[good], rel=1e-8)
    assert found[3] == 0.0  # less than 1e-9 of its length is its own: nothing but rounding
    assert background(MODEL, OBSERVED).rss == pytest.approx(rss(MODEL, OBSERVED))


def test_gains_without_a_model():
    candidates = RNG.normal(size=(5, 2, 40))
    empty = background(np.empty((0, 40)), OBSERVED)
    assert empty.basis.shape == (40, 0)
    assert empty.rss == pytest.approx(OBSERVED @ OBSERVED)
    expected = [fall(np.empty((0, 40)), own, OBSERVED) for own in candidates]
    assert gains(candidates, empty) == pytest.approx(expected)


def test_a_pair_of_one_column_gains_as_one():
    one = RNG.normal(size=40)
    back = background(MODEL, OBSERVED)
    pair = np.array([[one, one * 3.0], [one, np.zeros(40)], [MODEL[0], one]])
    assert gains(pair, back) == pytest.approx([fall(MODEL, one[None, :], OBSERVED)] * 3)
    # where waves have to stand apart, a pair that does not gains nothing at all
    assert gains(pair, back, independent=0.01).tolist() == [0.0, 0.0, 0.0]


def test_waves_must_stand_apart_by_the_share_asked_for():
    back = background(np.empty((0, 40)), OBSERVED)
    first, across = np.eye(40)[0], np.eye(40)[1]
    for angle, counts in ((0.05, False), (0.2, True)):
        pair = np.array([[first, np.cos(angle) * first + np.sin(angle) * across]])
        # determinant of the normalised pair: sin squared of the angle between them
        found = gains(pair, back, independent=0.01)[0]
        assert found == pytest.approx(OBSERVED[0] ** 2 + OBSERVED[1] ** 2 if counts else 0.0)


def test_what_cannot_be_negative_gains_nothing_below_zero():
    back = background(MODEL, OBSERVED)
    column = RNG.normal(size=40)
    both = np.array([[column], [-column]])
    free, bound = gains(both, back), gains(both, back, not_negative=True)
    ahead = int(column @ back.residual < 0)
    assert free[0] == pytest.approx(free[1])
    assert bound[ahead] == pytest.approx(free[0])
    assert bound[1 - ahead] == 0.0


@pytest.mark.parametrize("amplitudes", [1, 2])
def test_folded_runs_gain_what_whole_runs_gain(amplitudes):
    rng = np.random.default_rng(7)
    model, observed = rng.normal(size=(3, 50)), rng.normal(size=50)
    one_run = rng.normal(size=(6, amplitudes, 10))
    back = background(model, observed)
    folded = gains(one_run, back.folded(5), copies=5)
    expected = [fall(model, np.tile(own, 5), observed) for own in one_run]
    assert folded == pytest.approx(expected)
    assert gains(np.tile(one_run, 5), back) == pytest.approx(expected)


@pytest.mark.parametrize("columns", [1, 2, 5])
def test_gain_of_a_block(columns):
    block = np.random.default_rng(columns).normal(size=(columns, 40)) * 10.0 ** np.arange(columns)[:, None]
    found, rank, apart = gain_of_block(block, background(MODEL, OBSERVED))
    assert found == pytest.approx(fall(MODEL, block, OBSERVED))
    assert rank == columns
    # independence: smallest eigenvalue of the columns of length 1 with the model projected off
    unit = block / np.linalg.norm(block, axis=1)[:, None]
    numbers, *_ = np.linalg.lstsq(MODEL.T, unit.T, rcond=None)
    beside = unit.T - MODEL.T @ numbers
    assert apart == pytest.approx(np.linalg.svd(beside, compute_uv=False)[-1] ** 2)


def test_gain_of_a_block_with_repeated_and_empty_columns():
    one = RNG.normal(size=40)
    block = np.array([one, 2.0 * one, MODEL[2], np.zeros(40)])
    found, rank, apart = gain_of_block(block, background(MODEL, OBSERVED))
    assert rank == 1
    assert found == pytest.approx(fall(MODEL, one[None, :], OBSERVED))
    assert abs(apart) < INDEPENDENT


def test_an_orthonormal_basis_spans_what_is_left():
    extra = np.vstack([RNG.normal(size=(3, 40)), MODEL[0], np.zeros(40)])
    own = orthonormal(MODEL)
    basis = orthonormal(extra, own)
    assert basis.shape == (40, 3)
    assert basis.T @ basis == pytest.approx(np.eye(3), abs=1e-12)
    assert own.T @ basis == pytest.approx(np.zeros((4, 3)), abs=1e-12)
    both = np.hstack([own, basis])
    assert extra.T == pytest.approx(both @ (both.T @ extra.T), abs=1e-9)
    assert orthonormal(np.zeros((2, 40))).shape == (40, 0)
    assert orthonormal(np.empty((0, 40)), own).shape == (40, 0)


def test_nearly_alike_columns_give_an_orthogonal_basis():
    first = RNG.normal(size=40)
    basis = orthonormal(np.array([first, first + 3e-4 * RNG.normal(size=40)]))
    assert basis.shape == (40, 2)
    assert basis.T @ basis == pytest.approx(np.eye(2), abs=1e-12)


def test_least_squares_solves_as_lstsq_does():
    columns = RNG.normal(size=(5, 40)) * 10.0 ** np.arange(-6, 4, 2)[:, None]
    expected, *_ = np.linalg.lstsq(columns.T, OBSERVED, rcond=None)
    assert least_squares(columns, OBSERVED) == pytest.approx(expected, rel=1e-7)


def test_least_squares_shares_between_equal_columns():
    one = RNG.normal(size=40)
    found = least_squares(np.array([one, one, np.zeros(40)]), 4.0 * one)
    assert found == pytest.approx([2.0, 2.0, 0.0])


def test_a_folded_background_holds_sums_over_runs():
    back = Background(basis=RNG.normal(size=(6, 2)), residual=np.arange(6.0))
    folded = back.folded(3)
    assert folded.residual.tolist() == [0.0 + 2 + 4, 1.0 + 3 + 5]
    assert folded.basis == pytest.approx(back.basis[:2] + back.basis[2:4] + back.basis[4:])
