"""The search: what earns its place, and how sure an effect is over the models that compete."""

import itertools
import re
from dataclasses import replace

import numpy as np
import pytest
from inference_oracle import SIGMA, measured
from scipy.special import logsumexp

from rtec.blind.confusion import seed_of
from rtec.blind.game import play
from rtec.blind.lines import the_lines
from rtec.dataset.load import load_dataset
from rtec.effects import Observable, Shape, effect_named
from rtec.effects.viscous import ViscousShape
from rtec.inference.answer import probabilities, settled
from rtec.inference.diagnose import diagnose
from rtec.inference.proposals import by_chance
from rtec.inference.results import Verdict
from rtec.inference.rules import MATTERS, WORTH
from rtec.inference.scored import Judge
from rtec.inference.search import Search
from rtec.inference.space import Space
from rtec.metrology import Column, Measurement

NAMES = "scale backlash cyclic pitch_map drift lost_counts".split()
SCALE, BACKLASH, CYCLIC, MAP, DRIFT, STEP = (effect_named(n) for n in NAMES)
TILTED = lambda x, way, t, run: 5e-5 * x + 0.004 * way


def search_of(data, given=()):
    return Search(Judge(Space(data)), tuple(given))


def found_in(data, given=()):
    search = search_of(data, given)
    return search, search.run(lambda share: None)


def wave(period=41.0, size=0.006):
    return lambda x, way, t, run: size * np.sin(2 * np.pi * x / period)


@pytest.mark.parametrize(
    ("error", "expected"),
    [
        (TILTED, {"scale", "backlash"}),
        (wave(), {"cyclic"}),
        (lambda x, way, t, run: 0.006 * way + 0.006 * np.sin(2 * np.pi * x / 31.0), {"backlash", "cyclic"}),
        (lambda x, way, t, run: 0.02 * np.exp(-(((x - 150) / 60) ** 2)), {"pitch_map"}),
        (lambda x, way, t, run: 0.01 * way * (0.2 + np.exp(-(((x - 150) / 60) ** 2))), {"backlash_map"}),
        (lambda x, way, t, run: np.where(t > 905.0, 0.012, 0.0), {"lost_counts"}),
        (lambda x, way, t, run: 0.02 * (1.0 - np.exp(-t / 400.0)), {"warm_up"}),
        (lambda x, way, t, run: 0.0 * x, set()),
    ],
    ids=["tilted", "wave", "wave and play", "bump", "worn", "step", "warm", "nothing"],
)
def test_a_search_finds_what_was_planted(error, expected):
    _, model = found_in(measured(error))
    assert set(model.names) == expected


@pytest.mark.parametrize(
    ("off", "tilt"),
    [(-1, 1e-4), *(pytest.param(*one, marks=pytest.mark.sweep) for one in ((1, 0.0), (1, 1e-4), (-1, 0.0)))],
)
def test_where_one_approach_is_right_no_map_of_the_axis_is_named(off, tilt):
    """Half of a one-sided error is in both curves: a map of the axis and one of reversals would explain it, too."""
    wear = lambda x: 0.012 * np.exp(-(((x - 220) / 50) ** 2)) + 0.006 * np.exp(-(((x - 60) / 30) ** 2))
    _, model = found_in(measured(lambda x, way, t, run: tilt * x + wear(x) * (way == off)))
    assert set(model.names) == ({"backlash_map", "scale"} if tilt else {"backlash_map"})
    assert next(shape for effect, shape in model.choices if effect.is_map).side == off


def test_the_search_finds_the_likeliest_of_all_subsets_of_simple_effects():
    """Exhaustively, over effects without shape parameters."""
    import itertools

    for seed, error in enumerate((TILTED, lambda x, way, t, run: 8e-6 * t + 0.004 * way)):
        search, model = found_in(measured(error, seed=seed))
        simple = [SCALE, BACKLASH, DRIFT]
        subsets = [s for k in range(4) for s in itertools.combinations(simple, k)]
        best = max(subsets, key=lambda s: search.judge.score([(e, Shape()) for e in s]).score)
        assert set(model.names) == {e.name for e in best}


