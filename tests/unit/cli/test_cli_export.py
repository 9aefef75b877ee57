"""rtec export: tables for other programs, from a model file."""

import json

import pytest

from rtec.predictors import BidirectionalTable
from rtec.predictors.layered import LayeredNetwork, TrainedNetworks
from rtec.predictors.predictor_file import KnownPredictor, write_predictor
from rtec.predictors.warm.features import Feature
from rtec.predictors.warm.linear import Linear
from rtec.predictors.warm.warm_model import WarmModel

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


# models of heat


WARM = """
[[effect]]
name = "thermal_growth"
sensor = "temperature_screw"
expansion = "10 um/m/K"
[[effect]]
name = "warm_up"
time_constant = "20 min"
final = "20 um"
"""


@pytest.fixture
def warm(here):
    (here / "w.toml").write_text(MODEL.replace('[[effect]]\nname = "drift"\nrate = "2 um/h"\n', "") + WARM)
    return here


@pytest.mark.parametrize(
    "written", [("--csv", "z.csv"), ("--c", "z.c"), ("--sinumerik", "z.spf"), ("--linuxcnc", "z")]
)
@pytest.mark.parametrize(
    ("words", "says"),
    [
        ([], "--temperature is missing; give screw=22degC: thermal_growth"),
        (["--temperature", "screw=25degC"], "--at is missing"),
        (["--at", "1 h", "--temperature", "scrw=25degC"], "scrw is not valid"),
        (["--at", "1 h", "--temperature", "screw=25"], "a thermometer and its temperature, such as screw=22degC"),
        (["--at", "1 h", "--temperature", "screw=25degC", "--temperature", "SCREW=26degC"], "screw twice"),
        (["--at", "-1 h", "--temperature", "screw=25degC"], "--at"),
        (["--at", "60", "--temperature", "screw=25degC"], "unit"),
    ],
)
def test_a_model_of_heat_is_not_exported_without_its_warmth(warm, said, written, words, says):
    code, out, err = said("w.toml", *written, *words)
    assert (code, out) == (2, "")
    assert says in err and err.count("\n") == 1
    assert not (warm / written[1]).exists()


@pytest.mark.parametrize("temperature", ["screw=25degC", "temperature_screw = 77 degF", "screw=298.15K"])
def test_a_table_is_that_of_its_warmth(warm, said, temperature):
    code, out, _ = said("w.toml", "--csv", "z.csv", "--at", "20 min", "--temperature", temperature)
    assert code == 0 and "screw at 25 degC, 20 min after it was switched on" in out
    lines = (warm / "z.csv").read_text().splitlines()
    assert "# warmth: screw at 25 degC, 20 min after it was switched on" in lines
    first, last = (list(map(float, line.split(","))) for line in (lines[3], lines[-1]))
    warmed = 20.0 * (1 - 2.718281828459045**-1)
    assert first[1:] == pytest.approx([warmed - 7.0, warmed + 7.0], abs=2e-3)
    assert last[1:] == pytest.approx([warmed - 7.0 + 15.0, warmed + 7.0 + 15.0], abs=2e-3)


def test_where_nothing_is_warm_a_temperature_means_nothing(here, said):
    code, _, err = said("m.toml", "--csv", "z.csv", "--temperature", "screw=20degC")
    assert code == 2 and "--temperature means nothing for m.toml" in err


@pytest.fixture
def shift(here):
    model = WarmModel(
        features=(Feature(of="temperature_nose"), Feature(of="spindle_speed", lag_s=600.0, heat=True)),
        regressor=Linear(centre=[20.0, 0.0], intercept=0.0, slopes=[4.0, 1.0]),
        observe="z",
        sign=-1,
        ranges={"temperature_nose": (15.0, 30.0)},
    )
    write_predictor(here / "s.toml", KnownPredictor(predictor=model, name="nose", axis=3))
    return here


HOT = ("--temperature", "nose=22degC", "--spindle", "1000rpm")


def test_a_model_without_positions_is_the_same_everywhere(shift, said):
    code, out, err = said("s.toml", *HOT, "--sinumerik", "z.spf", "--csv", "z.csv", "--from", "0mm", "--to", "9mm")
    assert code == 0
    assert "$SA_TEMP_COMP_ABS_VALUE[AX3]=-0.009000" in (shift / "z.spf").read_text().splitlines()
    assert (shift / "z.csv").read_text().splitlines()[-2:] == ["0.000000,-9.000,-9.000", "9.000000,-9.000,-9.000"]
    assert "thermal shift of AX3, nose at 22 degC, spindle at 1000 rpm: -9 µm" in out
    assert "nose knows no positions: -9 µm everywhere" in err


