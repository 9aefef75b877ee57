"""LS-SVM: beside the whole system of equation 5 solved by numpy, scikit-learn, and refits without each block."""

import numpy as np
import pytest

from rtec.errors import ArgumentError
from rtec.predictors.fitting.warm.linear import fit_ridge
from rtec.predictors.fitting.warm.lssvm import fit_ls_svm, fit_ridge_and_ls_svm, train_ls_svm
from rtec.predictors.warm.lssvm import LsSvm


def spindle(rows=80, features=3, blocks=5, seed=0):
    draw = np.random.default_rng(seed)
    columns = 25.0 + draw.normal(size=(rows, features)) * np.geomspace(0.1, 10.0, features)
    output = 20.0 + np.sin(columns[:, 0] * 10.0) + 0.1 * columns[:, -1] + 0.1 * draw.normal(size=rows)
    return columns, output, draw.permutation(np.arange(rows) % blocks)


def kernel_of(left, right, width, linear=0.0):
    return np.exp(-((left[:, None] - right) ** 2).sum(axis=2) / (2.0 * width**2)) + linear * (left @ right.T)


def system(points, output, width, gamma, linear=0.0):
    """Solve equation 5 of Yao et al. as it is printed: bias, then multipliers."""
    kernel = kernel_of(points, points, width, linear)
    whole = np.block([[np.zeros((1, 1)), np.ones((1, len(points)))], [np.ones((len(points), 1)), kernel]])
    whole[1:, 1:] += np.eye(len(points)) / gamma
    return np.linalg.solve(whole, np.concatenate([[0.0], output]))


def answers(points, solution, asked, width, linear=0.0):
    return solution[0] + kernel_of(asked, points, width, linear) @ solution[1:]


def refits(columns, output, block, width, gamma, linear=0.0):
    scaled = (columns - columns.mean(axis=0)) / columns.std(axis=0)
    left = np.empty(len(output))
    for b in np.unique(block):
        rest = block != b
        solution = system(scaled[rest], output[rest], width, gamma, linear)
        left[~rest] = output[~rest] - answers(scaled[rest], solution, scaled[~rest], width, linear)
    return left


@pytest.mark.parametrize("linear", [0.0, 0.3])
@pytest.mark.parametrize(("width", "gamma"), [(0.5, 10.0), (3.0, 1e3), (10.0, 1.0)])
def test_it_solves_the_printed_system(width, gamma, linear):
    columns, output, _ = spindle(rows=150)
    points = (columns - columns.mean(axis=0)) / columns.std(axis=0)
    machine = train_ls_svm(points, output, width=width, gamma=gamma, linear=linear)
    theirs = system(points, output, width, gamma, linear)
    assert machine.bias == pytest.approx(theirs[0], rel=1e-9)
    assert machine.alpha == pytest.approx(theirs[1:], abs=1e-9 * np.abs(theirs[1:]).max())
    asked = points[:20] + 0.3
    assert machine.predict(asked)[0] == pytest.approx(answers(points, theirs, asked, width, linear), rel=1e-10)
    assert not machine.predict(asked)[1].any()


@pytest.mark.parametrize("rows", [50, 400])
def test_it_says_what_kernel_ridge_says(rows):
    kernel_ridge = pytest.importorskip("sklearn.kernel_ridge")
    columns, output, _ = spindle(rows=rows)
    points = columns / columns.std(axis=0)
    theirs = kernel_ridge.KernelRidge(alpha=0.01, kernel="rbf", gamma=0.125).fit(
        points, np.stack([output, np.ones(rows)], axis=1)
    )
    bias = theirs.dual_coef_[:, 0].sum() / theirs.dual_coef_[:, 1].sum()
    values = theirs.predict(points + 0.1)
    machine = train_ls_svm(points, output, width=2.0, gamma=100.0)
    found = values[:, 0] + bias * (1.0 - values[:, 1])
    assert machine.predict(points + 0.1)[0] == pytest.approx(found, abs=1e-8)


@pytest.mark.parametrize("linear", [0.0, 2.0])
@pytest.mark.parametrize("blocks", [2, 5, 80])
@pytest.mark.parametrize(("width", "gamma"), [(0.5, 10.0), (3.0, 1e3), (30.0, 1e4)])
def test_left_out_residuals_are_those_of_refits(blocks, width, gamma, linear):
    columns, output, block = spindle(blocks=blocks)
    fit = fit_ls_svm(columns, output, block, widths=[width / np.sqrt(3.0)], gammas=[gamma], linear=[linear])
    theirs = refits(columns, output, block, width, gamma, linear / 3.0)
    assert fit.left_out == pytest.approx(theirs, abs=1e-9)


