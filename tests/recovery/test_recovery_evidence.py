"""Evidence beyond right and wrong: periods, coverage, calibration, and games that are written down and compared."""

import dataclasses
import json

import pytest

from rtec.blind.answer import Answer, Rule
from rtec.blind.confusion import confusion
from rtec.blind.game import play
from rtec.blind.line import Line
from rtec.blind.plan import PLANS
from rtec.blind.scenario import OF_AIR, OF_HEAT, Scenario
from rtec.dataset.load import load_dataset
from rtec.effects import effect_named
from rtec.inference.compare import compare
from rtec.inference.fit import values_of
from rtec.inference.model import Model, Term
from rtec.inference.results import Value
from tools.evidence import TRUTHS, Belief, Evidence, ExaminedGame, Figure, Wave, deciles_of, evidence, figures_of
from tools.record import appending, game_line, going_on, read_games

GAME = ExaminedGame(trial=0, seed=1, plan="base", hidden="nothing", said="NONE", right=True, examined=Evidence())


def wave(found, error=None):
    return Wave(effect="cyclic", found_mm=found, error_mm=error, truth_mm=20.0)


def test_a_period_is_right_within_half_a_percent_or_two_and_a_half_errors():
    assert [wave(20.1).right, wave(20.11).right, wave(19.9).right] == [True, False, True]
    assert [wave(20.5, 0.2).right, wave(20.51, 0.2).right, wave(20.1, 0.001).right] == [True, False, True]


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


LINE = Line(
    title="a line", rule=Rule.NAMED, share=0.5, scenarios=(Scenario(names=("scale",), plan=PLANS["single_pass"]),)
)
VALUED = Answer(
    "NAMED", ("scale",), values=(("scale", (Value("scale", 70.0, 1.0, "um/m"),)),), probability={"scale": 0.99}
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
