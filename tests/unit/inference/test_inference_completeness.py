"""What speaks against a model in which effects were found: a floor missed, a colour, a trend, a beat."""

from dataclasses import replace

import numpy as np
import pytest
from inference_oracle import SIGMA, measured

from rtec.dataset.load import load_dataset
from rtec.effects import CyclicShape, Shape, effect_named
from rtec.inference.completeness import knows_the_floor
from rtec.inference.diagnose import diagnose
from rtec.inference.model import Model, Term
from rtec.inference.noise import noise_floor
from rtec.inference.results import Verdict
from rtec.inference.rules import signs_of
from rtec.inference.scored import Judge
from rtec.inference.search import Search
from rtec.inference.space import Space
from rtec.metrology import Column, Measurement

TILTED = lambda x, way, t, run: 5e-5 * x + 0.004 * way
BACKLASH, SCALE, CYCLIC = (effect_named(name) for name in ("backlash", "scale", "cyclic"))
FULL = ((BACKLASH, Shape()), (SCALE, Shape()))


def spoken_against(data, choices):
    search = Search(Judge(Space(data)))
    model = search.judge.score(choices)
    return {sign.depends_on for sign in signs_of(search, model, noise_floor(search.judge, model))}


def test_nothing_speaks_against_the_whole_truth_and_something_against_half_of_it():
    data = measured(TILTED)
    assert spoken_against(data, FULL) == set()
    assert spoken_against(data, FULL[:1])


def test_a_trend_says_what_it_depends_on():
    data = measured(lambda x, way, t, run: TILTED(x, way, t, run) + 2e-5 * way * (x - 150.0))
    assert "direction" in spoken_against(data, FULL)


def test_two_waves_closer_than_three_cycles_are_a_beat():
    wave = lambda period: lambda x, way, t, run: TILTED(x, way, t, run) + 0.004 * np.sin(2 * np.pi * x / period)
    both = lambda *where: wave(20.0)(*where) + wave(22.0)(*where)  # 1.4 cycles apart over 300 mm
    choices = [(CYCLIC, CyclicShape(period, 1)) for period in (20.0, 22.0, 30.0)]
    assert spoken_against(measured(both, targets=81), [*FULL, *choices[:2]]) == {"position"}
    apart = lambda *where: wave(20.0)(*where) + wave(30.0)(*where)
    assert spoken_against(measured(apart, targets=81), [*FULL, choices[0], choices[2]]) == set()


def test_a_floor_of_few_repeats_or_beside_slow_noise_is_none():
    judge = Judge(Space(measured(TILTED)))
    model = judge.score(FULL)
    floor = noise_floor(judge, model)
    assert knows_the_floor(judge, model, floor)
    assert not knows_the_floor(judge, model, replace(floor, degrees_of_freedom=9.0))
    assert not knows_the_floor(judge, model, replace(floor, from_repeats=False))
    slow = Judge(Space(measured(TILTED, rho=0.9, white=0.1)))
    model = slow.score(FULL)
    assert not knows_the_floor(slow, model, noise_floor(slow, model))


def test_beside_noise_that_wanders_an_effect_is_likely_and_not_named():
    found = diagnose(measured(TILTED, rho=0.9, white=0.1))
    assert found.verdict is Verdict.LIKELY and set(found.effects) == {"backlash", "scale"}


@pytest.mark.parametrize("seed", range(4))
def test_no_step_raises_an_error_and_no_probability_is_one(seed):
    bent = lambda x, way, t, run: (
        TILTED(x, way, t, run) + 0.006 * np.exp(-t / 500.0) + 0.003 * np.sin(x / 9.0) * (x > 99)
    )
    found = diagnose(measured(bent, seed=seed, rho=0.9 * (seed % 2)))
    assert found.steps
    for before, after in zip(found.steps, found.steps[1:], strict=False):
        assert after.rms_train <= before.rms_train and after.rms_heldout <= before.rms_heldout
    assert max(found.probability.values()) < 0.97


