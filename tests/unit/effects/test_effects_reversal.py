"""What happens after a reversal: spikes against a differential equation, and which name a curve has."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from rtec.effects import BuildUpShape, Conditions, distance_since_reversal
from rtec.effects.coulomb import Coulomb
from rtec.effects.hysteresis import Hysteresis, HysteresisShape, strokes
from rtec.effects.reversal_spike import ReversalSpike, SpikeShape
from rtec.effects.stribeck import Stribeck, StribeckShape
from rtec.effects.windup import Windup, WindupShape


def at(position, direction, run):
    return Conditions(
        position=position,
        position_unit="mm",
        run=run,
        direction=direction,
        since_reversal=distance_since_reversal(position, direction, run),
    )


def out_and_back(steps=60, span=300.0, turns=2):
    one = np.concatenate([np.linspace(0.0, span, steps), np.linspace(span, 0.0, steps)])
    position = np.tile(one, turns)
    direction = np.tile(np.repeat([1.0, -1.0], steps), turns)
    run = np.ones(position.size, dtype=np.int64)
    return at(position, direction, run)


def test_a_spike_dies_away_along_the_way():
    """z' = -z / distance over the way, set to the direction at each reversal; integrated in small steps."""
    c, distance = out_and_back(), 20.0
    expected, state, begin = np.empty(c.rows), 0.0, 0.0
    for i in range(c.rows):
        if i == 0 or c.direction[i] != c.direction[i - 1]:
            state = c.direction[i]
        else:
            for _ in range(200):
                state -= state / distance * abs(c.position[i] - begin) / 200
        begin = c.position[i]
        expected[i] = state
    found = ReversalSpike().contribution(c, SpikeShape(distance), [-0.02])
    assert found == pytest.approx(-0.01 * expected, abs=2e-5)


def one_way(begins, steps=20, span=100.0):
    position = np.concatenate([np.linspace(begin, begin + span, steps) for begin in begins])
    run = np.repeat(np.arange(1, len(begins) + 1), steps)
    direction = np.ones(position.size)
    return at(position, direction, run)


@pytest.mark.parametrize("effect", [ReversalSpike(), Windup()])
def test_runs_in_one_direction_show_what_follows_a_reversal_where_they_begin_at_several_places(effect):
    assert effect.untestable(one_way([0.0, 20.0, 60.0])) is None
    for begins in ([0.0, 0.0, 0.0], [0.0, 60.0], [0.0, 2.0, 4.0]):  # a map of the axis would do as well
        assert effect.untestable(one_way(begins)) == "one direction only, and not from 3 places far apart"


def test_a_spike_is_a_backlash_less_a_wind_up():
    c = out_and_back()
    whole = ReversalSpike().columns(c, SpikeShape(15.0)) + Windup().columns(c, WindupShape(15.0))
    assert whole[:, 0] == pytest.approx(c.direction / 2)


def test_a_spike_needs_points_behind_the_reversal():
    sparse = out_and_back(steps=6)
    assert "distances within" in ReversalSpike().untestable(sparse)
    assert ReversalSpike().shapes(out_and_back(steps=3, turns=1)) == []
    assert ReversalSpike().untestable(out_and_back()) is None
    (free,) = ReversalSpike().tunables(out_and_back(), SpikeShape(20.0))
    assert (free.low, free.high) == pytest.approx((20.0 / 1.5, 30.0))


def log(position, run=None, time_s=None):
    position = np.asarray(position, dtype=float)
    way = np.sign(np.diff(position, prepend=position[0]))
    for i in range(1, way.size):
        way[i] = way[i] or way[i - 1]
    return Conditions(
        position=position,
        position_unit="mm",
        run=np.ones(position.size, dtype=np.int64) if run is None else run,
        direction=way,
        since_reversal=distance_since_reversal(position, way, np.ones(position.size, dtype=np.int64)),
        time_s=np.arange(position.size) * 0.02 if time_s is None else time_s,
        moving=True,
    )


def path(*turns, step=0.05):
    ways = [np.arange(a, b, np.copysign(step, b - a)) for a, b in itertools.pairwise(turns)]
    return np.concatenate([*ways, turns[-1:]])


def leaf(conditions, distance=6.0, **more):
    return 2.0 * Hysteresis().columns(conditions, HysteresisShape(distance, **more))[:, 0]


