"""From models to an answer: what is sure, what is tied, what chance could have done."""

from dataclasses import replace

import numpy as np
import pytest
from inference_oracle import SIGMA, covariance, measured, one_chain, pushed, whitened
from scipy import stats

from rtec.effects import Shape, effect_named
from rtec.inference.answer import (
    EQUAL,
    LEVEL,
    SURE,
    adjusted_p,
    newly,
    rivalries,
    settled,
    shared,
    tied_models,
    wrong_signs,
)
from rtec.inference.scored import Judge
from rtec.inference.search import Search
from rtec.inference.space import Space

SCALE, BACKLASH, CYCLIC = (effect_named(n) for n in ("scale", "backlash", "cyclic"))


def run(data):
    search = Search(Judge(Space(data)))
    return search, search.run(lambda share: None)


@pytest.mark.parametrize("rho", [0.0, 0.9])
def test_the_adjusted_p_is_that_of_an_f_test_times_all_shapes(rho):
    data = measured(lambda x, way, t, run: 5e-5 * x + 0.0008 * way, rho=rho, white=0.3, runs=4, targets=16)
    judge = Judge(Space(data))
    model = judge.score([(SCALE, Shape()), (BACKLASH, Shape())])
    matrix = covariance(model.colour.rho, model.colour.white, one_chain(data.rows))
    columns = [np.ones(data.rows), data.conditions.position]
    table = whitened(np.vstack([*columns, data.conditions.direction, data.observed]), matrix)

    def left(rows):
        return float(np.sum((table[-1] - np.linalg.lstsq(rows.T, table[-1])[0] @ rows) ** 2))

    before, after = left(table[:-2]), left(table[:-1])
    dof = data.rows - len(columns) - 1
    p = float(stats.f.sf((before - after) / (after / dof), 1, dof))
    assert adjusted_p(judge, model, 1) == pytest.approx(
        min(1.0, p * np.exp(judge.price((BACKLASH, Shape())))), rel=1e-3
    )


def test_every_effect_and_every_shape_of_it_takes_its_share_of_the_level():
    judge = Judge(Space(measured(runs=2)))
    shapes, _ = judge.space.shapes(CYCLIC)
    tests = np.exp(judge.price((CYCLIC, shapes[0])))
    assert tests >= len(judge.space.library) * len(shapes)


def test_an_answer_holds_only_what_is_sure_and_passes_its_test():
    for seed in range(3):
        rng = np.random.default_rng(seed)
        a, b = rng.uniform(0.0, 0.002, 2)
        data = measured(lambda x, way, t, run, a=a, b=b: a * way + b * np.sin(x / 6.0), seed=seed, runs=3)
        search, model = run(data)
        model, known = settled(search, model)
        for k, (effect, _) in enumerate(model.choices):
            assert known[effect.name] >= SURE or tied_models(search, model, effect.name)
            assert adjusted_p(search.judge, model, k) < LEVEL
            assert search.gate.gain(search.neighbours.without(model, k), model).gain > 0.0
        assert all(0.0 <= p <= 1.0 for p in known.values())


def test_what_is_not_sure_is_kept_out_and_its_probability_told():
    """A reversal error right at the threshold: now in, now out, never with less than 95 %."""
    seen = set()
    for k, size in enumerate(np.linspace(0.2, 0.8, 7) * SIGMA):
        search, model = run(measured(lambda x, way, t, run, s=size: s * way, runs=2, seed=k % 3))
        answer, known = settled(search, model)
        seen.add(answer.names)
        if "backlash" in answer.names:
            assert known["backlash"] >= SURE
        elif "backlash" in known:
            assert "backlash" in search.gate.refused
    assert () in seen
    assert ("backlash",) in seen


def between(lacks, holds, data_of):
    """Return a search of data that are made so that what holds an effect is a little likelier than the effect."""
    low, high = 0.0, 0.01
    for _ in range(40):
        size = (low + high) / 2
        search, _ = run(data_of(size))
        one, other = (min((m for m in search.judge.seen.values() if m.names == names), key=lambda m: -m.score)
                      for names in (lacks, holds))  # fmt: skip
        ahead = other.score - one.score
        if 0.5 < ahead < EQUAL - 0.5:
            return search, one, other
        low, high = (size, high) if ahead < 0.5 else (low, size)
    raise AssertionError("never nearly as likely")


def test_of_what_is_nearly_as_likely_the_simplest_is_taken_and_what_holds_it_counts_for_it():
    bent = lambda size: measured(
        lambda x, way, t, run: 5e-5 * x + size * np.sin(np.pi * x / 300.0), targets=15, runs=3
    )
    search, line, curve = between(("scale",), ("pitch_map",), bent)
    answer, known = settled(search, curve)
    assert answer is line
    assert known["scale"] > 0.99
    assert known["pitch_map"] > 0.5


def test_a_reversal_error_beside_a_drift_is_no_map():
    """Beside noise slower than a cell of the chessboard a constant reversal error must show, too."""
    data = measured(
        lambda x, way, t, run: 0.0015 * way + 0.014 * t / t.max(),
        sigma=0.0005,
        at=np.linspace(0.0, 300.0, 11),
        seed=13,
    )
    answer, _ = settled(*run(data))
    assert set(answer.names) == {"backlash", "drift"}