def test_a_column_that_numbers_the_readings_changes_nothing():
    data = measured(TILTED)
    x = data.conditions.position
    counters = (np.arange(data.rows), np.argsort(np.argsort(x, kind="stable")) // 10, -data.conditions.run)
    numbered = replace(data, unknown=tuple((f"column {k}", c.astype(float)) for k, c in enumerate(counters)))
    plain, more = diagnose(data), diagnose(numbered)
    assert (plain.verdict, plain.effects, plain.rms_after) == (more.verdict, more.effects, more.rms_after)


def test_a_map_that_swings_is_told_as_approximate():
    rng = np.random.default_rng(2)
    waves = [(k + 0.9, size, rng.uniform(0.0, 6.28)) for k, size in enumerate((0.3, 0.5, 0.7, 1.0, 1.0, 1.0, 1.0))]
    curve = lambda x: 0.01 * sum(size * np.sin(2 * np.pi * k * x / 300.0 + phase) for k, size, phase in waves)
    found = diagnose(measured(lambda x, way, t, run: curve(x) + 0.004 * way, targets=61, runs=3))
    assert found.approximate == ("pitch_map",) and found.verdict is Verdict.UNKNOWN
    assert found.rms_after < 2.0 * SIGMA


@pytest.mark.parametrize(("size", "doubted"), [(0.0, True), (0.004, False)])
def test_what_was_given_is_tested_too(size, doubted):
    data = measured(lambda x, way, t, run: TILTED(x, way, t, run) + size * np.sin(2 * np.pi * x / 47.0))
    given = Model(observe="deviation", units=data.units, terms=(Term(effect=CYCLIC, shape=CyclicShape(47.0, 1)),))
    found = diagnose(data, given)
    assert any("cyclic, which was given, explains no more than noise" in note for note in found.notes) is doubted


def in_any_order(error, seed=1):
    """Four runs over 25 uneven places, each twice, in drawn order; ``error(x, way, moved, since)`` in mm."""
    rng = np.random.default_rng(seed)
    x = np.concatenate([rng.permutation(np.repeat(np.sort(rng.uniform(0.0, 300.0, 25)), 2)) for _ in range(4)])
    run = np.repeat([1, 2, 3, 4], 50)
    begins = np.append(True, np.diff(run) != 0)
    step = np.where(begins, 0.0, np.diff(x, prepend=x[0]))
    way, since = np.where(step < 0.0, -1.0, 1.0), np.zeros(x.size)
    for i in np.flatnonzero(~begins):
        since[i] = abs(step[i]) + (since[i - 1] if way[i] == way[i - 1] and not begins[i - 1] else 0.0)
    y = error(x, way, np.abs(step), since) + SIGMA * rng.standard_normal(x.size)
    columns = {"run": run, "direction": way, "target": x, "deviation": y}
    columns = {name: Column(name, "mm" if name in ("target", "deviation") else "", v) for name, v in columns.items()}
    return load_dataset(Measurement(source="any order", facts={}, columns=columns, unknown={}))


def test_in_any_order_of_targets_a_wind_up_is_told_from_an_error_of_the_last_move():
    wound = diagnose(in_any_order(lambda x, way, moved, since: 0.006 * way * (1.0 - np.exp(-since / 40.0))))
    assert (wound.verdict, wound.effects) == (Verdict.NAMED, ("windup",))
    assert {p.name: p.value for p in wound.steps[-1].params}["distance"] == pytest.approx(40.0, rel=0.15)
    moved = diagnose(in_any_order(lambda x, way, moved, since: 0.006 * way * np.sqrt(moved / 100.0)))
    assert moved.verdict is Verdict.UNKNOWN
    assert "direction" in moved.unknown.depends_on


def test_a_reversal_error_that_varies_is_no_backlash_that_leaves_a_trend():
    """Neither is 3 nats likelier: the simpler one would be the answer if it left nothing."""
    varies = diagnose(measured(lambda x, way, t, run: way * (4.0 + 0.7 * np.cos(x / 300.0 * np.pi)) / 1e3,
                               runs=4, targets=30, seed=4))  # fmt: skip
    assert (varies.verdict, varies.effects) == (Verdict.NAMED, ("backlash_map",))