@pytest.mark.parametrize("seed", [0, *(pytest.param(n, marks=pytest.mark.sweep) for n in (1, 2, 3))])
def test_every_effect_of_the_model_found_has_earned_its_place(seed):
    rng = np.random.default_rng(seed)
    a, b, c = rng.uniform(0.001, 0.006, 3)
    search, model = found_in(
        measured(lambda x, way, t, run: a * way + b * np.sin(x / 6.0) + c * t / 2000.0, seed=seed)
    )
    for k in range(len(model.choices)):
        rest = search.neighbours.without(model, k)
        assert model.score - rest.score >= WORTH
        assert search.gate.size(model, k) >= MATTERS
        assert search.gate.gain(rest, model).passes
        assert search.gate.why_not(model, k) is None


def test_given_effects_stay_even_where_they_explain_nothing():
    given = (CYCLIC, CYCLIC.shape_type(33.0))
    search, model = found_in(measured(TILTED), [given])
    assert given in model.choices
    assert set(model.names) == {"scale", "backlash", "cyclic"}
    assert search.gate.why_not(model, model.choices.index(given)) is None


def test_given_families_stay_whatever_a_second_wave_fills():
    given = (CYCLIC, CYCLIC.shape_type(41.0, 2))
    both = lambda x, way, t, run: wave()(x, way, t, run) + wave(23.0, 0.0025)(x, way, t, run)
    search, model = found_in(measured(both, targets=41, runs=2), [given])
    assert given in search.exchanges.exchanged(model).choices
    assert given in model.choices


def test_why_an_effect_does_not_earn_its_place():
    search = search_of(measured(TILTED))
    useless = search.judge.score([(SCALE, Shape()), (BACKLASH, Shape()), (DRIFT, Shape())])
    assert "nats, less than the 5 required" in search.gate.why_not(useless, 2)
    assert search.gate.why_not(useless, 0) is None
    long = search.judge.score([(CYCLIC, CYCLIC.shape_type(100.0))])
    assert "3.0 cycles" in search.gate.why_not(long, 0) or "2.9 cycles" in search.gate.why_not(long, 0)
    assert not search.gate.is_gated(long)
    assert "cycles" in search.gate.refused["cyclic"]


def test_beside_a_small_course_in_time_no_effect_is_sure():
    """Noise correlated by seconds in three one-way runs: a course in time explains more than a zero of each."""
    (line,) = [one for one in the_lines() if one.title == "nothing, drawn plans, noise: correlated by seconds"]
    seed = seed_of(0, line.title, 17)
    search, model = found_in(load_dataset(play(line.scenario(17, seed), seed)[0]))
    (course,) = [(effect, Shape()) for effect in search.space.library if effect.name == "any time 9"]
    small = search.judge.score([course])
    assert small.score > model.score
    assert "its contribution is below 2 times the residual" in search.gate.why_not(small, 0)
    assert search.gate.competes(small)
    assert settled(search, model)[0].names == ()


def test_collinear_effects_share_their_evidence():
    """In a single pass position and time are one: what a scale error explains a drift explains as well."""
    together = []
    for slope in np.linspace(4e-5, 1.4e-4, 11):
        data = measured(lambda x, way, t, run, slope=slope: slope * x, runs=1, bidirectional=False)
        search = search_of(data)
        rest, scale, drift = (search.judge.score(choices) for choices in ([], [(SCALE, Shape())], [(DRIFT, Shape())]))
        worth, alone = search.gate.worth(scale, 0, rest), scale.score - rest.score
        assert alone <= worth <= alone + np.log1p(len(SCALE.rivals))
        if alone < WORTH <= worth:
            assert worth >= logsumexp([scale.score, drift.score]) - rest.score
            together.append(diagnose(data))
        else:
            assert worth == alone or worth < WORTH
    assert together
    for result in together:
        assert result.verdict is Verdict.TIED
        assert "drift" in {name for one in result.candidates if one.accepted for name in (one.effect, *one.tied_with)}


