"""Periodic effects, and what a plan of positions can resolve."""

from dataclasses import replace

import numpy as np
import pytest
from encoder_disc_oracle import deviations

from rtec.effects import Conditions, CyclicShape, Units, frequency_grid
from rtec.effects.cogging import Cogging
from rtec.effects.cyclic import Cyclic, closer_steps
from rtec.effects.eccentricity import Eccentricity, EccentricityShape
from rtec.effects.frequency_grid import (
    alias_limit,
    frequencies,
    highest_frequency,
    looks_constant,
    phases_seen,
    resolved_harmonics,
)
from rtec.effects.interpolation import Interpolation, InterpolationShape
from rtec.errors import ArgumentError
from rtec.inference.forms import forms_of

WavesShape = Cogging().shape_type

LINEAR = Units("mm", "mm", "s")


def at(position, unit="mm", **others):
    x = np.asarray(position, dtype=np.float64)
    facts = {"position": x, "position_unit": unit, "run": np.ones(x.size, dtype=np.int64)}
    return Conditions(**{**facts, **others})


def lathe():
    x = 25.4 + 0.635 * np.arange(1561.0)
    both = np.repeat([1.0, -1.0], x.size)
    return at(np.tile(x, 2), direction=both, screw_pitch=6.35)


# what positions resolve


def test_two_waves_beyond_the_limit_of_regular_targets_look_the_same():
    c = at(np.arange(0.0, 101.0, 5.0))
    limit = alias_limit(c)
    assert limit == 0.1
    below, above = limit - 0.03, limit + 0.03
    assert np.cos(2 * np.pi * below * c.position) == pytest.approx(np.cos(2 * np.pi * above * c.position))


def test_a_missing_target_does_not_make_the_others_irregular():
    assert alias_limit(at(np.delete(np.arange(0.0, 101.0, 5.0), [3, 4, 11]))) == 0.1


def unlike(x, frequency, other):
    """Return the share of waves of a frequency that waves of another do not explain."""
    wanted, others = (
        np.column_stack([np.ones_like(x), np.sin(2 * np.pi * f * x), np.cos(2 * np.pi * f * x)])
        for f in (frequency, other)
    )
    left = wanted - others @ np.linalg.lstsq(others, wanted, rcond=None)[0]
    return np.linalg.norm(left) / np.linalg.norm(wanted[:, 1:])


def test_irregular_targets_tell_waves_of_eight_cycles_a_step_from_slower_ones():
    x = np.arange(0.0, 401.0, 5.0) + np.random.default_rng(1).uniform(-1.5, 1.5, 81)
    c = at(x)
    limit = alias_limit(c)
    assert limit == pytest.approx(8.0 / 5.0, rel=0.01)
    assert all(unlike(x, 0.07, other) > 0.5 for other in (2 * 0.1 - 0.07, 0.2 + 0.07, limit - 0.07))


def test_the_limit_lies_where_irregular_targets_show_two_waves_as_one():
    """All on a grid of 1 mm, at every place of it that was drawn: half a cycle per millimetre."""
    x = np.sort(np.random.default_rng(2).choice(np.arange(200.0), 40, replace=False))
    limit = alias_limit(at(x))
    assert limit == pytest.approx(0.5, rel=0.01)
    assert unlike(x, 0.47, 0.53) < 1e-9
    assert unlike(x, 0.43, 0.47) > 0.5


def test_a_log_resolves_one_cycle_a_step():
    x = np.arange(0.0, 401.0, 5.0) + np.random.default_rng(1).uniform(-1.5, 1.5, 81)
    step = np.median(np.diff(np.sort(x)))
    assert alias_limit(replace(at(x), moving=True, velocity=np.ones(81))) == pytest.approx(1.0 / step)


def test_the_scan_goes_from_five_cycles_to_the_limit_in_steps_of_three_tenths():
    c = at(np.arange(0.0, 101.0, 5.0))
    grid = frequencies(c)
    assert grid[0] == pytest.approx(0.05)
    assert np.diff(grid) == pytest.approx(0.003)
    assert highest_frequency(c) - 0.003 < grid[-1] <= highest_frequency(c) < 0.1
    assert frequencies(at(np.arange(0.0, 41.0, 5.0))).size == 0, "eight steps hold four cycles that are not aliased"


