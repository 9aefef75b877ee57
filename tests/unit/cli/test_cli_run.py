"""``rtec run``: the whole story of a short axis, on the terminal and as JSON."""

import contextlib
import io
import json

import pytest

from rtec.cli import main
from rtec.report.diagnosis import verdict_sentence
from rtec.study import builtin_text, read_study, run_study

STUDY = """
name = "short"
title = "a short axis"

[axis]
error = "short.csv"
cyclic_period = "0 mm"

[program]
end = "3.6 inch"
runs = 2
dwell = "4 s"

[laser]
dwell = "2 s"

[calibration]
increment = "0.1 inch"
dwell = "4 s"
runs = 3

[box]
designs = ["b"]

[figures]
feeds = []
hold_time_constant = "1 s"
"""
TABLE = "position_mm,forward_um,reverse_um\n0,0,60\n1000,100,160\n"


def written(folder):
    (folder / "short.csv").write_text(TABLE)
    (folder / "short.toml").write_text(STUDY)
    return folder / "short.toml"


@pytest.fixture
def study(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")
    return written(tmp_path)


@pytest.fixture(scope="module")
def learned(tmp_path_factory):
    """Return the folder of one run of the study, with its report in ``out``, and the document that it printed."""
    folder = written(tmp_path_factory.mktemp("learned")).parent
    printed = io.StringIO()
    with contextlib.chdir(folder), contextlib.redirect_stdout(printed):
        assert main(["run", "short.toml", "-o", "out", "--json"]) == 0
    return folder, json.loads(printed.getvalue())


def with_model(study, name):
    study.write_text(STUDY + f'\n[predictor]\nmodel = "{name}"\n')


def test_the_terminal_tells_the_verdict_the_staircase_and_before_and_after(study, capsys):
    assert main(["run", "short.toml", "-o", "out"]) == 0
    out, err = capsys.readouterr()
    assert "Traceback" not in err
    lines = [" ".join(line.split()) for line in out.splitlines()]
    assert lines[0] == verdict_sentence(run_study(read_study(study)).learned.diagnosis)
    order = ["perfect axis", "+ backlash", "max average error", "audit", "Report: out/report.html"]
    places = [next(i for i, line in enumerate(lines) if line.startswith(words)) for words in order]
    assert places == sorted(places)
    for name in ("report.html", "model.toml", "readings/calibration.csv", "figures/axis-staircase.png"):
        assert (study.parent / "out" / name).is_file()


@pytest.mark.parametrize("noise", [True, False], ids=["noise", "none"])
def test_json_is_one_document_with_diagnosis_and_rows(study, learned, capsys, noise):
    document = learned[1]
    if not noise:
        assert main(["run", "short.toml", "--json", "--repeatability", "0um"]) == 0
        document = json.loads(capsys.readouterr().out)
    assert set(document["diagnosis"]["effects"]) >= {"backlash", "scale"}
    assert document["diagnosis"]["verdict"] == "NAMED" or not noise
    assert document["diagnosis"]["steps"] and document["diagnosis"]["noise_floor"] > 0.0
    assert document["model"]["predictor"] == "learned"
    assert document["model"]["rms_against_truth_um"] < 1.0
    rows = {row["name"]: row for row in document["rows"]}
    assert list(rows) == ["uncompensated", "table", "b"]
    assert rows["uncompensated"]["max_reversal_error_um"] == pytest.approx(60.0, abs=3.0)
    assert rows["b"]["max_reversal_error_um"] < 4.0
    assert rows["b"]["corrections_inserted"] > 100


def test_the_learned_model_can_be_used_again_and_changed(study, learned, capsys):
    folder, first = learned
    with_model(study, f"{folder}/out/model.toml")
    assert main(["run", "short.toml", "--json"]) == 0
    again = json.loads(capsys.readouterr().out)
    assert again["diagnosis"] is None
    assert again["rows"] == first["rows"]
    assert again["model"]["rms_against_truth_um"] == pytest.approx(first["model"]["rms_against_truth_um"], abs=1e-9)


def test_a_predictor_that_is_given_is_not_learned(study, capsys):
    with_model(study, "short.csv")
    assert main(["run", "short.toml", "-o", "out"]) == 0
    out = capsys.readouterr().out
    assert "perfect axis" not in out
    assert not (study.parent / "out" / "model.toml").exists()
    assert not (study.parent / "out" / "readings" / "calibration.csv").exists()


def test_what_a_model_file_loses_as_a_predictor_is_warned_of(study, capsys):
    (study.parent / "m.toml").write_text(
        'observe = "deviation"\n[[effect]]\nname = "backlash"\nbacklash = "-60 um"\n'
        '[[effect]]\nname = "drift"\namplitudes = ["1 um/h"]\n'
    )
    with_model(study, "m.toml")
    assert main(["run", "short.toml", "-o", "out"]) == 0
    assert "the predictor does without drift: it changes with time" in capsys.readouterr().err


def test_the_builtin_study_is_written_to_be_changed_and_over_nothing(study, capsys):
    file = study.parent / "mine.toml"
    assert main(["run", "warm", "--write-study", str(file)]) == 0
    assert "[heat]" in file.read_text(encoding="utf-8")
    file.unlink()
    assert main(["run", "--write-study", str(file)]) == 0
    assert file.read_text() == builtin_text()
    file.write_text("# mine\n")
    assert main(["run", "--write-study", str(file)]) == 2
    assert "--force" in capsys.readouterr().err
    assert file.read_text() == "# mine\n"


def test_a_model_that_is_none_is_one_line(study, capsys):
    with_model(study, "lurned")
    assert main(["run", "short.toml"]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.count("\n") == 1
    assert "predictor.model" in err and "did you mean 'learned'?" in err
