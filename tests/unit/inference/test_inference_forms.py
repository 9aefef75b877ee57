"""What speaks against a name by the form that was fitted, and which forms may be one cause."""

from dataclasses import replace

import numpy as np
import pytest

from rtec.effects import LIBRARY, Conditions, CyclicShape, HeatShape, MapShape, WavesShape
from rtec.effects.backlash_map import BacklashMap, ReversalMapShape
from rtec.effects.cogging import Cogging
from rtec.effects.cyclic import Cyclic
from rtec.effects.eccentricity import Eccentricity, EccentricityShape
from rtec.effects.hysteresis import Hysteresis
from rtec.effects.lost_counts import LostCounts, StepShape
from rtec.effects.pitch_map import PitchMap
from rtec.effects.reversal_spike import ReversalSpike
from rtec.effects.thermal_growth import GrowthShape, ThermalGrowth
from rtec.effects.thermal_shift import ThermalShift
from rtec.effects.warm_up import WarmShape, WarmUp
from rtec.effects.warm_up_growth import WarmGrowthShape, WarmUpGrowth
from rtec.effects.windup import Windup
from rtec.inference.forms import finest_drawn, forms_of, is_asked, left_out

CYCLIC, COGGING, ECCENTRICITY = map(forms_of, (Cyclic(), Cogging(), Eccentricity()))


def at(position, unit="mm", **others):
    x = np.asarray(position, dtype=np.float64)
    facts = {"position": x, "position_unit": unit, "run": np.ones(x.size, dtype=np.int64)}
    return Conditions(**{**facts, **others})


def turned():
    x = 0.66 * np.arange(300.0)
    return at(np.tile(x, 2), direction=np.repeat([1.0, -1.0], x.size), screw_pitch=6.35)


def crowded(effect, conditions, shape, others, finest=np.inf):
    return forms_of(effect).crowded(conditions, shape, others, finest)


# waves


def test_a_wave_that_nobody_stated_needs_five_cycles_and_more_than_two_readings_a_cycle():
    c = at(np.arange(0.0, 401.0, 5.0))
    assert "4.0 cycles of 100 mm only" in CYCLIC.doubtful(c, CyclicShape(100.0))
    assert "a span of 500 mm would settle it" in CYCLIC.doubtful(c, CyclicShape(100.0))
    assert CYCLIC.doubtful(c, CyclicShape(79.0)) is None
    assert "5.0 cycles" in CYCLIC.doubtful(c, CyclicShape(80.0)), "at the end of the scan: it may lie beyond"
    assert CYCLIC.doubtful(c, CyclicShape(10.6)) is None
    assert "two readings long" in CYCLIC.doubtful(c, CyclicShape(10.3))
    assert COGGING.doubtful(c, WavesShape(100.0)) == CYCLIC.doubtful(c, CyclicShape(100.0))


def test_fractions_of_a_turn_are_not_stated_for_a_joint_that_goes_through_half_of_one():
    joint = at(np.arange(0.0, 200.0, 1.0), unit="deg", revolution=360.0)
    assert "1.7 cycles of 120 deg only" in COGGING.doubtful(joint, WavesShape(120.0))
    assert COGGING.doubtful(joint, WavesShape(30.0)) is None  # seven cycles need no statement
    assert COGGING.doubtful(at(np.arange(0.0, 300.0), unit="deg", revolution=360.0), WavesShape(120.0)) is None


def test_two_waves_a_turn_alone_are_no_disc_off_centre():
    c = at(np.linspace(0.0, 350.0, 36), unit="deg", revolution=360.0)
    for first, plausible in ((0.49, False), (0.51, True)):
        why = ECCENTRICITY.implausible(c, EccentricityShape(360.0, 2), np.array([first, 0.0, 0.6, 0.8]))
        assert why is None if plausible else "two are stronger" in why
    assert ECCENTRICITY.implausible(c, EccentricityShape(), np.array([0.1, 0.0])) is None