def test_its_spindle_may_have_run_for_a_while(shift, answer):
    (one,) = answer("s.toml", *HOT, "--at", "10 min", "--sinumerik", "z.spf")["tables"]
    assert one["shift_um"] == pytest.approx(-8.0 - (1 - 2.718281828459045**-1))


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("--temperature", "nose=22degC"), "--spindle is missing; give 3000rpm: nose follows it"),
        (("--spindle", "1000rpm"), "--temperature is missing; give nose=22degC"),
        (("--temperature", "nose=31degC", "--spindle", "1000rpm"), "temperature_nose of nose: 31"),
        (("--temperature", "nase=22degC", "--spindle", "1000rpm"), "did you mean 'nose'"),
        ((*HOT, "--csv", "z.csv"), "--from is missing"),
    ],
)
def test_what_it_follows_has_to_be_known(shift, said, words, says):
    code, _, err = said("s.toml", *words, *(() if "--csv" in words else ("--sinumerik", "z.spf")))
    assert code == 2 and says in err and err.count("\n") == 1


# controls and programs


def test_tables_of_controls_say_the_error_that_is_left(here, answer):
    words = ["m.toml", "--sinumerik", "z.spf", "--heidenhain", "Z.COM", "--axis", "z", "--within", "0.5um"]
    sinumerik, heidenhain = answer(*words)["tables"]
    assert (sinumerik["axis"], heidenhain["axis"]) == ("AX3", "Z")
    assert sinumerik["left_max_um"] == pytest.approx(7.0, abs=0.51)  # half of the reversal error
    assert heidenhain["left_max_um"] < 0.6
    assert (here / "Z.COM").read_text().startswith("BEGIN Z.COM MM\nNR   AXISPOS       BACKLASH      Z\n0    +0.0000")


def test_a_program_is_corrected(here, answer, said):
    (here / "part.nc").write_text("G0 X10\nG1 X20 F100\nX10\nX400\n")
    words = ["m.toml", "--gcode", "part.nc", "-o", "out.nc", "--zero", "5 mm"]
    (program,) = answer(*words)["tables"]
    assert (program["moves"], program["moves_outside"], program["axis"]) == (4, 1, "X")
    assert program["left_max_um"] < 0.3 and program["before_max_um"] > 5.0
    head = (here / "out.nc").read_text().splitlines()[:2]
    assert head[0] == "(Positions of X corrected by rtec for the errors of m.toml)"
    code, out, err = said(*words, "--force")
    assert code == 0 and out.startswith("out.nc: 4 moves of X corrected for m.toml; ")
    assert "1 moves end outside of 0 to 300 mm" in err and "drift is not in the table" in err


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["--gcode", "part.nc"], "--gcode needs -o OUT.nc"),
        (["-o", "out.nc"], "-o needs --gcode PART.nc"),
        (["--gcode", "none.nc", "-o", "out.nc"], "none.nc: there is no such file"),
        (["--gcode", "part.nc", "-o", "part.nc", "--force"], "another file than the program itself"),
        (["--gcode", "part.nc", "-o", "part.nc"], "part.nc exists"),
        (["--gcode", "part.nc", "-o", "out.nc", "--axis", "a"], "--axis: a"),
        (["--gcode", "part.nc", "-o", "out.nc", "--resolution", "1 mm"], "--resolution: 1 mm"),
        (["--gcode", "part.nc", "-o", "no/out.nc"], "no"),
        (["--sinumerik", "z.spf", "--axis", "spindle"], "--axis"),
        (["--heidenhain", "z.com", "--axis", "AX1"], "--axis"),
    ],
)
def test_bad_words_of_programs_and_controls(here, said, words, says):
    (here / "part.nc").write_text("G0 X10\n")
    code, out, err = said("m.toml", *words)
    assert (code, out) == (2, "")
    assert says in err and err.count("\n") == 1
    assert (here / "part.nc").read_text() == "G0 X10\n" and not (here / "out.nc").exists()
