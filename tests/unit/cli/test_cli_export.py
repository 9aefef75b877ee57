"""rtec export: tables for other programs, from a model file."""

import json

import pytest

from rtec.predictors import BidirectionalTable
from rtec.predictors.layered import LayeredNetwork, TrainedNetworks
from rtec.predictors.predictor_file import KnownPredictor, write_predictor

VERB = "export"

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


def test_every_format_at_once(here, said):
    code, out, err = said("m.toml", "--linuxcnc", "z.comp", "--csv", "z.csv", "--c", "z.c")
    assert code == 0
    assert out.count("µm at most") == 3
    assert "drift is not in the table: it changes with time or temperature" in err
    first, *_, last = (here / "z.comp").read_text().splitlines()
    assert (first, last.split()[0]) == ("0.000000 -0.007000 0.007000", "300.000000")
    assert "double z_error_mm(double position_mm, int direction)" in (here / "z.c").read_text()


def test_the_document_says_range_nodes_and_error(here, said):
    code, out, _ = said("m.toml", "--csv", "z.csv", "--from", "50 mm", "--to", "4 inch", "--json")
    assert code == 0
    (table,) = json.loads(out)["tables"]
    assert (table["format"], table["from_mm"], table["to_mm"]) == ("csv", 50.0, pytest.approx(101.6))
    assert 0.0 < table["interpolation_error_um"] <= 0.101
    assert table["left_out"][0]["effect"] == "drift"
    assert len((here / "z.csv").read_text().splitlines()) == table["nodes"] + 3


def test_a_model_without_a_range_takes_that_of_its_maps_or_asks(here, said):
    bare = "\n".join(line for line in MODEL.splitlines() if not line.startswith("range"))
    (here / "bare.toml").write_text(bare)
    code, out, err = said("bare.toml", "--csv", "z.csv")
    assert (code, out) == (2, "")
    assert err.startswith("rtec: --from is missing; give a position")
    (here / "map.toml").write_text(
        bare + '\n[[effect]]\nname = "pitch_map"\nnodes = ["10 mm", "90 mm", "200 mm"]\n'
        'amplitudes = ["0 um", "3 um", "1 um"]\n'
    )
    assert said("map.toml", "--csv", "z.csv")[0] == 0
    assert (here / "z.csv").read_text().splitlines()[-1].startswith("200.000000,")


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["m.toml"], "--linuxcnc, --sinumerik, --heidenhain, --csv or --c with a file, or --gcode PART.nc -o OUT.nc"),
        (["m.toml", "--csv", "m.toml"], "m.toml exists"),
        (["m.toml", "--csv", "z.csv", "--from", "400 mm"], "--from: 400 mm"),
        (["m.toml", "--csv", "z.csv", "--to", "300"], "unit"),
        (["m.toml", "--csv", "z.csv", "--within", "-1 um"], "--within"),
        (["m.toml", "--linuxcnc", "z.comp", "--unit", "furlong"], "mm or inch"),
    ],
)
def test_bad_words_are_one_line_and_2(here, said, words, says):
    code, out, err = said(*words)
    assert (code, out) == (2, "")
    assert err.count("\n") == 1
    assert says in err
    assert not (here / "z.csv").exists()


def test_a_model_of_a_force_has_no_table_of_positions(here, said):
    text = MODEL.replace('"deviation"', '"force"').replace('observed = "mm"', 'observed = "n"')
    (here / "f.toml").write_text(text.split("[[effect]]")[0] + '[[effect]]\nname = "coulomb"\ncoulomb = "3 N"\n')
    code, _, err = said("f.toml", "--csv", "z.csv")
    assert code == 2
    assert "observe: 'force' is not valid" in err and "a table corrects positions, and no force" in err
    assert "measurement" not in err


# trained predictors

TURN = LayeredNetwork(
    inputs=("turn", "direction"), middle=[2.5, 0.5], half=[2.5, 0.5], hidden=(2,),
    weights=[1.0, -2.0, 0.5, 0.3, 0.1, 0.2, 0.6, -0.4, 0.1], bias_mm=0.001, factor_mm=0.004,
)  # fmt: skip
NETWORKS = TrainedNetworks(networks=(TURN,), range_mm=(2.0, 43.0), pitch_mm=5.0)
TABLE = BidirectionalTable(
    forward_positions_mm=[0.0, 10.0, 30.0],
    forward_errors_mm=[0.001, 0.004, -0.002],
    reverse_positions_mm=[1.0, 11.0, 31.5],
    reverse_errors_mm=[0.006, 0.009, 0.003],
)


@pytest.fixture
def trained(here):
    write_predictor(here / "n.toml", KnownPredictor(predictor=NETWORKS, name="network 2", interval_mm=0.001))
    write_predictor(here / "t.toml", KnownPredictor(predictor=TABLE, name="table"))
    return here


def test_a_trained_predictor_leaves_as_c_whole(trained, said):
    code, out, err = said("n.toml", "--c", "z axis.c")
    assert (code, err) == (0, "")
    assert out == "z axis.c: z_axis_error_mm(), the predictor itself from 2 to 43 mm, in double precision\n"
    assert "double z_axis_error_mm(double position_mm, int direction)\n" in (trained / "z axis.c").read_text()


def test_its_document_says_function_and_precision(trained, answer):
    words = ["n.toml", "--c", "z.c", "--csv", "z.csv", "--precision", "single", "--to", "40mm"]
    tables = {table["format"]: table for table in answer(*words)["tables"]}
    whole = {"function": "z_error_mm", "precision": "single", "nodes": None, "interpolation_error_um": 0.0}
    assert tables["c"].items() >= {**whole, "from_mm": 2.0, "to_mm": 40.0, "left_out": []}.items()
    assert tables["csv"]["nodes"] > 16 and "function" not in tables["csv"]
    assert "position_mm > 40.0f" in (trained / "z.c").read_text()


@pytest.mark.parametrize(
    ("change", "words", "says"),
    [
        (("version = 1", "version = 2"), (), "bad.toml: version = 2; use version = 1"),
        (("name =", 'colour = "red"\nname ='), (), "unknown key 'colour'"),
        (('"networks"', '"oracle"'), (), "predictor = 'oracle'"),
        (("predictor =", "study ="), (), "bad.toml: unknown key 'study'"),
        (("half = [2.5", "half = [0.0"), (), "half"),
        (("", ""), ("--precision", "quad"), "--precision: 'quad' is not valid; use double or single"),
        (("", ""), ("--from", "50 mm"), "--from: 50 mm"),
        (('pitch = "5.0 mm"', 'pitch = "0.00001 mm"'), ("--csv", "z.csv"), "4.1e+06 turns of the screw"),
    ],
)
def test_a_bad_predictor_file_is_one_line_and_2(trained, said, change, words, says):
    text = (trained / "n.toml").read_text()
    assert change[0] in text
    (trained / "bad.toml").write_text(text.replace(*change, 1))
    code, out, err = said("bad.toml", *(words if "--csv" in words else ("--c", "z.c", *words)))
    assert (code, out) == (2, "")
    assert err.count("\n") == 1 and says in err
    assert not (trained / "z.c").exists() and not (trained / "z.csv").exists()
