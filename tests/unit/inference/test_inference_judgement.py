"""What a finished search comes to."""

from dataclasses import replace

import numpy as np
import pytest
from inference_oracle import SIGMA, measured, pushed

from rtec.effects import Shape, effect_named
from rtec.inference.diagnose import diagnose, nothing_testable
from rtec.inference.finding import Finding, in_order
from rtec.inference.fit import values_of
from rtec.inference.judgement import _verdict, judged
from rtec.inference.model import Model
from rtec.inference.probes import Probe
from rtec.inference.results import Outlier, Unknown, Verdict
from rtec.inference.scored import Judge
from rtec.inference.search import Search
from rtec.inference.space import Space

SCALE, BACKLASH, WINDUP = (effect_named(n) for n in ("scale", "backlash", "windup"))
ODD = Unknown(depends_on=("run",), period=None, frequency_hz=None, description="")
TILTED = lambda x, way, t, run: 5e-5 * x + 0.004 * way
BOTH = [(SCALE, Shape()), (BACKLASH, Shape())]


def finding(data, choices=(), given=(), **changes):
    """As if a search had found some effects, each of them for sure."""
    search = Search(Judge(Space(data)), tuple(given))
    model = search.judge.score(choices)
    facts = {
        "search": search,
        "model": model,
        "scout": search,
        "scouted": model,
        "begun": Model(observe=data.observe, units=data.units),
        "probability": dict.fromkeys(model.names, 1.0),
    }
    return Finding(**(facts | changes))


@pytest.mark.parametrize(
    ("unknown", "tied", "found", "floor", "inconclusive", "verdict"),
    [
        (ODD, True, True, True, True, Verdict.UNKNOWN),
        (None, True, True, True, True, Verdict.TIED),
        (None, False, True, True, True, Verdict.NAMED),
        (None, False, True, False, True, Verdict.LIKELY),
        (None, False, False, True, True, Verdict.INCONCLUSIVE),
        (None, False, False, True, False, Verdict.NONE),
    ],
)
def test_the_order_of_verdicts(unknown, tied, found, floor, inconclusive, verdict):
    assert _verdict(unknown, tied, found, floor, inconclusive) is verdict


def test_named_asks_for_a_floor_from_repeats():
    assert judged(finding(measured(TILTED), BOTH)).verdict is Verdict.NAMED
    once = judged(finding(measured(TILTED, runs=1), BOTH))
    assert once.verdict is Verdict.LIKELY
    assert once.noise.floor is None
    assert any("no noise floor" in note for note in once.notes)
    assert "repeat the same targets" in once.experiment.text


def test_an_effect_that_may_be_there_makes_nothing_inconclusive():
    result = judged(finding(measured(), probability={"backlash": 0.6}))
    assert result.verdict is Verdict.INCONCLUSIVE
    assert next(c for c in result.candidates if c.effect == "backlash").probability == pytest.approx(0.6 * 0.96)
    assert judged(finding(measured(), probability={"backlash": 0.1})).verdict is Verdict.NONE


def test_effects_stand_in_the_order_of_what_each_foretells():
    data = measured(lambda x, way, t, run: 2e-5 * x + 0.01 * way)
    names = lambda ordered: [effect.name for effect, _ in ordered[1]]
    assert names(in_order(finding(data, BOTH))) == ["backlash", "scale"]
    assert names(in_order(finding(data, BOTH, given=BOTH[:1]))) == ["scale", "backlash"]


def test_the_staircase_is_that_of_nested_fits():
    data = measured(lambda x, way, t, run: 2e-5 * x + 0.01 * way)
    result = judged(finding(data, BOTH))
    constant, way, x = np.ones(210), data.conditions.direction, data.conditions.position
    for step, columns in zip(result.steps, ([constant, way], [constant, way, x]), strict=True):
        table = np.array(columns).T
        left = data.observed - table @ np.linalg.lstsq(table, data.observed)[0]
        assert step.rms_train == pytest.approx(np.sqrt(np.mean(left**2)), rel=0.04)  # zeros of runs beside
        assert step.gain > 0.0
        assert step.p_adjusted < 0.01
    assert [step.effect for step in result.steps] == ["backlash", "scale"]
    assert result.rms_before == pytest.approx(np.sqrt(np.mean(data.observed**2)))
    assert result.rms_after == result.steps[-1].rms_train
    assert result.rms_heldout == result.steps[-1].rms_heldout
    assert SIGMA * 0.8 < result.rms_heldout < result.rms_heldout_before
    first = next(c for c in result.candidates if c.effect == "backlash")
    assert first.achieved_rms == result.steps[0].rms_train


def test_every_testable_effect_is_listed_once_with_a_reason():
    found = finding(measured(TILTED), BOTH)
    result = judged(found)
    names = [c.effect for c in result.candidates]
    assert len(set(names)) == len(names)
    library = {e.name for e in found.search.space.library if not isinstance(e, Probe)}
    assert set(names) == library | {"cosine"}
    assert all(c.reason for c in result.candidates)
    reasons = found.search.space.reasons
    assert dict(result.not_testable) == {name: why for name, why in reasons.items() if why is not None}
    assert all(0.0 <= c.p_adjusted <= 1.0 for c in result.candidates)
    assert {c.effect for c in result.candidates if c.accepted} == {"scale", "backlash"}
    quiet = next(c for c in result.candidates if c.effect == "drift")
    assert "not significant; it would be detected from" in quiet.reason


