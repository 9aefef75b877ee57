"""rtec safety: the table, the page, the exit code, and what it refuses."""

import json
from pathlib import Path

import pytest

import rtec.examples
from rtec.cli import main
from rtec.injector import Design
from rtec.machine.faults import FaultKind
from rtec.report.terminal_safety import show
from rtec.verify.safety import case as safety, matrix as safety_matrix
from rtec.verify.safety.case import Ramp
from rtec.verify.safety.matrix import MatrixPlan, Outcome
from rtec.verify.safety.phases import Phase
from rtec.verify.safety.variants import VARIANTS


@pytest.fixture(autouse=True)
def small(monkeypatch):
    """Three faults in two phases, so that a command takes a second."""
    kinds = (FaultKind.PC_KILLED, FaultKind.FRAME_DUPLICATED, FaultKind.LINE_BROKEN)

    def plan(**words):
        some = tuple(variant for variant in VARIANTS if variant.kind in kinds)
        return MatrixPlan(**({"phases": (Phase.CUTTING, Phase.AT_REST), "variants": some} | words))

    monkeypatch.setattr(safety_matrix, "MatrixPlan", plan)


def said(capsys, *words):
    code = main(["safety", *words])
    return code, *capsys.readouterr()


def test_the_table_says_what_happens(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    code, out, _ = said(capsys, "--seeds", "1", "--design", "c")
    lines = [" ".join(line.split()) for line in out.splitlines()]
    assert code == 0
    assert lines[1] == "fault cut rest"
    assert "PC killed stop stop" in lines
    at = lines.index("frame duplicated")
    assert lines[at + 1] == "once, PC to box tol. tol."
    at = lines.index("one line of a pair broken")
    assert lines[at + 1] == "for 50 ms lost -"
    assert "PC killed; cutting, design c, run 0: safe stop after" in out
    *lines, again = out.splitlines()
    assert max(map(len, lines)) <= 80
    assert again.startswith("play it again: rtec safety --fault 'one line of a pair broken, for 50 ms' --phase")


def test_a_fault_in_a_phase_alone_strikes_as_among_the_others(capsys):
    words = ["--seeds", "1", "--design", "c", "--json"]
    everything = json.loads(said(capsys, *words)[1])["rows"]
    code, out, _ = said(capsys, *words, "--fault", "frame-duplicated", "--phase", "cutting", "--fault", "PC killed")
    document = json.loads(out)
    wanted = [row for row in everything if row["phase"] == "cutting" and row["class"] != "one line of a pair broken"]
    assert code == 0
    assert sorted(document["rows"], key=str) == sorted(wanted, key=str)
    assert (document["ramps"], document["reasons"]) == ([], [])


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


def test_an_undetected_error_is_an_exit_code_of_one(capsys, monkeypatch):
    monkeypatch.setattr(safety_matrix, "is_wrong", lambda axis, twin: axis is not twin)
    code, out, _ = said(capsys, "--seeds", "1", "--design", "c")
    assert code == 1
    assert "undetected error: frame duplicated, once, PC to box, cutting, design c, run 0" in " ".join(out.split())
    assert "FAILS:" in out


def test_a_limit_that_catches_nothing_is_a_reason(capsys):
    ramp = Ramp(design=Design.C, limit="limit_mm = 0.05", outcome=Outcome.UNDETECTED, reason="", off_mm=0.1)
    case = safety.SafetyCase(
        matrix=safety_matrix.Matrix(plan=MatrixPlan(variants=()), trials=()), ramps=(ramp,), soak=None
    )
    assert case.reasons == ("a PC that runs away, design c, limit limit_mm = 0.05: undetected",)
    assert not case.good
    show(case)
    assert case.reasons[0] in capsys.readouterr().out


def test_a_soak_beside_it(capsys):
    code, out, _ = said(capsys, "--seeds", "1", "--design", "c", "--soak", "2min", "--json")
    soak = json.loads(out)["soak"]
    assert soak["hours"] >= 2.2 / 60.0
    assert sum(soak["outcomes"].values()) == soak["episodes"]
    assert soak["undetected"] == []
    assert (code == 0) == (soak["missing"] == [])  # so short a soak has not met every class


OWN = Path(rtec.examples.__file__).parent / "mutants.py"


def test_a_class_of_ones_own_that_is_wrong_without_any_fault_is_told_so(capsys):
    words = (
        "--algorithm",
        f"{OWN}:COrder",
        "--step",
        "2",
        "--phase",
        "cutting",
        "--fault",
        "pc-killed",
        "--seeds",
        "1",
    )
    code, out, _ = said(capsys, *words)
    assert code == 1
    assert out.startswith("mutants.py:COrder, in the place of:")
    assert "wrong without any fault: cutting, design c, run 0" in out
    assert f"rtec safety --algorithm {OWN}:COrder --fault 'PC killed'" in out


@pytest.mark.parametrize(
    ("words", "said_of_it"),
    [
        (["-o", "safety.html"], ".md"),
        (["--soak", "100"], "--soak"),
        (["--soak", "1 ms"], "--soak"),
        (["--design", "d"], "d"),
        (["--seeds", "0"], "--seeds"),
        (["--fault", "pc-kiled"], "--fault: 'pc-kiled'"),
        (["--fault", "pc-kiled"], "did you mean 'pc-killed'?"),
        (["--fault", "x"], "babbling-node, bus-off"),
        (["--fault", ""], "--fault"),
        (["--phase", "cuting"], "did you mean 'cutting'?"),
        (["--phase", "x"], "start-up, at-rest"),
        (["--fault", "stale data valid, for 20 ms", "--phase", "at-rest"], "cutting, rapid"),
        (["--algorithm", "none.py:Mine", "--design", "c"], "none.py: no such file"),
        (["--algorithm", "none.ihx", "--design", "c"], "none.ihx: No such file"),
        (["--algorithm", f"{OWN}:Mine", "--design", "c"], "there is no class Mine"),
        (["--algorithm", f"{OWN}:COrder"], "--design original|a|b|c once, or --step N"),
        (["--algorithm", f"{OWN}:COrder", "--design", "c", "--design", "a"], "--design original|a|b|c once"),
        (["--algorithm", f"{OWN}:COrder", "--step", "3"], "--step: 3 in 00,10,11,01 fits no box"),
        (["--algorithm", f"{OWN}:COrder", "--step", "2", "--design", "c"], "--step does not go with --design"),
        (["--algorithm", str(OWN), "--design", "c"], "does not say which class"),
        (["--algorithm", "top.v", "--design", "c"], "cannot work in these boxes; use file.py:Name or image.ihx"),
        (["--algorithm", "c", "--design", "c"], "a design of rtec needs no --algorithm"),
        (["--states", "00"], "--states needs --algorithm"),
    ],
)
def test_bad_input_is_one_line(capsys, words, said_of_it):
    code, _, err = said(capsys, *words)
    assert code == 2
    assert err.count("\n") == 1
    assert said_of_it in err


def test_the_case_is_not_good_where_a_fault_never_struck():
    some = tuple(variant for variant in VARIANTS if variant.kind is FaultKind.PC_KILLED)
    plan = MatrixPlan(designs=(Design.C,), phases=(Phase.CUTTING,), variants=some)
    case = safety.SafetyCase(matrix=safety_matrix.Matrix(plan=plan, trials=()), ramps=(), soak=None)
    assert case.matrix.unproven == ((some[0], Phase.CUTTING),)
    assert not case.good