def test_width_and_gamma_are_the_best_of_those_tried():
    columns, output, block = spindle()
    widths, gammas = [0.2, 1.0, 20.0], [0.1, 10.0, 1e4]
    fit = fit_ls_svm(columns, output, block, widths=widths, gammas=gammas)
    figures = [
        np.sqrt(np.mean(refits(columns, output, block, width * np.sqrt(3.0), gamma) ** 2))
        for width in widths
        for gamma in gammas
    ]
    assert [figure for _, figure in fit.tried] == pytest.approx(figures, rel=1e-6)
    width, gamma = fit.tried[int(np.argmin(figures))][0].split(", ")
    assert fit.notes[-1].lower().startswith(f"{width} of scaled columns, {gamma}")
    assert np.sqrt(np.mean(fit.left_out**2)) == pytest.approx(min(figures), rel=1e-9)


def test_the_linear_part_is_the_best_of_those_tried():
    columns, output, block = spindle()
    fit = fit_ls_svm(
        columns, output + 3.0 * columns[:, 0], block, widths=[0.5], gammas=[10.0], linear=[0.0, 0.3, 3.0]
    )
    figures = [
        np.sqrt(
            np.mean(refits(columns, output + 3.0 * columns[:, 0], block, 0.5 * np.sqrt(3.0), 10.0, linear / 3.0) ** 2)
        )
        for linear in (0.0, 0.3, 3.0)
    ]
    assert [figure for _, figure in fit.tried] == pytest.approx(figures, rel=1e-6)
    assert fit.regressor.linear == pytest.approx([0.0, 0.1, 1.0][int(np.argmin(figures))])
    assert f"linear part {fit.regressor.linear:.3g}" in fit.notes[-1]


def test_a_linear_part_goes_on_where_bells_fall_silent():
    x = np.linspace(0.0, 1.0, 60)[:, None]
    block = np.arange(60) // 6
    bells = fit_ls_svm(x, 5.0 * x[:, 0], block).regressor
    both = fit_ls_svm(x, 5.0 * x[:, 0], block, linear=[10.0]).regressor
    assert both.predict(np.array([[3.0]]))[0][0] == pytest.approx(15.0, abs=0.5)
    assert abs(bells.predict(np.array([[30.0]]))[0][0]) < 50.0
    assert both.predict(np.array([[30.0]]))[0][0] == pytest.approx(150.0, rel=0.05)


def test_the_mean_of_a_line_and_a_machine_is_their_mean():
    columns, output, block = spindle()
    stuck = np.insert(columns, 1, 26.0, axis=1)
    grid = {"widths": [0.5, 2.0], "gammas": [10.0, 100.0], "linear": [0.0, 1.0]}
    both = fit_ridge_and_ls_svm(stuck, output, block, **grid)
    line, machine = fit_ridge(columns, output, block), fit_ls_svm(columns, output, block, **grid)
    asked = np.concatenate([columns[:10], columns[:3] + 20.0])
    theirs = (line.regressor.predict(asked)[0] + machine.regressor.predict(asked)[0]) / 2.0
    found, sd = both.regressor.predict(np.insert(asked, 1, 30.0, axis=1))
    assert found == pytest.approx(theirs, rel=1e-9)
    assert both.left_out == pytest.approx((line.left_out + machine.left_out) / 2.0, abs=1e-9)
    assert both.notes[0] == "Column 2 is constant and left out."
    assert len(both.notes) == 3
    ratio = sd / machine.regressor.predict(asked)[1]
    assert ratio == pytest.approx(ratio[0])
    assert 0.5 < ratio[0] < 2.0


def test_the_ends_of_the_grid_are_named():
    fit = fit_ls_svm(*spindle(), widths=[0.01, 0.02], gammas=[0.1, 10.0, 1e3])
    assert "width at an end" in fit.notes[-1] or "width and gamma at an end" in fit.notes[-1]


def test_a_hundred_settings_are_tried():
    fit = fit_ls_svm(*spindle(rows=200, features=17, blocks=10))
    assert len({name for name, _ in fit.tried}) == 100


