"""What a finished search comes to."""

from dataclasses import replace

import numpy as np
import pytest
from inference_oracle import SIGMA, measured

from rtec.effects import Shape, effect_named
from rtec.inference.diagnose import diagnose
from rtec.inference.judgement import HARD_TO_SEE, _in_order, _inconclusive, _verdict, judged, nothing_testable
from rtec.inference.model import Model
from rtec.inference.noise import noise_from_repeats, noise_from_residual
from rtec.inference.results import Unknown, Verdict
from rtec.inference.trial import Search
from rtec.inference.workspace import Workspace

SCALE, BACKLASH, OFFSET, CYCLIC = (effect_named(n) for n in ("scale", "backlash", "offset", "cyclic"))
ODD = Unknown(depends_on=("run",), period=None, frequency_hz=None, description="")
TILTED = lambda x, way, t, run: 5e-5 * x + 0.004 * way


def state_of(data, kept=(), tests=50.0):
    noise = noise_from_repeats(data) or noise_from_residual(data, data.observed, 1)
    start = Model(observe="deviation", units=data.units)
    return Search(
        dataset=data,
        heldout=None,
        start=start,
        workspace=Workspace(data, noise),
        rng=np.random.default_rng(0),
        tests=tests,
        kept=list(kept),
    )


def verdict_on(state):
    return judged(state, state.start, [], np.random.default_rng(0), lambda share: None)


@pytest.mark.parametrize(
    ("unknown", "tied", "found", "inconclusive", "verdict"),
    [
        (ODD, True, True, True, Verdict.UNKNOWN),
        (None, True, True, True, Verdict.TIED),
        (None, False, True, True, Verdict.NAMED),
        (None, False, False, True, Verdict.INCONCLUSIVE),
        (None, False, False, False, Verdict.NONE),
    ],
)
def test_the_order_of_verdicts(unknown, tied, found, inconclusive, verdict):
    assert _verdict(unknown, tied, found, inconclusive) is verdict


def test_data_are_inconclusive_where_half_of_the_effects_would_hide():
    state = state_of(measured())
    sigma = state.workspace.noise.sigma
    small, large = 0.9 * HARD_TO_SEE * sigma, 1.1 * HARD_TO_SEE * sigma
    assert not _inconclusive(state, {"a": small, "b": small, "c": large}, False)
    assert _inconclusive(state, {"a": small, "b": large, "c": large}, False)
    assert _inconclusive(state, {"a": small}, True)  # one effect is nearly significant
    assert _inconclusive(state, {}, False)
    assert _inconclusive(state_of(measured(runs=1)), {"a": small}, False)


def test_effects_stand_in_the_order_of_what_each_explains():
    data = measured(lambda x, way, t, run: 2e-5 * x + 0.01 * way)
    choices = [(SCALE, Shape()), (BACKLASH, Shape())]
    assert [e.name for e, _ in _in_order(state_of(data, choices), [])] == ["backlash", "scale"]
    assert [e.name for e, _ in _in_order(state_of(data, choices), choices[:1])] == ["scale", "backlash"]


def test_the_staircase_is_that_of_nested_fits():
    data = measured(lambda x, way, t, run: 2e-5 * x + 0.01 * way)
    result = verdict_on(state_of(data, [(SCALE, Shape()), (BACKLASH, Shape())]))
    constant, way, x = np.ones(210), data.conditions.direction, data.conditions.position
    for step, columns in zip(result.steps, ([constant, way], [constant, way, x]), strict=True):
        table = np.array(columns).T
        left = data.observed - table @ np.linalg.lstsq(table, data.observed)[0]
        assert step.rms_train == pytest.approx(np.sqrt(np.mean(left**2)))
    assert [step.effect for step in result.steps] == ["backlash", "scale"]
    assert result.rms_before == pytest.approx(np.sqrt(np.mean(data.observed**2)))
    assert result.rms_after == result.steps[-1].rms_train
    first = next(c for c in result.candidates if c.effect == "backlash")
    assert first.predicted_rms == pytest.approx(result.steps[0].rms_train)
    assert first.achieved_rms == result.steps[0].rms_train