def test_a_hair_beside_much_noise_is_of_no_interest():
    """A tenth of the noise, certain after 8000 readings."""
    search = search_of(measured(lambda x, way, t, run: 0.1 * SIGMA * way, runs=200))
    model = search.judge.score([(BACKLASH, Shape())])
    assert model.score - search.judge.score([]).score > WORTH
    assert search.gate.size(model, 0) == pytest.approx(0.1, abs=0.04)
    assert search.gate.why_not(model, 0) == "its contribution is below 0.15 of the residual"


def test_the_size_of_an_effect_is_what_the_others_cannot_explain():
    data = measured(lambda x, way, t, run: 1e-4 * x + 0.003 * np.sin(x / 12.0))
    search = search_of(data)
    shape = MAP.shape_type(tuple(np.linspace(0.0, 300.0, 6)))
    model = search.judge.score([(SCALE, Shape()), (MAP, shape)])
    assert search.gate.size(model, 0) < 1e-6, "a map draws any line"


def test_a_negative_friction_is_refused_with_a_word():
    rng = np.random.default_rng(0)
    data = measured(runs=2)
    speed = rng.normal(size=data.rows)
    conditions = replace(data.conditions, velocity=speed, moving=True)
    data = replace(
        data, observable=Observable.DRIVE, conditions=conditions, observed=-2.0 * speed + rng.normal(size=data.rows)
    )
    search = search_of(data)
    model = search.judge.score([(effect_named("viscous"), ViscousShape())])
    assert search.gate.why_not(model, 0) == "its amplitude would have to be negative"


def test_without_an_effect_goes_what_builds_on_it():
    rng = np.random.default_rng(0)
    data = measured(runs=2)
    speed = rng.normal(size=data.rows)
    conditions = replace(data.conditions, velocity=speed, direction=np.sign(speed), moving=True)
    data = replace(data, observable=Observable.DRIVE, conditions=conditions)
    viscous, askew = effect_named("viscous"), effect_named("asymmetric_friction")
    search = search_of(data)
    assert askew not in search.neighbours.effects_for(search.judge.score([]))
    model = search.judge.score([(viscous, ViscousShape()), (askew, Shape())])
    assert search.neighbours.without(model, 0).names == ()
    assert search.neighbours.without(model, 1).names == ("viscous",)
    assert askew in search.neighbours.effects_for(search.neighbours.without(model, 1))


def test_no_more_of_an_effect_than_a_model_may_hold():
    search = search_of(measured())
    steps = [(STEP, STEP.shape_type(205.0 + 400.0 * k)) for k in range(3)]
    assert STEP in search.neighbours.effects_for(search.judge.score(steps[:2]))
    assert STEP not in search.neighbours.effects_for(search.judge.score(steps))
    assert SCALE not in search.neighbours.effects_for(search.judge.score([(SCALE, Shape())]))


def test_probabilities_are_shares_of_all_models_that_compete():
    search, model = found_in(measured(TILTED, sigma=4 * SIGMA))
    near = search.gate.near(model)
    competing = [
        m for m in near if m is model or all(search.gate.why_not(m, k) is None for k in range(len(m.choices)))
    ]
    found = probabilities(search, model)
    scores = np.array([m.score for m in competing])
    holds = {"scale": {"scale", "pitch_map", "warm_up_growth"}, "backlash": {"backlash", "backlash_map", "windup"}}
    for name in model.names:
        having = [m.score for m in competing if holds[name] & set(m.names)]
        expected = np.exp(logsumexp(having) - logsumexp(scores))
        # of the same effects the best shape decides whether they compete, which brings in some shapes more
        assert found[name] == pytest.approx(expected, abs=0.05)
        assert 0.0 <= found[name] <= 1.0
    assert set(found) >= set(model.names)


