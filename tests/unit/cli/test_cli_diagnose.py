"""rtec diagnose: the verdict, the document that scripts rely on, the report and the model."""

import contextlib
import io
import json

import numpy as np
import pytest

from rtec.cli import main
from rtec.effects import LIBRARY
from rtec.inference.model_file import read_model

VERDICTS = {"NAMED", "LIKELY", "TIED", "NOT_TESTABLE", "INCONCLUSIVE", "UNKNOWN", "NONE"}


def text_of(error, seed=1, sigma=1.0, runs=5):
    """Bidirectional runs of 21 targets; errors and noise in um."""
    rng = np.random.default_rng(seed)
    up = np.linspace(0.0, 400.0, 21) + rng.uniform(-4, 4, 21)
    lines = ["run,direction,time_s,target_mm,deviation_um"]
    t = 0.0
    for run in range(1, runs + 1):
        for way, places in ((1, up), (-1, up[::-1])):
            for x in places:
                t += 12.0
                lines.append(f"{run},{way},{t:.1f},{x:.4f},{error(x, way) + rng.normal(0, sigma):.5f}")
    return "\n".join(lines) + "\n"


TWO = text_of(lambda x, way: 5.0 * way + 0.03 * x)


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "two.csv").write_text(TWO)
    (tmp_path / "one.csv").write_text(text_of(lambda x, way: 5.0 * way))
    (tmp_path / "other.csv").write_text(text_of(lambda x, way: 5.0 * way, seed=2))
    (tmp_path / "none.csv").write_text(text_of(lambda x, way: 0.0))
    (tmp_path / "lead.toml").write_text('observe = "deviation"\n[[effect]]\nname = "scale"\n')
    return tmp_path


def said(capsys, *words):
    code = main(["diagnose", *words])
    return code, *capsys.readouterr()


def answer(capsys, *words):
    code, out, err = said(capsys, *words, "--json")
    assert (code, err, out.count("\n")) == (0, "", 1)
    return json.loads(out, parse_constant=pytest.fail)


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    """The document of two effects, which says in what folder its report and its model stand."""
    folder = tmp_path_factory.mktemp("found")
    out = io.StringIO()
    with contextlib.chdir(folder), contextlib.redirect_stdout(out):
        (folder / "two.csv").write_text(TWO)
        assert main(["diagnose", "two.csv", "--save", "found.toml", "-o", "report", "--json"]) == 0
    return json.loads(out.getvalue(), parse_constant=pytest.fail) | {"folder": folder}


def test_two_effects_are_named_with_their_sizes(found):
    document = found
    assert (document["verdict"], set(document["effects"]), document["unit"]) == ("NAMED", {"scale", "backlash"}, "um")
    steps = document["steps"]
    assert [step["effect"] for step in steps] == document["effects"]
    numbers = {key: value for step in steps for key, value in step["params"].items()}
    assert numbers["backlash_um"] == pytest.approx(10.0, abs=5 * 2 / np.sqrt(210))
    assert numbers["scale_um_per_m"] == pytest.approx(30.0, abs=5 * 1000 / (120 * np.sqrt(210)))
    assert document["rms_before"] > steps[0]["rms_train"] > steps[1]["rms_train"]
    assert document["rms_after"] == pytest.approx(document["noise_floor"], rel=0.1)
    model = read_model(found["folder"] / "found.toml")
    assert model.names == tuple(document["effects"])
    assert document["model"] == "found.toml"
    backlash = next(term for term in model.terms if term.name == "backlash")
    # in the file stand the numbers of the whole model: those of its last step
    last = steps[-1]["effect"]
    term, key = {"backlash": (backlash, "backlash_um"), "scale": (model.terms[-1], "scale_um_per_m")}[last]
    assert term.amplitudes[0] * (1e3 if last == "backlash" else 1e6) == pytest.approx(numbers[key])
    assert backlash.amplitudes[0] * 1e3 == pytest.approx(10.0, abs=5 * 2 / np.sqrt(210))


