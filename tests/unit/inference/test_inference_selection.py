"""Which effects belong in a model: the search against every subset, special cases, limits."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from inference_oracle import SIGMA, measured

from rtec.effects import Observable, Shape, effect_named
from rtec.inference.exchange import exchanged, search, simplified
from rtec.inference.forms import fits_places, refined, stated_period, tuned_shape
from rtec.inference.noise import Noise, noise_from_repeats
from rtec.inference.selection import (
    MOST_OF_A_KIND,
    MOST_STEPS_IN_TIME,
    allowed,
    backward,
    candidates,
    coherent,
    forward,
    without,
)
from rtec.inference.whitening import Correlation
from rtec.inference.workspace import Workspace

NAMES = "scale backlash cyclic pitch_map backlash_map drift windup lost_counts offset".split()
SCALE, BACKLASH, CYCLIC, MAP, REVERSALS, DRIFT, WINDUP, STEP, OFFSET = (effect_named(n) for n in NAMES)
TILTED = lambda x, way, t, run: 5e-5 * x + 0.004 * way
BOTH = [(SCALE, Shape()), (BACKLASH, Shape())]
COGGING = effect_named("cogging")
DENSE = np.concatenate([[0.0, 1.0, 2.0, 4.0, 7.0, 12.0, 20.0], np.linspace(35.0, 300.0, 12)])


def work_of(data, **changes):
    given = {"sigma": SIGMA, "correlation": Correlation(), "freedom": 168.0, "from_repeats": True} | changes
    return Workspace(data, Noise(**given))


def names(choices):
    return {effect.name for effect, _ in choices}


def wave(period=47.0, size=0.006):
    return lambda x, way, t, run: size * np.sin(2 * np.pi * x / period)


def test_the_search_finds_the_best_of_all_subsets_of_simple_effects():
    """Exhaustively, over effects without shape parameters."""
    for seed, error in enumerate((TILTED, lambda x, way, t, run: 2e-6 * t + 0.004 * way, lambda *a: 5e-5 * a[0])):
        work = work_of(measured(error, seed=seed))
        effects = [SCALE, BACKLASH, DRIFT]
        subsets = [s for k in range(4) for s in itertools.combinations(effects, k)]
        best = max(subsets, key=lambda s: work.total([(e, Shape()) for e in s]))
        assert names(forward(work, [], effects)) == {e.name for e in best}


@pytest.mark.parametrize(
    ("error", "expected"),
    [
        (TILTED, {"scale", "backlash"}),
        (wave(), {"cyclic"}),
        (lambda x, way, t, run: 0.006 * way + 0.006 * np.sin(2 * np.pi * x / 31.0), {"backlash", "cyclic"}),
        (lambda x, way, t, run: 0.02 * np.exp(-(((x - 150) / 60) ** 2)), {"pitch_map"}),
        (lambda x, way, t, run: 0.01 * way * (0.2 + np.exp(-(((x - 150) / 60) ** 2))), {"backlash_map"}),
        (lambda x, way, t, run: np.where(t > 905.0, 0.012, 0.0), {"lost_counts"}),
        (lambda x, way, t, run: 0.0 * x, set()),
    ],
)
def test_a_search_names_what_was_planted(error, expected):
    found = search(work_of(measured(error)), [])
    assert names(found) - {"offset"} == expected


def test_windup_and_backlash_are_told_apart_by_dense_points_after_reversals():
    play = search(work_of(measured(lambda x, way, t, run: 0.006 * way, at=DENSE)), [])
    assert names(play) - {"offset"} == {"backlash"}
    gone = lambda x, way: np.where(way > 0, x, 300.0 - x)
    soft = measured(lambda x, way, t, run: 0.008 * way * (1 - np.exp(-gone(x, way) / 12.0)), at=DENSE_BOTH)
    found = search(work_of(soft), [])
    assert names(found) - {"offset"} == {"windup"}
    assert dict(found_by_name(found))["windup"].distance == pytest.approx(12.0, rel=0.4)


DENSE_BOTH = np.unique(np.concatenate([DENSE, 300.0 - DENSE]))


def found_by_name(choices):
    return [(effect.name, shape) for effect, shape in choices]


def test_a_repeated_plan_with_many_readings_is_searched_on_its_mean_run(monkeypatch):
    data = measured(lambda x, way, t, run: 5e-5 * x + 0.004 * way + 2e-6 * t, runs=6)
    slow = search(work_of(data), [])
    monkeypatch.setattr("rtec.inference.exchange.MANY_ROWS", 100)
    fast = search(work_of(data), [])
    assert names(fast) == names(slow) == {"scale", "backlash", "drift"}


def test_given_effects_stay_even_where_they_explain_nothing():
    data = measured(TILTED)
    given = (CYCLIC, CYCLIC.shape_type(33.0))
    found = search(work_of(data), [given])
    assert names(found) - {"offset"} == {"scale", "backlash", "cyclic"}
    assert found[0][0] is CYCLIC


def test_banned_effects_are_not_taken():
    found = search(work_of(measured(TILTED)), [], banned=["backlash"])
    assert "backlash" not in names(found)
    assert "scale" in names(found)


def test_the_search_tells_each_candidate_that_it_takes():
    seen = []
    forward(work_of(measured(TILTED)), [], [SCALE, BACKLASH], watch=lambda model, c: seen.append(c.effect.name))
    assert set(seen) == {"scale", "backlash"}


def test_backward_takes_out_what_is_not_needed():
    work = work_of(measured(TILTED))
    useless = (CYCLIC, CYCLIC.shape_type(33.0))
    assert backward(work, [useless, *BOTH]) == BOTH
    assert backward(work, [useless, *BOTH], given=["cyclic"]) == [useless, *BOTH]
    assert backward(work, [useless, *BOTH], keep=useless) == [useless, *BOTH]
    assert backward(work, [useless]) == [useless]  # the last one is left to the tests


def test_what_an_effect_explains_beside_the_others():
    work = work_of(measured(TILTED))
    found = without(work, BOTH, 1)
    expected = work.total(BOTH) - work.total(BOTH[:1])
    assert found.evidence == pytest.approx(expected)


def test_an_exchange_takes_the_better_effect():
    work = work_of(measured(wave(47.0, 0.01)))
    start = [(MAP, MAP.shape_type(tuple(np.linspace(0, 300, 10))))]
    found = exchanged(work, start, [CYCLIC, MAP])
    assert names(found) == {"cyclic"}
    assert work.total(found) > work.total(start)
    assert exchanged(work, start, [CYCLIC, MAP], given=["pitch_map"])[0] == start[0]


def test_a_special_case_takes_the_place_of_its_map():
    line = work_of(measured(lambda x, way, t, run: 5e-5 * x))
    mapped = [(MAP, MAP.shape_type(tuple(np.linspace(0, 300, 4))))]
    assert names(simplified(line, mapped, [SCALE, MAP])) == {"scale"}
    assert simplified(line, mapped, [SCALE, MAP], given=["pitch_map"]) == mapped
    bent = work_of(measured(lambda x, way, t, run: 0.02 * np.exp(-(((x - 150) / 60) ** 2))))
    kept = simplified(bent, [(MAP, MAP.shape_type(tuple(np.linspace(0, 300, 8))))], [SCALE, MAP])
    assert names(kept) == {"pitch_map"}
    play = work_of(measured(lambda x, way, t, run: 0.006 * way))
    nodes = tuple(np.linspace(0, 300, 4))
    assert names(simplified(play, [(REVERSALS, REVERSALS.shape_type(nodes))], [BACKLASH, REVERSALS])) == {"backlash"}


def test_harmonics_are_taken_as_far_as_they_go():
    double = lambda x, way, t, run: 0.004 * np.sin(2 * np.pi * x / 60) + 0.004 * np.cos(4 * np.pi * x / 60)
    found = dict(found_by_name(search(work_of(measured(double, targets=40)), [])))["cyclic"]
    assert (found.harmonics, found.by_direction) == (2, False)
    assert found.period == pytest.approx(60.0, rel=0.005)
    turned = lambda x, way, t, run: 0.004 * np.sin(2 * np.pi * x / 47 + 0.8 * way)
    found = dict(found_by_name(search(work_of(measured(turned)), [])))["cyclic"]
    assert (found.harmonics, found.by_direction) == (1, True)


def test_a_line_that_is_a_harmonic_lengthens_its_family():
    double = lambda x, way, t, run: 0.006 * np.sin(2 * np.pi * x / 60) + 0.003 * np.cos(6 * np.pi * x / 60)
    found = search(work_of(measured(double, targets=50)), [])
    families = [shape for effect, shape in found if effect is CYCLIC]
    assert len(families) == 1
    assert families[0].harmonics == 3


def test_tuning_finds_the_place_between_grid_points():
    data = measured(wave(47.0, 0.01), sigma=1e-6)
    work = work_of(data)
    back = work.background([])
    best = work.best_of_scan(CYCLIC, back)
    tuned = tuned_shape(work, CYCLIC, best.shape, back)
    assert tuned.period == pytest.approx(47.0, rel=1e-3)
    assert work.judge(CYCLIC, tuned, back).gain >= best.gain
    assert refined(work, best, [], back).evidence >= best.evidence


@pytest.mark.parametrize(
    ("held", "effect", "ok"),
    [
        ([], BACKLASH, True),
        ([BACKLASH], BACKLASH, False),
        ([CYCLIC], CYCLIC, False),
        ([COGGING] * (MOST_OF_A_KIND - 1), COGGING, True),
        ([COGGING] * MOST_OF_A_KIND, COGGING, False),
        ([STEP] * (MOST_STEPS_IN_TIME - 1), STEP, True),
        ([STEP] * MOST_STEPS_IN_TIME, STEP, False),
        ([], effect_named("asymmetric_friction"), False),
        ([effect_named("viscous")], effect_named("asymmetric_friction"), True),
    ],
)
def test_how_often_an_effect_may_be_held(held, effect, ok):
    work = work_of(measured())
    assert allowed(work, [(e, Shape()) for e in held], effect) is ok


def test_fewer_of_a_kind_where_some_were_struck_out():
    work = work_of(measured())
    assert allowed(work, [(STEP, STEP.shape_type(10.0))], STEP)
    work.most = {"lost_counts": 1}
    assert not allowed(work, [(STEP, STEP.shape_type(10.0))], STEP)
    assert allowed(work, [], STEP)


def test_an_addition_needs_what_it_is_added_to():
    friction, viscous = effect_named("asymmetric_friction"), effect_named("viscous")
    assert coherent([(friction, Shape()), (viscous, Shape())])
    assert not coherent([(friction, Shape()), (SCALE, Shape())])
    assert coherent([])


def test_functions_of_position_leave_places_to_test_them_by():
    data = measured(targets=12)
    work = work_of(data)
    # 12 places: 6.6 parameters
    wide, narrow = (CYCLIC, CYCLIC.shape_type(40.0, 3)), (CYCLIC, CYCLIC.shape_type(40.0, 2))
    assert not fits_places(work, [wide])
    assert fits_places(work, [narrow])
    assert fits_places(work, [narrow, (SCALE, Shape())])
    assert not fits_places(work, [narrow, (SCALE, Shape()), (MAP, MAP.shape_type((0.0, 100.0, 300.0)))])
    assert fits_places(work, [(MAP, MAP.shape_type(tuple(data.conditions.places)))])  # alone: its own ladder's limit
    # what differs by direction is counted by itself
    assert fits_places(work, [narrow, (BACKLASH, Shape()), (WINDUP, WINDUP.shape_type(5.0))])
    drive = work_of(replace(data, observable=Observable.DRIVE))
    assert fits_places(drive, [wide] * 5)


def test_candidates_come_best_first_and_only_once_each():
    work = work_of(measured(TILTED))
    found = candidates(work, [], work.library)
    evidence = [c.evidence for c in found]
    assert evidence == sorted(evidence, reverse=True)
    assert len({c.effect.name for c in found}) == len(found)
    assert {c.effect.name for c in candidates(work, BOTH, work.library)}.isdisjoint({"scale", "backlash"})


def test_where_time_is_the_coordinate_a_drift_comes_before_a_scale_error():
    data = measured(lambda x, way, t, run: 5e-5 * x, at=10.0 * np.arange(30.0), runs=1, bidirectional=False, unit="s")
    found = candidates(work_of(data, from_repeats=False), [], [SCALE, DRIFT])
    assert [c.effect.name for c in found] == ["drift", "scale"]
    assert found[0].evidence == pytest.approx(found[1].evidence)


def test_few_readings_without_repeats_carry_few_parameters():
    data = measured(wave(), runs=1, targets=4)
    found = candidates(work_of(data, from_repeats=False), [], work_of(data).library)
    assert all(c.amplitudes <= 0.25 * 8 - 1 for c in found)


def test_a_stated_period_is_taken_where_it_does_as_well():
    data = measured(wave(20.0), targets=60, screw_pitch=20.0)
    work = work_of(data)
    assert stated_period(work, (CYCLIC, CYCLIC.shape_type(20.02, 2)), [])[1] == CYCLIC.shape_type(20.0, 2)
    assert stated_period(work, (SCALE, Shape()), []) == (SCALE, Shape())
    other = (CYCLIC, CYCLIC.shape_type(20.6))  # 3 % away: another period
    assert stated_period(work, other, []) == other
    fraction = measured(wave(10.0), targets=80, screw_pitch=20.0)
    assert stated_period(work_of(fraction), (CYCLIC, CYCLIC.shape_type(10.01)), [])[1].period == 10.0
    lied = measured(wave(20.3), targets=60, screw_pitch=20.0)
    found = (CYCLIC, CYCLIC.shape_type(20.3))
    assert stated_period(work_of(lied), found, []) == found
    untold = work_of(measured(wave(20.0), targets=60))
    assert stated_period(untold, found, []) == found


def test_correlated_noise_is_no_reason_to_add_effects():
    for seed in range(4):
        data = measured(rho=0.9, seed=seed, timed=False)
        assert names(search(Workspace(data, noise_from_repeats(data)), [])) <= {"offset", "pitch_map"}


def bell(x):
    """A smooth curve that no one wave draws: three bells over the travel."""
    return sum(h * np.exp(-0.5 * ((x - at) / w) ** 2) for h, at, w in ((1, 60, 34), (-1.4, 150, 38), (0.8, 245, 33)))


def test_a_map_that_explains_all_that_repeats_takes_the_place_of_a_map_and_a_wave():
    data = measured(lambda x, way, t, run: 0.008 * bell(x), rho=0.9)
    work = Workspace(data, noise_from_repeats(data))
    both = [(MAP, MAP.shape_type(tuple(np.linspace(0, 300, 5)))), (CYCLIC, CYCLIC.shape_type(period=128.0))]
    assert names(simplified(work, both, work.library)) == {"pitch_map"}
    assert names(search(work, [])) == {"pitch_map"}
    # a wave that no map can draw stays
    waved = measured(lambda x, way, t, run: 0.008 * bell(x) + 0.006 * np.sin(2 * np.pi * x / 6.35), rho=0.9)
    work = Workspace(waved, noise_from_repeats(waved))
    both = [(MAP, MAP.shape_type(tuple(np.linspace(0, 300, 10)))), (CYCLIC, CYCLIC.shape_type(period=6.35))]
    assert names(simplified(work, both, work.library)) == {"pitch_map", "cyclic"}


def test_a_wave_is_not_given_up_where_only_some_readings_were_repeated():
    # what repeats may fit without the wave; the readings that nobody repeated do not
    data = measured(lambda x, way, t, run: 0.008 * bell(x) + 0.006 * np.sin(2 * np.pi * x / 31.0), runs=3, targets=41)
    few = np.isin(data.cell, np.unique(data.cell)[::6])
    some = data.take((data.coordinates.run == 1) | few)
    some = replace(some, cell=np.where(np.isin(some.cell, np.unique(data.cell)[::6]), some.cell, -1))
    work = Workspace(some, noise_from_repeats(some))
    both = [(MAP, MAP.shape_type(tuple(np.linspace(0, 300, 10)))), (CYCLIC, CYCLIC.shape_type(period=31.0))]
    assert names(simplified(work, both, work.library)) == {"pitch_map", "cyclic"}


@pytest.mark.parametrize(
    ("error", "together", "alone"),
    [
        (lambda x, way, t, run: 2e-5 * t, [(DRIFT, Shape()), "warm_up"], "drift"),
        (lambda x, way, t, run: 0.02 * (1.0 - np.exp(-t / 300.0)), [(DRIFT, Shape()), "warm_up"], "warm_up"),
        (lambda x, way, t, run: 0.01 * way, [(BACKLASH, Shape()), "windup"], "backlash"),
    ],
)
def test_one_of_two_alike_goes_where_the_other_does_alone(error, together, alone):
    data = measured(error, at=DENSE)
    work = Workspace(
        data, noise_from_repeats(data, [(effect_named("warm_up"), effect_named("warm_up").shape_type(300.0))])
    )
    other = effect_named(together[1])
    model = [together[0], (other, other.shapes(data.conditions)[5])]
    assert names(simplified(work, model, [other, together[0][0]])) == {alone}


def test_an_effect_that_says_nothing_new_is_taken_out():
    data = measured(lambda x, way, t, run: 5e-5 * x)
    work = work_of(data)
    back = work.background([(SCALE, Shape())])
    assert work.judge(SCALE, Shape(), back).evidence < 0.0
    assert names(backward(work, [(SCALE, Shape()), (SCALE, Shape())])) == {"scale"}
    assert len(backward(work, [(SCALE, Shape()), (SCALE, Shape())])) == 1


def test_a_period_is_not_tuned_beyond_what_the_span_holds():
    data = measured()
    shape = CYCLIC.shape_type(period=120.0)
    (tunable,) = CYCLIC.tunables(data.conditions, shape)
    assert tunable.low < 120.0 < tunable.high < data.conditions.span / 2.3
    longer = CYCLIC.shape_type(period=200.0)  # stated by the user: kept, but no longer
    assert CYCLIC.tunables(data.conditions, longer)[0].high == 200.0
