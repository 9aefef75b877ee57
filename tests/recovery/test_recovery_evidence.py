"""Evidence beyond right and wrong: periods, coverage, calibration, and games that are written down and compared."""

import dataclasses
import itertools
import json
import math

import pytest

from rtec.blind.answer import Answer, Rule
from rtec.blind.confusion import confusion
from rtec.blind.game import play
from rtec.blind.hidden import Hidden, Parameter, Secret
from rtec.blind.line import Line
from rtec.blind.plan import PLANS
from rtec.blind.scenario import OF_AIR, OF_HEAT, Scenario
from rtec.dataset.load import load_dataset
from rtec.effects import effect_named
from rtec.errors import FileFormatError
from rtec.inference.compare import compare
from rtec.inference.fit import values_of
from rtec.inference.model import Model, Term
from rtec.inference.results import Value
from tools.evidence import (
    TRUTHS,
    Belief,
    Evidence,
    ExaminedGame,
    Figure,
    Wave,
    beliefs_of,
    deciles_of,
    evidence,
    figures_of,
    waves_of,
)
from tools.record import appending, comparison, game_line, going_on, mcnemar, paired, read_games

GAME = ExaminedGame(trial=0, seed=1, plan="base", hidden="nothing", said="NONE", right=True, examined=Evidence())


def secret(name, **numbers):
    parameters = tuple(Parameter(key, value, "") for key, value in numbers.items())
    hidden = Hidden(name=name, description="", parameters=parameters, rms_sigma=3.0)
    return Secret(effects=(hidden,), noise="white", sigma_um=2.0, seed=0, plan="base", outside=())


def answer(name, *values, **more):
    return Answer("NAMED", (name,), values=((name, values),), **more)


def wave(found, error=None):
    return Wave(effect="cyclic", found_mm=found, error_mm=error, truth_mm=20.0)


def test_a_period_is_right_within_half_a_percent_or_two_and_a_half_errors():
    assert [wave(20.1).right, wave(20.11).right, wave(19.9).right] == [True, False, True]
    assert [wave(20.5, 0.2).right, wave(20.51, 0.2).right, wave(20.1, 0.001).right] == [True, False, True]


def test_a_multiple_is_told_from_a_wrong_period():
    assert [wave(period).multiple for period in (20.0, 40.1, 59.9, 50.0, 10.0)] == [False, True, True, False, False]


def test_only_what_was_hidden_and_named_is_evidence():
    hidden = secret("cyclic", period=20.0, amplitude=3.0)
    period = Value("period", 20.05, 0.1, "mm")
    assert waves_of(answer("cyclic", period), hidden) == (
        Wave(effect="cyclic", found_mm=20.05, error_mm=0.1, truth_mm=20.0),
    )
    assert waves_of(answer("drift", period), hidden) == ()
    assert waves_of(answer("cyclic", period), secret("drift", rate=1.0)) == ()
    assert waves_of(answer("cyclic", Value("period", 20.05, math.nan, "mm")), hidden)[0].error_mm is None


def test_numbers_are_compared_in_the_same_unit_and_with_the_same_sign():
    hidden = secret("backlash", play=12.0)
    found = figures_of(answer("backlash", Value("backlash", -12.5, 0.3, "um")), hidden)
    assert found == (Figure(name="backlash.backlash", found=-12.5, error=0.3, truth=-12.0),)
    assert found[0].covered
    assert not dataclasses.replace(found[0], error=0.2).covered
    assert figures_of(answer("backlash", Value("backlash", -0.0125, 0.3, "mm")), hidden) == ()
    assert figures_of(answer("backlash", Value("backlash", -12.5, None, "um")), hidden) == ()


PLAN_OF = dict.fromkeys(OF_HEAT, "temperature") | dict.fromkeys(OF_AIR, "weather")
PLAN_OF |= {"load_friction": "loads"}
SHORT_DRIVE = dataclasses.replace(PLANS["drive"], runs=1, targets=24)
KNOWN = sorted({effect for effect, _ in TRUTHS})


@pytest.mark.parametrize("name", KNOWN)
def test_the_game_and_the_library_mean_the_same_numbers(name):
    drive = name in ("inertia", "viscous", "coulomb", "stribeck", "force_offset")
    names = ("coulomb", "stribeck") if name == "stribeck" else (name,)
    plan = SHORT_DRIVE if drive else PLANS[PLAN_OF.get(name, "base")]
    measurement, hidden = play(Scenario(names=names, strength_sigma=5.0, plan=plan), 4)
    dataset = load_dataset(measurement)
    terms = tuple(Term(effect=effect_named(one)) for one in names)
    fitted = compare(dataset, Model(observe=dataset.observe, units=dataset.units, terms=terms)).model
    known = Answer("NAMED", names, values=tuple((term.name, values_of(term, fitted)) for term in fitted.terms))
    numbers = {one.name: one for one in figures_of(known, hidden) if one.name.startswith(name)}
    assert set(numbers) == {f"{effect}.{number}" for effect, number in TRUTHS if effect == name}
    for one in numbers.values():
        # the library smooths a log, and with it the steps of dry friction
        assert one.found == pytest.approx(one.truth, rel=0.15)


def test_probabilities_are_those_of_what_was_accepted():
    told = Answer("UNKNOWN", ("drift", "scale", "offset"), probability={"drift": 0.9, "offset": 1.0, "cyclic": 0.2})
    assert beliefs_of(told, secret("drift", rate=1.0)) == (Belief(effect="drift", probability=0.9, right=True),)
    assert not beliefs_of(told, secret("scale", scale=1.0))[0].right
    assert beliefs_of(Answer("NAMED", ("drift",)), secret("drift", rate=1.0)) == ()