def test_a_long_log_ends_its_scan_early_and_says_where():
    x = np.random.default_rng(2).uniform(0.0, 150.0, 20_000)
    c = at(x, moving=True)
    assert frequencies(c).size == 3000
    assert frequencies(c)[0] == pytest.approx(5.0 / np.ptp(x))
    assert highest_frequency(c) == pytest.approx(frequencies(c)[-1])
    assert highest_frequency(c) < alias_limit(c)


@pytest.mark.parametrize("position", [np.full(9, 4.0), np.arange(5.0), np.array([1.0])])
def test_too_few_places_resolve_nothing(position):
    c = at(position)
    assert (frequencies(c).size, highest_frequency(c), alias_limit(c)) == (0, 0.0, 0.0)
    assert "only: at least 6 needed" in Cyclic().untestable(c)


def test_the_lathe_resolves_four_harmonics_of_its_screw():
    assert resolved_harmonics(lathe(), 6.35) == 4
    assert resolved_harmonics(lathe(), 12.7) == 9
    x = lathe().position
    assert np.abs(np.sin(2 * np.pi * 5 * x / 6.35)).max() < 1e-9, "the fifth is seen at its zeros only"


@pytest.mark.parametrize(
    "places, period, seen",
    [
        ([0.0, 6.35, 63.5], 6.35, 1),
        ([0.0, 6.36, 63.49], 6.35, 1),  # within 2 %, on both sides of a whole turn
        ([0.0, 3.175, 6.35, 9.525], 6.35, 2),
        (np.arange(0.0, 26.0, 0.635), 6.35, 10),
        (np.linspace(0.0, 6.35, 4001), 6.35, 50),
    ],
)
def test_phases_of_a_period(places, period, seen):
    assert phases_seen(np.asarray(places), period) == pytest.approx(seen, abs=1 if seen > 10 else 0)


@pytest.mark.parametrize("runs", [1, 4])
@pytest.mark.parametrize("other_step, other", [(0.66294, 0.0), (0.635, 0.3 * 0.635)])
def test_a_wave_is_mainly_constant_where_most_runs_meet_one_phase_of_it(runs, other_step, other):
    """The mean of its unit vectors, by hand: ones of the first runs, and what the vernier or the shift adds."""
    first, second = 25.4 + 0.635 * np.arange(1561.0), 25.4 + other + other_step * np.arange(1495.0)
    x, run = np.append(np.tile(first, runs), second), np.repeat(np.arange(runs + 1), [*[1561] * runs, 1495])
    turned = 0.0 if other == 0.0 else np.exp(2j * np.pi * 0.3)  # the vernier goes round 65 times
    expected = abs(1561 * runs + 1495 * turned) / x.size
    c = at(x, run=run)
    for share in (expected - 0.02, expected + 0.02):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(frequency_grid, "MOSTLY", share)
            assert looks_constant(c, 1 / 0.635) == (share < expected)
    assert not looks_constant(c, 2 / 6.35)
    assert not looks_constant(at(x, run=run, moving=True), 1 / 0.635), "a log dwells where it likes"
    part = np.arange(0, x.size, 7)
    assert looks_constant(replace(c.take(part), whole=c), 1 / 0.635) == looks_constant(c, 1 / 0.635)


def test_a_family_ends_before_a_harmonic_that_most_targets_see_as_a_constant():
    first, second = 25.4 + 0.635 * np.arange(1561.0), 25.4 + 0.66294 * np.arange(1495.0)
    runs = [first, first, first, first, second]
    run = np.repeat(np.arange(5), [one.size for one in runs])
    c = at(np.concatenate(runs), run=run, screw_pitch=6.35)
    found = Cyclic().variants(c, CyclicShape(6.35 / 2))
    for part, most in ((2, 4), (1, 8)):  # the fifth and the tenth are 0.635 mm
        assert max(s.harmonics for s in found if s.period == pytest.approx(6.35 / part)) == most


# cyclic