def test_a_constant_within_what_the_effects_go_through_is_a_datum():
    """The instrument was set to zero at the first reading, at one end of the reversal error."""
    result = judged(finding(measured(lambda x, way, t, run: 0.006 * (way - 1.0)), [(BACKLASH, Shape())]))
    assert result.effects == ("backlash",)
    assert result.model.datum == pytest.approx(-0.006, abs=0.001)
    assert "offset" not in {c.effect for c in result.candidates}


def test_a_constant_beyond_that_is_an_offset():
    result = judged(finding(measured(lambda x, way, t, run: 0.006 * way + 0.05), [(BACKLASH, Shape())]))
    assert result.effects == ("offset", "backlash")
    assert result.model.datum == 0.0
    assert result.model.terms[0].amplitudes[0] == pytest.approx(0.05, abs=0.001)
    assert result.steps[0].effect == "offset"
    assert result.steps[0].p_adjusted < 0.01
    assert result.probability["offset"] > 0.99


def test_outliers_are_listed_in_a_note():
    many = tuple(Outlier(row, 0.1) for row in range(3, 15))
    (note,) = [n for n in judged(finding(measured(), outliers=many)).notes if "outliers" in n]
    assert "readings 3, 4, 5, 6, 7, 8, 9, 10 and 4 more" in note
    assert judged(finding(measured(), outliers=many)).outliers == many


@pytest.mark.parametrize(("distance", "end"), [(60.0, "longest"), (1.5, "shortest"), (20.0, None)])
def test_a_parameter_at_its_bound_is_said_to_be(distance, end):
    """Wind-up is looked for up to a fifth of the span, and from half the shortest distance on."""
    at = np.linspace(0.0, 300.0, 101)
    shapes = Space(measured(at=at)).shapes(WINDUP)[0]
    built = max(s.distance for s in shapes) if end == "longest" else min(s.distance for s in shapes)
    shape = WINDUP.shape_type(built if end else distance)
    data = measured(lambda x, way, t, run: 0.004 * way, at=at, runs=2)
    notes = [note for note in judged(finding(data, [(WINDUP, shape)])).notes if "windup: its distance" in note]
    assert len(notes) == (end is not None)
    if end:
        assert f"is at the {end} that was searched; the true value may lie beyond" in notes[0]


def test_a_force_with_the_wrong_sign_is_asked_about():
    for sign, asked in ((1.0, False), (-1.0, True)):
        result = diagnose(pushed(sign, seconds=8.0))
        questions = [note for note in result.notes if "is the sign of force opposite" in note]
        assert bool(questions) is asked
        assert ("coulomb" in result.effects) is not asked


def test_periods_that_the_targets_cannot_show_are_told_and_shifted():
    at = 15.0 * np.arange(21.0)
    result = judged(finding(measured(at=at), []))
    assert result.unseen_periods == ("15 mm / k",)
    assert "shift the targets by" in result.experiment.text
    assert judged(finding(measured(), [])).unseen_periods == ()


def test_nothing_testable_says_why_of_each_effect():
    data = measured(at=np.array([10.0]), runs=4, bidirectional=False, timed=False)
    search = Search(Judge(Space(data)))
    begun = Model(observe="deviation", units=data.units)
    result = nothing_testable(search, begun)
    assert result.verdict is Verdict.NOT_TESTABLE
    assert dict(result.not_testable)["thermal_growth"] == "no temperature column"
    assert dict(result.not_testable)["scale"] == "one position only"
    assert result.rms_before == result.rms_after == pytest.approx(np.sqrt(np.mean(data.observed**2)))
    still = replace(data, observed=np.full(data.rows, 0.003))
    constant = nothing_testable(Search(Judge(Space(still))), begun)
    assert set(dict(constant.not_testable).values()) == {"the observed column never changes"}
    assert "recorded at all" in constant.experiment.text


def test_runs_that_differ_by_a_constant_each_are_named():
    zero = {1: 0.0, 2: 0.4, 3: -0.3, 4: 0.1}
    data = measured(lambda x, way, t, run: TILTED(x, way, t, run) + np.vectorize(zero.get)(run), runs=4)
    result = diagnose(data)
    assert set(result.effects) == {"scale", "backlash", "run_offset"}
    (found,) = [values_of(term, result.model) for term in result.model.terms if term.name == "run_offset"]
    assert {v.name: v.value for v in found} == pytest.approx({"run_2": 400, "run_3": -300, "run_4": 100}, abs=3.0)
    assert all(abs(v.value - 1e3 * zero[int(v.name[4:])]) < 4.0 * v.error for v in found)
    assert result.noise.sigma == pytest.approx(SIGMA, rel=0.15)
    assert "run_offset" not in diagnose(measured(TILTED, runs=4)).effects
