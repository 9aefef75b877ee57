"""A teacher gives each student an axis with hidden errors, marks their answers, and shows how A and B are counted."""

import itertools
import json
import re
import shlex
from pathlib import Path

README = Path(__file__).parents[2] / "README.md"
GAME = ("blind", "new", "--hide", "backlash=9 um", "--seed", "5", "-o", "data.csv")


def points(done):
    return re.search(r"^Points: (\d) of (\d)$", done.stdout, re.MULTILINE).groups()


def test_the_teacher_hides_students_answer_and_the_list_marks_them(typed, tmp_path):
    assert "data.csv.sealed" in typed(*GAME).stdout
    text = (tmp_path / "data.csv").read_text(encoding="utf-8")
    assert "backlash" not in text + (tmp_path / "data.csv.sealed").read_text(encoding="utf-8")

    found = json.loads(typed("diagnose", "data.csv", "--json").stdout)
    assert (found["verdict"], found["effects"]) == ("NAMED", ["backlash"])
    size, error, unit = found["final"]["backlash"]["backlash"]
    assert abs(abs(size) - 9.0) < 4 * error
    shown = f"backlash=\N{MINUS SIGN}{abs(size):.2f} ± {error:.2f} {unit.replace('u', 'µ')}"  # as her screen shows it
    right = typed("blind", "guess", "data.csv", shown, "--by", "Ada")
    assert points(right) == ("3", "3")
    assert "backlash is right; the size is" in right.stdout

    far = typed("blind", "guess", "data.csv", "backlash=90 um", "--by", "Ben")
    assert points(far) == ("2", "3")
    assert "900 % off" in far.stdout
    wrong = typed("blind", "guess", "data.csv", "drift", "--by", "Cem", code=1)
    assert points(wrong) == ("0", "3")
    assert "backlash is missed" in wrong.stdout
    assert "drift is not hidden" in wrong.stdout
    misspelt = typed("blind", "guess", "data.csv", "backlsh=9 um", "--by", "Dot", code=2)
    assert "did you mean 'backlash'?" in misspelt.stderr
    typed("blind", "guess", "data.csv", "backlash=9 um", "--by", "Cem")  # again, having seen what was missed

    (game,) = json.loads(typed("blind", "score", "data.csv", "--json").stdout)["games"]
    marks = [(one["by"], one["points"], one["counts"]) for one in game["answers"]]
    assert marks == [("Ada", 3, True), ("Ben", 2, True), ("Cem", 0, True), ("Cem", 3, False)]


def test_a_class_counts_the_insertions_of_every_design(typed):
    """By the rule on the blackboard: 00, 10, 11, 01 are a ring, and one place further on it is one count."""
    ring = ["00", "10", "11", "01"]
    rows = json.loads(typed("tables", "--json").stdout)["rows"]
    ends = {}
    for row in rows:
        levels = [ring[row["state"] - 1], *row["levels"]]
        counts = [(ring.index(new) - ring.index(old) + 1) % 4 - 1 for old, new in itertools.pairwise(levels)]
        assert row["counts"] == list(itertools.accumulate(counts)), row
        ends.setdefault(row["design"], set()).add(row["counts"][-1])
    assert ends == {"original": {4, -4}, "a": {4, -4}, "b": {1, -1}, "c": {2, -2}}


def test_a_class_sees_an_insertion(rtec, tmp_path):
    """What the README shows him draws A, B, states and counts on both sides; the controller counts two more."""
    row = next(line for line in README.read_text(encoding="utf-8").splitlines() if line.startswith("| teach"))
    words = re.search("`rtec (simulate [^`]*)`", row)[1].replace("c.png", "c.svg")
    found = json.loads(rtec(*shlex.split(words), "--json").stdout)
    assert found["controller_counts"] - found["encoder_counts"] == 2
    assert found["illegal_transitions"] == 0
    picture = (tmp_path / "c.svg").read_text(encoding="utf-8")
    assert "+2 from state" in picture
    assert all(f"<!-- {word} -->" in picture for word in ("encoder", "controller", "A", "B", "state", "count"))