def test_waves_that_differ_by_direction():
    c = lathe()
    shape = CyclicShape(6.35, 2, by_direction=True)
    amplitudes = [3.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, -0.5]
    added = Cyclic().contribution(c, shape, amplitudes)
    angle = 2 * np.pi * c.position / 6.35
    forward = 4.0 * np.sin(angle) + 0.5 * np.cos(2 * angle)
    backward = 2.0 * np.sin(angle) + 1.5 * np.cos(2 * angle)
    assert added == pytest.approx(np.where(c.direction > 0, forward, backward), abs=1e-9)
    names = [amplitude.name for amplitude in Cyclic().amplitudes(shape, LINEAR)]
    assert names == [
        *("sin_1", "cos_1", "sin_2", "cos_2"),
        *("sin_1_by_direction", "cos_1_by_direction", "sin_2_by_direction", "cos_2_by_direction"),
    ]


def test_people_read_amplitude_and_phase_of_each_harmonic():
    lines = {n: (v, u) for n, v, u in Cyclic().summary(CyclicShape(6.35, 2), [0.003, 0.004, 0.0, -0.001], LINEAR)}
    assert lines["period"] == (6.35, "mm")
    assert lines["harmonics"] == (2.0, "")
    assert lines["amplitude_1"] == (pytest.approx(5.0), "um")
    assert lines["phase_1"] == (pytest.approx(53.1301), "deg")
    assert lines["amplitude_2"] == (pytest.approx(1.0), "um")
    assert lines["phase_2"] == (pytest.approx(-90.0), "deg")
    x = np.linspace(0.0, 1.0, 100_001)
    wave = 3 * np.sin(2 * np.pi * x) + 4 * np.cos(2 * np.pi * x) - np.cos(4 * np.pi * x)
    assert lines["peak_to_peak"][0] == pytest.approx(np.ptp(wave), rel=1e-5)


def test_people_read_both_directions_apart():
    shape = CyclicShape(6.35, 1, by_direction=True)
    lines = {n: v for n, v, _ in Cyclic().summary(shape, [0.003, 0.0, 0.001, 0.0], LINEAR)}
    assert lines["amplitude_1_forward"] == pytest.approx(4.0)
    assert lines["peak_to_peak_backward"] == pytest.approx(4.0, rel=1e-5)


def test_stated_pitch_and_fractions_are_scanned_where_their_phases_are_seen(bidirectional):
    c = bidirectional(np.arange(21) * 20.3, screw_pitch=5.0)
    grid = frequencies(c).size
    stated = [shape.period for shape in Cyclic().shapes(c)][grid:]
    assert stated == pytest.approx([5.0 / part for part in range(1, 6)])
    assert 1 / stated[0] > highest_frequency(c)
    assert [shape.period for shape in Cyclic().shapes(lathe())][-4:] == pytest.approx(
        [6.35 / k for k in (1, 2, 3, 4)]
    )


def test_targets_at_whole_turns_hide_a_cyclic_error(bidirectional):
    whole = bidirectional(np.arange(21) * 2 * 6.35, screw_pitch=6.35)
    assert Cyclic().untestable(whole) == (
        "targets lie at whole turns of the screw (6.35 mm): a cyclic error with that period looks constant here"
    )
    seen = Cyclic().contribution(whole, CyclicShape(6.35), [0.02, 0.01])
    assert np.ptp(seen) < 1e-12
    halves = bidirectional(np.arange(21) * 2.5 * 6.35, screw_pitch=6.35)
    assert "two phases" in Cyclic().untestable(halves)
    assert Cyclic().untestable(bidirectional(np.arange(21) * 19.7, screw_pitch=6.35)) is None
    assert Cyclic().untestable(bidirectional(np.arange(21) * 2 * 6.35)) is None, "not stated, not known"


