"""Hidden effects are found again: a few games of every published line, and the page that the command writes."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from rtec.blind import Rule, confusion, the_lines, wilson
from rtec.blind.judged import judged, refitted

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "confusion.md"
LINES = the_lines()
FEW = 3
PUBLISHED = 200
"""Games of each line, at least."""
ROW = re.compile(
    r"^\| (?P<title>[^|]+) \| [^|]+ \| (?P<bar>[^|]+) \| (?P<right>\d+) of (?P<trials>\d+)[^|]* (?P<rest>\|.*)$", re.M
)


@pytest.mark.parametrize("line", LINES, ids=lambda line: line.title)
def test_a_few_games_do_not_contradict_the_bar(line):
    result = confusion([line], FEW, judged, seed=20, refit=refitted)
    score = result.scores[0]
    told = [f"seed {game.seed}: {game.hidden} -> {game.said}" for game in score.games if game.right is False]
    assert score.interval[1] >= line.share, told


def test_two_processes_play_the_same_games_as_one():
    lines = [next(line for line in LINES if line.rule is Rule.TIED)]
    alone = confusion(lines, 3, judged, seed=4)
    together = confusion(lines, 3, judged, seed=4, workers=2)
    assert together == alone


def test_the_command_writes_a_page_with_every_game_that_went_wrong(tmp_path):
    page = tmp_path / "confusion.md"
    tied = str([line.rule for line in LINES].index(Rule.TIED))
    words = ["--trials", "1", "--only", "0", "--only", tied, "--workers", "1", "-o", str(page)]
    done = subprocess.run(
        [sys.executable, "-m", "tests.recovery.confusion", *words],
        capture_output=True,
        text=True,
        check=False,
        cwd=ROOT,
    )
    assert done.returncode in (0, 1), done.stderr
    text = page.read_text()
    rows = ROW.findall(text)
    assert [row[0] for row in rows] == [LINES[0].title, LINES[int(tied)].title]
    wrong = sum(int(trials) - int(right) for _, _, right, trials, _ in rows)
    assert len(re.findall(r"^\| \d{8,} \|", text, re.M)) == wrong
    assert done.returncode == (1 if wrong else 0)


def test_the_published_page_counts_right():
    text = PAGE.read_text(encoding="utf-8")
    rows = {row["title"]: row for row in ROW.finditer(text)}
    for line in LINES:
        row = rows[line.title]
        right, trials = int(row["right"]), int(row["trials"])
        low, high = wilson(right, trials)
        mark = "reached" if right / trials >= line.share else "missed"
        assert f"| {right / trials:.1%} | {low:.1%} to {high:.1%} | {mark} |" in row["rest"], line.title
        section = text.split(f"### {line.title[:1].upper()}{line.title[1:]}\n")[1].split("\n#")[0]
        cells = [cell for found in section.splitlines()[3:] for cell in re.findall(r"\| (\d+) (?=\|)", found)]
        assert sum(map(int, cells)) == trials, line.title
        assert trials >= PUBLISHED, line.title
        assert mark == "reached", line.title
    assert "python -m tests.recovery.confusion --trials 200 -o docs/confusion.md" in " ".join(text.split())


@pytest.mark.sweep
@pytest.mark.parametrize("line", LINES, ids=lambda line: line.title)
def test_two_hundred_games_reach_the_bar(line):
    score = confusion([line], 200, judged, refit=refitted, workers=2, patience=4).scores[0]
    told = [f"seed {game.seed}: {game.hidden} -> {game.said}" for game in score.games if game.right is False]
    assert score.trials == 200
    assert score.reached, told
