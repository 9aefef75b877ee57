"""Effects of one's own, learned curves, the next hour and what has changed, on the command line."""

import json

import numpy as np
import pytest

from rtec.cli import main

MINE = """
import numpy as np
import rtec

print("loaded")

@rtec.effect(over="position")
def dent(position, *, place: rtec.Within(0, 500, "mm"), width: rtec.Within(2, 40, "mm")):
    "A dent in the way."
    return np.exp(-(((position - place) / width) ** 2))
"""


def axis(backlash=4.0, bump=5.0, seed=1):
    rng = np.random.default_rng(seed)
    x = np.tile(np.concatenate([np.arange(0.0, 400.0, 5.0), np.arange(400.0, 0.0, -5.0)]), 3)
    way, run = np.tile(np.repeat([1, -1], 80), 3), np.repeat([1, 2, 3], 160)
    y = -backlash / 2 * way + bump * np.exp(-(((x - 180.0) / 12.0) ** 2)) + rng.normal(0.0, 0.5, x.size)
    rows = (f"{r},{w},{a:g},{b:.3f}" for r, w, a, b in zip(run, way, x, y, strict=True))
    return "run,direction,target_mm,deviation_um\n" + "\n".join(rows) + "\n"


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.py").write_text(MINE)
    (tmp_path / "z.csv").write_text(axis())
    (tmp_path / "worn.csv").write_text(axis(backlash=6.0, seed=2))
    return tmp_path


def said(capsys, *words, code=0):
    assert main(list(words)) == code
    return capsys.readouterr()


def document(capsys, *words):
    return json.loads(said(capsys, *words, "--json").out)


def test_an_own_effect_takes_part_in_every_command(here, capsys):
    found = document(capsys, "diagnose", "z.csv", "--effects", "mine.py", "--save", "m.toml")
    assert (found["verdict"], set(found["effects"])) == ("NAMED", {"backlash", "dent"})
    assert found["final"]["dent"]["place"][0] == pytest.approx(180.0, abs=1.0)
    left = document(capsys, "compare", "z.csv", "--model", "m.toml", "--effects", "mine.py")
    assert left["rms"] == pytest.approx(found["rms_after"], rel=1e-3)
    said(capsys, "export", "m.toml", "--csv", "t.csv", "--effects", "mine.py")
    table = np.loadtxt(here / "t.csv", delimiter=",", skiprows=2)
    peak = np.abs(table[:, 0] - 180.0).argmin()
    assert table[peak, 1] - table[0, 1] == pytest.approx(5.0, abs=0.6)
    assert "--effects FILE.py" in said(capsys, "compare", "z.csv", "--model", "m.toml", code=2).err
    card = said(capsys, "effects", "dent", "--effects", "mine.py")
    assert "A dent in the way" in card.out
    assert "loaded" in card.err


def test_an_own_effect_is_added_with_a_shape(here, capsys):
    words = (
        "add",
        "dent",
        "z.csv",
        "--effects",
        "mine.py",
        "-o",
        "m.toml",
        "--set",
        "place=180 mm",
        "--set",
        "width=12 mm",
    )
    assert document(capsys, *words)["final"]["dent"]["width"][0] == 12.0
    again = (*words[:-1], "width=12")
    assert "unit" in said(capsys, *again, "--force", code=2).err
    assert "NAME=VALUE" in said(capsys, "add", "--help").out


def test_a_check_says_what_a_plan_would_show(here, capsys):
    found = document(capsys, "effects", "--check", "mine.py", "--plan", "z.csv")
    (dent,) = found["effects"]
    assert dent["not_testable"] is None
    assert dent["look_alikes"][0]["name"] == "pitch_map"
    usual, worst = dent["smallest_amplitude"]
    assert 0.3 < usual < worst
    (here / "mine.py").write_text(MINE.replace("position", "oil_level").replace('over="oil_level"', ""))
    assert "no column oil_level" in said(capsys, "effects", "--check", "mine.py", "--plan", "z.csv", code=1).out
    assert "--plan" in said(capsys, "effects", "--check", "mine.py", code=2).err


def test_a_curve_is_learned_saved_and_read_again(here, capsys):
    found = document(capsys, "diagnose", "z.csv", "--save", "m.toml")
    assert (found["verdict"], found["curve"]["over"]) == ("UNKNOWN", "position")
    assert found["curve"]["rms"] < 0.6
    left = document(capsys, "compare", "z.csv", "--model", "m.toml")
    assert left["rms"] == pytest.approx(found["curve"]["rms"], rel=0.01)
    added = document(capsys, "add", "curve:position*direction", "z.csv", "-o", "c.toml")
    assert added["rms_after"] < 0.6
    assert "no velocity" in said(capsys, "add", "curve:velocity", "z.csv", "-o", "c.toml", "--force", code=2).err
    assert "one quantity or two" in said(capsys, "add", "curve:a*b*c", "z.csv", "-o", "d.toml", code=2).err


def test_the_next_hour_is_written_as_three_files(here, capsys):
    words = ("diagnose", "z.csv", "--effects", "mine.py", "--next", "1h", "--suggest", "plan.toml")
    plan = document(capsys, *words)["plan"]
    assert plan["duration_s"] <= 3600.0
    assert {one["effect"] for one in plan["standard_errors"]} == {"backlash", "dent"}
    assert sorted(file.name for file in here.glob("plan.*")) == ["plan.csv", "plan.nc", "plan.toml"]
    assert "plan.toml" in said(capsys, *words, code=2).err
    for wrong in ("1", "0.5 s", "200 h"):
        assert "--next" in said(capsys, "diagnose", "z.csv", "--next", wrong, code=2).err


def test_what_has_changed_since_a_model(here, capsys):
    document(capsys, "diagnose", "z.csv", "--effects", "mine.py", "--save", "m.toml")
    words = ("--model", "m.toml", "--effects", "mine.py")
    since = {(c["effect"], c["parameter"]): c for c in document(capsys, "compare", "worn.csv", *words)["since"]}
    assert since["backlash", "backlash"]["outcome"] == "differs"
    assert since["backlash", "backlash"]["difference"] == pytest.approx(-2.0, abs=0.4)
    assert since["dent", "place"]["outcome"] == "same"
    text = said(capsys, "compare", "z.csv", "worn.csv", *words, "-o", "report")
    assert "worn.csv against m.toml" in text.out
    assert (here / "report" / "figures" / "parameters.svg").is_file()