def test_a_family_is_taken_apart_into_what_may_be_a_part_of_it():
    c = at(np.linspace(0.0, 300.0, 61) + np.random.default_rng(0).uniform(-1, 1, 61))
    parts = {(round(s.period, 6), s.harmonics) for s in CYCLIC.regrouped(c, CyclicShape(51.0, 3))}
    assert {(51.0, 1), (51.0, 2), (25.5, 1), (17.0, 1), (34.0, 2), (17.0, 3)} <= parts
    assert (51.0, 3) not in parts
    assert max(harmonics for _, harmonics in parts) == 3
    assert CYCLIC.regrouped(c, CyclicShape(51.0)) == []
    assert all(CYCLIC.doubtful(c, s) is None for s in CYCLIC.regrouped(c, CyclicShape(51.0, 3)))


def test_families_of_a_stated_period_do_not_hold_each_other():
    c = at(np.arange(0.0, 100.0, 0.7), screw_pitch=10.0)
    belongs = "harmonics of another family"
    assert belongs in crowded(Cyclic(), c, CyclicShape(10.0, 4), [CyclicShape(10.0001, 3, True)])
    assert belongs in crowded(Cyclic(), c, CyclicShape(5.0), [CyclicShape(10.0, 2)])
    assert belongs in crowded(Cyclic(), c, CyclicShape(10.0, 2), [CyclicShape(5.0)])
    assert belongs in crowded(
        Cyclic(), c, CyclicShape(10.0, 3), [CyclicShape(2.5)]
    )  # the fourth goes on where it ends
    assert crowded(Cyclic(), c, CyclicShape(10.0, 2), [CyclicShape(2.5, 2)]) is None


def test_waves_nearer_than_the_span_tells_apart_are_crowded():
    c = at(np.linspace(0.0, 300.0, 41))
    apart = 1.0 / (1.0 / 40.0 + 1.5 / c.span)
    assert crowded(Cyclic(), c, CyclicShape(40.0), []) is None
    assert crowded(Cyclic(), c, CyclicShape(40.0), [CyclicShape(apart * 0.999)]) is None
    assert "amplitude changes" in crowded(Cyclic(), c, CyclicShape(40.0), [CyclicShape(apart * 1.01)])
    nodes = finest_drawn(MapShape((0.0, 50.0, 100.0, 200.0)))
    assert nodes == pytest.approx(400.0 / 3.0)
    assert "draws such a wave" in crowded(Cyclic(), c, CyclicShape(nodes * 1.01), [], nodes)
    assert crowded(Cyclic(), c, CyclicShape(nodes * 0.99), [], nodes) is None
    assert "amplitude changes" in crowded(Cyclic(), c, CyclicShape(40.0), [CyclicShape(80.0, 2)]), (
        "its second harmonic"
    )


def test_suspects_are_waves_of_fewer_than_five_cycles():
    c = at(np.linspace(0.0, 300.0, 41))
    cycles = [c.span / shape.period for shape in CYCLIC.suspects(c)]
    assert min(cycles) == pytest.approx(1.5) and max(cycles) < 5.0
    assert max(np.diff(cycles)) <= 0.3 + 1e-9
    assert all(CYCLIC.doubtful(c, shape) for shape in CYCLIC.suspects(c))
    assert CYCLIC.suspects(at(np.linspace(0.0, 300.0, 4))) == ()


@pytest.mark.parametrize(("period", "ratio", "is_family"), [(90.0, 0.1, False), (90.0, 0.2, True)])
def test_a_fraction_of_a_turn_needs_its_first_wave(period, ratio, is_family):
    c = at(np.linspace(0.0, 359.0, 360), "deg", revolution=360.0)
    third = np.array([ratio, 0.0, 0.1, 0.1, 0.6, 0.8])
    why = COGGING.implausible(c, WavesShape(period, 3), third)
    assert why is None if is_family else "a multiple of the true period" in why


def test_a_force_that_comes_once_or_twice_a_turn_is_a_weight():
    c = at(np.linspace(0.0, 359.0, 360), "deg", revolution=360.0)
    once = np.array([41.0, 3.0, 2.0, 0.0])
    for period in (360.0, 180.0):
        assert "as a weight does" in COGGING.implausible(c, WavesShape(period, 2), once)
    assert COGGING.implausible(c, WavesShape(120.0, 2), once) is None


def test_two_fractions_of_a_turn_may_be_one_family_of_it():
    c = turned()
    forms = CYCLIC.joined(c, CyclicShape(6.35 / 2, 2), CyclicShape(6.35 / 3, 4))
    assert forms and all(form.period == 6.35 and form.harmonics >= 3 for form in forms)
    assert {form.by_direction for form in forms} == {False, True}
    assert CYCLIC.joined(c, CyclicShape(6.35 / 2), CyclicShape(41.0)) == ()
    nobody = at(c.position, direction=c.direction)
    assert CYCLIC.joined(nobody, CyclicShape(6.35 / 2), CyclicShape(6.35 / 3)) == ()


