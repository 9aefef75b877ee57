"""Fuzzy networks: equation 1 written out, refits without each block, and rows outside all rules."""

import numpy as np
import pytest

from rtec.errors import ArgumentError
from rtec.predictors.fitting.warm.fuzzy import fit_fuzzy
from rtec.predictors.warm.fuzzy import Conjunction, Fuzzy

ONE = {"components": [2], "rules": [3], "overlaps": [1.0], "shares": [1e-3]}


def spindle(rows=120, features=4, blocks=6, seed=0):
    draw = np.random.default_rng(seed)
    columns = (
        25.0
        + draw.normal(size=(rows, 2)) @ draw.normal(size=(2, features))
        + 0.1 * draw.normal(size=(rows, features))
    )
    output = np.abs(columns[:, 0] - 25.0) + 0.05 * draw.normal(size=rows)
    return columns, output, draw.permutation(np.arange(rows) % blocks)


def printed(net, row, least=False):
    """Return equation 1 of Yao et al. term by term."""
    z = net.axes @ (row - net.centre)
    above = below = 0.0
    for rule, widths, theta in zip(net.rules, net.widths, net.consequents, strict=True):
        memberships = np.exp(-((z - rule) ** 2) / (2.0 * widths**2))
        weight = memberships.min() if least else memberships.prod()
        above += weight * (theta @ np.concatenate([[1.0], z]))
        below += weight
    return above / below


@pytest.mark.parametrize("conjunction", Conjunction)
def test_it_is_the_printed_equation(conjunction):
    columns, output, block = spindle()
    net = fit_fuzzy(columns, output, block, conjunctions=[conjunction], **ONE).regressor
    assert net.conjunction is conjunction
    theirs = [printed(net, row, conjunction is Conjunction.MINIMUM) for row in columns]
    assert net.predict(columns)[0] == pytest.approx(theirs, rel=1e-9)


@pytest.mark.parametrize("conjunction", Conjunction)
def test_left_out_residuals_are_those_of_refits(conjunction):
    columns, output, block = spindle()
    fit = fit_fuzzy(columns, output, block, conjunctions=[conjunction], **ONE)
    net = fit.regressor
    z = (columns - net.centre) @ net.axes.T
    square = ((z[:, None] - net.rules) / net.widths) ** 2
    weights = np.exp(-0.5 * (square.max(axis=2) if conjunction is Conjunction.MINIMUM else square.sum(axis=2)))
    shares = weights / weights.sum(axis=1, keepdims=True)
    terms = np.column_stack([np.ones(len(z)), z])
    table = np.hstack([terms, *(shares[:, i : i + 1] * terms for i in range(3))])
    penalty = 1e-3 * len(z) * np.diag([0.0] + [1.0] * (table.shape[1] - 1))

    def fitted(rest):
        return np.linalg.solve(table[rest].T @ table[rest] + penalty, table[rest].T @ output[rest])

    theirs = np.empty(len(z))
    for b in np.unique(block):
        theirs[block == b] = (output - table @ fitted(block != b))[block == b]
    assert fit.left_out == pytest.approx(theirs, abs=1e-9)
    assert net.predict(columns)[0] == pytest.approx(table @ fitted(block >= 0), abs=1e-9)


def test_it_bends_where_a_line_cannot():
    columns, output, block = spindle(rows=300)
    fit = fit_fuzzy(columns, output, block)
    assert np.sqrt(np.mean(fit.left_out**2)) < 0.5 * output.std()
    assert len(fit.tried) > 50
    assert np.sqrt(np.mean(fit.left_out**2)) == pytest.approx(min(figure for _, figure in fit.tried))
    assert fit.notes[-1].startswith(next(name for name, f in fit.tried if f == min(f for _, f in fit.tried))[:12])


def test_components_are_not_correlated_and_of_equal_size():
    columns, output, block = spindle()
    net = fit_fuzzy(columns, output, block, **ONE).regressor
    z = (columns - net.centre) @ net.axes.T
    assert np.cov(z.T, bias=True) == pytest.approx(np.eye(2), abs=1e-9)
    centred = (columns - columns.mean(axis=0)) / columns.std(axis=0)
    first = np.linalg.eigh(np.cov(centred.T))[1][:, -1]
    assert abs(np.corrcoef(centred @ first, z[:, 0])[0, 1]) == pytest.approx(1.0)