@pytest.mark.parametrize("linear", [0.0, 3.0])
def test_the_standard_deviation_is_that_of_the_process(linear):
    columns, output, block = spindle(rows=60)
    machine = fit_ls_svm(columns, output, block, widths=[0.5], gammas=[20.0], linear=[linear]).regressor
    points, width = machine.points, machine.width
    asked = columns[:5] + np.array([0.02, 0.1, 3.0])
    inverse = np.linalg.inv(kernel_of(points, points, width, linear / 3.0) + np.eye(60) / 20.0)
    scaled = (asked - columns.mean(axis=0)) / columns.std(axis=0)
    alike = kernel_of(scaled, points, width, linear / 3.0)
    bias = (1.0 - alike @ inverse.sum(axis=0)) ** 2 / inverse.sum()
    prior = 1.0 + linear / 3.0 * (scaled**2).sum(axis=1)
    square = prior + 0.05 - np.einsum("ij,jk,ik->i", alike, inverse, alike) + bias
    assert machine.predict(asked)[1] == pytest.approx(machine.noise_sd * np.sqrt(square), rel=1e-4)


def test_left_out_residuals_have_the_size_that_is_predicted():
    draw = np.random.default_rng(3)
    columns = draw.uniform(-2.0, 2.0, size=(600, 1))
    output = np.sin(2.0 * columns[:, 0]) + 0.2 * draw.normal(size=600)
    machine = fit_ls_svm(columns, output, np.arange(600) // 10).regressor
    value, sd = machine.predict(np.array([[0.5], [50.0]]))
    assert value[0] == pytest.approx(np.sin(1.0), abs=0.1)
    assert sd[0] == pytest.approx(0.2, rel=0.15)
    assert sd[1] > 3.0 * sd[0]


@pytest.mark.parametrize("linear", [0.0, 1.0])
@pytest.mark.parametrize("rows", [40, 300])
def test_the_compiled_function_says_the_same(rows, linear):
    columns, output, block = spindle(rows=rows)
    found = fit_ls_svm(columns, output, block, widths=[0.3, 3.0], gammas=[1.0, 100.0], linear=[linear]).regressor
    numbers, room, sd = found.numbers, np.zeros(found.room), np.zeros(1)
    asked = np.concatenate([columns[:20], columns[:5] + 100.0])
    for row, value, unsure in zip(asked, *found.predict(asked), strict=True):
        assert found.function(numbers, row, room, sd) == pytest.approx(value, rel=1e-12)
        assert sd[0] == pytest.approx(unsure, rel=1e-10)


def test_plain_data_build_the_same_function():
    found = fit_ls_svm(*spindle(), widths=[1.0], gammas=[1.0], linear=[1.0]).regressor
    again = LsSvm.of(found.plain)
    assert again.numbers.tolist() == found.numbers.tolist()
    assert again.parameters == 80 + 1 + 3


def test_a_constant_column_does_not_count():
    columns, output, block = spindle()
    stuck = np.insert(columns, 1, 26.0, axis=1)
    found, bare = fit_ls_svm(stuck, output, block), fit_ls_svm(columns, output, block)
    assert found.notes[0] == "Column 2 is constant and left out."
    assert found.left_out == pytest.approx(bare.left_out, abs=1e-9)
    away = stuck + np.array([0.0, 5.0, 0.0, 0.0])
    assert found.regressor.predict(away)[0] == pytest.approx(bare.regressor.predict(columns)[0])


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("alpha", [1.0]),
        ("points", [1.0, 2.0, 3.0]),
        ("per_unit", []),
        ("width", 0.0),
        ("gamma", -1.0),
        ("bias", None),
        ("noise_sd", float("inf")),
        ("linear", -1.0),
        ("slopes", [1.0]),
    ],
)
def test_wrong_plain_data_are_refused(name, value):
    plain = train_ls_svm(np.arange(4.0).reshape(2, 2), np.ones(2), width=1.0, gamma=1.0).plain
    with pytest.raises(ArgumentError):
        LsSvm.of({**plain, name: value})


@pytest.mark.parametrize("wrong", [{"widths": []}, {"gammas": [0.0]}, {"widths": [float("nan")]}, {"linear": [-1.0]}])
def test_a_grid_that_cannot_be_tried_is_refused(wrong):
    with pytest.raises(ArgumentError, match=next(iter(wrong))):
        fit_ls_svm(*spindle(), **wrong)


def test_one_block_cannot_be_left_out():
    columns, output, block = spindle()
    with pytest.raises(ArgumentError, match="at least two"):
        fit_ls_svm(columns, output, block * 0)


def test_rows_that_repeat_need_a_smaller_gamma():
    with pytest.raises(ArgumentError, match="too large"):
        train_ls_svm(np.zeros((50, 1)), np.arange(50.0), width=1.0, gamma=1e30)
