"""rtec pc: its words, its predictors, and its end."""

import json
import os
import time

import pytest

from rtec.cli import main
from rtec.errors import ArgumentError

ERRORS = "position_mm,forward_um,reverse_um\n-10,12,12\n50,12,12\n"


@pytest.fixture
def table(tmp_path):
    file = tmp_path / "z.csv"
    file.write_text(ERRORS)
    return file


@pytest.fixture
def box(on_a_bus):
    """A box on a virtual bus, in a thread: its channel."""
    from rtec.cli.box import _warm_up
    from rtec.machine.station import Station, StationSettings
    from rtec.requester.supervision import SupervisionLimits

    settings = StationSettings(supervision=SupervisionLimits(cycle_ps=50 * 10**9, watchdog_ps=300 * 10**9))
    _warm_up(settings)  # as rtec box does: compiling with a PC on the bus would take longer than the watchdog timeout
    station = Station(settings)
    return on_a_bus(station), station


def run_pc(capsys, *words):
    code = main(["pc", "--json", "--cycle", "50ms", *words])
    out, err = capsys.readouterr()
    return code, json.loads(out), err


def on(channel):
    return ["--interface", "virtual", "--channel", channel]


def test_a_table_is_corrected(capsys, box, tmp_path):
    (tmp_path / "z.comp").write_text("-10 -9.988 -9.988\n50 50.012 50.012\n")
    channel, station = box
    table = ["--table", str(tmp_path / "z.comp"), "--table-unit", "mm"]
    code, report, _ = run_pc(capsys, *on(channel), *table, "--duration", "2s")
    assert (code, report["ended"]) == (0, "duration")
    # 12 µm are three steps of 4 counts
    assert (report["axes"][0]["requested"], report["axes"][0]["completed"]) == (3, 3)
    assert report["handshake"]["number"] == 1
    assert station.view.inserted_counts == 12


@pytest.fixture
def warm(tmp_path):
    """The file of a model: 4 µm for each kelvin of the nose above 20 degC, trained up to 30 degC."""
    import numpy as np

    from rtec.predictors import KnownPredictor, write_predictor
    from rtec.predictors.warm.features import Feature
    from rtec.predictors.warm.linear import Linear
    from rtec.predictors.warm.warm_model import WarmModel

    nose = "temperature_nose"
    line = Linear(centre=np.array([20.0]), intercept=0.0, slopes=np.array([4.0]))
    model = WarmModel(features=(Feature(of=nose),), regressor=line, observe="z", ranges={nose: (15.0, 30.0)})
    write_predictor(tmp_path / "warm.toml", KnownPredictor(predictor=model, name="nose"))
    return tmp_path / "warm.toml"


@pytest.mark.parametrize(("degc", "steps", "held"), [("23", 3, False), ("31", 0, True)])
def test_a_model_of_temperatures_is_followed_within_what_it_was_trained_for(capsys, box, warm, degc, steps, held):
    heat = warm.with_name("heat.csv")
    heat.write_text(f"time_s,temperature_nose_degc\n0,20\n1,{degc}\n")
    channel, station = box
    words = ["--model", str(warm), "--heat", str(heat), "--duration", "2s"]
    code, report, _ = run_pc(capsys, *on(channel), *words)
    assert (code == 1) is held
    assert report["axes"][0]["completed"] == steps
    assert station.view.inserted_counts == 4 * steps


@pytest.mark.parametrize(
    ("heat", "says"),
    [
        (None, "--heat is missing; give a file with temperature_nose, which the model of z follows"),
        ("time_s,temperature_nase_degc\n", "did you mean 'temperature_nose'|temperature_nase"),
        ("time_s\n", "the headings 'time_s'"),
    ],
)
def test_a_model_of_temperatures_needs_its_thermometers(capsys, warm, heat, says):
    import re

    words = ["pc", "--model", str(warm)]
    if heat is not None:
        warm.with_name("heat.csv").write_text(heat)
        words += ["--heat", str(warm.with_name("heat.csv"))]
    assert main(words) == 2
    err = capsys.readouterr().err
    assert err.count("\n") == 1 and re.search(says, err)


def test_thermometers_without_a_model_of_them_mean_nothing(capsys, table):
    table.with_name("heat.csv").write_text("temperature_nose_degc\n20\n")
    assert main(["pc", "--table", str(table), "--heat", str(table.with_name("heat.csv"))]) == 2
    assert "--heat needs --model of a warm machine" in capsys.readouterr().err


def test_with_caution_no_more_is_asked_for_than_the_interval_supports(capsys, box, tmp_path):
    """Of 12 ± 5 µm, 7 µm are sure: two steps of 4 counts."""
    from rtec.predictors import KnownPredictor, UnidirectionalTable, write_predictor

    channel, station = box
    table = UnidirectionalTable(positions_mm=[-5.0, 200.0], errors_mm=[0.012, 0.012], backlash_mm=0.0)
    file = tmp_path / "p.toml"
    write_predictor(file, KnownPredictor(predictor=table, name="table", interval_mm=0.005))
    assert of_files([1], file)[1].error_mm(0.0, 1) == 0.012
    code, report, _ = run_pc(capsys, *on(channel), "--model", str(file), "--cautious", "--duration", "2s")
    assert code == 0
    assert report["axes"][0]["completed"] == 2
    assert station.view.inserted_counts == 8