def test_the_strongest_line_may_be_a_harmonic_of_its_family():
    second = CyclicShape(6.35 / 2)
    variants = Cyclic().variants(lathe(), second)
    assert CyclicShape(6.35, 3) in variants
    assert CyclicShape(6.35, 4, by_direction=True) in variants
    assert CyclicShape(6.35, 1) not in variants, "it would not hold the line"
    assert max(variant.harmonics for variant in Cyclic().variants(lathe(), CyclicShape(100.0))) == 4, "not stated"
    for variant in variants:
        shown = [phases_seen(lathe().places, variant.period / k) for k in range(1, variant.harmonics + 1)]
        assert min(shown) >= 3, "of a stated pitch every harmonic that three phases show"
    for variant in Cyclic().variants(lathe(), CyclicShape(7.1)):
        assert variant.harmonics <= resolved_harmonics(lathe(), variant.period)
    assert not any(variant.by_direction for variant in Cyclic().variants(lathe().take(np.arange(1561)), second))


def test_the_pitch_goes_before_its_fractions_where_both_alias():
    # every 4 mm a turn of 6 mm is seen at three phases, and so are its third, fourth and fifth, which look the same
    assert [s.period for s in Cyclic().shapes(at(4.0 * np.arange(30), screw_pitch=6.0))][-1] == 6.0
    assert 6.35 / 2 in [s.period for s in Cyclic().shapes(lathe())]


@pytest.mark.parametrize(("step", "pitch", "harmonics"), [(3.0, 10.0, 4), (4.0, 6.0, 1), (25.0, 10.0, 1)])
def test_waves_of_the_pitch_may_alias_as_long_as_none_looks_like_another(step, pitch, harmonics):
    targets = at(step * np.arange(30.0) + (step == 25.0) * (np.arange(30) % 2), screw_pitch=pitch)
    own = [s.harmonics for s in Cyclic().variants(targets, CyclicShape(pitch)) if s.period == pitch]
    assert max(own) == harmonics


def test_a_fundamental_goes_round_five_times_or_is_the_line_itself():
    long = CyclicShape(400.0)
    assert {variant.period for variant in Cyclic().variants(lathe(), long)} == {400.0}
    stated = CyclicShape(800.0)  # as a file may state it
    assert {variant.period for variant in Cyclic().variants(lathe(), stated)} == {800.0}
    # 990.6 mm hold five cycles of 198 mm
    assert {round(v.period) for v in Cyclic().variants(lathe(), CyclicShape(95.0))} == {95, 190}
    assert {round(v.period) for v in Cyclic().variants(lathe(), CyclicShape(105.0))} == {105}


@pytest.mark.parametrize(("pitch", "told"), [(100.0, True), (400.0, True), (444.0, True), (450.0, False)])
def test_a_stated_pitch_needs_nine_tenths_of_a_cycle(pitch, told):
    c = at(np.arange(0.0, 401.0, 5.0), screw_pitch=pitch)
    grid = frequencies(c)
    assert grid[0] == pytest.approx(5.0 / 400.0)
    stated = [shape.period for shape in Cyclic().shapes(c)][grid.size :]
    assert (pitch in stated) is told
    if told:
        assert forms_of(Cyclic()).doubtful(c, CyclicShape(pitch)) is None
        assert Cyclic().tried(c, CyclicShape(pitch)) == len(stated) < 10
        assert Cyclic().tried(c, CyclicShape(37.0)) >= grid.size > 100


def test_a_far_harmonic_of_the_pitch_is_a_period_that_nobody_stated():
    c = at(np.arange(0.0, 401.0, 5.0), screw_pitch=120.0)
    assert Cyclic().tried(c, CyclicShape(120.0 / 5)) < 10
    assert Cyclic().tried(c, CyclicShape(120.0 / 6)) >= frequencies(c).size
    near_two = CyclicShape(120.0 / 12)  # right at two readings a cycle, where any wave of noise is
    assert "two readings long" in forms_of(Cyclic()).doubtful(c, near_two)


def test_a_line_beside_the_stated_pitch_is_a_line_of_its_own():
    c = at(np.arange(0.0, 4001.0, 5.0), screw_pitch=100.0)
    # half of 1 / 4000 away it cannot be told from the pitch: 100 / (1 + 0.0125)
    assert Cyclic().tried(c, CyclicShape(100.5)) == Cyclic().tried(c, CyclicShape(100.0))
    assert Cyclic().tried(c, CyclicShape(102.0)) >= frequencies(c).size