def test_outside_all_rules_there_is_no_answer():
    columns, output, block = spindle()
    net = fit_fuzzy(columns, output, block, **ONE).regressor
    far = columns[:1] + 1000.0
    assert np.isnan(net.predict(far)).all()
    sd = np.zeros(1)
    assert np.isnan(net.function(net.numbers, far[0], np.zeros(net.room), sd))
    assert np.isnan(sd[0])


@pytest.mark.parametrize("conjunction", Conjunction)
def test_the_compiled_function_says_the_same(conjunction):
    columns, output, block = spindle()
    net = fit_fuzzy(columns, output, block, conjunctions=[conjunction]).regressor
    numbers, room, sd = net.numbers, np.zeros(net.room), np.zeros(1)
    for row, value, unsure in zip(columns, *net.predict(columns), strict=True):
        assert net.function(numbers, row, room, sd) == pytest.approx(value, rel=1e-12, abs=1e-12)
        assert sd[0] == pytest.approx(unsure, rel=1e-12)


def test_left_out_residuals_have_the_size_that_is_predicted():
    draw = np.random.default_rng(3)
    columns = draw.uniform(-2.0, 2.0, size=(600, 1))
    output = 3.0 * columns[:, 0] + 0.2 * draw.normal(size=600)
    _, sd = fit_fuzzy(columns, output, np.arange(600) // 10).regressor.predict(np.array([[0.5]]))
    assert sd[0] == pytest.approx(0.2, rel=0.1)


def test_the_seed_decides_the_rules():
    rows = spindle()
    first, again = (fit_fuzzy(*rows, seed=1, **ONE).regressor for _ in range(2))
    assert first.numbers.tolist() == again.numbers.tolist()


def test_plain_data_build_the_same_function():
    net = fit_fuzzy(*spindle(), conjunctions=[Conjunction.MINIMUM], **ONE).regressor
    again = Fuzzy.of(net.plain)
    assert again.numbers.tolist() == net.numbers.tolist()
    assert again.parameters == net.parameters == 3 * 3 + 3 * 2 + 3 * 2


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("conjunction", "maximum"),
        ("rules", []),
        ("axes", [1.0, 2.0, 3.0]),
        ("widths", [0.0] * 6),
        ("widths", [1.0]),
        ("consequents", "none"),
        ("spread", [1.0]),
        ("centre", []),
        ("noise_sd", -1.0),
    ],
)
def test_wrong_plain_data_are_refused(name, value):
    plain = fit_fuzzy(*spindle(), **ONE).regressor.plain
    with pytest.raises(ArgumentError):
        Fuzzy.of({**plain, name: value})


def test_a_constant_column_does_not_count():
    columns, output, block = spindle()
    stuck = np.insert(columns, 1, 26.0, axis=1)
    fit = fit_fuzzy(stuck, output, block, **ONE)
    assert fit.notes[0] == "Column 2 is constant and left out."
    assert fit.left_out == pytest.approx(fit_fuzzy(columns, output, block, **ONE).left_out, abs=1e-9)


def test_more_components_and_rules_than_there_are_become_fewer():
    x = np.repeat([0.0, 1.0, 2.0], 4)[:, None]
    fit = fit_fuzzy(np.hstack([x, 2.0 * x]), x[:, 0] ** 2, np.arange(12) % 4, components=[5], rules=[8])
    assert fit.notes[-1].startswith("1 component, 3 rules")


@pytest.mark.parametrize(
    "wrong", [{"rules": [1]}, {"components": []}, {"overlaps": [0.0]}, {"overlaps": [1e-3]}, {"shares": [-1.0]}]
)
def test_what_cannot_be_tried_is_refused(wrong):
    with pytest.raises(ArgumentError, match=next(iter(wrong))):
        fit_fuzzy(*spindle(), **wrong)
