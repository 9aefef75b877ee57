"""rtec blind: a game is played, opened and scored."""

import json
import shutil

import pytest

from rtec.blind import kept_answers, lines as published
from rtec.blind.answer import Rule
from rtec.blind.line import Line
from rtec.blind.scenario import Scenario, scenario_of
from rtec.blind.sealing import reveal
from rtec.cli import main
from rtec.errors import OutputError

VERB = "blind"


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_a_game_is_sealed_and_opened(here, said, answer):
    code, out, err = said("new", "--seed", "7", "-o", "data.csv")
    assert (code, err) == (0, "")
    assert "data.csv.sealed" in out
    names = reveal("data.csv").names
    data = (here / "data.csv").read_text() + out
    assert not [name for name in names if name in data]
    code, out, _ = said("reveal", "data.csv")
    assert code == 0
    assert all(name in out for name in names)
    document = answer("reveal", "data.csv")
    assert ([effect["name"] for effect in document["effects"]], document["seed"]) == (list(names), 7)


def test_a_game_with_nothing_in_it_says_so(here, said):
    seed = next(seed for seed in range(1000) if not scenario_of(seed).names)
    assert said("new", "--seed", seed, "-o", "data.csv")[0] == 0
    assert "Nothing is hidden" in said("reveal", "data.csv")[1]


def test_nothing_is_overwritten_without_force(here, said, refused):
    (here / "data.csv.sealed").write_text("mine")
    assert "--force" in refused("new", "-o", "data.csv")
    assert not (here / "data.csv").exists()
    assert (here / "data.csv.sealed").read_text() == "mine"
    assert said("new", "-o", "data.csv", "--force")[0] == 0


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["reveal"], "'rtec blind reveal --help'"),
        (["measure", "data.csv", "--plan", "p.toml", "-o", "b.csv"], "data.csv"),
        (["measure", "data.csv", "-o", "b.csv"], "'--plan'"),
        (["measure", "data.csv", "--plan", "p.toml", "-o", "b.csv", "--seed", "0"], "--seed"),
        (["new", "-o", "a.csv", "--hide", "driftt"], "did you mean 'drift'?"),
        (["new", "-o", "a.csv", "--hide", "servo_lag=1 ms"], "it shows in the plans moving"),
        (["new", "-o", "a.csv", "--hide", "backlash=3"], "such as backlash='5 um'"),
        (["new", "-o", "a.csv", "--hide", "backlash=3 mm"], "--hide: backlash=3000 um"),
        (["guess", "data.csv", "drift=3 um"], "such as drift='5 um/h'"),
        (["guess", "data.csv", "drift", "--by", "x" * 81], "--by"),
        (["score", "data.csv"], "data.csv"),
        (["score", "data.csv", "--trials", "3"], "--trials does not go with the data of a game"),
        (["new", "-o", "a.csv", "--hide", "drift", "--plan", "bas"], "--plan: 'bas'"),
        (["new", "-o", "a.csv", "--plan", "base"], "needs --hide"),
        (["new", "-o", "a.csv", "--effects", "none.py"], "--effects: none.py"),
        (
            ["guess", "data.csv", "dent=3 um"],
            "'dent' is not an effect; use effects of 'rtec effects' or of --effects",
        ),
        (["new", "--seed", "-1", "-o", "a.csv"], "--seed"),
        (["score", "--trials", "1000000"], "--trials"),
        (["score", "--jobs", "1000"], "--jobs"),
        (["reveel"], "did you mean 'reveal'?"),
    ],
)
def test_bad_words_are_one_line_and_2(here, refused, words, says):
    assert says in refused(*words)
    assert list(here.iterdir()) == []


def lines_for(share):
    """One easy line, so that a score takes seconds: a backlash of 10 sigma."""
    hidden = (Scenario(names=("backlash",), strength_sigma=10.0),)
    return (
        Line(title="plain to see", rule=Rule.NAMED, share=share, scenarios=hidden),
        Line(title="down to the floor", rule=Rule.FLOOR, share=share, scenarios=hidden),
    )


def test_the_score_is_that_of_the_diagnosis(here, said, monkeypatch):
    monkeypatch.setattr(published, "the_lines", lambda: lines_for(0.5))
    code, out, err = said("score", "--trials", "2", "--seed", "1", "--json", "-o", "score.md")
    assert (code, err, out.count("\n")) == (0, "", 1)
    document = json.loads(out)
    named, floor = document["lines"]
    assert (named["right"], named["trials"], named["reached"]) == (2, 2, True)
    assert named["confusion"] == [{"hidden": "backlash", "answered": "backlash", "count": 2}]
    assert named["wilson_95"] == pytest.approx([0.3424, 1.0], abs=1e-4)  # Wilson's interval of 2 of 2
    assert [game["trial"] for game in named["games"]] == [0, 1]
    assert len({game["seed"] for game in named["games"]}) == 2
    assert (floor["right"], floor["confusion"][0]["answered"]) == (2, "at the floor")
    assert (document["trials"], document["seed"], document["table"]) == (2, 1, "score.md")
    assert "plain to see" in (here / "score.md").read_text()
    monkeypatch.setattr(published, "the_lines", lambda: lines_for(0.5)[:1])
    code, out, _ = said("score", "--trials", "1")
    assert code == 0
    assert out == out.rstrip("\n") + "\n"
    assert "| plain to see |" in out


