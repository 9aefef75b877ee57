"""Bayesian networks of a warm machine: states, causes and what left-out blocks say."""

import re
from pathlib import Path

import numpy as np
import pytest

from rtec.errors import ArgumentError
from rtec.predictors.fitting.warm.bayes import fit_bayes
from rtec.predictors.fitting.warm.states import Cutting, cuts_of
from rtec.predictors.warm.bayes_network import BayesNetwork
from rtec.predictors.warm.features import Feature

FEATURES = (Feature(of="spindle_speed"), Feature(of="temperature_front"), Feature(of="temperature_rear"))


def warm_rows(seed=0, rows=600):
    """Speeds held for 40 rows; the front follows them, the error follows the front, the rear goes its own way."""
    draw = np.random.default_rng(seed)
    block = np.arange(rows) // 40
    speed = 1000.0 * draw.integers(0, 4, block.max() + 1)[block]
    front = 20.0 + speed / 250.0 + draw.normal(0.0, 1.0, rows)
    rear = 20.0 + draw.normal(0.0, 2.0, rows)
    error = 2.0 * front + draw.normal(0.0, 0.5, rows)
    return np.stack([speed, front, rear], axis=1), error, block


def check_left_out(fit, columns, output, block, left):
    """Count anew the rows of the other blocks, and ask the network of each left-out row."""
    chosen = fit.regressor
    of_output = np.searchsorted(cuts_of(output, chosen.means.size, Cutting.EQUAL_COUNTS), output)
    inner = [np.searchsorted(cuts, column) for cuts, column in zip(chosen.cuts, columns.T, strict=True)]
    states, others = np.stack([*inner, of_output], axis=1), block != left
    again = BayesNetwork.learn(chosen.network.nodes, states[others], prior=chosen.network.prior)
    means = [output[others & (of_output == k)].mean() for k in range(chosen.means.size)]
    for row in np.flatnonzero(block == left)[::7]:
        evidence = {name: int(state) for name, state in zip(chosen.names, states[row], strict=False)}
        expected = output[row] - again.posterior("output", evidence).mean(means)
        assert fit.left_out[row] == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("left", [0, 7, 14])
def test_left_out_rows_are_those_of_counts_without_their_block(left):
    columns, output, block = warm_rows()
    check_left_out(fit_bayes(columns, output, block, features=FEATURES), columns, output, block, left)


def test_effects_of_the_output_count_too():
    """Arrows turned round: the front is an effect of the error, the rear one of error and speed."""
    columns, output, block = warm_rows()
    structure = {"output": [], "temperature_front": ["output"], "temperature_rear": ["spindle_speed", "output"]}
    fit = fit_bayes(columns, output, block, features=FEATURES, structure=structure)
    assert [node.parents for node in fit.regressor.network.nodes] == [
        (),
        ("output",),
        ("spindle_speed", "output"),
        (),
    ]
    assert np.sqrt(np.mean(np.square(fit.left_out))) < 0.3 * output.std()
    check_left_out(fit, columns, output, block, 3)


def test_the_cause_is_chosen_and_the_other_temperature_is_not():
    fit = fit_bayes(*warm_rows(), features=FEATURES)
    output = fit.regressor.network.nodes[-1]
    assert output.parents[0] == "temperature_front"
    assert "temperature_rear" not in output.parents
    assert any(note.startswith("The output depends on temperature_front") for note in fit.notes)
    assert np.sqrt(np.mean(np.square(fit.left_out))) == pytest.approx(min(figure for _, figure in fit.tried))
    columns, output, _ = warm_rows(seed=9)
    found, sd = fit.regressor.predict(columns)
    assert np.sqrt(np.mean(np.square(found - output))) < 0.2 * output.std()
    assert 0.8 < np.mean(np.abs(found - output) < 1.645 * sd) <= 1.0


def test_a_lost_sensor_is_answered_by_the_others():
    columns, output, block = warm_rows()
    fit = fit_bayes(columns, output, block, features=FEATURES)
    columns[:, 1] = np.nan
    found, sd = fit.regressor.predict(columns)
    assert np.sqrt(np.mean(np.square(found - output))) < 0.5 * output.std()
    assert (sd > 1.5).all()


def test_where_nothing_helps_the_mean_answers():
    draw = np.random.default_rng(3)
    columns, output, block = warm_rows()
    fit = fit_bayes(columns, draw.normal(size=output.size), block, features=FEATURES)
    assert fit.regressor.network.nodes[-1].parents == ()
    assert "The output depends on nothing" in fit.notes[-1]
    found = fit.regressor.predict(columns)[0]
    assert found == pytest.approx(np.full(output.size, found[0]))


def test_constant_columns_and_few_rows_have_their_say():
    columns, output, block = warm_rows(rows=80)
    columns[:, 2] = 21.0
    fit = fit_bayes(columns[::20], output[::20], block[::20], features=FEATURES)
    assert fit.regressor.network.nodes[2].states == 1
    assert "Column 3 is constant and left out." in fit.notes
    assert np.isfinite(fit.left_out).all()
    assert fit.regressor.predict(columns)[0].shape == output.shape


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"features": FEATURES[:2]}, "one for each of 3"),
        ({"structure": {"output": ["temperature_top"]}}, "temperature_top"),
        ({"structure": {"spindle_speed": ["temperature_front"]}}, "circle"),
        ({"structure": {"output": ["output"]}}, "circle"),
        ({"block": np.zeros(600, dtype=int)}, "at least two"),
        ({"columns": np.ones((600, 3))}, "constant"),
    ],
)
def test_what_cannot_be_fitted_says_why(change, said):
    columns, output, block = warm_rows()
    given = {"columns": columns, "output": output, "block": block, "features": FEATURES, **change}
    with pytest.raises(ArgumentError, match=said):
        fit_bayes(**given)


def test_equal_counts_keep_equal_values_together():
    values = np.repeat([1.0, 2.0, 3.0, 4.0, 9.0], [10, 1, 1, 10, 2])
    assert cuts_of(values, 2, Cutting.EQUAL_COUNTS).tolist() == [3.5]
    assert cuts_of(values, 3, Cutting.EQUAL_COUNTS).tolist() == [1.5, 3.5]
    assert cuts_of(values, 5, Cutting.EQUAL_COUNTS).tolist() == [1.5, 2.5, 3.5, 6.5]
    assert cuts_of(np.ones(4), 3, Cutting.EQUAL_COUNTS).size == 0


def test_the_example_of_the_page_runs(capsys):
    page = (Path(__file__).parents[4] / "docs" / "warm-machine.md").read_text(encoding="utf-8")
    codes = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    exec(next(code for code in codes if "fit_bayes" in code), {})  # noqa: S102 - our own page
    answer, moved, unseen = capsys.readouterr().out.splitlines()
    assert re.match(r"\(array\(\[-\d", answer)  # z goes down as the machine warms up
    assert re.match(r"\(\('temperature_(front_bearing|motor)', -\d", moved)
    assert unseen == "False"
