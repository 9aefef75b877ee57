"""Bayesian network with LS-SVMs: conditions, their machines, and left-out blocks by fitting again."""

import numpy as np
import pytest

from rtec.errors import ArgumentError
from rtec.predictors.fitting.warm.bayes_lssvm import fit_bayes_ls_svm
from rtec.predictors.fitting.warm.conditions import divisions, signs_among
from rtec.predictors.fitting.warm.lssvm import fit_ls_svm, train_ls_svm
from rtec.predictors.warm.bayes_lssvm import BayesLsSvm
from rtec.predictors.warm.bayes_network import BayesNetwork
from rtec.predictors.warm.features import Feature, columns_of
from rtec.predictors.warm.regressor import Regressor

FEATURES = (
    Feature(of="spindle_speed"),
    Feature(of="temperature_front"),
    Feature(of="temperature_front", lag_s=600.0),
    Feature(of="temperature_rear"),
)
STEPS = (0.0, 2000.0, 0.0, 4000.0, 2000.0, 0.0, 4000.0, 0.0)


def warm_rows():
    """Heating, the error is one function of the temperatures; cooling, it is another."""
    draw = np.random.default_rng(2)
    block = np.repeat(np.arange(len(STEPS)), 40)
    speed, time_s = np.array(STEPS)[block], 60.0 * np.arange(block.size)
    front = np.empty(block.size)
    front[0] = 20.0
    for i in range(1, front.size):
        front[i] = front[i - 1] + 0.06 * (20.0 + speed[i] / 200.0 - front[i - 1])
    inputs = {
        "spindle_speed": speed,
        "temperature_front": front + draw.normal(0.0, 0.02, front.size),
        "temperature_rear": 20.0 + 0.2 * (front - 20.0) + draw.normal(0.0, 0.02, front.size),
    }
    columns = columns_of(FEATURES, time_s, inputs)
    rising = speed > 0.0
    error = np.where(rising, 2.0 * (front - 20.0), 1.2 * (front - 20.0)) + draw.normal(0.0, 0.1, front.size)
    return columns, error, block


@pytest.fixture(scope="module")
def fit():
    return fit_bayes_ls_svm(*warm_rows(), features=FEATURES)


@pytest.mark.parametrize("linear", [0.0, 1.0])
def test_left_out_rows_are_those_of_machines_and_counts_without_their_block(linear):
    columns, output, block = warm_rows()
    alone = fit_ls_svm(columns, output, block, linear=(linear,))
    fit = fit_bayes_ls_svm(columns, output, block, features=FEATURES, alone=alone)
    found = fit.regressor
    signs = np.stack([columns[:, a] - (columns[:, b] if b >= 0 else 0.0) for a, b in found.signs], axis=1)
    ways = {way.names: way.of_row for way in divisions(FEATURES, columns)}
    label = ways[found.conditions]
    states = [np.searchsorted(cuts, sign) for cuts, sign in zip(found.classifier.cuts, signs.T, strict=True)]
    rows = np.stack([*states, label], axis=1)
    for left in (1, 5):
        others = block != left
        network = BayesNetwork.learn(found.classifier.network.nodes, rows[others])
        at = np.flatnonzero(block == left)[::11]
        expected = np.zeros(at.size)
        for condition, place in enumerate(found.machine_of):
            machine, members = found.machines[place], others & (label == condition)
            scaled = (columns - machine.centre) * machine.per_unit
            again = train_ls_svm(
                scaled[members], output[members], width=machine.width, gamma=machine.gamma, linear=machine.linear
            )
            for k, row in enumerate(at):
                evidence = dict(zip(found.classifier.names, rows[row, :-1].tolist(), strict=True))
                weight = network.posterior("output", evidence).probabilities[condition]
                expected[k] += weight * again.predict(scaled[row : row + 1])[0][0]
        assert fit.left_out[at] == pytest.approx(output[at] - expected, abs=1e-6)


def test_conditions_that_differ_are_told_apart(fit):
    columns, output, _ = warm_rows()
    found, sd = fit.regressor.predict(columns)
    assert np.sqrt(np.mean((found - output) ** 2)) < 0.1 * output.std()
    assert (sd > 0.0).all()
    name, probability = fit.regressor.probable(columns[60])[0]
    assert probability > 0.9 and name in fit.notes[-3]
    assert sum(share for _, share in fit.regressor.probable(columns[60])) == pytest.approx(1.0)
    assert fit.notes[-1].startswith("Left-out blocks:")
    assert min(figure for _, figure in fit.tried) == pytest.approx(np.sqrt(np.mean(fit.left_out**2)))


