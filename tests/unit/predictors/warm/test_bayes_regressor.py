"""A Bayesian network as a function of features: answers, what moves them, and plain data."""

import copy

import numpy as np
import pytest

from rtec.errors import ArgumentError
from rtec.predictors.warm.bayes import BayesRegressor
from rtec.predictors.warm.bayes_network import BayesNetwork, Node
from rtec.predictors.warm.causes import causal_structure, with_stated
from rtec.predictors.warm.features import Feature
from rtec.predictors.warm.regressor import Regressor

NODES = (
    Node(name="speed", states=2),
    Node(name="front", states=3, parents=("speed",)),
    Node(name="rear", states=3, parents=("speed",)),
    Node(name="output", states=4, parents=("front", "speed")),
)
COLUMNS = np.array([[0.0, 20.0, 20.0], [3000.0, 26.0, 31.0], [np.nan, 31.0, 20.0], [0.0, np.nan, np.nan]])


def machine(prior=0.5):
    draw = np.random.default_rng(4)
    speed = draw.integers(2, size=200)
    front, rear = np.minimum(speed + draw.integers(2, size=200), 2), np.minimum(speed + draw.integers(2, size=200), 2)
    output = np.minimum(front + speed * draw.integers(2, size=200), 3)
    network = BayesNetwork.learn(NODES, np.stack([speed, front, rear, output], axis=1), prior=prior)
    cuts = ([1000.0], [25.0, 30.0], [25.0, 30.0])
    return BayesRegressor(network=network, cuts=cuts, means=[0.0, 5.0, 9.0, 30.0], variances=[1.0, 2.0, 3.0, 4.0])


def test_the_answer_is_the_mean_of_the_posterior():
    found, sd = machine().predict(COLUMNS)
    evidence = [
        {"speed": 0, "front": 0, "rear": 0},
        {"speed": 1, "front": 1, "rear": 2},
        {"front": 2, "rear": 0},
        {"speed": 0},
    ]
    for row, states in enumerate(evidence):
        posterior = machine().network.posterior("output", states)
        assert found[row] == pytest.approx(posterior.mean([0.0, 5.0, 9.0, 30.0]), abs=1e-12)
        assert sd[row] == pytest.approx(posterior.sd([0.0, 5.0, 9.0, 30.0], [1.0, 2.0, 3.0, 4.0]), abs=1e-12)
        assert machine().posterior(COLUMNS[row]).probabilities == pytest.approx(posterior.probabilities, abs=1e-12)


def test_the_compiled_function_gives_the_same():
    regressor = machine()
    assert isinstance(regressor, Regressor)
    found, sd = regressor.predict(COLUMNS)
    for row, columns in enumerate(COLUMNS):
        told = np.empty(1)
        answer = regressor.function(regressor.numbers, columns, np.full(regressor.room, np.nan), told)
        assert (answer, told[0]) == pytest.approx((found[row], sd[row]), abs=1e-9)


def test_a_value_on_a_cut_lies_below_it():
    regressor = machine()
    on, above, below = regressor.predict(np.array([[0.0, 25.0, 20.0], [0.0, 25.001, 20.0], [0.0, 1.0, 20.0]]))[0]
    assert on == below != above


def test_what_moves_an_answer_is_each_observed_feature_against_leaving_it_out():
    regressor = machine()
    moved = dict(regressor.moved(COLUMNS[1]))
    whole = regressor.predict(COLUMNS[1:2])[0][0]
    for k, name in enumerate(("speed", "front", "rear")):
        without = COLUMNS[1:2].copy()
        without[0, k] = np.nan
        assert moved[name] == pytest.approx(whole - regressor.predict(without)[0][0], abs=1e-12)
    assert moved["rear"] == pytest.approx(0.0, abs=1e-12)  # the causes of the output are observed
    sizes = [abs(change) for _, change in regressor.moved(COLUMNS[1])]
    assert sizes == sorted(sizes, reverse=True) and sizes[0] > 1.0
    assert [name for name, _ in regressor.moved(COLUMNS[3])] == ["speed"]


