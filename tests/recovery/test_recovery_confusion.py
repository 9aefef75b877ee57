"""Hidden effects are found again: a few games of every published line, and the page that the command writes."""

import csv
import re
import sys
from pathlib import Path

import pytest
from scipy.stats import binomtest

from rtec.blind.answer import Rule
from rtec.blind.confusion import confusion
from rtec.blind.harder_lines import the_pools
from rtec.blind.judged import judged, refitted
from rtec.blind.lines import the_lines
from rtec.blind.scored import wilson
from tools.confusion import main

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "confusion.md"
LINES = the_lines()
FEW = 2
SURE = 0.9973
"""A few games contradict a bar only where they are below it by three standard errors."""
PUBLISHED = 125
"""Games of each line, at least, unless too many are left out as too weak."""
ROW = re.compile(
    r"^\| (?P<title>[^|]+) \| [^|]+ \| (?P<bar>[^|]+) \| (?P<right>\d+) of (?P<trials>\d+)[^|]* (?P<rest>\|.*)$", re.M
)
MARKS = ("reached", "missed", "shown")


def numbers_of(*titles):
    return [word for title in titles for word in ("--only", str([line.title for line in LINES].index(title)))]


@pytest.fixture
def run(monkeypatch, capsys):
    """Run the command; return its exit code and what it says on both streams."""

    def said(*words):
        monkeypatch.setattr(sys, "argv", ["confusion", "--workers", "1", *words])
        return main(), *capsys.readouterr()

    return said


def cells_of(page):
    """Return the games of each cell beside a page, by line, row and column."""
    with page.with_suffix(".csv").open(encoding="utf-8", newline="") as file:
        return {(one["line"], one["row"], one["column"]): int(one["games"]) for one in csv.DictReader(file)}


def check_row(cells, row, line):
    """Check one row of a page, and the cells of its line, against each other; return its mark."""
    right, trials = int(row["right"]), int(row["trials"])
    low, high = wilson(right, trials)
    mark = row["rest"].rstrip(" |").rsplit("| ", 1)[1]
    assert row["rest"].startswith(f"| {right / trials:.1%} | {low:.1%} to {high:.1%} |"), line.title
    if line.share == 0.0:
        assert (row["bar"], mark) == ("none", "shown"), line.title
    elif line.most_left_out == 1.0:
        assert mark == ("reached" if right / trials >= line.share else "missed"), line.title
    drawn = line.draw is not None and line.rule is Rule.NAMED
    counted = {key: games for key, games in cells.items() if key[0] == line.title}
    assert sum(games for key, games in counted.items() if not drawn or key[1] == "verdict") == trials, line.title
    return mark


@pytest.mark.one_in(4)
@pytest.mark.parametrize("line", LINES, ids=lambda line: line.title)
def test_a_few_games_do_not_contradict_the_bar(line):
    result = confusion([line], FEW, judged, seed=20, refit=refitted)
    score = result.scores[0]
    told = [f"seed {game.seed}: {game.hidden} -> {game.said}" for game in score.games if game.right is False]
    if score.trials:
        share = binomtest(score.right, score.trials).proportion_ci(SURE, method="wilson")
        assert share.high >= line.share, told


def test_two_processes_play_and_draw_the_same_games_as_one():
    lines = [next(line for line in LINES if line.rule is Rule.TIED), next(line for line in LINES if line.draw)]
    assert confusion(lines, 2, judged, seed=4, workers=2) == confusion(lines, 2, judged, seed=4)


def test_the_command_writes_a_page_with_every_game_that_went_wrong(run, tmp_path):
    page, games = tmp_path / "confusion.md", tmp_path / "games.jsonl"
    tied = next(line.title for line in LINES if line.rule is Rule.TIED)
    drawn = next(line.title for line in LINES if line.draw is not None)
    words = ["--trials", "2", *numbers_of(LINES[0].title, tied, drawn), "--resume", str(games)]
    code, _, err = run(*words, "-o", str(page))
    assert code in (0, 1), err
    text = page.read_text()
    rows = list(ROW.finditer(text.split("\n## ")[0]))
    assert [row["title"] for row in rows] == [LINES[0].title, tied, drawn]
    by_title = {line.title: line for line in LINES}
    marks = [check_row(cells_of(page), row, by_title[row["title"]]) for row in rows]
    wrong = sum(int(row["trials"]) - int(row["right"]) for row in rows)
    listed = page.with_name("confusion-games.csv").read_text().splitlines()
    assert len(listed) == 1 + wrong
    assert sum(map(int, re.findall(r"^- .*? \((\d+) of \d+\): ", text, re.M))) == wrong
    assert code == (1 if "missed" in marks else 0)
    for heading in ("Periods of waves", "Coverage of the standard errors", "Calibration of the probabilities"):
        assert f"\n## {heading}\n" in text
    assert len(games.read_text().splitlines()) == 6
    assert run(*words, "-o", str(page))[0] == code
    assert page.read_text().split("\nPlayed in")[0] == text.split("\nPlayed in")[0]
    assert len(games.read_text().splitlines()) == 6
    code, out, err = run("--resume", str(games), "--compare", str(games))
    assert code == 0, err
    assert f"| {LINES[0].title} | 2 |" in out


def test_the_command_refuses_a_record_of_other_games(run, tmp_path):
    games = tmp_path / "games.jsonl"
    games.write_text("{}\n")
    code, _, err = run("--trials", "1", "--only", "0", "--resume", str(games))
    assert (code, "this is no game" in err) == (2, True)
    code, _, err = run("--compare", str(games))
    assert (code, "--resume" in err) == (2, True)


def test_the_published_page_counts_right():
    text = PAGE.read_text(encoding="utf-8")
    rows = {row["title"]: row for row in ROW.finditer(text)}
    assert not [line.title for line in LINES if line.title not in rows], "write the page again"
    for line in LINES:
        assert check_row(cells_of(PAGE), rows[line.title], line) in MARKS
        weak = line.above_detectable and "too weak" in rows[line.title][0]
        assert int(rows[line.title]["trials"]) >= PUBLISHED or weak, line.title
    for pool in the_pools():
        row = rows[pool.title]
        together = [sum(int(rows[title][key]) for title in pool.members) for key in ("right", "trials")]
        assert [int(row["right"]), int(row["trials"])] == together
        assert row["rest"].rstrip(" |").endswith("reached" if together[0] / together[1] >= pool.share else "missed")
    assert f"python -m tools.confusion --trials {PUBLISHED} -o docs/confusion.md" in " ".join(text.split())


@pytest.mark.sweep
@pytest.mark.parametrize("line", LINES, ids=lambda line: line.title)
def test_published_games_reach_the_bar(line):
    score = confusion([line], PUBLISHED, judged, refit=refitted, workers=2, patience=4).scores[0]
    told = [f"seed {game.seed}: {game.hidden} -> {game.said}" for game in score.games if game.right is False]
    assert score.reached, told