def test_of_rivals_that_exclude_each_other_the_probabilities_sum_to_one():
    """Backlash and lag at one feed: the models that compete hold one of them, or both, or none."""
    data = measured(lambda x, way, t, run: 0.006 * way, timed=False)
    data = replace(data, conditions=replace(data.conditions, velocity=20.0 * data.conditions.direction))
    search, model = found_in(data)
    lag = effect_named("servo_lag")
    other = search.judge.score([(lag if model.names == ("backlash",) else BACKLASH, Shape())])
    share = [probabilities(search, m)[m.names[0]] for m in (model, other)]
    assert sum(share) == pytest.approx(1.0, abs=0.02)
    assert share[0] == pytest.approx(0.5, abs=0.05)


def test_two_steps_are_as_sure_as_two_steps():
    jumps = lambda x, way, t, run: np.where(t > 505.0, 0.02, 0.0) - np.where(t > 1505.0, 0.03, 0.0)
    search, model = found_in(measured(jumps))
    assert model.names == ("lost_counts", "lost_counts")
    assert probabilities(search, model)["lost_counts"] > 0.99


def test_waves_too_long_for_the_data_compete_and_are_never_accepted():
    search, model = found_in(measured(lambda x, way, t, run: 0.008 * np.sin(2 * np.pi * x / 84.0 + 0.4)))
    found = probabilities(search, model)
    assert found["cyclic in doubt"] > 0.9
    assert search.doubts == {"cyclic"}
    assert "cyclic" not in model.names or all(s.period < 61.0 for e, s in model.choices if e.name == "cyclic")
    assert any(
        search.gate.in_doubt(m) and search.gate.competes(m) and not search.gate.is_gated(m)
        for m in search.gate.near(model)
    )


def test_what_a_refit_moved_has_to_earn_its_place_again():
    search = Search(Judge(Space(measured(lambda x, way, t, run: 0.008 * np.sin(2 * np.pi * x / 62.0)))))
    longer = search.judge.score([(CYCLIC, CYCLIC.shape_type(62.0))])
    assert search.gate.earned(longer).choices == ()
    assert "cycles of 62 mm only" in search.gate.refused["cyclic"]


@pytest.mark.sweep
@pytest.mark.parametrize(("period", "share", "seed"), [(41.14, 0.52, 3), (27.49, 0.6635, 4)])
def test_two_periods_nearly_in_a_simple_ratio_are_no_family_of_one(period, share, seed):
    both = lambda x, way, t, run: (
        5e-5 * x
        - 0.003 * way
        + 0.01 * np.sin(2 * np.pi * x / period + 1.0)
        + 0.0075 * np.sin(2 * np.pi * x / (share * period) + 2.0)
    )
    _, model = found_in(measured(both, targets=61, runs=4, seed=seed))
    assert sorted(model.names) == ["backlash", "cyclic", "cyclic", "scale"]
    periods = sorted(shape.period for effect, shape in model.choices if effect is CYCLIC)
    assert periods == pytest.approx([share * period, period], rel=0.005)


@pytest.mark.parametrize(("cycles", "seed"), [((6.3, 9.6, 13.9), 1)])
def test_three_periods_are_found_one_by_one_where_families_bring_them_together(cycles, seed):
    sizes = (0.010, 0.008, 0.006)
    error = lambda x, way, t, run: sum(
        size * np.sin(2 * np.pi * x * f / 300.0 + k) for k, (size, f) in enumerate(zip(sizes, cycles, strict=True), 1)
    )
    _, model = found_in(measured(error, targets=81, runs=4, seed=seed))
    assert model.names == ("cyclic",) * 3
    assert sorted(300.0 / shape.period for _, shape in model.choices) == pytest.approx(cycles, rel=0.005)


def on_uneven_targets(jitter, period, size, runs=3):
    """Return readings at targets about 10 mm apart that hold one wave; its size is in sigma."""
    at = 10.0 * np.arange(31) + np.random.default_rng(3).normal(0.0, jitter, 31)
    return measured(wave(period, size * SIGMA), at=at, runs=runs)