def test_tenths_are_calibrated_where_there_are_a_hundred_cases():
    def tenth(cases, right, probability=0.95):
        given = [Belief(effect="drift", probability=probability, right=number < right) for number in range(cases)]
        return deciles_of(given)[0]

    assert tenth(100, 95).calibrated is True
    assert tenth(100, 90).calibrated is True
    assert tenth(100, 89).calibrated is False
    assert tenth(99, 0).calibrated is None
    assert (tenth(3, 1, 0.0).number, tenth(3, 1, 0.1).number, tenth(3, 1, 1.0).number) == (0, 1, 9)


def test_evidence_counts_right_answers_for_numbers_and_all_games_for_probabilities():
    belief = Belief(effect="drift", probability=0.95, right=False)
    figure = Figure(name="drift.rate", found=1.0, error=0.1, truth=1.1)
    good = dataclasses.replace(GAME, examined=Evidence(waves=(wave(20.0), wave(40.0)), figures=(figure,)))
    bad = dataclasses.replace(GAME, right=False, examined=Evidence(waves=(wave(9.0),), beliefs=(belief,) * 100))
    text = "\n".join(evidence([good, bad]))
    assert "| right | at least 98% | 1 of 2 | 50.0% |" in text
    assert "| a multiple of the true one | at most 1% | 1 of 2 | 50.0% |" in text
    assert "| all numbers | 90% to 98% | 1 of 1 | 100.0% | 20.7% to 100.0% | missed |" in text
    assert "| drift.rate | | 1 of 1 |" in text
    assert "| 0.9 to 1.0 | 0.950 | 0 of 100 | 0.0% | 0.0% to 3.7% | missed |" in text
    empty = "\n".join(evidence([]))
    assert empty.count("no case") == 3
    assert "The diagnosis gave no probability." in empty


def test_mcnemar_is_two_sided_and_exact():
    assert mcnemar(0, 0) == 1.0
    assert mcnemar(1, 9) == mcnemar(9, 1) == pytest.approx(2 * 11 / 1024)
    assert mcnemar(500, 600) == pytest.approx(0.00284, rel=0.02)  # beyond the largest float


LINE = Line(
    title="a line", rule=Rule.NAMED, share=0.5, scenarios=(Scenario(names=("scale",), plan=PLANS["single_pass"]),)
)
VALUED = Answer(
    "NAMED",
    ("scale",),
    values=(("scale", (Value("scale", 70.0, 1.0, "um/m"),)),),
    probability={"scale": 0.99},
)


def test_games_are_written_down_and_not_played_again(tmp_path):
    file = tmp_path / "games.jsonl"
    whole = confusion([LINE], 3, lambda _: VALUED, play=going_on({}, appending(file)))
    assert len(file.read_text().splitlines()) == 3
    with file.open("a") as torn:
        torn.write(game_line(LINE.title, whole.scores[0].games[0])[:40])
    known = read_games(file, 0)
    assert known == {("a line", game.trial): game for game in whole.scores[0].games}
    asked = []
    more = confusion([LINE], 5, lambda m: (asked.append(m), VALUED)[1], play=going_on(known, appending(file)))
    assert len(asked) == 2
    assert [json.loads(line)["trial"] for line in file.read_text().splitlines()] == [0, 1, 2, 3, 4]
    assert more == confusion([LINE], 5, lambda _: VALUED, play=going_on({}))


def test_a_record_of_other_games_is_refused(tmp_path):
    file = tmp_path / "games.jsonl"
    assert read_games(file, 0) == {}
    confusion([LINE], 1, lambda _: VALUED, play=going_on({}, appending(file)))
    with pytest.raises(FileFormatError, match="not played with --seed 1"):
        read_games(file, 1)
    file.write_text(file.read_text() + "{}\n")
    with pytest.raises(FileFormatError, match="no game"):
        read_games(file, 0)


def test_games_left_out_are_replaced_whether_known_or_not(tmp_path):
    file = tmp_path / "games.jsonl"
    line = dataclasses.replace(LINE, above_detectable=True)

    def judge(answers):
        return lambda _: Answer("NAMED", ("scale",), detectable_um={"scale": next(answers)})

    def play_on(answers, trials, known):
        given = confusion([line], trials, judge(answers), patience=3, play=going_on(known, appending(file)))
        return given.scores[0]

    first = play_on(itertools.cycle([99.0, 0.1]), 2, {})
    assert (first.trials, first.left_out, len(first.games)) == (2, 2, 4)
    second = play_on(itertools.repeat(0.1), 3, read_games(file, 0))
    assert (second.trials, second.left_out, len(second.games)) == (3, 2, 5)


def test_two_judges_are_compared_on_the_games_that_count_with_both():
    def games(*rights):
        return {("a line", n): dataclasses.replace(GAME, trial=n, right=right) for n, right in enumerate(rights)}

    pairs = paired(games(True, True, False, None, True), games(True, False, True, True), ["a line", "another"])
    assert pairs == [("a line", [(True, True), (True, False), (False, True)]), ("another", [])]
    rows = comparison(pairs)
    assert rows[2] == "| a line | 3 | 66.7% | 66.7% | 1 | 1 | 1 |"
    assert rows[3] == "| another | 0 | none | none | 0 | 0 | 1 |"