def test_a_wave_that_is_a_constant_at_uneven_targets_is_in_doubt():
    """Its difference by direction would be a backlash."""
    off = np.random.default_rng(3).normal(0.0, 1.0, 31)
    nearly, uneven = (at(50.0 * np.arange(31) + share * off) for share in (3.0, 10.0))
    assert "mainly a constant" in CYCLIC.doubtful(nearly, CyclicShape(50.0))
    assert CYCLIC.doubtful(nearly, CyclicShape(31.0)) is None
    assert CYCLIC.doubtful(uneven, CyclicShape(50.0)) is None


# maps


def along(share, cycles, grows):
    return (share**2 if grows else 1.0) * np.sin(2.0 * np.pi * cycles * share) + 3.0 * share


@pytest.mark.parametrize("effect", [PitchMap(), BacklashMap()])
@pytest.mark.parametrize(
    ("cycles", "grows", "is_map"),
    [(1.0, False, True), (3.0, False, True), (3.0, True, True), (5.5, True, False), (8.0, False, False)],
)
def test_a_curve_that_swings_as_often_as_a_wave_is_no_map(effect, cycles, grows, is_map):
    c = at(np.linspace(100.0, 400.0, 61))
    nodes = np.linspace(100.0, 400.0, 24)
    why = forms_of(effect).implausible(c, MapShape(tuple(nodes)), along((nodes - 100.0) / 300.0, cycles, grows))
    assert why is None if is_map else "as fast as a wave of" in why
    if not is_map and not grows:
        assert f"of {cycles:.0f} cycles" in why


def test_a_node_at_each_of_a_few_targets_is_a_table():
    c = at(np.linspace(0.0, 110.0, 12))
    error = np.resize([0.01, -0.01], 12)  # as fast as it can be
    assert forms_of(PitchMap()).implausible(c, MapShape(tuple(np.linspace(0.0, 110.0, 12))), error) is None


def test_a_straight_map_does_not_swing():
    c = at(np.linspace(0.0, 100.0, 21))
    shape = MapShape((0.0, 40.0, 70.0, 100.0))
    assert forms_of(PitchMap()).implausible(c, shape, np.array([0.0, 4.0, 7.0, 10.0])) is None
    assert forms_of(PitchMap()).implausible(c, shape, np.zeros(4)) is None


# reversals


@pytest.mark.parametrize(
    ("effect", "size", "beside", "says"),
    [
        (ReversalSpike(), -0.004, {"backlash": [-0.02]}, None),
        (ReversalSpike(), 0.004, {"backlash": [-0.02]}, "beside this backlash it is a wind-up"),
        (ReversalSpike(), 0.004, {"backlash_map": [-0.02, -0.01]}, "it is a wind-up"),
        (ReversalSpike(), 0.004, {"scale": [-0.02]}, None),
        (ReversalSpike(), -0.004, {"windup": [-0.02]}, "beside a wind-up it is a backlash"),
        (Windup(), -0.004, {"backlash": [-0.02]}, None),
        (Windup(), 0.004, {"backlash": [-0.02]}, "it is a reversal spike"),
        (Windup(), 0.004, {"reversal_spike": [0.02]}, "beside a reversal spike it is a backlash"),
    ],
)
def test_one_curve_has_one_name(effect, size, beside, says):
    others = {name: np.array(values) for name, values in beside.items()}
    why = forms_of(effect).misnamed(np.array([size]), others)
    assert why is None if says is None else says in why


def test_springs_have_one_name():
    one = np.array([-0.004])
    assert forms_of(Hysteresis()).misnamed(one, {"windup": one}) is not None
    assert forms_of(Windup()).misnamed(one, {"hysteresis": one}) is not None
    assert forms_of(Hysteresis()).misnamed(one, {"backlash": one}) is None


# heat and time


