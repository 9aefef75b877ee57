"""Effects of position and direction, against simulations that know nothing of columns."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from rtec.effects import Conditions, MapShape, Shape, Units
from rtec.effects.backlash import backlash
from rtec.effects.backlash_map import BacklashMap, ReversalMapShape
from rtec.effects.pitch_map import PitchMap
from rtec.effects.scale import scale
from rtec.effects.windup import Windup, WindupShape

LINEAR = Units("mm", "mm", "s")


def path(turns, step=0.05):
    """Positions of a path that goes from turn to turn, in steps, and the direction of each step."""
    pieces, ways = [np.array([turns[0]])], [np.array([np.sign(turns[1] - turns[0])])]
    for begin, end in itertools.pairwise(turns):
        count = round(abs(end - begin) / step)
        pieces.append(begin + (end - begin) * np.arange(1, count + 1) / count)
        ways.append(np.full(count, np.sign(end - begin)))
    return np.concatenate(pieces), np.concatenate(ways)


def conditions(position, direction):
    run = np.ones(position.size, dtype=np.int64)
    turned = np.flatnonzero(np.diff(direction) != 0)
    # the distance counts from the point where the axis turned round, which is the last reading of the way before
    begin = np.concatenate([[position[0]], position[turned]])[np.cumsum(np.append(False, np.diff(direction) != 0))]
    return Conditions(
        position=position, position_unit="mm", run=run, direction=direction, since_reversal=np.abs(position - begin)
    )


def test_play_between_drive_and_slide():
    position, direction = path([-5.0, 60.0, 20.0, 80.0, 0.0])
    play, slide, deviation = 0.4, position[0] - 0.2, []
    for x in position:
        slide = min(max(slide, x - play / 2), x + play / 2)  # pushed by one flank of the nut or the other
        deviation.append(slide - x)
    c = conditions(position, direction)
    beyond = c.since_reversal > play
    added = backlash.contribution(c, Shape(), [-play])
    assert added[beyond] == pytest.approx(np.array(deviation)[beyond], abs=1e-12)


@pytest.mark.parametrize("carried", [False, True])
def test_an_elastic_drive_against_friction(carried):
    position, direction = path([0.0, 90.0, 10.0, 85.0, 0.0], step=0.004)
    full, distance = -0.03, 4.0
    bend, deviation = full / 2 * (-1.0 if carried else 0.0), []
    for i, way in enumerate(direction):
        travel = abs(position[i] - position[i - 1]) if i else 0.0
        if not carried and i and way != direction[i - 1]:
            bend = 0.0
        bend += travel / distance * (full / 2 * way - bend)
        deviation.append(bend)
    added = Windup().contribution(conditions(position, direction), WindupShape(distance, carried), [full])
    assert added == pytest.approx(np.array(deviation), abs=2e-5)
    assert np.ptp(added) == pytest.approx(abs(full), rel=1e-3)


def test_windup_takes_both_starts_into_question(bidirectional):
    variants = Windup().variants(bidirectional(), WindupShape(8.0))
    assert variants[:2] == [WindupShape(8.0), WindupShape(8.0, carried=True)]
    assert [(v.distance, v.carried) for v in variants[2:4]] == [(6.0, True), (pytest.approx(4.4), True)]
    beyond = [(v.distance, v.carried, v.overshoot) for v in variants[4:]]
    assert beyond == [(v.distance, v.carried, pytest.approx(0.1 * v.distance)) for v in variants[:4]]
    moving = replace(bidirectional(), velocity=np.ones(bidirectional().rows), moving=True)
    assert Windup().variants(moving, WindupShape(8.0)) == [WindupShape(8.0)], "a log holds the reversal itself"


@pytest.mark.parametrize("settled", [False, True])
def test_windup_in_a_log_remembers_every_reversal(settled):
    """Nested loops: short strokes never wind it up wholly. Integrated in small steps."""
    position, direction = path([0.0, 30.0, 27.0, 30.0, 24.0, 50.0, 0.0], step=0.002)
    full, distance = 0.03, 4.0
    bend, deviation = full / 2 if settled else 0.0, []
    for i, way in enumerate(direction):
        travel = abs(position[i] - position[i - 1]) if i else 0.0
        bend += travel / distance * (full / 2 * way - bend)
        deviation.append(bend)
    log = replace(conditions(position, direction), moving=True)
    shape = WindupShape(distance, carried=True, settled=settled)
    assert Windup().contribution(log, shape, [full]) == pytest.approx(np.array(deviation), abs=1e-5)
    assert shape in [replace(s, distance=distance) for s in Windup().shapes(log)]
    # after a stroke of 3 mm it has not turned round, as one that forgets has
    forgets = Windup().contribution(conditions(position, direction), WindupShape(distance, carried=True), [full])
    assert np.abs(forgets - deviation).max() > 0.1 * full


def test_windup_turned_beyond_the_last_reading_has_come_farther(bidirectional):
    c = bidirectional()
    shape = WindupShape(8.0, carried=True, overshoot=1.5)
    farther = replace(c, since_reversal=c.since_reversal + 1.5)
    expected = Windup().columns(farther, WindupShape(8.0, carried=True))
    assert Windup().columns(c, shape) == pytest.approx(expected)
    assert [t.name for t in Windup().tunables(c, shape)] == ["distance", "overshoot"]
    assert [t.name for t in Windup().tunables(c, WindupShape(8.0))] == ["distance"]


def test_windup_scans_from_half_the_shortest_distance_to_a_fifth_of_the_span(bidirectional):
    distances = [shape.distance for shape in Windup().shapes(bidirectional())]
    assert distances[0] == pytest.approx(19.7 / 2)
    assert distances[-1] == pytest.approx(394.0 / 5)
    assert (np.diff(np.log(distances)) < np.log(1.2501)).all()


def test_a_screw_with_the_wrong_lead(bidirectional):
    c = bidirectional()
    travelled = c.position / 6.35 * 6.3501  # turns of the screw times what a turn moves
    assert scale.contribution(c, Shape(), [0.0001 / 6.35]) == pytest.approx(travelled - c.position, abs=1e-12)


def test_a_map_goes_through_its_nodes_without_a_bend_at_the_ends():
    nodes, values = (0.0, 30.0, 45.0, 100.0), np.array([0.0, 0.004, -0.002, 0.001])
    x = np.linspace(-20.0, 120.0, 14001)
    c = Conditions(position=x, position_unit="mm", run=np.ones(x.size, dtype=np.int64))
    curve = PitchMap().contribution(c, MapShape(nodes), values)
    assert curve[np.searchsorted(x, np.array(nodes) - 1e-6)] == pytest.approx(values, abs=1e-9)
    bend = np.diff(curve, n=2) / 0.01**2
    middle = x[1:-1]
    assert np.abs(bend[(middle < -0.02) | (middle > 100.02)]).max() < 1e-8, "straight outside"
    assert np.abs(np.interp([0.05, 99.95], middle, bend)).max() < 1e-6, "natural ends"
    # piecewise cubic: the second derivative is a straight line from node to node
    for begin, end in itertools.pairwise(nodes):
        inside = (middle > begin + 0.05) & (middle < end - 0.05)
        line = np.polyfit(middle[inside], bend[inside], 1)
        assert bend[inside] == pytest.approx(np.polyval(line, middle[inside]), abs=1e-8)


@pytest.mark.parametrize(("approach", "right"), [("forward_right", 1.0), ("backward_right", -1.0)])
def test_a_one_sided_map_leaves_the_other_approach_right(bidirectional, approach, right):
    c = bidirectional(np.array([0.0, 10.0, 20.0, 40.0]), runs=1)
    shape = ReversalMapShape((0.0, 10.0, 20.0, 40.0), **{approach: True})
    added = BacklashMap().contribution(c, shape, [0.01, 0.02, 0.04, 0.03])
    assert not added[c.direction == right].any()
    assert added[:4] - added[:3:-1] == pytest.approx([0.01, 0.02, 0.04, 0.03])


def test_a_one_sided_map_is_one_of_three_forms(bidirectional):
    c = bidirectional(np.linspace(0.0, 300.0, 31), runs=1)
    count = len(BacklashMap().shapes(c))
    both, back = BacklashMap().shapes(c)[2], replace(BacklashMap().shapes(c)[2], forward_right=True)
    assert (BacklashMap().tried(c, both), BacklashMap().tried(c, back)) == (count, 3 * count)
    assert {shape.side for shape in BacklashMap().variants(c, back)} == {-1}
    assert [shape.nodes for shape in BacklashMap().variants(c, back)] == [s.nodes for s in BacklashMap().shapes(c)]


def test_a_map_of_the_reversal_error_says_its_mean_and_how_much_it_varies():
    """8 um of play, 1 um more at one end: one number alone would hide the other."""
    shape = MapShape((0.0, 100.0, 200.0, 300.0))
    read = {name: value for name, value, _ in BacklashMap().summary(shape, [8e-3, 8.25e-3, 8.75e-3, 9e-3], LINEAR)}
    assert read == pytest.approx({"nodes": 4.0, "mean": 8.5, "least": 8.0, "largest": 9.0, "peak_to_peak": 1.0})


def test_nodes_that_lie_close_have_names_of_their_own():
    names = [a.name for a in PitchMap().amplitudes(MapShape((100.0, 100.001, 100.002)), LINEAR)]
    assert names == ["at_100", "at_100.001", "at_100.002"]


@pytest.mark.parametrize(
    "effect, change, reason",
    [
        (scale, {"position": np.full(210, 5.0)}, "one position only"),
        (PitchMap(), {"position": np.tile([0.0, 5.0], 105)}, "2 positions only"),
        (PitchMap(), {"revolution": 394.0}, "one turn of a rotary axis closes"),
        (PitchMap(), {"position_unit": "s"}, "time stands for them"),
        (scale, {"position_unit": "s"}, "what is proportional to time is a drift"),
        (backlash, {"direction": np.ones(210)}, "one direction only"),
        (Windup(), {"direction": np.ones(210)}, "one direction only"),
        (Windup(), {"since_reversal": None}, "0 distances within 106 mm after a reversal only"),
        (
            Windup(),
            {"since_reversal": np.tile([0.0, 1.0, 2.0, 3.0, 3.0 + 1e-12, 107.0], 35)},
            "3 distances within 106 mm after a reversal",
        ),
    ],
)
def test_what_the_data_cannot_show(bidirectional, effect, change, reason):
    assert reason in effect.untestable(bidirectional(**change))


@pytest.mark.parametrize(
    ("turn", "closes"), [(394.0 / 0.7, False), (394.0 / 0.8, True), (270.0, True), (250.0, False)]
)
def test_a_map_is_none_where_its_end_is_its_beginning(bidirectional, turn, closes):
    assert (PitchMap().untestable(bidirectional(revolution=turn)) is not None) is closes
