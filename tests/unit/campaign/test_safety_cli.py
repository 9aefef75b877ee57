"""rtec safety: the table, the page, the exit code, and what it refuses."""

import json

import pytest

from rtec.campaign import safety, safety_matrix
from rtec.campaign.safety_matrix import MatrixPlan, Outcome
from rtec.campaign.safety_phases import Phase
from rtec.campaign.safety_variants import VARIANTS
from rtec.cli import main
from rtec.machine.faults import FaultKind


@pytest.fixture(autouse=True)
def small(monkeypatch):
    """Three faults in two phases, so that a command takes a second."""
    kinds = (FaultKind.PC_KILLED, FaultKind.FRAME_DUPLICATED, FaultKind.LINE_BROKEN)

    def plan(**words):
        some = tuple(variant for variant in VARIANTS if variant.kind in kinds)
        return MatrixPlan(**words, phases=(Phase.CUTTING, Phase.AT_REST), variants=some)

    monkeypatch.setattr(safety_matrix, "MatrixPlan", plan)


def said(capsys, *words):
    code = main(["safety", *words])
    out, err = capsys.readouterr()
    return code, out, "".join(line for line in err.splitlines(keepends=True) if "compiling" not in line)


def test_the_table_says_what_happens(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "160")
    code, out, _ = said(capsys, "--seeds", "1", "--design", "c")
    lines = {" ".join(line.split()) for line in out.splitlines()}
    assert code == 0
    assert "PC killed held held" in lines
    assert "frame duplicated, once, PC to box right right" in lines
    assert "one line of a pair broken, for 50 ms upstream ·" in lines


def test_the_page_and_its_picture(capsys, tmp_path):
    page = tmp_path / "safety.md"
    code, out, _ = said(capsys, "-o", str(page), "--seeds", "1", "--design", "a", "--seed", "4", "--json")
    document = json.loads(out)
    assert code == 0
    assert document["good"] is True
    assert document["page"] == str(page)
    assert (document["seed"], document["trials"]) == (4, 14)
    assert {row["outcome"] for row in document["rows"]} <= {outcome.value for outcome in Outcome}
    text = page.read_text(encoding="utf-8")
    assert "rtec safety -o safety.md --design a --seeds 1 --seed 4" in text
    assert (tmp_path / "safety.png").read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"
    assert said(capsys, "-o", str(page))[0] == 2  # it exists


def test_a_silent_error_is_an_exit_code_of_one(capsys, monkeypatch):
    monkeypatch.setattr(safety_matrix, "is_wrong", lambda axis, twin: True)
    code, out, _ = said(capsys, "--seeds", "1", "--design", "c")
    assert code == 1
    assert "silent error: frame duplicated, once, PC to box, cutting, design c, seed 0" in " ".join(out.split())


def test_a_soak_beside_it(capsys):
    code, out, _ = said(capsys, "--seeds", "1", "--design", "c", "--soak", "2min", "--json")
    soak = json.loads(out)["soak"]
    assert soak["hours"] >= 2.0 / 60.0
    assert soak["silent"] == []
    assert (code == 0) == (soak["missing"] == [])  # so short a soak has not met every class


@pytest.mark.parametrize(
    ("words", "said_of_it"),
    [
        (["-o", "safety.html"], ".md"),
        (["--soak", "100"], "--soak"),
        (["--soak", "1 ms"], "--soak"),
        (["--design", "d"], "d"),
        (["--seeds", "0"], "--seeds"),
    ],
)
def test_bad_input_is_one_line(capsys, words, said_of_it):
    code, _, err = said(capsys, *words)
    assert code == 2
    assert err.count("\n") == 1
    assert said_of_it in err


def test_the_case_is_not_good_where_a_fault_never_struck():
    some = tuple(variant for variant in VARIANTS if variant.kind is FaultKind.PC_KILLED)
    plan = MatrixPlan(designs=(), phases=(Phase.CUTTING,), variants=some)
    case = safety.SafetyCase(matrix=safety_matrix.Matrix(plan=plan, trials=()), ramps=(), soak=None)
    assert case.matrix.unproven == ((some[0], Phase.CUTTING),)
    assert not case.good