def test_every_testable_effect_is_listed_once_with_a_reason():
    result = verdict_on(state_of(measured(TILTED), [(SCALE, Shape()), (BACKLASH, Shape())]))
    names = [c.effect for c in result.candidates]
    assert len(set(names)) == len(names)
    work = Workspace(measured(TILTED), noise_from_repeats(measured(TILTED)))
    assert set(names) == {e.name for e in work.library} | {"cosine"}
    assert all(c.reason for c in result.candidates)
    assert set(dict(result.not_testable)) == {n for n, r in work.reasons.items() if r is not None}
    assert all(0.0 <= c.p_adjusted <= 1.0 for c in result.candidates)
    assert {c.effect for c in result.candidates if c.accepted} == {"scale", "backlash"}
    quiet = next(c for c in result.candidates if c.effect == "drift")
    assert "would show" in quiet.reason


def test_a_constant_that_is_a_datum_is_not_listed():
    shifted = measured(lambda x, way, t, run: 0.006 * (way - 1.0))
    kept = [(BACKLASH, Shape()), (OFFSET, Shape())]
    result = verdict_on(state_of(shifted, kept))
    assert result.effects == ("backlash",)
    assert result.model.datum == pytest.approx(-0.006, abs=0.001)
    assert any("set to zero" in note for note in result.notes)
    own = verdict_on(state_of(measured(lambda x, way, t, run: 0.006 * way + 0.05), kept))
    assert set(own.effects) == {"backlash", "offset"}


def test_notes_say_what_the_data_lack():
    once = verdict_on(state_of(replace(measured(runs=1), notes=("the file was short",))))
    assert once.notes[0] == "the file was short"
    assert any("no noise floor" in note for note in once.notes)
    assert not any("no noise floor" in note for note in verdict_on(state_of(measured())).notes)


def test_nearly_significant_effects_make_a_search_inconclusive():
    """A reversal error at the brink: with one test p lies between 0.01 and 0.05."""
    data = measured(timed=False)
    way = data.conditions.direction
    free = data.observed - way * float(way @ data.observed) / 210
    for z, brink in ((2.25, True), (1.0, False)):
        brinkish = replace(data, observed=free + way * z * SIGMA / np.sqrt(210))
        state = state_of(brinkish, tests=1.0)
        state.workspace.library = (BACKLASH,)
        result = verdict_on(state)
        assert any("was not accepted" in note for note in result.notes) is brink


def test_lack_of_fit_is_told_by_what_was_looked_at():
    names = {name for name, _ in verdict_on(state_of(measured())).lack_of_fit}
    assert names == {"means over repeats", "changes in time", "changes in direction", "changes in position"}
    assert verdict_on(state_of(measured(runs=1))).lack_of_fit == ()


def test_nothing_testable_says_why_of_each_effect():
    state = state_of(measured())
    result = nothing_testable(state, state.start, constant=False)
    assert result.verdict is Verdict.NOT_TESTABLE
    assert dict(result.not_testable)["thermal_growth"] == "no temperature column"
    assert "scale" not in dict(result.not_testable)
    other = replace(state, heldout=measured(seed=4))
    judged_on = nothing_testable(other, state.start, constant=True)
    assert judged_on.rms_heldout == pytest.approx(np.sqrt(np.mean(other.heldout.observed**2)))
    assert judged_on.heldout_by == other.heldout.source
    assert "scale" in dict(judged_on.not_testable)


def test_what_was_tried_and_taken_out_says_so():
    data = measured(lambda x, way, t, run: 0.006 * way)
    other = measured(seed=4)
    result = diagnose(data, heldout=other)
    tried = next(c for c in result.candidates if c.effect == "backlash")
    assert tried.reason.startswith("tried and taken out again")
    assert not tried.accepted
    assert tried.achieved_rms is None