def test_the_document_has_the_keys_that_scripts_rely_on(found):
    document = found
    for key in (
        "verdict", "effects", "steps", "candidates", "noise_floor", "rms_before", "rms_after", "unit", "not_testable",
        "minimum_detectable", "unknown", "suggested_experiment", "unseen_periods", "outliers", "probability",
        "final",
    ):  # fmt: skip
        assert key in document
    assert set(document["probability"]) >= set(document["effects"])
    assert all(0.95 <= document["probability"][name] <= 1.0 for name in document["effects"])
    assert document["outliers"] == []
    assert list(document["final"]) == document["effects"]
    numbers, last = document["steps"][-1]["params"], document["final"][document["steps"][-1]["effect"]]
    assert [value for value, _, _ in last.values()] == [n for key, n in numbers.items() if not key.endswith("_error")]
    assert set(document["steps"][0]) >= {"effect", "params", "rms_train", "rms_heldout", "p_adjusted"}
    assert set(document["candidates"][0]) >= {"effect", "predicted_rms", "p_adjusted", "tied_with", "reason"}
    assert document["not_testable"]["thermal_growth"] == "no temperature column"
    assert set(document["not_testable"]) | {one["effect"] for one in document["candidates"]} <= {
        effect.name for effect in LIBRARY
    }


def test_nothing_is_named_where_nothing_is(here, capsys):
    document = answer(capsys, "none.csv")
    assert (document["verdict"], document["effects"], document["steps"]) == ("NONE", [], [])
    assert document["minimum_detectable"]


def test_a_seed_gives_the_same_answer(here, capsys):
    first, second = (answer(capsys, "one.csv", "--seed", "5") for _ in range(2))
    assert first == second
    assert first["seed"] == 5


def test_what_is_known_is_not_found_again(here, capsys):
    document = answer(capsys, "two.csv", "--model", "lead.toml")
    assert document["effects"] == ["scale", "backlash"]
    assert [step["effect"] for step in document["steps"]] == ["backlash"]


def test_another_file_judges(here, capsys):
    document = answer(capsys, "one.csv", "--heldout", "other.csv")
    assert document["heldout_by"] == "other.csv"
    assert document["rms_heldout"] == pytest.approx(1.0, rel=0.15)


def test_the_terminal_says_it_in_a_sentence_first(here, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    code, out, err = said(capsys, "one.csv", "-o", "report", "--save", "found.toml")
    assert code == 0
    first, rest = out.split("\n", 1)
    assert "backlash" in first.lower()
    assert "RMS" in first
    assert "NAMED" in rest
    assert f"Report: report/{'report.html'}" in rest
    assert "Model: found.toml" in rest
    assert all(line.startswith("rtec: ") for line in err.splitlines())


def test_a_note_on_the_file_comes_once(here, capsys):
    header, *rows = (here / "none.csv").read_text().splitlines()
    dwells = [f"{row},{k % 7}" for k, row in enumerate(rows)]
    (here / "dwell.csv").write_text("\n".join([f"{header},dwell_s", *dwells]))
    err = said(capsys, "dwell.csv")[2]
    assert err.count("dwell_s") == 1


def test_the_report_stands_in_its_folder(found):
    page = found["folder"] / found["report"]
    assert "backlash" in page.read_text(encoding="utf-8").lower()
    assert list((page.parent / "figures").glob("*.svg"))
    assert json.loads((page.parent / "result.json").read_text())["verdict"] == "NAMED"


def test_what_exists_is_not_overwritten(here, capsys):
    (here / "found.toml").write_text("mine")
    (here / "report").mkdir()
    (here / "report" / "mine.txt").write_text("mine")
    for words in (["--save", "found.toml"], ["-o", "report"], ["--save", "no/such.toml"]):
        code, out, err = said(capsys, "one.csv", *words)
        assert (code, out, err.count("\n")) == (2, "", 1)
    assert (here / "found.toml").read_text() == "mine"
    assert sorted(path.name for path in (here / "report").iterdir()) == ["mine.txt"]
    code, _, _ = said(capsys, "one.csv", "--save", "found.toml", "-o", "report", "--force")
    assert code == 0
    assert read_model(here / "found.toml").terms
    assert (here / "report" / "mine.txt").read_text() == "mine"


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("constant", "run,direction,target_mm,deviation_um\n" + "".join(f"1,1,{x},3\n" for x in range(20))),
        ("one place", "run,direction,target_mm,deviation_um\n" + "".join(f"{r},1,5,{r % 3 - 1}\n" for r in range(9))),
        ("three rows", "target_mm,deviation_um\n1,2\n2,3.5\n3,1\n"),
        ("one way", text_of(lambda x, way: 0.0, runs=1).split("\n1,-1")[0] + "\n"),
    ],
)
def test_poor_data_get_a_verdict_but_no_name(here, capsys, name, text):
    (here / "poor.csv").write_text(text)
    document = answer(capsys, "poor.csv")
    assert document["verdict"] in VERDICTS - {"NAMED", "LIKELY", "TIED"}
    assert document["effects"] == []