def test_from_nothing_the_springs_bend_as_an_exponential():
    x = path(0.0, 60.0)
    assert leaf(log(x)) == pytest.approx(1.0 - np.exp(-x / 6.0), abs=0.005)


def test_a_way_back_is_twice_as_long_as_the_first():
    """Masing: the branch after a reversal is the first curve, twice as large both ways."""
    x = path(0.0, 100.0, 0.0)
    turn = int(np.argmax(x))
    h = leaf(log(x))
    back = 100.0 - x[turn:]
    assert h[turn:] == pytest.approx(1.0 - 2.0 * (1.0 - np.exp(-back / 12.0)), abs=0.01)


def test_a_small_loop_closes_where_it_began_and_is_forgotten():
    within = path(0.0, 8.0, 5.0, 8.0, 20.0)
    without = path(0.0, 20.0)
    h, plain = leaf(log(within)), leaf(log(without))
    eights = np.flatnonzero(np.abs(within - 8.0) < 0.026)
    assert h[eights[-1]] == pytest.approx(h[eights[0]], abs=0.01)
    assert h[-1] == pytest.approx(plain[-1], abs=1e-3), "beyond the loop nothing is left of it"
    assert np.ptp(h[eights[0] : eights[-1] + 1]) > 0.3, "but it was a loop"


def test_a_run_that_goes_on_remembers_and_one_after_a_pause_does_not():
    x = path(0.0, 30.0, 25.0)
    half = x.size // 2
    run = np.where(np.arange(x.size) < half, 1, 2)
    assert leaf(log(x, run=run)) == pytest.approx(leaf(log(x)))
    pause = np.arange(x.size) * 0.02 + 100.0 * (run == 2)
    begun = leaf(log(x, run=run, time_s=pause))
    assert begun[half] == 0.0
    assert leaf(log(x, run=run, time_s=pause), settled=True)[half] == 1.0


@pytest.mark.parametrize(
    ("effect", "shape"),
    [
        (Windup(), WindupShape(6.0, carried=True)),
        (Windup(), WindupShape(6.0, carried=True, settled=True)),
        (Coulomb(), BuildUpShape(6.0, carried=True)),
        (Stribeck(), StribeckShape(6.0, carried=True, speed=3.0)),
        (Hysteresis(), HysteresisShape(6.0)),
    ],
)
def test_the_number_of_a_run_changes_nothing_in_a_motion_that_goes_on(effect, shape):
    """A run begins where the axis turns round: the other way is no beginning."""
    x = path(0.0, 30.0, 25.0, 30.0, 10.0)
    one = log(x)
    one = replace(one, velocity=2.0 * one.direction)
    second = np.arange(x.size) >= np.argmax(one.direction < 0)
    runs = replace(one, run=1 + second)
    whole = effect.columns(one, shape)[:, 0]
    assert effect.columns(runs, shape)[:, 0] == pytest.approx(whole)
    pause = replace(runs, time_s=one.time_s + 100.0 * second)
    assert np.abs(effect.columns(pause, shape)[:, 0] - whole).max() > 0.2


@pytest.mark.parametrize(
    ("conditions", "why"),
    [
        (out_and_back(), "no moving data"),
        (log(path(0.0, 50.0, 0.0)), "2 strokes between reversals only: at least 4 needed"),
        (log(path(0.0, 50.0, 0.0, 50.0, 0.0, 50.0)), "all strokes are of one length: confounded with windup"),
        (log(path(0.0, 50.0, 45.0, 50.0, 0.0, 20.0, 15.0)), None),
    ],
)
def test_memory_shows_where_strokes_differ(conditions, why):
    assert Hysteresis().untestable(conditions) == why


def test_a_drawn_part_remembers_the_whole_way():
    whole = log(path(0.0, 8.0, 5.0, 20.0, 3.0, 12.0))
    rows = np.sort(np.random.default_rng(1).choice(whole.rows, 80, replace=False))
    part = replace(whole.take(rows), whole=whole)
    assert leaf(part) == pytest.approx(leaf(whole)[rows])
    carried = WindupShape(4.0, carried=True)
    assert Windup().columns(part, carried) == pytest.approx(Windup().columns(whole, carried)[rows])
    assert strokes(part) == pytest.approx(strokes(whole))
