"""Linear functions of features: beside numpy's least squares, block by block, and with columns that go wrong."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from rtec.errors import ArgumentError
from rtec.predictors.fitting.warm.linear import fit_least_squares, fit_ridge
from rtec.predictors.fitting.warm.rows import thin_by_blocks
from rtec.predictors.warm.linear import Linear


def spindle(rows=60, features=4, blocks=6, seed=0):
    """Columns in odd units that depend on each other a little, an output, and blocks that are not in one piece."""
    draw = np.random.default_rng(seed)
    columns = draw.normal(size=(rows, features)) @ draw.normal(size=(features, features))
    columns = 20.0 + columns * np.geomspace(0.01, 100.0, features)
    output = 3.0 + columns[:, 0] * 50.0 + draw.normal(size=rows)
    return columns, output, draw.permutation(np.arange(rows) % blocks)


def refits(columns, output, block, fit):
    """Return output less what ``fit`` (weights of scaled columns with a leading 1) says without each block."""
    scaled = (columns - columns.mean(axis=0)) / columns.std(axis=0)
    table = np.column_stack([np.ones(len(scaled)), scaled])
    left = np.empty(len(output))
    for b in np.unique(block):
        rest = block != b
        left[~rest] = output[~rest] - table[~rest] @ fit(table[rest], output[rest])
    return left


def least_squares(table, output):
    return np.linalg.lstsq(table, output, rcond=None)[0]


def ridge(share, rows):
    def fit(table, output):
        penalty = np.diag([0.0, *[share * rows] * (table.shape[1] - 1)])
        return np.linalg.solve(table.T @ table + penalty, table.T @ output)

    return fit


def test_least_squares_are_those_of_numpy():
    columns, output, block = spindle()
    fit = fit_least_squares(columns, output, block)
    table = np.column_stack([np.ones(len(columns)), columns])
    theirs = np.linalg.lstsq(table, output, rcond=None)[0]
    assert fit.regressor.predict(columns)[0] == pytest.approx(table @ theirs, abs=1e-9)
    assert fit.regressor.slopes == pytest.approx(theirs[1:], rel=1e-7)
    assert fit.regressor.parameters == 5


@settings(max_examples=40, deadline=None)
@given(st.integers(10, 50), st.integers(1, 5), st.integers(2, 9), st.integers(0, 1000), st.floats(1e-6, 1e2))
def test_left_out_residuals_are_those_of_refits(rows, features, blocks, seed, share):
    columns, output, block = spindle(rows, features, blocks, seed)
    fit = fit_ridge(columns, output, block, shares=[share])
    theirs = refits(columns, output, block, ridge(share, rows))
    assert fit.left_out == pytest.approx(theirs, abs=1e-9 * np.abs(theirs).max())
    if rows - np.bincount(block).max() > 2 * features + 2:
        theirs = refits(columns, output, block, least_squares)
        assert fit_least_squares(columns, output, block).left_out == pytest.approx(
            theirs, abs=1e-9 * np.abs(theirs).max()
        )


def test_blocks_of_one_row_are_left_out_one_by_one():
    columns, output, _ = spindle(rows=20)
    block = np.arange(20)
    theirs = refits(columns, output, block, least_squares)
    assert fit_least_squares(columns, output, block).left_out == pytest.approx(theirs, abs=1e-9)


def test_the_ridge_parameter_is_the_best_of_those_tried():
    columns, output, block = spindle(rows=24, features=6, blocks=4)
    shares = [1e-4, 1e-2, 1.0, 10.0]
    fit = fit_ridge(columns, output, block, shares=shares)
    figures = [np.sqrt(np.mean(refits(columns, output, block, ridge(share, 24)) ** 2)) for share in shares]
    assert [figure for _, figure in fit.tried] == pytest.approx(figures, rel=1e-9)
    best = shares[int(np.argmin(figures))]
    assert f"Ridge parameter {best:.3g} for each row" in fit.notes[-1]
    assert fit.left_out == pytest.approx(refits(columns, output, block, ridge(best, 24)), abs=1e-9)


def test_a_ridge_at_the_end_of_what_was_tried_is_named():
    columns, output, block = spindle()
    assert "an end of what was tried" in fit_ridge(columns, output, block, shares=[1.0, 100.0]).notes[-1]


def test_collinear_columns_share_their_slope():
    columns, output, block = spindle(features=2)
    twice = np.column_stack([columns, 2.0 * columns[:, 0] + 7.0])
    fit = fit_least_squares(twice, output, block)
    alone = fit_least_squares(columns, output, block)
    assert "depend on each other in 1 way" in " ".join(fit.notes)
    assert fit.regressor.predict(twice)[0] == pytest.approx(alone.regressor.predict(columns)[0], abs=1e-8)
    assert fit.left_out == pytest.approx(alone.left_out, abs=1e-8)
    assert fit.regressor.slopes[0] == pytest.approx(2.0 * fit.regressor.slopes[2])


@pytest.mark.parametrize("fit", [fit_least_squares, fit_ridge])
def test_a_constant_column_is_left_out_with_a_note(fit):
    columns, output, block = spindle()
    stuck = np.insert(columns, 1, 26.0, axis=1)
    found = fit(stuck, output, block)
    assert found.notes[0] == "Column 2 is constant and left out."
    assert found.left_out == pytest.approx(fit(columns, output, block).left_out, abs=1e-9)
    away = stuck + np.array([0.0, 5.0, 0.0, 0.0, 0.0])
    assert found.regressor.predict(away)[0].tolist() == found.regressor.predict(stuck)[0].tolist()


def test_a_block_that_alone_determines_a_slope_is_named():
    columns, output, block = spindle(blocks=5)
    switch = np.where(block == 3, np.arange(60.0), 0.0)
    fit = fit_least_squares(np.column_stack([columns, switch]), output, block)
    assert "1 block alone determined a slope" in fit.notes[-1]
    without = np.column_stack([np.ones(60), columns])
    theirs = np.linalg.lstsq(without[block != 3], output[block != 3], rcond=None)[0]
    assert fit.left_out[block == 3] == pytest.approx((output - without @ theirs)[block == 3], abs=1e-7)
    theirs = refits(np.column_stack([columns, switch]), output, block, least_squares)
    assert fit.left_out[block != 3] == pytest.approx(theirs[block != 3], abs=1e-7)


def test_left_out_residuals_have_the_size_that_is_predicted():
    draw = np.random.default_rng(5)
    columns = draw.normal(size=(3000, 8))
    output = columns.sum(axis=1) + 0.7 * draw.normal(size=3000)
    fit = fit_least_squares(columns, output, np.arange(3000) // 30)
    _, sd = fit.regressor.predict(np.array([[0.0] * 8, [30.0] * 8]))
    assert sd[0] == pytest.approx(0.7, rel=0.05)
    assert sd[1] == pytest.approx(0.7 * np.sqrt(1.0 + 8 * 900.0 / 3000.0), rel=0.1)


def test_the_compiled_function_says_the_same():
    columns, output, block = spindle()
    found = fit_ridge(columns, output, block).regressor
    sd = np.zeros(1)
    for row, value, unsure in zip(columns, *found.predict(columns), strict=True):
        assert found.function(found.numbers, row, np.zeros(found.room), sd) == pytest.approx(value, rel=1e-12)
        assert sd[0] == pytest.approx(unsure, rel=1e-12)


def test_plain_data_build_the_same_function():
    columns, output, block = spindle()
    found = fit_ridge(columns, output, block).regressor
    again = Linear.of(found.plain)
    assert again.numbers.tolist() == found.numbers.tolist()


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("slopes", [1.0]),
        ("intercept", None),
        ("noise_sd", "much"),
        ("spread", [1.0, 2.0, 3.0]),
        ("centre", [1.0, float("nan")]),
        ("centre", "all"),
    ],
)
def test_wrong_plain_data_are_refused(name, value):
    plain = Linear(centre=[1.0, 2.0], intercept=0.0, slopes=[1.0, 1.0]).plain
    with pytest.raises(ArgumentError) as refused:
        Linear.of({**plain, name: value})
    assert refused.value.name == name


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda c, o, b: (c, o, b * 0), "at least two"),
        (lambda c, o, b: (c * np.nan, o, b), "row 1"),
        (lambda c, o, b: (c, np.where(b == b[5], np.nan, o), b), "not finite"),
        (lambda c, o, b: (c, o[1:], b), "one value for each of 60 rows"),
        (lambda c, o, b: (c[:, 0], o, b), "one column for each feature"),
        (lambda c, o, b: (c * 0.0 + 20.0, o, b), "at least one that varies"),
    ],
)
def test_rows_that_cannot_be_fitted_are_refused(change, said):
    with pytest.raises(ArgumentError, match=said):
        fit_ridge(*change(*spindle()))


def test_a_column_of_twice_the_weight_is_penalised_a_quarter():
    columns, output, block = spindle(features=2)
    fit = fit_ridge(columns, output, block, shares=[0.3], weights=[1.0, 2.0])
    scaled = (columns - columns.mean(axis=0)) / columns.std(axis=0)
    penalty = 0.3 * 60 * np.diag([1.0, 0.25])
    theirs = np.linalg.solve(scaled.T @ scaled + penalty, scaled.T @ (output - output.mean())) / columns.std(axis=0)
    assert fit.regressor.slopes == pytest.approx(theirs, rel=1e-9)


@pytest.mark.parametrize("weights", [[1.0], [1.0, 0.0, 1.0, 1.0], -1.0])
def test_weights_are_above_zero_and_one_for_each_column(weights):
    with pytest.raises(ArgumentError, match="weights"):
        fit_ridge(*spindle(), weights=weights)


def test_a_ridge_parameter_is_above_zero():
    with pytest.raises(ArgumentError, match="shares"):
        fit_ridge(*spindle(), shares=[0.0])


def test_the_longest_blocks_are_thinned_first():
    block = np.repeat([1, 2, 3], [5, 50, 100])
    kept = thin_by_blocks(block, most_rows=45)
    assert np.bincount(block[kept]).tolist() == [0, 5, 20, 20]
    assert kept[:5].tolist() == [0, 1, 2, 3, 4]
    assert kept[-1] == 154
    assert np.diff(np.flatnonzero(block[kept] == 3)).max() == 1


def test_every_fourth_row_is_counted_from_the_start_of_its_block():
    block = np.repeat([1, 2], [6, 5])
    assert thin_by_blocks(block, every=4).tolist() == [0, 4, 6, 10]


@pytest.mark.parametrize("wrong", [{"every": 0}, {"most_rows": 1}])
def test_rows_that_cannot_be_kept_are_refused(wrong):
    with pytest.raises(ArgumentError):
        thin_by_blocks([1, 1, 2], **wrong)
