"""The folder and the page of a diagnosis and of a comparison."""

from __future__ import annotations

import json
import xml.etree.ElementTree as ET

import numpy as np
import pytest

from rtec.inference.results import Experiment, Unknown, Verdict
from rtec.report.diagnosis import folder as folder_module, verdict_sentence, write_comparison, write_diagnosis
from rtec.report.drawn import Illustration
from tests.pages import XHTML, files_in, needs_nothing_else, page_of, text_of

HOSTILE = "<script>alert('x')</script> \"&amp; {{ 7 * 7 }} {% raw %} $\\frac{"
FIGURES = ("measured", "staircase", "components", "candidates", "residual", "spectra", "cosines")


@pytest.fixture
def quick(monkeypatch):
    """Draw figures that cost nothing."""
    drawn = [Illustration(name=name, title=name, caption="A dot.", svg=b"<svg/>", png=b"") for name in FIGURES]
    monkeypatch.setattr(folder_module, "diagnosis_figures", lambda *_: drawn)
    monkeypatch.setattr(folder_module, "comparison_figures", lambda *_: drawn[:1])


def _part(tree: ET.Element, name: str) -> ET.Element:
    return tree.find(f".//*[@id='{name}']")


def _rows(part: ET.Element) -> list[list[str]]:
    return [[text_of(cell) for cell in row] for body in part.iter(f"{XHTML}tbody") for row in body]


def test_a_diagnosis_is_a_page_that_needs_nothing_else(make_diagnosis, out):
    page = write_diagnosis(make_diagnosis(), out)
    assert page == out / "report.html" and page.read_text("utf-8").startswith("<!DOCTYPE html>\n<html")
    assert files_in(out) == {
        "report.html",
        "result.json",
        *(f"figures/{name}.{ending}" for name in FIGURES for ending in ("png", "svg")),
    }
    assert len(list(out.iterdir())) == 3  # no hidden folder is left
    needs_nothing_else(page, len(FIGURES))


@pytest.mark.usefixtures("quick")
def test_the_verdict_comes_first_with_the_sentence(make_diagnosis, out):
    diagnosis = make_diagnosis()
    tree = page_of(write_diagnosis(diagnosis, out))
    assert text_of(_part(tree, "verdict")) == f"NAMED. {verdict_sentence(diagnosis)}"
    assert _part(tree, "verdict").get("class") == "good"
    sections = [section.get("id") for section in tree.iter(f"{XHTML}section")]
    assert sections == ["effects", "measurement", "steps", "judged", "left", "limits", "next", "definitions", "files"]


@pytest.mark.usefixtures("quick")
@pytest.mark.parametrize(
    ("verdict", "tone"), [(Verdict.UNKNOWN, "bad"), (Verdict.TIED, "mind"), (Verdict.NONE, "good")]
)
def test_the_verdict_has_its_colour(make_diagnosis, out, verdict, tone):
    unknown = Unknown(depends_on=("position",), period=3.2, frequency_hz=None, description="A bump that moves.")
    tree = page_of(write_diagnosis(make_diagnosis(verdict=verdict, unknown=unknown), out))
    assert _part(tree, "verdict").get("class") == tone
    assert "A bump that moves." in text_of(_part(tree, "left"))