def test_the_compiled_function_gives_the_same(fit):
    columns = warm_rows()[0][::17]
    regressor = fit.regressor
    assert isinstance(regressor, Regressor)
    found, sd = regressor.predict(columns)
    numbers, room, told = regressor.numbers, np.full(regressor.room, np.nan), np.empty(1)
    for row, one in enumerate(columns):
        answer = regressor.function(numbers, one, room, told)
        assert (answer, told[0]) == pytest.approx((found[row], sd[row]), abs=1e-9)


def test_a_lost_sensor_has_no_answer(fit):
    columns = warm_rows()[0][:1]
    columns[0, 1] = np.nan
    regressor, told = fit.regressor, np.empty(1)
    assert np.isnan(regressor.predict(columns)).all()
    assert np.isnan(regressor.function(regressor.numbers, columns[0], np.empty(regressor.room), told))
    assert np.isnan(told[0])


def test_plain_data_build_the_same_function(fit):
    columns = warm_rows()[0]
    again = BayesLsSvm.of(fit.regressor.plain)
    assert np.array_equal(np.stack(again.predict(columns)), np.stack(fit.regressor.predict(columns)))
    assert (again.conditions, again.parameters) == (fit.regressor.conditions, fit.regressor.parameters)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"conditions": ["heating"]}, "conditions: 1"),
        ({"conditions": [1.0, 2.0, 3.0]}, "list of names"),
        ({"signs": [0, -1]}, "signs: a list of 2"),
        ({"signs": [0, -1, 1, 7]}, "columns from 0 to 3"),
        ({"machine_of": [0, 1]}, "machine_of"),
        ({"machine_of": [0, 0, -1]}, "machine_of"),
        ({"machine_1_width": 0.0}, "width"),
        ({"classifier_means": [0.0]}, "means"),
    ],
)
def test_plain_data_that_cannot_be_say_why(fit, change, said):
    plain = {**fit.regressor.plain, **change}
    with pytest.raises(ArgumentError, match=said):
        BayesLsSvm.of(plain)


def test_rules_name_trend_and_speed():
    columns = np.array([[0.0, 20.0, 20.0, 20.0], [3000.0, 30.0, 20.0, 21.0], [0.0, 25.0, 32.0, 22.0]])
    by_trend, by_speed, by_both = divisions(FEATURES, columns)
    assert [by_trend.names[k] for k in by_trend.of_row] == ["steady", "heating", "cooling"]
    assert [by_speed.names[k] for k in by_speed.of_row] == [
        "spindle_speed below 1500",
        "spindle_speed above 1500",
        "spindle_speed below 1500",
    ]
    assert by_both.names[by_both.of_row[2]] == "cooling, spindle_speed below 1500"
    assert len(by_both.names) == 3
    assert signs_among(FEATURES) == {
        "spindle_speed": (0, -1),
        "temperature_front less behind by 600 s": (1, 2),
    }


def test_a_condition_with_few_rows_is_answered_by_the_machine_of_all():
    columns, output, block = warm_rows()
    columns[:, 0] = np.where(np.arange(output.size) < 12, 9000.0, 0.0)
    columns[:, 2] = columns[:, 1]  # nothing leads: all is steady
    fit = fit_bayes_ls_svm(columns, output, block, features=FEATURES)
    assert fit.regressor.conditions == ("spindle_speed below 4500", "spindle_speed above 4500")
    assert "1 of 2 have a machine of their own." in fit.notes
    assert np.isfinite(fit.left_out).all()
    alone = fit_ls_svm(columns, output, block)
    assert fit.regressor.machines[fit.regressor.machine_of[1]].plain == alone.regressor.plain


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"features": FEATURES[:2]}, "one for each of 4"),
        ({"features": (FEATURES[1], FEATURES[3], Feature(of="temperature_a"), Feature(of="temperature_b"))}, "lags"),
        ({"block": np.zeros(320, dtype=int)}, "at least two"),
    ],
)
def test_what_cannot_be_fitted_says_why(change, said):
    columns, output, block = warm_rows()
    with pytest.raises(ArgumentError, match=said):
        fit_bayes_ls_svm(**{"columns": columns, "output": output, "block": block, "features": FEATURES, **change})
