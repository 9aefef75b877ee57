"""What looks alike on a plan, which rivals the data cannot reject, and what is only a datum."""

from dataclasses import replace

import numpy as np
import pytest
from inference_oracle import SIGMA, measured

from rtec.effects import Shape, effect_named
from rtec.inference.lookalikes import Rivalry, constant_is_datum, cosines, rivalries
from rtec.inference.noise import Noise, noise_from_repeats
from rtec.inference.whitening import Correlation
from rtec.inference.workspace import Workspace

SCALE, BACKLASH, LAG, DRIFT, OFFSET, WINDUP, MAP, CYCLIC = (
    effect_named(n) for n in ("scale", "backlash", "servo_lag", "drift", "offset", "windup", "pitch_map", "cyclic")
)
DENSE = np.concatenate([[0.0, 1.0, 2.0, 4.0, 7.0, 12.0, 20.0], np.linspace(35.0, 300.0, 12)])


def with_speed(data, speeds):
    """The same data, approached at a feed for each run."""
    feed = np.asarray(speeds)[(data.conditions.run - 1) % len(speeds)]
    return replace(data, conditions=replace(data.conditions, velocity=feed * data.conditions.direction))


def work_of(data, **changes):
    given = {"sigma": SIGMA, "correlation": Correlation(), "freedom": 168.0, "from_repeats": True} | changes
    return Workspace(data, Noise(**given))


def cosine_of(data, first, second, choices=()):
    found = cosines(work_of(data), choices)
    return found.cosine[found.names.index(first), found.names.index(second)]


def angle(first, second):
    a, b = first - first.mean(), second - second.mean()
    return abs(float(a @ b)) / np.sqrt(float(a @ a) * float(b @ b))


def test_backlash_and_lag_look_alike_at_one_feed_and_less_at_three():
    data = measured()
    assert cosine_of(with_speed(data, [20.0]), "backlash", "servo_lag") == pytest.approx(1.0)
    three = with_speed(data, [1.0, 20.0, 40.0])
    found = cosine_of(three, "backlash", "servo_lag")
    assert found == pytest.approx(angle(three.conditions.direction, three.conditions.velocity))
    assert found < 0.9


def test_scale_and_drift_look_alike_in_one_pass_and_not_forth_and_back():
    once = measured(runs=1, bidirectional=False)
    expected = angle(once.conditions.position, once.conditions.time_s)
    assert cosine_of(once, "scale", "drift") == pytest.approx(expected)
    assert expected > 0.99
    # the plan of the method's table: both directions, five times
    assert cosine_of(measured(), "scale", "drift") < 0.01


def test_the_matrix_is_symmetric_with_ones_and_without_the_constant():
    found = cosines(work_of(measured(timed=False)), [(BACKLASH, Shape())])
    assert "offset" not in found.names
    assert found.cosine == pytest.approx(found.cosine.T)
    assert np.diag(found.cosine) == pytest.approx(np.ones(len(found.names)))
    assert (found.cosine <= 1.0).all()
    assert (found.cosine >= 0.0).all()


def test_between_several_columns_the_largest_cosine_of_any_two_combinations():
    data = measured(timed=False)
    shape = CYCLIC.shape_type(290.0, 1)
    found = cosine_of(data, "cyclic", "scale", [(CYCLIC, shape)])
    waves = data.columns(CYCLIC, shape)
    line = data.conditions.position - data.conditions.position.mean()
    waves = waves - waves.mean(axis=0)
    numbers, *_ = np.linalg.lstsq(waves, line)
    left = line - waves @ numbers
    assert found == pytest.approx(np.sqrt(1 - left @ left / (line @ line)))


def test_one_effect_alone_has_no_cosines():
    one = measured(runs=9, at=np.array([100.0]), bidirectional=False, timed=False)
    assert cosines(work_of(one), []) is None


def rivals_of(data, choices, k=0):
    work = Workspace(data, noise_from_repeats(data)) if data.has_repeats else work_of(data)
    return {r.rival: r for r in rivalries(work, choices, k)}


def test_a_lag_at_one_feed_is_a_rival_that_the_data_cannot_reject():
    data = with_speed(measured(lambda x, way, t, run: 0.005 * way), [20.0])
    found = rivals_of(data, [(BACKLASH, Shape())])["servo_lag"]
    assert found.tied
    assert found.cosine == pytest.approx(1.0)
    assert found.lack == pytest.approx(0.0, abs=1e-6)
    assert found.candidacy.effect is LAG