def test_a_missed_bar_is_1(here, said, monkeypatch):
    nothing = (Scenario(names=()),)
    missed = (Line(title="cannot be", rule=Rule.UNKNOWN, share=0.5, scenarios=nothing),)
    monkeypatch.setattr(published, "the_lines", lambda: missed)
    code, out, _ = said("score", "--trials", "1", "--json")
    assert code == 1
    assert json.loads(out)["lines"][0]["reached"] is False


@pytest.fixture(scope="module")
def played(tmp_path_factory):
    data = tmp_path_factory.mktemp("played") / "data.csv"
    words = ["--seed", "5", "--hide", "thermal_growth", "--plan", "one_heating", "-o", str(data)]
    assert main(["blind", "new", *words]) == 0
    return data.parent


@pytest.fixture
def poor(here, played):
    """A game of a poor plan lies here as data.csv, with its seal."""
    shutil.copytree(played, here, dirs_exist_ok=True)


@pytest.mark.usefixtures("poor")
def test_twice_round_the_loop_from_the_command_line(here, said, capsys):
    code, out, _ = run_diagnose(capsys, "data.csv", "--suggest", "plan.toml", "--json")
    document = json.loads(out)
    assert (code, document["verdict"], document["plan"]) == (0, "TIED", "plan.toml")
    text = (here / "plan.toml").read_text()
    assert text.startswith("# ")
    assert document["suggested_experiment"].split()[:6] == text.split()[1:7]
    code, out, err = said("measure", "data.csv", "--plan", "plan.toml", "-o", "second.csv", "--json")
    assert (code, err) == (0, "")
    assert json.loads(out) == {"data": "second.csv", "sealed": "second.csv.sealed", "plan": "plan.toml"}
    assert "thermal_growth" not in (here / "second.csv").read_text()
    assert [one.name for one in reveal("second.csv").effects] == ["thermal_growth"]
    second = json.loads(run_diagnose(capsys, "second.csv", "--json")[1])
    assert (second["verdict"], second["effects"]) == ("NAMED", ["thermal_growth"])
    # a second measurement is measured again as the first was
    assert said("measure", "second.csv", "--plan", "plan.toml", "-o", "third.csv")[0] == 0
    second, third = ((here / name).read_text().splitlines() for name in ("second.csv", "third.csv"))
    assert (second[:4], len(second)) == (third[:4], len(third))
    assert second[10] != third[10]


def run_diagnose(capsys, *words):
    code = main(["diagnose", *words])
    out, err = capsys.readouterr()
    return code, out, err


@pytest.mark.usefixtures("poor")
@pytest.mark.parametrize(
    ("plan", "says"),
    [
        ('[targets]\nstart = "5 mm"\n', "plan.toml: targets.start: 5 mm"),
        ('[runs]\nfeeds = ["1 m/s"]\n', "plan.toml: runs.feeds: 1000 mm/s"),
        ("[runs]\nnumbr = 3\n", "did you mean 'number'"),
        ("runs = \n", "plan.toml"),
    ],
)
def test_a_plan_that_cannot_be_carried_out_is_one_line_and_2(here, refused, plan, says):
    (here / "plan.toml").write_text(plan)
    assert says in refused("measure", "data.csv", "--plan", "plan.toml", "-o", "second.csv")
    assert not list(here.glob("second*"))


@pytest.mark.usefixtures("poor")
def test_a_measurement_writes_over_nothing_and_needs_its_seal(here, said):
    (here / "plan.toml").write_text("[runs]\nnumber = 2\n")
    (here / "second.csv").write_text("mine")
    words = ("measure", "data.csv", "--plan", "plan.toml", "-o")
    code, _, err = said(*words, "second.csv")
    assert (code, err.count("\n")) == (2, 1)
    assert "--force" in err
    code, _, err = said(*words, "data.csv", "--force")
    assert code == 2
    assert "another file" in err
    assert said(*words, "second.csv", "--force")[0] == 0
    (here / "data.csv.sealed").unlink()
    code, _, err = said(*words, "third.csv")
    assert (code, err.count("\n")) == (2, 1)
    assert "data.csv.sealed" in err


