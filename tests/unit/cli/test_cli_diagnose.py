"""rtec diagnose: the verdict, the document that scripts rely on, the report and the model."""

import contextlib
import io
import json

import numpy as np
import pytest

from rtec.cli import main
from rtec.inference.model_file import read_model

VERB = "diagnose"


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


def test_a_seed_gives_the_same_answer(here, answer):
    first, second = (answer("one.csv", "--seed", "5") for _ in range(2))
    assert first == second
    assert first["seed"] == 5


def test_another_file_judges(here, answer):
    document = answer("one.csv", "--heldout", "other.csv")
    assert document["heldout_by"] == "other.csv"
    assert document["rms_heldout"] == pytest.approx(1.0, rel=0.15)


def test_the_terminal_says_it_in_a_sentence_first(here, said, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    code, out, err = said("one.csv", "-o", "report", "--save", "found.toml")
    assert code == 0
    first, rest = out.split("\n", 1)
    assert "backlash" in first.lower()
    assert "RMS" in first
    assert "NAMED" in rest
    assert f"Report: report/{'report.html'}" in rest
    assert "Model: found.toml" in rest
    assert all(line.startswith("rtec: ") for line in err.splitlines())


def test_a_note_on_the_file_comes_once(here, said):
    header, *rows = (here / "none.csv").read_text().splitlines()
    dwells = [f"{row},{k % 7}" for k, row in enumerate(rows)]
    (here / "dwell.csv").write_text("\n".join([f"{header},dwell_s", *dwells]))
    err = said("dwell.csv")[2]
    assert err.count("dwell_s") == 1


def test_the_report_stands_in_its_folder(found):
    page = found["folder"] / found["report"]
    assert "backlash" in page.read_text(encoding="utf-8").lower()
    assert list((page.parent / "figures").glob("*.svg"))
    assert json.loads((page.parent / "result.json").read_text())["verdict"] == "NAMED"


def test_what_exists_is_not_overwritten(here, said, refused):
    (here / "found.toml").write_text("mine")
    (here / "report").mkdir()
    (here / "report" / "mine.txt").write_text("mine")
    for words in (["--save", "found.toml"], ["-o", "report"], ["--save", "no/such.toml"]):
        refused("one.csv", *words)
    assert (here / "found.toml").read_text() == "mine"
    assert sorted(path.name for path in (here / "report").iterdir()) == ["mine.txt"]
    code, _, _ = said("one.csv", "--save", "found.toml", "-o", "report", "--force")
    assert code == 0
    assert read_model(here / "found.toml").terms
    assert (here / "report" / "mine.txt").read_text() == "mine"


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["two.csv", "--seed", "-1"], "--seed"),
        (["two.csv", "--heldout", "./two.csv"], "--lock holds back a part"),
        (["two.csv", "--heldout", "force.csv"], "force.csv: column: 'deviation'"),
        (["two.csv", "--model", "hot.toml"], "no temperature column"),
        (["backwards.csv"], "backwards.csv, line 5"),
    ],
)
def test_bad_words_and_files_are_one_line_and_2(here, refused, words, says):
    (here / "hot.toml").write_text('observe = "deviation"\n[[effect]]\nname = "thermal_growth"\n')
    (here / "force.csv").write_text("time_s,actual_mm,force_n\n0,1,2\n1,2,3\n2,3,4\n3,4,5\n4,5,6\n")
    (here / "backwards.csv").write_text("time_s,target_mm,deviation_um\n0,1,2\n60,2,3\n120,3,4\n90,4,5\n150,5,6\n")
    assert says in refused(*words)