def test_a_lag_at_three_feeds_is_rejected():
    data = with_speed(measured(lambda x, way, t, run: 0.005 * way), [1.0, 20.0, 40.0])
    assert "servo_lag" not in rivals_of(data, [(BACKLASH, Shape())])


def test_the_lack_is_twice_the_log_likelihood_between_the_two():
    data = measured(lambda x, way, t, run: 0.005 * way, at=DENSE, timed=False)
    work = work_of(data)
    found = {r.rival: r for r in rivalries(work, [(BACKLASH, Shape())], 0)}["windup"]
    columns = [data.columns(BACKLASH, Shape()), data.columns(WINDUP, found.candidacy.shape)]
    falls = []
    for column in columns:
        table = np.hstack([np.ones((data.rows, 1)), column])
        left = data.observed - table @ np.linalg.lstsq(table, data.observed)[0]
        falls.append(float(left @ left) / SIGMA**2)
    more = WINDUP.freedom(found.candidacy.shape)  # parameters beside an amplitude, each of which explains 1 by chance
    assert more >= 1
    assert found.lack == pytest.approx(falls[1] - falls[0] + more, rel=1e-6)


def test_a_cosine_misalignment_is_a_rival_for_ever_and_ties_nothing():
    found = rivals_of(measured(lambda x, way, t, run: 5e-5 * x), [(SCALE, Shape())])["cosine"]
    assert found.permanent
    assert not found.tied


def test_what_holds_the_effect_as_a_special_case_is_no_rival():
    data = measured(lambda x, way, t, run: 5e-5 * x)
    assert "pitch_map" not in rivals_of(data, [(SCALE, Shape())])
    assert "scale" not in rivals_of(data, [(MAP, MAP.shape_type(tuple(np.linspace(0, 300, 5))))])
    held = rivals_of(
        measured(lambda x, way, t, run: 5e-5 * x + 1e-5 * t, runs=1), [(SCALE, Shape()), (DRIFT, Shape())]
    )
    assert "drift" not in held
    assert "offset" not in held


def test_an_effect_of_no_size_has_permanent_rivals_only():
    data = replace(measured(), observed=np.zeros(210))
    assert set(rivals_of(data, [(SCALE, Shape())])) == {"cosine"}


@pytest.mark.parametrize(
    ("cosine", "lack", "permanent", "tied"),
    [(0.96, 5.9, False, True), (0.95, 5.9, False, False), (0.96, 6.0, False, False), (1.0, 0.0, True, False)],
)
def test_rivals_are_tied_above_a_cosine_and_below_a_lack(cosine, lack, permanent, tied):
    assert Rivalry(effect="a", rival="b", cosine=cosine, lack=lack, permanent=permanent).tied is tied


@pytest.mark.parametrize("zero", ["mean", "start", "forward"])
def test_a_constant_that_says_where_zero_is_is_a_datum(zero):
    data = measured(lambda x, way, t, run: 5e-5 * (x + 40.0) + 0.006 * way, sigma=SIGMA)
    raw = 5e-5 * (data.conditions.position + 40.0) + 0.006 * data.conditions.direction
    forward = raw[data.conditions.direction > 0]
    shift = {"mean": raw.mean(), "start": raw[0], "forward": forward.mean()}[zero]
    work = work_of(replace(data, observed=data.observed - shift))
    assert constant_is_datum(work, [(SCALE, Shape()), (BACKLASH, Shape())])


def test_a_constant_of_its_own_is_no_datum():
    work = work_of(measured(lambda x, way, t, run: 0.05 + 5e-5 * x + 0.006 * way))
    assert not constant_is_datum(work, [(SCALE, Shape()), (BACKLASH, Shape())])
    assert not constant_is_datum(work, [(OFFSET, Shape())])
    assert not constant_is_datum(work, [])


def test_a_backlash_read_from_its_forward_side_has_a_datum():
    work = work_of(measured(lambda x, way, t, run: 0.006 * (way - 1.0)))
    assert constant_is_datum(work, [(BACKLASH, Shape())])
    one_way = measured(lambda x, way, t, run: 5e-5 * (x - 100.0), bidirectional=False)
    assert not constant_is_datum(work_of(one_way), [(SCALE, Shape())])
