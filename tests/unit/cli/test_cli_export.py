"""rtec export: tables for other programs, from a model file."""

import json

import pytest

from rtec.cli import main

MODEL = """
observe = "deviation"
observed = "mm"
position = "mm"
clock = "s"
range = ["0 mm", "300 mm"]
[[effect]]
name = "backlash"
backlash = "-14 um"
[[effect]]
name = "cyclic"
period = "25 mm"
harmonics = 1
amplitudes = ["6 um", "0 um"]
[[effect]]
name = "drift"
rate = "2 um/h"
"""


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "m.toml").write_text(MODEL)
    return tmp_path


def said(capsys, *words):
    code = main(["export", *words])
    out, err = capsys.readouterr()
    return code, out, err


def test_every_format_at_once(here, capsys):
    code, out, err = said(capsys, "m.toml", "--linuxcnc", "z.comp", "--csv", "z.csv", "--c", "z.c")
    assert code == 0
    assert out.count("µm at most") == 3
    assert "drift is not in the table: it changes with time or temperature" in err
    first, *_, last = (here / "z.comp").read_text().splitlines()
    assert (first, last.split()[0]) == ("0.000000 -0.007000 0.007000", "300.000000")
    assert "double rtec_error_mm(double position_mm, int direction)" in (here / "z.c").read_text()


def test_the_document_says_range_nodes_and_error(here, capsys):
    code, out, _ = said(capsys, "m.toml", "--csv", "z.csv", "--from", "50 mm", "--to", "4 inch", "--json")
    assert code == 0
    (table,) = json.loads(out)["tables"]
    assert (table["format"], table["from_mm"], table["to_mm"]) == ("csv", 50.0, pytest.approx(101.6))
    assert 0.0 < table["interpolation_error_um"] <= 0.101
    assert table["left_out"][0]["effect"] == "drift"
    assert len((here / "z.csv").read_text().splitlines()) == table["nodes"] + 3


def test_a_model_without_a_range_takes_that_of_its_maps_or_asks(here, capsys):
    bare = "\n".join(line for line in MODEL.splitlines() if not line.startswith("range"))
    (here / "bare.toml").write_text(bare)
    code, out, err = said(capsys, "bare.toml", "--csv", "z.csv")
    assert (code, out) == (2, "")
    assert err.startswith("rtec: --from: nothing is not allowed")
    (here / "map.toml").write_text(
        bare + '\n[[effect]]\nname = "pitch_map"\nnodes = ["10 mm", "90 mm", "200 mm"]\n'
        'amplitudes = ["0 um", "3 um", "1 um"]\n'
    )
    assert said(capsys, "map.toml", "--csv", "z.csv")[0] == 0
    assert (here / "z.csv").read_text().splitlines()[-1].startswith("200.000000,")


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["m.toml"], "--linuxcnc F.comp, --csv F.csv or --c F.c"),
        (["m.toml", "--csv", "m.toml"], "m.toml exists"),
        (["m.toml", "--csv", "no/z.csv"], "no folder"),
        (["none.toml", "--csv", "z.csv"], "none.toml"),
        (["m.toml", "--csv", "z.csv", "--from", "400 mm"], "--to: 300 mm"),
        (["m.toml", "--csv", "z.csv", "--to", "300"], "unit"),
        (["m.toml", "--csv", "z.csv", "--within", "-1 um"], "--within"),
        (["m.toml", "--linuxcnc", "z.comp", "--unit", "furlong"], "mm or inch"),
    ],
)
def test_bad_words_are_one_line_and_2(here, capsys, words, says):
    code, out, err = said(capsys, *words)
    assert (code, out) == (2, "")
    assert err.count("\n") == 1
    assert says in err
    assert not (here / "z.csv").exists()


def test_a_model_of_a_force_has_no_table_of_positions(here, capsys):
    text = MODEL.replace('"deviation"', '"force"').replace('observed = "mm"', 'observed = "n"')
    (here / "f.toml").write_text(text.split("[[effect]]")[0] + '[[effect]]\nname = "coulomb"\ncoulomb = "3 N"\n')
    code, _, err = said(capsys, "f.toml", "--csv", "z.csv")
    assert code == 2
    assert "observe: 'force' is not allowed" in err and "a table corrects positions, and no force" in err
    assert "measurement" not in err


def test_a_model_of_angles_has_no_table_in_mm(here, capsys):
    text = MODEL.replace(' mm"', ' deg"').replace('"mm"', '"deg"').split("[[effect]]")[0]
    (here / "a.toml").write_text(text + '[[effect]]\nname = "backlash"\nbacklash = "3 arcsec"\n')
    code, _, err = said(capsys, "a.toml", "--csv", "z.csv", "--from", "0 mm", "--to", "9 mm")
    assert code == 2
    assert "deviation in deg over positions in deg" in err and "measurement" not in err


def test_a_model_over_time_is_asked_for_no_position(here, capsys):
    lines = [line for line in MODEL.splitlines() if not line.startswith("range")]
    text = "\n".join(lines).replace('position = "mm"', 'position = "s"').replace("25 mm", "25 s")
    (here / "time.toml").write_text(text)
    code, out, err = said(capsys, "time.toml", "--csv", "z.csv")
    assert (code, out) == (2, "")
    assert err.startswith("rtec: model: deviation in mm over time is not allowed; allowed: a deviation in mm over p")


def test_a_diagnosis_says_where_it_was_measured(here, capsys):
    assert main(["blind", "new", "--seed", "3352", "-o", "my.csv"]) == 0
    assert main(["diagnose", "my.csv", "--save", "found.toml"]) == 0
    capsys.readouterr()
    assert said(capsys, "found.toml", "--linuxcnc", "z.comp")[0] == 0
    assert (here / "z.comp").read_text().split()[0] == "18.766000"
