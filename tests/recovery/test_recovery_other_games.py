"""The second family of games: the same seed gives the same file, and the judge is fooled by no answer."""

import json
import re
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest

from tools.other_games import (
    ROUND,
    USELESS,
    Z_SEEN,
    calibration,
    counts,
    game_of,
    judged,
    mistakes,
    page,
    played,
    rows,
    wilson,
    with_useless,
)
from tools.other_worlds import CLASHES, OF_FORCE, OF_POSITION, OUTSIDE_AT_REST, OUTSIDE_IN_MOTION

PAGE = Path(__file__).parents[2] / "docs" / "other-games.md"
GAMES = [game_of(3, index) for index in range(5 * len(ROUND))]


def answer(verdict, *effects, tied=(), steps=(), **more):
    return {
        "verdict": verdict,
        "effects": list(effects),
        "probability": dict.fromkeys(effects, 0.97),
        "rms_before": 10.0,
        "steps": [{"effect": "x", "rms_train": rms} for rms in steps],
        "tied": {one: [other] for one, other in tied},
        **more,
    }


def table_of(game):
    lines = [line for line in game.text.splitlines() if line[0] != "#"]
    return lines[0].split(","), np.array([[float(cell) for cell in line.split(",")] for line in lines[1:]])


def test_a_seed_gives_the_same_game_and_another_seed_another():
    for index in range(len(ROUND)):
        assert game_of(3, index) == GAMES[index]
        assert game_of(4, index).text != GAMES[index].text


def test_every_file_has_a_row_a_reading_and_finite_numbers():
    for game in GAMES:
        names, numbers = table_of(game)
        assert numbers.shape == (game.detail["rows"], len(names))
        assert np.isfinite(numbers).all()
        assert len(set(names)) == len(names)


def test_known_games_hide_names_of_the_library_that_do_not_contain_each_other():
    for game in GAMES:
        assert bool(game.planted) == game.group.startswith("known")
        assert bool(game.outside) == game.group.startswith("outside")
        assert set(game.planted) <= set(OF_FORCE if "force_offset" in game.planted else OF_FORCE | OF_POSITION)
        assert not any({one, other} in CLASHES for one, other in combinations(game.planted, 2))
        assert len(game.planted) <= 4
    assert len(OUTSIDE_AT_REST) >= 20
    assert len(OUTSIDE_IN_MOTION) >= 20


def test_what_is_planted_is_seen_in_the_file():
    for game in GAMES:
        _, numbers = table_of(game)
        for ratio in game.detail["ratio"].values():
            assert ratio * np.sqrt(len(numbers)) > 0.3 * Z_SEEN or ratio < 1e-9  # a constant force


def test_useless_columns_leave_the_rest_as_it_is():
    for game in GAMES[:12]:
        more = with_useless(game.text, 1).splitlines()
        assert [line[: len(old)] for line, old in zip(more, game.text.splitlines(), strict=True)] == (
            game.text.splitlines()
        )
        head = next(line for line in more if line[0] != "#")
        assert head.endswith("," + ",".join(USELESS))


@pytest.mark.parametrize(
    ("planted", "outside", "given", "right"),
    [
        (["scale"], "", answer("NAMED", "scale"), True),
        (["scale"], "", answer("NAMED", "scale", "offset"), True),
        (["scale"], "", answer("NAMED"), False),
        (["scale"], "", answer("NAMED", "scale", "backlash"), False),
        (["scale"], "", answer("NAMED", "drift"), False),
        (["scale"], "", answer("TIED", "drift", tied=[("drift", "scale")]), True),
        (["scale"], "", answer("NAMED", "drift", tied=[("drift", "scale")]), False),
        (["scale"], "", answer("TIED", "drift", tied=[("drift", "warm_up")]), False),
        (["cyclic"], "", answer("NAMED", "eccentricity"), True),
        (["scale"], "", answer("NAMED", "scale", steps=[10.2]), False),
        (["scale"], "", answer("NAMED", "scale", steps=[10.05]), True),
        (["force_map"], "", answer("NAMED", "force_map", "force_offset"), True),
        (["coulomb"], "", answer("NAMED", "coulomb", "force_offset"), False),
        (["scale"], "", answer("ERROR"), False),
        ([], "", answer("ERROR"), False),
        ([], "", answer("NONE"), True),
        ([], "", answer("LIKELY", "drift"), False),
        ([], "", answer("UNKNOWN", "drift"), True),
        ([], "hunting", answer("TIED", "drift"), False),
        ([], "hunting", answer("UNKNOWN", "drift"), True),
    ],
)
def test_the_judge(planted, outside, given, right):
    assert judged(planted, outside, given)["right"] is right


def record(index, planted, outside, given, group="known warm", *, useless=False, plan="warm"):
    return {
        "index": index,
        "useless": useless,
        "group": group,
        "planted": planted,
        "outside": outside,
        "detail": {"plan": plan},
        "answer": given,
    }


def test_the_page_counts():
    records = [
        record(0, ["scale"], "", answer("NAMED", "scale")),
        record(1, ["scale"], "", answer("UNKNOWN", "drift")),
        record(0, ["scale"], "", answer("NAMED", "drift"), useless=True),
        record(2, [], "hunting", answer("LIKELY", "drift"), "outside at rest"),
    ]
    low, high = wilson(1, 2)
    right, wrong, *_ = rows(records)[0][2:]
    assert right == wrong == f"1 (50%; {low:.0%} to {high:.0%})"
    assert rows(records)[0][4] == "50%"
    assert calibration(records) == [("0.95 to 0.99", 3, calibration(records)[0][2])]
    assert calibration(records)[0][2].startswith("1 (33%;")
    assert ("hunting", "named drift", 1, "LIKELY 1", "2") in mistakes(records)
    assert ("scale", "missed", 1, "UNKNOWN 1", "1") in mistakes(records)
    text = page(records, 3, 0)
    assert "0 (0%; 0% to 79%) of 1 games" in text


@pytest.mark.parametrize(
    ("planted", "outside", "plan", "counted"),
    [
        (["windup"], "", "dense", True),
        (["windup", "pitch_map"], "", "dense", False),
        (["windup", "pitch_map"], "", "log", True),
        (["refraction"], "", "weather", True),
        ([], "thermostat", "weather", False),
        ([], "thermostat", "rest", True),
    ],
)
def test_games_with_two_right_answers_do_not_count(planted, outside, plan, counted):
    one = record(0, planted, outside, answer("NAMED", "drift"), plan=plan)
    assert counts(one) is counted
    assert f"{1 - counted} games do not count" in page([one], 1, 0)


def test_a_game_is_played_and_kept(tmp_path):
    found = played(GAMES[0], tmp_path)
    kept = json.loads((tmp_path / "00000.json").read_text(encoding="utf-8"))
    assert kept == json.loads(json.dumps(found))
    assert (tmp_path / "00000.csv").read_text(encoding="utf-8") == GAMES[0].text
    assert found["answer"]["verdict"] != "ERROR"


def test_the_published_page_counts_enough_games():
    text = PAGE.read_text(encoding="utf-8")
    numbers = [
        int(one) for one in re.findall(r"^\| (?:known|outside|null)[^|]*\| (\d+) \| \d+ \(", text, re.MULTILINE)
    ]
    assert sum(numbers) >= 200