def test_a_single_run_is_likely_at_most(here, capsys):
    (here / "once.csv").write_text(text_of(lambda x, way: 8.0 * np.sin(2 * np.pi * x / 61.0), runs=1))
    document = answer(capsys, "once.csv")
    assert (document["verdict"], document["effects"]) == ("LIKELY", ["cyclic"])
    assert document["noise_floor"] is None
    assert document["probability"]["cyclic"] >= 0.95


def test_an_outlier_is_listed_with_its_row_and_value(here, capsys):
    lines = text_of(lambda x, way: 5.0 * way).splitlines()
    cells = lines[100].split(",")
    lines[100] = ",".join([*cells[:-1], "88"])
    (here / "spoilt.csv").write_text("\n".join(lines) + "\n")
    document = answer(capsys, "spoilt.csv")
    assert document["outliers"] == [{"row": 100, "deviation": 88.0}]
    assert (document["verdict"], document["effects"]) == ("NAMED", ["backlash"])


def test_periods_that_the_targets_hide_are_listed(here, capsys):
    noise = np.random.default_rng(2).normal(size=(5, 21))
    rows = [f"{r + 1},1,{20 * k},{noise[r, k]:.4f}" for r in range(5) for k in range(21)]
    (here / "grid.csv").write_text("run,direction,target_mm,deviation_um\n" + "\n".join(rows) + "\n")
    document = answer(capsys, "grid.csv")
    assert document["unseen_periods"] == ["20 mm / k"]
    assert "shift the targets by 6 mm" in document["suggested_experiment"]


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ([], "'rtec diagnose --help'"),
        (["nowhere.csv"], "nowhere.csv"),
        (["two.csv", "--seed", "-1"], "--seed"),
        (["two.csv", "--seed", "x"], "--seed"),
        (["two.csv", "--observe", "force"], "--observe"),
        (["two.csv", "--heldout", "./two.csv"], "--lock holds back a part"),
        (["two.csv", "--heldout", "force.csv"], "force.csv: column: 'deviation'"),
        (["two.csv", "--model", "hot.toml"], "no temperature column"),
        (["backwards.csv"], "backwards.csv, line 5"),
    ],
)
def test_bad_words_and_files_are_one_line_and_2(here, capsys, words, says):
    (here / "hot.toml").write_text('observe = "deviation"\n[[effect]]\nname = "thermal_growth"\n')
    (here / "force.csv").write_text("time_s,actual_mm,force_n\n0,1,2\n1,2,3\n2,3,4\n3,4,5\n4,5,6\n")
    (here / "backwards.csv").write_text("time_s,target_mm,deviation_um\n0,1,2\n60,2,3\n120,3,4\n90,4,5\n150,5,6\n")
    code, out, err = said(capsys, *words)
    assert (code, out) == (2, "")
    assert err.count("\n") == 1
    assert err.startswith("rtec: ")
    assert says in err
