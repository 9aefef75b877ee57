"""rtec tables: rows for programs, tables for people, one line for a word that is no design."""

import json

import pytest

from rtec.cli import main


def answer(capsys, *words):
    code = main(["tables", *words])
    out, err = capsys.readouterr()
    return code, out, err.splitlines()


def test_rows_hold_every_state_and_sign(capsys):
    code, out, err = answer(capsys, "--design", "C", "--json")
    found = json.loads(out)
    assert (code, err, found["design"]) == (0, [], "c")
    assert [(row["state"], row["sign"]) for row in found["rows"]] == [
        (s, sign) for s in (1, 2, 3, 4) for sign in "+-"
    ]
    assert found["rows"][3] == {
        "design": "c", "state": 2, "start_levels": "10", "sign": "-", "states": [1, 4], "levels": ["00", "01"],
        "counts": [-1, -2], "changes": ["A=0", "B=1"],
    }  # fmt: skip


def test_without_a_design_all_four(capsys):
    found = json.loads(answer(capsys, "--json")[1])
    assert [row["design"] for row in found["rows"]] == ["original"] * 2 + ["a"] * 8 + ["b"] * 8 + ["c"] * 8


def test_table_for_people(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    code, out, _ = answer(capsys, "--design", "original")
    assert code == 0
    row = next(line for line in out.splitlines() if "1 (00)" in line and " - " in line)
    assert [cell.strip() for cell in row.strip("│").split("│")] == [
        "1 (00)", "-", "4 3 2 1", "01 11 10 00", "-1 -2 -3 -4", "B=1 A=1 B=0 A=0",
    ]  # fmt: skip


@pytest.mark.parametrize(("word", "near"), [("orginal", "original"), ("d", "original, a, b, c")])
def test_unknown_design(capsys, word, near):
    code, out, err = answer(capsys, "--design", word)
    assert (code, out, len(err)) == (2, "", 1)
    assert err[0].startswith(f"rtec: --design: '{word}'")
    assert near in err[0]
