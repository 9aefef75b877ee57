"""rtec tables: rows for programs, tables for people."""

import pytest

VERB = "tables"


def test_rows_hold_every_state_and_sign(answer):
    found = answer("--design", "C")
    assert found["design"] == "c"
    assert [(row["state"], row["sign"]) for row in found["rows"]] == [
        (s, sign) for s in (1, 2, 3, 4) for sign in "+-"
    ]
    assert found["rows"][3] == {
        "design": "c", "state": 2, "start_levels": "10", "sign": "-", "states": [1, 4], "levels": ["00", "01"],
        "counts": [-1, -2], "changes": ["A=0", "B=1"],
    }  # fmt: skip
    assert [row["design"] for row in answer()["rows"]] == ["original"] * 2 + ["a"] * 8 + ["b"] * 8 + ["c"] * 8


def test_table_for_people(said, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    code, out, _ = said("--design", "original")
    assert code == 0
    row = next(line for line in out.splitlines() if "1 (00)" in line and " - " in line)
    assert [cell.strip() for cell in row.strip("│").split("│")] == [
        "1 (00)", "-", "4 3 2 1", "01 11 10 00", "-1 -2 -3 -4", "B=1 A=1 B=0 A=0",
    ]  # fmt: skip


@pytest.mark.parametrize(("word", "near"), [("orginal", "original"), ("d", "original, a, b, c")])
def test_unknown_design(refused, word, near):
    err = refused("--design", word)
    assert err.startswith(f"rtec: --design: '{word}'") and near in err