def test_a_refit_moves_the_frequency_by_less_than_the_resolution():
    (tunable,) = Cyclic().tunables(lathe(), CyclicShape(6.35))
    assert 1 / tunable.low - 1 / 6.35 == pytest.approx(0.3 / 990.6, rel=0.02)


def test_time_stands_for_position_where_there_is_none():
    c = at(3.27 * np.arange(600.0), unit="s")
    assert Cyclic().untestable(c) is None
    periods = [shape.period for shape in Cyclic().shapes(c)]
    assert min(abs(period - 384.0) for period in periods) < 10


def test_the_compiled_scan_keeps_nine_digits_far_from_zero():
    x = np.random.default_rng(10).uniform(900.0, 1050.0, 400)
    c = at(x, moving=True)
    shapes = Cyclic().shapes(c)[-300:]
    mixed = [shapes[7], *shapes, shapes[7], shapes[3], shapes[40], shapes[41], shapes[42]]
    waves = Cyclic().scan(c, mixed)
    for wave, shape in zip(waves, mixed, strict=True):
        angle = 2 * np.pi * (x / shape.period)
        assert np.abs(wave - np.stack([np.sin(angle), np.cos(angle)])).max() < 1e-9


# cogging


def held():
    return at(np.arange(0.0, 8192.0, 16.0) * 360 / 8192, unit="deg", revolution=360.0, direction=np.ones(512))


def test_poles_and_slots_are_found_as_families():
    c = held()
    assert Cogging().untestable(c) is None
    scanned = np.array([360.0 / shape.period for shape in Cogging().shapes(c)])
    # up to the limit of 512 places; of 128 cycles a turn they show four phases, however few are looked at
    assert {float(k) for k in range(1, 255)} <= set(scanned.round(9).tolist())
    strongest = WavesShape(360 / 14.1)  # within a hundredth of 14 cycles a turn
    assert WavesShape(360 / 7, 5) in Cogging().variants(c, strongest)
    assert max(variant.harmonics for variant in Cogging().variants(c, strongest)) == 12
    twelve = Cogging().variants(c, WavesShape(360 / 36))
    assert WavesShape(1 / (36 / 360 / 3), 3) in twelve
    assert all(round(360 / variant.period) == pytest.approx(360 / variant.period) for variant in twelve)


def test_whole_cycles_a_turn_are_not_refitted():
    assert Cogging().tunables(held(), WavesShape(360 / 7, 5)) == ()
    assert Cogging().tunables(held(), WavesShape(51.0)) == (), "one turn tells no other line from whole cycles"
    ten = at(np.linspace(0.0, 3600.0, 5000), unit="deg", revolution=360.0)
    assert len(Cogging().tunables(ten, WavesShape(360 / 7.5))) == 1
    assert Cogging().tunables(ten, WavesShape(360 / 7)) == ()


def test_cogging_of_a_linear_motor_needs_no_turn():
    c = at(np.linspace(0.0, 1200.0, 3000))
    assert WavesShape(12.0, 1) in Cogging().variants(c, WavesShape(12.0))
    assert len(Cogging().tunables(c, WavesShape(12.0))) == 1
    lines = {n: (v, u) for n, v, u in Cogging().summary(WavesShape(12.0), [0.0, 0.25], Units("a", "mm", "s"))}
    assert lines["peak_to_peak"] == (pytest.approx(0.5), "A")


# interpolation and eccentricity


def test_signals_of_the_scale_that_are_no_perfect_sine_and_cosine():
    period = 0.02
    x = np.linspace(0.0, 0.2, 4000)
    angle = 2 * np.pi * x / period
    sine = 1.01 * np.sin(angle + np.radians(0.5)) + 0.008
    cosine = np.cos(angle) - 0.005
    read = np.unwrap(np.arctan2(sine, cosine)) / (2 * np.pi) * period
    deviation = x - read
    c = at(x, signal_period=period)
    (shape,) = Interpolation().shapes(c)
    assert shape == InterpolationShape(period, 2)
    columns = np.column_stack([Interpolation().columns(c, shape), np.ones(x.size)])
    fit, *_ = np.linalg.lstsq(columns, deviation, rcond=None)
    left = deviation - columns @ fit
    assert np.std(left) < 0.02 * np.std(deviation)
    once = np.hypot(0.008, 0.005) * period / (2 * np.pi)
    lines = {n: v for n, v, _ in Interpolation().summary(shape, fit[:4], LINEAR)}
    assert lines["amplitude_1"] == pytest.approx(1e3 * once, rel=0.02)


