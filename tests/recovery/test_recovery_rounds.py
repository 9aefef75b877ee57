"""Look-alikes twice round the loop: a few games of each pair, and the page that the command writes."""

import re
from functools import cache
from pathlib import Path

import pytest

from rtec.blind.answer import Answer
from rtec.blind.scored import wilson
from tools.rounds import BAR, Rounds, page, played, rows, the_pairs

PAGE = Path(__file__).parents[2] / "docs" / "rounds.md"
PAIRS = the_pairs()
FEW = 2
"""Games: one of each effect of a pair."""
PUBLISHED = 100


@cache
def played_here(pair):
    return played(pair, FEW, seed=7)


@pytest.mark.one_in(2)
@pytest.mark.parametrize("pair", PAIRS, ids=lambda pair: pair.title)
def test_suggestion_measurement_and_naming_go_through(pair):
    for one in played_here(pair):
        told = (one.seed, one.hidden, one.first.verdict, one.asked, one.second and one.second.verdict)
        assert one.solved, told


def test_two_processes_play_the_same_rounds_as_one():
    assert played(PAIRS[4], FEW, seed=7, workers=2) == played_here(PAIRS[4])


def one(first, second, *, asked=True):
    return Rounds(hidden="drift", seed=1, first=first, asked=asked, second=second)


TIED, NAMED = Answer("TIED", ("drift",), tied=("drift", "scale")), Answer("NAMED", ("drift",))


@pytest.mark.parametrize(
    ("game", "tied", "told_apart", "solved"),
    [
        (one(TIED, NAMED), True, True, True),
        (one(Answer("INCONCLUSIVE"), NAMED), False, True, True),
        (one(TIED, NAMED, asked=False), False, True, False),
        (one(NAMED, NAMED), False, True, False),
        (one(TIED, Answer("NAMED", ("drift", "scale"))), True, False, False),
        (one(TIED, None), True, False, False),
    ],
)
def test_when_a_game_is_solved(game, tied, told_apart, solved):
    assert (game.tied, game.told_apart, game.solved) == (tied, told_apart, solved)


def test_the_page_counts_and_lists_what_did_not_go_through():
    games = (one(TIED, NAMED), one(TIED, None), one(TIED, NAMED, asked=False), one(TIED, NAMED))
    text = page([(PAIRS[3], games)], 4, 0)
    low, high = wilson(2, 4)
    assert f"| 2 (50.0%; {low:.1%} to {high:.1%}) |" in text
    assert "| drift | 1 | TIED drift | no plan |" in text
    assert "| drift | 1 | TIED drift, another experiment | NAMED drift |" in text
    assert text.count("\n| drift |") == 2


def test_the_published_page_counts_right():
    text = PAGE.read_text(encoding="utf-8")
    listed = text.count("\n| ", text.index("## Games")) - 1 if "## Games" in text else 0
    missed = 0
    for pair in PAIRS:
        cells = re.search(rf"^\| {re.escape(pair.title)} \| (\d+) \|(.*)\|$", text, re.M)
        games, counts = int(cells[1]), [int(number) for number in re.findall(r"(?:^|\|) (\d+) \(", cells[2])]
        assert games >= PUBLISHED
        assert len(counts) == len(rows([])[0].split("|")) - 4
        low, high = wilson(counts[-1], games)
        assert f"({counts[-1] / games:.1%}; {low:.1%} to {high:.1%})" in cells[2]
        assert counts[-1] >= BAR * games, pair.title
        missed += games - counts[-1]
    assert listed == missed
