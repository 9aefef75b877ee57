"""Errors outside the library: no map of position and direction with a simple course in time describes them."""

import numpy as np
import pytest

from rtec.blind.axis_run import measure
from rtec.blind.circumstances import Circumstances, simulate_air, simulate_heat
from rtec.blind.drawn_plans import drawn_plan
from rtec.blind.outside import KINDS
from rtec.blind.plan import draw_course
from rtec.blind.scenario import unfit
from rtec.blind.slow_errors import SLOW
from rtec.predictors import NoError

TERMS = 7
"""Of a smooth map over the travel, one for each direction."""
LEFT = 0.3
"""Share of the RMS that the library has to leave: at three sigma nearly one, in each of a hundred readings."""


def circumstances(seed, targets, runs):
    rng = np.random.default_rng(seed)
    plan = drawn_plan(rng, targets=targets, runs=runs, both=True)
    course = draw_course(plan, rng)
    measured = measure(course, NoError())
    return Circumstances(
        course=course,
        measured=measured,
        heat=simulate_heat(course, measured.time_s, rng),
        air=simulate_air(course, rng),
    )


DENSE = [circumstances(seed, (61, 61), (4, 4)) for seed in range(3)]
FEW = circumstances(9, (41, 41), (3, 3))


def left_by_the_library(c, added):
    """Return the share of an error that a smooth map of each direction, a drift and a warm-up leave."""
    x = 2.0 * (c.course.target_mm - c.course.plan.start_mm) / c.course.plan.span_mm - 1.0
    late = c.measured.time_s / c.measured.time_s[-1]
    maps = np.polynomial.legendre.legvander(x, TERMS - 1)
    left = []
    for tau in np.geomspace(0.02, 1.0, 12):
        columns = np.column_stack([maps, maps * c.direction[:, None], late, 1.0 - np.exp(-late / tau)])
        left.append(np.std(added - columns @ np.linalg.lstsq(columns, added, rcond=None)[0]) / np.std(added))
    return min(left)


@pytest.mark.parametrize("name", KINDS)
def test_the_library_cannot_describe_it(name):
    for number, c in enumerate([*DENSE, FEW]):
        error = KINDS[name].draw(c, np.random.default_rng([number, 8]))
        assert np.isfinite(error.added_mm).all()
        assert left_by_the_library(c, error.added_mm) > LEFT


@pytest.mark.parametrize("name", ["drift", "warm_up"])
def test_what_lies_inside_is_described(name):
    error = SLOW[name](DENSE[0], np.random.default_rng(1))
    assert left_by_the_library(DENSE[0], error.added_mm) < 0.1


WAVES = ("growing_wave", "fading_wave", "partial_wave", "slipping_wave", "breathing_ribs")


@pytest.mark.parametrize("name", WAVES)
def test_no_single_wave_describes_it(name):
    for number, c in enumerate(DENSE):
        error = KINDS[name].draw(c, np.random.default_rng([number, 3]))
        period = next(p.value for p in error.parameters if p.name == "period")
        assert c.course.plan.span_mm / period >= 5.0
        left = []
        for near in period * np.linspace(0.9, 1.1, 21):
            angle = 2.0 * np.pi * c.course.target_mm / near
            wave = np.column_stack([np.sin(angle), np.cos(angle), np.ones(angle.size)])
            rest = error.added_mm - wave @ np.linalg.lstsq(wave, error.added_mm, rcond=None)[0]
            left.append(np.std(rest) / np.std(error.added_mm))
        assert min(left) > LEFT


def test_a_knock_leaves_what_was_before_alone():
    c = DENSE[0]
    error = KINDS["late_map"].draw(c, np.random.default_rng(0))
    moment = next(p.value for p in error.parameters if p.name == "moment")
    assert np.array_equal(error.added_mm != 0.0, c.measured.time_s > moment)


def test_play_counts_the_reversals():
    c = DENSE[0]
    error = KINDS["counting_play"].draw(c, np.random.default_rng(0))
    play_mm = np.abs(error.added_mm)
    assert (np.diff(play_mm) >= 0.0).all()
    assert np.unique(play_mm.round(12)).size == 8
    assert (np.sign(error.added_mm[play_mm > 0]) == -c.direction[play_mm > 0]).all()


def test_a_plan_that_cannot_show_a_kind_refuses_it():
    one_run = drawn_plan(np.random.default_rng(0), runs=(1, 1), both=True)
    assert unfit("moving_bump", one_run) == "it needs several runs"
    few = drawn_plan(np.random.default_rng(0), targets=(12, 12), runs=(3, 3), both=True)
    assert unfit("scale_joints", few) == "it needs more targets"
    assert unfit("room_wave", few) is None