@pytest.mark.parametrize(
    "change, reason",
    [
        ({}, "no scale_signal_period is stated"),
        ({"signal_period": 19.7 / 400}, "targets lie at whole multiples of the scale's signal period (0.04925 mm)"),
        ({"signal_period": 3 * 19.7 / 400.0}, "3 phases of the scale's signal period"),
    ],
)
def test_a_signal_period_that_the_targets_do_not_show(bidirectional, change, reason):
    assert reason in Interpolation().untestable(bidirectional(np.arange(21) * 19.7, **change))


def test_an_oval_disc_off_centre_has_a_second_wave():
    turned = np.linspace(0.0, 2.0 * np.pi, 72, endpoint=False)
    off, oval = 4e-3, 3e-3
    c = at(np.degrees(turned), unit="deg", revolution=360.0)
    (shape,) = Eccentricity().shapes(c)
    assert shape == EccentricityShape(360.0, 4)
    columns = Eccentricity().columns(c, shape)
    deviation = np.degrees(deviations(turned, off * np.exp(0.4j), oval, 1.1))
    fit, *_ = np.linalg.lstsq(columns, deviation, rcond=None)
    assert np.std(deviation - columns @ fit) < np.degrees((off + oval) ** 3)  # five waves a turn are of third order
    lines = {n: v for n, v, _ in Eccentricity().summary(shape, fit, Units("deg", "deg", "s"))}
    arcsec = 3600.0 * np.degrees(1.0)
    assert lines["harmonics"] == 4.0
    assert lines["amplitude_1"] == pytest.approx(arcsec * off, rel=1e-2)
    assert lines["amplitude_2"] == pytest.approx(arcsec * oval, rel=1e-2)
    assert lines["amplitude_3"] < arcsec * 3.0 * off * oval
    assert lines["amplitude_4"] < arcsec * oval**2
    assert forms_of(Eccentricity()).implausible(c, shape, fit) is None


@pytest.mark.parametrize(
    ("turned", "places", "most"),
    [(180.0, 60, 2), (270.0, 60, 3), (359.0, 60, 4), (720.0, 60, 4), (359.0, 18, 3), (359.0, 8, 1), (359.0, 4, 1)],
)
def test_a_turn_that_is_full_shows_more_waves(turned, places, most):
    c = at(np.linspace(0.0, turned, places), unit="deg", revolution=360.0)
    forms = Eccentricity().variants(c, EccentricityShape(360.0))
    assert [form.harmonics for form in forms] == list(range(1, most + 1))
    assert Eccentricity().shapes(c) == [forms[-1]]
    assert Eccentricity().tried(c, forms[0]) == most


@pytest.mark.parametrize(
    "position, turn, reason",
    [
        (np.linspace(0.0, 360.0, 13), None, "no rotary axis"),
        (np.linspace(0.0, 90.0, 13), 360.0, "0.25 turns only: at least 0.5 needed"),
        (np.array([0.0, 180.0, 360.0]), 360.0, "3 positions only"),
    ],
)
def test_a_turn_that_the_data_do_not_show(position, turn, reason):
    assert reason in Eccentricity().untestable(at(position, unit="deg", revolution=turn))


# a step once a turn


def turned(harmonics=2, **others):
    x = 0.66 * np.arange(300.0)
    both = np.repeat([1.0, -1.0], x.size)
    return at(np.tile(x, 2), direction=both, screw_pitch=6.35), CyclicShape(6.35, harmonics, **others)