def test_a_step_in_a_log_has_a_gradual_rival():
    """Spread over a fiftieth of the log, the same in the middle: what wanders slowly passes for a step, too."""
    still = at(np.zeros(210), time_s=5.0 * np.arange(210))
    assert forms_of(LostCounts()).softer(still, StepShape(500.0)) == ()
    log = replace(still, moving=True)
    (soft,) = forms_of(LostCounts()).softer(log, StepShape(500.0))
    assert soft.over == pytest.approx(1045.0 / 50)
    ramp = LostCounts().columns(log, soft)[:, 0]
    expected = np.interp(log.time_s, [500.0 - 10.45, 500.0 + 10.45], [0.0, 1.0])
    assert ramp == pytest.approx(expected)


def test_a_course_that_dies_out_at_the_start_of_a_log_is_no_heat():
    log = at(np.zeros(101), time_s=10.0 * np.arange(101.0), moving=True)
    for effect, kind in ((WarmUp(), WarmShape), (WarmUpGrowth(), WarmGrowthShape)):
        assert "within 5% of the log" in forms_of(effect).doubtful(log, kind(49.0))
        assert forms_of(effect).doubtful(log, kind(51.0)) is None
        assert forms_of(effect).doubtful(replace(log, moving=False), kind(49.0)) is None


def test_counts_are_not_lost_over_a_while():
    c = at(np.zeros(9), time_s=np.arange(9.0))
    assert "not over a while" in forms_of(LostCounts()).doubtful(c, StepShape(4.5, 1.0))
    assert forms_of(LostCounts()).doubtful(c, StepShape(4.5)) is None


@pytest.mark.parametrize(
    ("effect", "shape"),
    [(ThermalGrowth(), GrowthShape(elsewhere=True)), (WarmUpGrowth(), WarmGrowthShape(elsewhere=True))],
)
def test_growth_about_a_point_far_beyond_the_axis_is_a_shift(effect, shape):
    c = at(np.linspace(0.0, 400.0, 9))
    for point, near in ((150.0, True), (1200.0, True), (1201.0, False), (-801.0, False)):
        why = forms_of(effect).implausible(c, shape, np.array([1.2e-5, -1.2e-5 * point]))
        assert why is None if near else "beyond the axis" in why
    fixed = replace(shape, elsewhere=False)
    assert forms_of(effect).implausible(c, fixed, np.array([1.2e-5])) is None


def test_one_sensor_is_followed_with_two_lags_that_differ_and_another_beside_it():
    c = at(np.zeros(9))
    for effect, kind in ((ThermalShift(), HeatShape), (ThermalGrowth(), GrowthShape)):
        assert crowded(effect, c, kind("bed"), [kind("bed")]) == "bed is followed already"
        assert crowded(effect, c, kind("bed", 150.0), [kind("bed", 60.0)]) == "bed is followed already"
        assert crowded(effect, c, kind("bed", 600.0), [kind("bed", 60.0)]) is None
        assert crowded(effect, c, kind("bed", 600.0), [kind("bed"), kind("bed", 60.0)]) == "bed is followed already"
        assert crowded(effect, c, kind("bed"), [kind("head")]) is None


# all


def test_a_one_sided_map_may_stand_for_a_map_of_the_axis_and_of_reversals():
    forms = forms_of(BacklashMap()).joined(at(np.arange(9.0)), ReversalMapShape((0.0, 4.0, 8.0)), MapShape())
    assert {shape.side for shape in forms} == {1, -1}
    assert forms_of(BacklashMap()).joins == "pitch_map"


def test_what_is_not_ranked_is_found_by_other_means():
    for unit in ("mm", "deg"):
        c = at(np.linspace(0.0, 90.0, 9), unit)
        idle = {effect.name for effect in LIBRARY if not forms_of(effect).ranked(c)}
        assert idle == {"offset", "cosine", "quantisation"} | ({"gravity"} if unit == "mm" else set())


def test_a_rule_that_is_left_out_says_nothing():
    c, wave = at(np.arange(0.0, 401.0, 5.0)), CyclicShape(100.0)
    with left_out("doubtful"):
        assert forms_of(Cyclic()).doubtful(c, wave) is None
        assert crowded(Cyclic(), c, wave, [CyclicShape(101.0)]) is not None
        with left_out("crowded"):
            assert crowded(Cyclic(), c, wave, [CyclicShape(101.0)]) is None
            assert not is_asked("doubtful")
        assert is_asked("crowded")
    assert forms_of(Cyclic()).doubtful(c, wave) is not None