@pytest.mark.usefixtures("quick")
def test_steps_effects_and_limits_hold_the_searchs_numbers(make_diagnosis, out):
    tree = page_of(write_diagnosis(make_diagnosis(), out))
    steps = _rows(_part(tree, "steps"))
    assert [row[0] for row in steps] == ["start: no effect", "+ scale", "+ backlash", "+ cyclic"]
    assert [row[2] for row in steps] == ["7.00", "6.80", "3.70", "0.990"]
    assert steps[2][1] == "backlash 12.00 ± 0.20 µm" and steps[2][3:6] == ["3.89", "20.0 ± 1.0", "< 0.001"]
    assert _rows(_part(tree, "effects"))[0] == ["backlash", "backlash 12.00 ± 0.20 µm"]
    cards = [element for element in tree.iter(f"{XHTML}article")]
    assert [text_of(card.find(f"{XHTML}h3")) for card in cards] == ["Backlash (reversal error) backlash",
                                                                  "Cyclic error cyclic"]  # fmt: skip
    for card in cards:
        terms = [text_of(term) for term in card.iter(f"{XHTML}dt")]
        assert {"How it looks", "Cause", "Effect", "Action", "Not changed by", "Source"} <= set(terms)
    # amplitudes 3 and 4 µm, each ± 0.1 µm: 5 µm ± 0.1 µm
    values = dict(
        zip(*([text_of(one) for one in cards[1].iter(f"{XHTML}{tag}")] for tag in ("dt", "dd")), strict=True)
    )
    assert values["amplitude 1"] == "5.00 ± 0.10 µm" and values["period"] == "6.35 mm"
    limits = text_of(_part(tree, "limits"))
    assert "no velocity or feed column" in limits and "0.300 µm" in limits
    following = text_of(_part(tree, "next"))
    assert "Measure dense points just after a reversal." in following and "backlash and windup" in following
    assert "0.980" in following
    prepared = text_of(_part(tree, "measurement"))
    assert "Row order and time agree." in prepared and "1.00 µm (standard deviation from repeats, 168" in prepared


@pytest.mark.usefixtures("quick")
def test_hostile_text_is_shown_and_not_obeyed(make_diagnosis, make_dataset, make_candidate, make_step, out):
    dataset = make_dataset(source="../" + HOSTILE, observe=HOSTILE, notes=(HOSTILE + "\x00\ud800",),
                           unknown=((HOSTILE, np.arange(210.0)),))  # fmt: skip
    diagnosis = make_diagnosis(
        dataset=dataset,
        candidates=(make_candidate(HOSTILE, reason=HOSTILE),),
        steps=(make_step(HOSTILE, 0.001, reason=HOSTILE),),
        not_testable=((HOSTILE, HOSTILE),),
        minimum_detectable=((HOSTILE, 0.001),),
        lack_of_fit=((HOSTILE, 0.5),),
        unknown=Unknown(depends_on=(HOSTILE,), period=None, frequency_hz=None, description=HOSTILE),
        experiment=Experiment(text=HOSTILE),
        heldout_by=HOSTILE,
        notes=(HOSTILE,),
    )
    path = write_diagnosis(diagnosis, out)
    tree = page_of(path)
    assert not list(tree.iter(f"{XHTML}script")) and "7 * 7" in path.read_text("utf-8") and "49" not in HOSTILE
    for place in ("measurement", "steps", "judged", "left", "limits", "next"):
        assert "<script>alert('x')</script>" in text_of(_part(tree, place)), place
    assert "\ufffd\ufffd" in text_of(_part(tree, "measurement"))
    assert json.loads((out / "result.json").read_text("utf-8"))["observe"] == HOSTILE
    assert files_in(out) - {"report.html", "result.json"} == {
        f"figures/{name}.{ending}" for name in FIGURES for ending in ("png", "svg")
    }


@pytest.mark.usefixtures("quick")
def test_an_empty_search_leaves_its_sections_out(make_diagnosis, out):
    bare = make_diagnosis(verdict=Verdict.NONE, model=make_diagnosis().start, steps=(), candidates=(), cosines=None,
                          not_testable=(), minimum_detectable=(), lack_of_fit=(), notes=())  # fmt: skip
    tree = page_of(write_diagnosis(bare, out))
    assert _part(tree, "effects") is None and _part(tree, "judged") is None
    assert _rows(_part(tree, "steps")) == [["start: no effect", "", "7.00", "", "", "", ""]]


@pytest.mark.usefixtures("quick")
def test_a_comparison_says_where_the_residual_lives(make_comparison, out):
    tree = page_of(write_comparison(make_comparison(), out))
    assert text_of(_part(tree, "verdict")).startswith("The model (backlash and cyclic error) leaves 1.50 µm RMS")
    assert _part(tree, "verdict").get("class") == "mind"
    rows = _rows(_part(tree, "left"))
    assert rows == [
        ["position", "60%", "10 to 20 mm, backward", "2.00 µm", "10"],
        ["direction", "30%", "backward", "2.00 µm", "105"],
        ["run", "2%", "", "", ""],
    ]
    assert json.loads((out / "result.json").read_text("utf-8"))["rms_heldout"] == pytest.approx(1.6)