@pytest.mark.parametrize("period", [3.3, 10.0, 14.3])
def test_uneven_targets_show_waves_shorter_than_their_mean_step(period):
    found = diagnose(on_uneven_targets(1.5, period, 3.0))
    assert [step.effect for step in found.steps] == ["cyclic"]
    assert found.steps[0].params[0].value == pytest.approx(period, rel=0.002)
    assert found.verdict is Verdict.NAMED


def test_periods_that_the_targets_hardly_tell_apart_are_tied():
    found = diagnose(on_uneven_targets(0.3, 100.0 / 3.0, 1.0))
    assert found.verdict is Verdict.TIED
    assert re.search(r"a period of 14\.\d+ mm explains the readings as well as one of 33\.\d+ mm", found.notes[-1])
    assert "other uneven targets" in found.experiment.text
    assert diagnose(on_uneven_targets(0.3, 100.0 / 7.0, 10.0)).verdict is Verdict.NAMED


@pytest.mark.parametrize(("planted", "expected"), [("wave", False), ("table", True)])
def test_a_wave_of_less_than_two_steps_has_to_explain_more_of_the_targets_than_chance_does(planted, expected):
    at = 10.0 * np.arange(21) + np.random.default_rng(4).uniform(-4.0, 4.0, 21)
    own = np.random.default_rng(5).normal(0.0, 4.0 * SIGMA, 21)
    data = measured(wave(3.3, 4.0 * SIGMA) if planted == "wave" else lambda x, *_: own[np.searchsorted(at, x)], at=at)
    judge = Judge(Space(data))
    cyclic = effect_named("cyclic")
    likely = [judge.score([(cyclic, shape)]) for shape in cyclic.shapes(data.conditions)]
    short = [m for m in likely if m.choices[0][1].period < 10.0]
    best = max(short, key=lambda m: m.score)
    assert best.score > judge.score([]).score + WORTH, "by the readings alone it would be a wave"
    assert by_chance(judge, best, 0) is expected


def test_two_effects_that_a_third_resembles_are_found_together():
    """A screw that grows beside its scale: after the one or the other, a growth in time explains more than either."""
    t = 10.0 * np.arange(100)
    heat = {"scale": 20.5 + 2.5 * (1.0 - np.exp(-t / 400.0)), "motor": 21.0 + 3.0 * (1.0 - np.exp(-t / 250.0))}
    grown = lambda x, way, t, run: 1e-4 * x * (heat["scale"] - 20.0) - 2.4e-4 * x
    data = measured(grown, bidirectional=False, targets=20, seed=1, temperatures=heat)
    assert set(diagnose(data).effects) == {"scale", "thermal_growth"}


def test_an_effect_is_found_with_the_one_that_it_builds_on():
    """Friction that grows with speed nearly one way only: viscous friction alone explains next to nothing."""
    rng, t = np.random.default_rng(1), np.arange(3000) / 100.0
    speeds = np.repeat(rng.uniform(5.0, 60.0, 30) * np.tile([1.0, -1.0], 15), 100)
    v = np.convolve(speeds, np.hanning(31) / np.hanning(31).sum(), "same")
    x = np.cumsum(v) / 100.0
    f = 0.004 * v + 0.02 * np.abs(v) + 0.15 * np.sign(v) + 0.6 * np.sin(2 * np.pi * x / 9.3)
    columns = {"time": ("s", t), "actual": ("mm", x), "force": ("N", f + 0.05 * rng.standard_normal(t.size))}
    columns = {name: Column(name, unit, values) for name, (unit, values) in columns.items()}
    found = diagnose(load_dataset(Measurement(source="x", facts={}, columns=columns, unknown={}), observe="force"))
    assert set(found.effects) == {"coulomb", "viscous", "asymmetric_friction", "cogging"}
    for before, after in itertools.pairwise(found.steps):
        assert after.rms_heldout <= before.rms_heldout