def test_states_that_no_row_had_are_flagged_and_wide():
    regressor = machine(prior=1e-3)
    never = np.array([[0.0, 31.0, 20.0]])  # at rest the front never was in its last state
    assert regressor.unseen(np.vstack([never, COLUMNS])).tolist() == [True, False, False, False, False]
    found, sd = regressor.predict(never)
    assert found[0] == pytest.approx(np.mean([0.0, 5.0, 9.0, 30.0]))
    assert sd[0] == pytest.approx(np.sqrt(np.var([0.0, 5.0, 9.0, 30.0]) + np.mean([1.0, 2.0, 3.0, 4.0])))


def test_plain_data_build_the_same_function():
    regressor = machine()
    again = BayesRegressor.of(copy.deepcopy(regressor.plain))
    assert np.array_equal(np.stack(again.predict(COLUMNS)), np.stack(regressor.predict(COLUMNS)))
    assert again.parameters == regressor.parameters == (1 + 4 + 4 + 18) + 4
    assert again.moved(COLUMNS[0]) == regressor.moved(COLUMNS[0])


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"names": "speed"}, "names"),
        ({"states": [2, 3, 3]}, "states: a list of 3"),
        ({"states": [2, 3, 3, 4.5]}, "states"),
        ({"parents": [0, 0, 1, 9]}, "parents: 0 to 9"),
        ({"causes": [0, 1, 1, -2]}, "causes"),
        ({"parents": [1, 0, 1, 0], "causes": [1, 1, 0, 2]}, "circle"),
        ({"counts": [1.0]}, "counts: a list of 1"),
        ({"cuts": [1000.0, 30.0, 25.0, 25.0, 30.0]}, "cuts of front"),
        ({"means": [0.0]}, "means"),
        ({"variances": [1.0, 1.0, 1.0, -1.0]}, "variances: -1"),
        ({"prior": 0.0}, "prior"),
    ],
)
def test_plain_data_that_cannot_be_say_why(change, said):
    plain = {**machine().plain, **change}
    with pytest.raises(ArgumentError, match=said):
        BayesRegressor.of(plain)


def test_rows_of_another_width_are_refused():
    with pytest.raises(ArgumentError, match="rows of 3 features"):
        machine().predict(COLUMNS[:, :2])


ROTATION, FRONT = Feature(of="spindle_speed"), Feature(of="temperature_front")
SLOW = "temperature_front behind by 60 s"
HEAT, HEAT_BEHIND = Feature(of="spindle_speed", heat=True), Feature(of="spindle_speed", heat=True, lag_s=600.0)
AMBIENT, BEHIND = Feature(of="temperature_room_1"), Feature(of="temperature_front", lag_s=60.0)


def test_speed_heats_what_the_room_and_lags_follow():
    found = causal_structure((BEHIND, FRONT, AMBIENT, HEAT_BEHIND, HEAT, ROTATION), [str(FRONT)])
    assert found == {
        SLOW: ("temperature_front",),
        "temperature_front": ("temperature_room_1", "spindle_speed^(5/3) behind by 600 s"),
        "temperature_room_1": (),
        "spindle_speed^(5/3) behind by 600 s": ("spindle_speed^(5/3)",),
        "spindle_speed^(5/3)": ("spindle_speed",),
        "spindle_speed": (),
        "output": ("temperature_front",),
    }


def test_without_what_would_stand_between_causes_are_nearer():
    assert causal_structure((HEAT_BEHIND, ROTATION, BEHIND)) == {
        str(HEAT_BEHIND): ("spindle_speed",),
        "spindle_speed": (),
        SLOW: (str(HEAT_BEHIND),),
        "output": (),
    }


def test_a_stated_structure_takes_the_place_of_what_is_known():
    known = causal_structure((FRONT, ROTATION))
    assert with_stated(known, {"temperature_front": []})["temperature_front"] == ()
    with pytest.raises(ArgumentError, match="temperature_frnt"):
        with_stated(known, {"output": ["temperature_frnt"]})
    with pytest.raises(ArgumentError, match="each feature once"):
        causal_structure((FRONT, FRONT))