def test_probing_corrects_nothing(capsys, box, table):
    channel, station = box
    code, report, _ = run_pc(capsys, *on(channel), "--table", str(table), "--probe", "--duration", "500ms")
    assert code == 0
    assert station.view.inserted_counts == 0
    assert report["axes"][0]["status"] in ("PROBING", "HELD")


def test_a_large_correction_goes_at_once(capsys, box, tmp_path):
    channel, _ = box
    file = tmp_path / "hot.csv"
    file.write_text(ERRORS.replace("12", "200"))
    code, report, _ = run_pc(capsys, *on(channel), "--table", str(file), "--large", "--duration", "2s")
    assert code == 0
    assert report["axes"][0]["completed"] == 50
    assert report["handshake"]["number"] == 1  # one request, not 17 of three steps


def test_a_deviation_beyond_the_limit_holds(capsys, box, table):
    channel, _ = box
    code, report, err = run_pc(capsys, *on(channel), "--table", str(table), "--deviation-limit", "5um")
    assert (code, report["ended"]) == (1, "held")
    assert report["axes"][0]["reason"] == "DEVIATION_LIMIT"
    assert "the predictor asks for more than the limit" in err.splitlines()[-1]


def test_no_box_offers_a_line(capsys):
    begun_s = time.monotonic()
    assert main(["pc", "--channel", f"none-{os.getpid()}", "--start-up", "400ms"]) == 2
    assert time.monotonic() - begun_s >= 0.4
    waiting, error = capsys.readouterr().err.splitlines()
    assert waiting == f"rtec: waiting up to 0.4 s for a box on the line 'none-{os.getpid()}': 'rtec box' offers it"
    assert "no box has offered it for 0.4 s; start 'rtec box' in another terminal" in error


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--table", "none.csv"], "none.csv"),
        (["--table", "none.comp"], "--table-unit"),
        (["--table", "none.csv", "--table-unit", "inch"], "--table-unit"),
        (["--table", "a.csv", "--model", "b.toml"], "--model"),
        (["--home", "0mm"], "--home: 0mm is not valid; use 25.4 to 1016 mm, the range of the predictor"),
        (["--home", "1"], "--home: '1'"),
        (["--watchdog", "10ms"], "--watchdog: "),
        (["--completion-timeout", "2"], "--completion-timeout: '2'"),
        (["--deviation-limit", "-1um"], "--deviation-limit: "),
        (["--start-up", "never"], "--start-up: 'never'"),
        (["--axes", "0"], "--axes: 0"),
        (["--design", "x"], "design: 'x'"),
    ],
)
def test_bad_words_are_refused_in_one_line(capsys, words, said):
    assert main(["pc", "--interface", "virtual", "--channel", "x", *words]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1 and said in lines[0]


def axis_file(folder, axis, others, name=None):
    """Write a predictor of an axis that looks at others."""
    from rtec.predictors import AxisTables, KnownPredictor, write_predictor
    from rtec.predictors.axis_tables import AxisTable

    tables = [AxisTable(of=of, positions_mm=[0.0, 300.0], values=[0.0, 0.01]) for of in ("position", *others)]
    file = folder / (name or f"axis_{axis}.toml")
    predictor = AxisTables(tables=tuple(tables), range_mm=(0.0, 300.0))
    write_predictor(file, KnownPredictor(predictor=predictor, name="straightness", axis=axis))
    return file


def of_files(numbers, *files):
    from rtec.cli.pc import _predictors

    return _predictors(numbers, None, None, list(files), 0.0, 300.0, False)[0]


def test_files_are_for_the_axes_that_they_name(tmp_path, capsys):
    third, first = axis_file(tmp_path, 3, ["position_1"]), axis_file(tmp_path, 1, ["position_2", "position_3"])
    found = of_files([1, 2, 3], third, first)
    assert [found[axis].inputs[2:] for axis in (1, 2, 3)] == [("position_2", "position_3"), (), ("position_1",)]
    assert "axis 2: not corrected" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("numbers", "files", "says"),
    [
        ([1, 2], [(3, [])], "axis_3.toml, a file of axis 3"),
        ([1, 2], [(1, []), (1, [])], "a second file of axis 1"),
        ([1, 2], [(None, ["position_2"])], "does not say of which axis"),
        ([1, 2], [(1, []), (None, [])], "does not say of which axis"),
        ([1], [(1, ["position_2"])], "axis 1 alone"),
    ],
)
def test_files_that_leave_an_axis_open_are_refused(tmp_path, numbers, files, says):
    with pytest.raises(ArgumentError, match=says):
        of_files(numbers, *(axis_file(tmp_path, axis, others) for axis, others in files))