@pytest.mark.usefixtures("poor")
def test_an_answer_is_scored(here, said, refused):
    code, out, err = said("guess", "data.csv", "thermal_growth")
    assert (code, err) == (0, "")
    assert out.startswith("Solved.\nRight: thermal_growth\nPoints: 2 of 3\n")
    code, out, err = said("guess", "data.csv", "drift", "thermal_shift", "--json")
    assert (code, err, out.count("\n")) == (1, "", 1)
    assert json.loads(out) == {
        "data": "data.csv", "solved": False, "right": [], "missed": ["thermal_growth"],
        "wrong": ["drift", "thermal_shift"], "points": 0, "most_points": 3, "by": "", "number": 2,
        "kept": "data.csv.answers",
        "reasons": ["0 of 3: thermal_growth is missed", "-1 of 0: drift is not hidden",
                    "-1 of 0: thermal_shift is not hidden"],
    }  # fmt: skip
    code, out, _ = said("guess", "data.csv", "nothing")
    assert code == 1
    assert out.startswith("Not solved.\nMissed: thermal_growth\nPoints: 0 of 3\n")
    assert "did you mean 'drift'" in refused("guess", "data.csv", "drfit")


def test_the_answers_of_a_class_are_kept_and_shown(here, said, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    said("new", "-o", "data.csv", "--hide", "backlash=10 um", "--seed", "5")
    assert "no answers yet" in said("score", "data.csv")[1]
    for by, *words in (("Ada", "backlash=10.5 um"), ("Bo", "drift"), ("Bo", "backlash")):
        code, out, _ = said("guess", "data.csv", *words, "--by", by)
        assert code == (1 if words == ["drift"] else 0)
    assert "Kept: answer 3 in data.csv.answers" in out
    code, out, _ = said("score", "data.csv")
    assert code == 0
    assert "(2 of 3)" in out
    assert max(map(len, out.splitlines())) <= 80
    (here / "data.csv.answers").write_text((here / "data.csv.answers").read_text().replace("e", "f", 1))
    code, _, err = said("score", "data.csv")
    assert (code, err.count("\n")) == (2, 1)
    assert "was changed" in err


@pytest.mark.usefixtures("poor")
def test_an_answer_that_cannot_be_kept_is_scored(here, said, refused, monkeypatch):
    def refused(data, answer):
        raise OutputError("data.csv.answers: cannot be written: Read-only file system")

    monkeypatch.setattr(kept_answers, "keep", refused)
    code, out, err = said("guess", "data.csv", "thermal_growth", "--json")
    assert (code, json.loads(out)["kept"], json.loads(out)["number"]) == (0, None, None)
    assert err == "rtec: not kept: data.csv.answers: cannot be written: Read-only file system\n"


MINE = """
import numpy as np
import rtec


@rtec.effect(over="position")
def dent(position, *, place: rtec.Within(0, 500, "mm"), width: rtec.Within(2, 40, "mm")):
    return np.exp(-(((position - place) / width) ** 2))
"""


@pytest.fixture
def mine(here):
    (here / "mine.py").write_text(MINE)
    return "--effects", "mine.py"


def test_an_effect_of_ones_own_is_hidden_found_and_guessed(here, said, answer, refused, mine, capsys):
    assert said("new", *mine, "--hide", "dent=12 um", "--seed", "3", "-o", "data.csv")[0] == 0
    assert (reveal("data.csv").names, "dent" in (here / "data.csv").read_text()) == (("dent",), False)
    found = json.loads(run_diagnose(capsys, "data.csv", *mine, "--json")[1])
    assert (found["verdict"], found["effects"]) == ("NAMED", ["dent"])
    document = answer("guess", "data.csv", *mine, "dent=12 um")
    assert (document["solved"], document["points"]) == (True, 3)
    assert answer("score", "data.csv")["games"][0]["answers"][0]["points"] == 3
    (here / "plan.toml").write_text("[runs]\nnumber = 3\n")
    words = ("measure", "data.csv", "--plan", "plan.toml", "-o", "second.csv")
    assert "give its file with --effects" in refused(*words)
    assert said(*words, *mine)[0] == 0
    first, second = (answer("reveal", name)["effects"][0]["parameters"] for name in ("data.csv", "second.csv"))
    assert first == second


def test_without_hide_one_of_ones_own_effects_is_hidden(said, mine):
    for seed in (1, 2):
        assert said("new", *mine, "--seed", seed, "-o", f"{seed}.csv")[0] == 0
        assert "dent" in reveal(f"{seed}.csv").names


def test_an_effect_of_ones_own_that_the_plan_cannot_show_is_one_line_and_2(here, refused, mine):
    words = ("new", *mine, "-o", "a.csv", "--hide", "dent", "--plan")
    assert "--hide: dent cannot be seen with the plan drive" in refused(*words, "drive")
    assert "own effects are hidden in readings at rest; it shows in the plans base" in refused(*words, "moving")
    assert [path.name for path in here.iterdir()] == ["mine.py"]