def test_a_scale_error_looks_like_a_cosine_error_for_ever():
    search, model = run(measured(lambda x, way, t, run: 5e-5 * x))
    found = rivalries(search, model, 0)
    assert [(r.rival, r.permanent, r.cosine) for r in found] == [("cosine", True, 1.0)]


def test_a_map_is_no_rival_of_its_special_case():
    search, model = run(measured(lambda x, way, t, run: 1e-4 * x))
    assert model.names == ("scale",)
    assert "pitch_map" not in {effect.name for effect, _ in tied_models(search, model, "scale")}


def test_the_cosine_is_that_of_columns_beside_the_others():
    data = measured(lambda x, way, t, run: 3e-4 * x, runs=1, bidirectional=False)
    search, model = run(data)
    answer, _ = settled(search, model)
    (rivalry,) = [r for r in rivalries(search, answer, 0) if not r.permanent]
    assert {rivalry.effect, rivalry.rival} == {"scale", "drift"}
    matrix = covariance(answer.colour.rho, answer.colour.white, one_chain(data.rows))
    white = whitened(np.vstack([np.ones(data.rows), data.conditions.position, data.conditions.time_s]), matrix)
    one, x, t = (
        white[0] / np.linalg.norm(white[0]),
        *(row - (row @ white[0]) / (white[0] @ white[0]) * white[0] for row in white[1:]),
    )
    assert rivalry.cosine == pytest.approx(abs(x @ t) / np.linalg.norm(x) / np.linalg.norm(t), rel=1e-6)
    assert one @ one == pytest.approx(1.0)


def test_a_rival_that_is_there_beside_the_effect_keeps_its_probability():
    search, model = run(measured(lambda x, way, t, run: 0.02 * way + 0.03 * (t > 95.0), runs=1))
    answer, every = settled(search, model)
    assert set(answer.names) == {"backlash", "lost_counts"}
    (k,) = (i for i, name in enumerate(answer.names) if name == "backlash")
    rivals = {"backlash": rivalries(search, answer, k)}
    (rivalry,) = [r for r in rivals["backlash"] if r.rival == "lost_counts"]
    assert rivalry.model.names.count("lost_counts") == 2
    assert newly(rivalry.model, answer, "lost_counts") not in answer.choices
    assert rivalry.cosine > 0.9, "of the second step, not of the one that both models have"
    found = shared(search, answer, every, rivals)
    assert found["lost_counts"] == every["lost_counts"] > 0.95
    assert found["backlash"] < 0.9 * every["backlash"]


def test_what_has_no_place_of_its_own_is_no_rival():
    # two waves of one family: beside the whole family anything does as well as the second wave beside the first
    waves = lambda x, way, t, run: 0.006 * np.sin(2 * np.pi * x / 48.0) + 0.004 * np.sin(2 * np.pi * x / 24.0)
    search = Search(Judge(Space(measured(waves, runs=3, at=np.linspace(0.0, 300.0, 41)))))
    cyclic = effect_named("cyclic")
    shape = cyclic.shape_type
    two = search.judge.score([(cyclic, shape(48.0)), (cyclic, shape(24.0))])
    idle = search.judge.score([(cyclic, shape(48.0, 2)), (effect_named("backlash"), Shape())])
    spoken = [m.score + sum(map(search.judge.price, m.choices)) for m in (two, idle)]
    assert abs(spoken[0] - spoken[1]) < 3.0
    assert tied_models(search, two, "cyclic") == []


def test_what_is_tied_shares_its_probability_whatever_it_has_to_choose_from():
    # a step of lost counts at the reversal is a reversal error, and may have come at any of so many readings
    data = measured(lambda x, way, t, run: 0.02 * way, runs=1)
    search, model = run(data)
    answer, every = settled(search, model)
    assert answer.names == ("backlash",)
    assert every["backlash"] > 0.95
    rivals = {"backlash": rivalries(search, answer, 0)}
    (rivalry,) = [r for r in rivals["backlash"] if r.rival == "lost_counts"]
    found = shared(search, answer, every, rivals)
    assert found["backlash"] + found["lost_counts"] == pytest.approx(every["backlash"] + every["lost_counts"])
    price = {m: sum(map(search.judge.price, m.choices)) for m in (answer, rivalry.model)}
    odds = np.exp(answer.score + price[answer] - rivalry.model.score - price[rivalry.model])
    assert found["backlash"] / found["lost_counts"] == pytest.approx(odds)
    assert 0.05 < found["backlash"] < 0.95
    assert shared(search, answer, every, {"backlash": []}) == every


def test_a_friction_that_is_there_says_that_the_sign_is_right():
    search, model = run(pushed(1.0))
    answer, _ = settled(search, model)
    start = search.judge.score(())
    for held in (answer, start):
        falling = (effect_named("stribeck"), effect_named("stribeck").shape_type(speed=0.1))
        odd = replace(held, choices=(*held.choices, falling), wrong_sign=("stribeck",), score=answer.score + 50.0)
        search.judge.seen[odd.key] = odd
    assert wrong_signs(search, answer) == ()
    assert wrong_signs(search, start) == ("stribeck",)
    # what the user said is no finding, and what comes out below zero itself says nothing
    search.given = answer.choices
    assert wrong_signs(search, answer) == ("stribeck",)
    search.given = ()
    assert wrong_signs(search, replace(answer, wrong_sign=answer.names)) == ("stribeck",)