def test_a_wave_with_a_step_rises_by_its_size_where_the_step_is_and_nowhere_else():
    shape = CyclicShape(6.0, 1, by_direction=True, step_at=2.0)
    amplitudes = [0.0, 0.0, 0.0, 0.0, 3.0, 1.0]
    for way, rise in ((1.0, 4.0), (-1.0, 2.0)):
        c = at([1.999999, 2.000001, 8.0 - 1e-6, 8.0 + 1e-6, 5.0, 5.001], direction=np.full(6, way))
        y = Cyclic().contribution(c, shape, amplitudes)
        assert y[1] - y[0] == pytest.approx(rise, rel=1e-5)
        assert y[3] - y[2] == pytest.approx(rise, rel=1e-5)
        assert y[5] - y[4] == pytest.approx(-rise * 0.001 / 6.0)
        assert y[4] == pytest.approx(0.0, abs=1e-12)


def test_the_peak_to_peak_value_holds_the_step():
    units = Units("mm", "mm", "s")
    shape = CyclicShape(6.0, 1, step_at=2.0)
    values = dict((name, value) for name, value, _ in Cyclic().summary(shape, [0.01, 0.0, 0.02], units))
    place = np.linspace(0.0, 6.0, 200_001)
    y = 0.01 * np.sin(2 * np.pi * place / 6.0) + 0.02 * (0.5 - np.mod(place - 2.0, 6.0) / 6.0)
    assert values["peak_to_peak"] == pytest.approx(1000 * np.ptp(y), rel=1e-3)
    assert (values["step_at"], values["step"]) == (2.0, 20.0)
    plain = dict((name, value) for name, value, _ in Cyclic().summary(CyclicShape(6.0, 1), [0.01, 0.0], units))
    assert "step" not in plain and "step_at" not in plain


def test_steps_are_looked_for_in_a_stated_turn_with_many_phases_only():
    c, shape = turned()
    forms = Cyclic().variants(c, shape)
    steps = [form for form in forms if form.step_at > 0.0]
    assert len(steps) == 100
    assert {form.harmonics for form in steps} == {2}
    assert all(Cyclic().columns(c, form).shape[1] == len(Cyclic().amplitudes(form, LINEAR)) for form in forms)
    assert not any(form.step_at for form in Cyclic().variants(lathe(), CyclicShape(6.35, 4))), "ten phases"
    assert not any(form.step_at for form in Cyclic().variants(c, CyclicShape(6.35))), "a single wave"
    nobody = at(c.position, direction=c.direction)
    assert not any(form.step_at for form in Cyclic().variants(nobody, CyclicShape(6.35, 2)))


def test_a_step_is_found_in_its_gap_by_a_coarse_and_a_fine_look():
    c, shape = turned()
    truth = 4.321
    y = 0.004 * (np.mod(c.position - truth, 6.35) / 6.35) + 0.01 * np.sin(2 * np.pi * c.position / 6.35)

    def left(form):
        columns = np.hstack([Cyclic().columns(c, form), np.ones((c.rows, 1))])
        return float(np.sum((y - columns @ np.linalg.lstsq(columns, y, rcond=None)[0]) ** 2))

    coarse = min((f for f in Cyclic().variants(c, shape) if f.step_at > 0.0), key=left)
    fine = min([coarse, *closer_steps(c, coarse)], key=left)
    assert left(fine) < 1e-20 < left(shape)
    phases = np.sort(np.mod(c.places, 6.35))
    assert not ((phases > min(fine.step_at, truth)) & (phases < max(fine.step_at, truth))).any()
    assert closer_steps(c, shape) == ()


def test_a_step_outside_its_period_is_refused():
    with pytest.raises(ArgumentError, match="step_at"):
        CyclicShape(6.35, 2, step_at=6.4)
    with pytest.raises(ArgumentError, match="step_at"):
        CyclicShape(6.35, 2, step_at=-0.1)


def test_few_uneven_targets_resolve_fewer_cycles_a_step():
    limits = []
    for count in (11, 21, 31):
        x = 50.0 * np.arange(count) + np.random.default_rng(3).uniform(-15.0, 15.0, count)
        limits.append(alias_limit(at(x)) * 50.0)
    assert limits == pytest.approx([1.0, 90.0 / 20.0, 8.0], rel=0.15)
