"""Files of trained predictors: the same numbers again, and one clear error for each file that is none."""

import math

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from rtec.errors import ArgumentError, FileFormatError, OutputError
from rtec.predictors import BidirectionalTable, NoError, UnidirectionalTable
from rtec.predictors.layered import LayeredNetwork, TrainedNetworks
from rtec.predictors.predictor_file import KnownPredictor, is_predictor_file, read_predictor, write_predictor
from rtec.predictors.tables import Between

NETWORK = """\
predictor = "networks"
version = 1
name = "network 1 lm"
source = "z.csv"
range = ["0 mm", "100 mm"]
interval = "1.8 um"
pitch = "5 mm"

[[network]]
inputs = ["position", "turn"]
middle = [50.0, 2.5]
half = [50.0, 2.5]
hidden = [1]
weights = [1.0, 2.0, 3.0, 4.0, 5]
bias_mm = 0.0783
factor_mm = 0.0351
"""
TABLE = """\
predictor = "table"
version = 1
name = "table"
range = ["0 mm", "10 mm"]
between = "cubic"

[forward]
positions_mm = [0.0, 5.0, 10.0]
errors_mm = [0.0, 0.001, 0.002]

[reverse]
positions_mm = [0.0, 10.0]
errors_mm = [0.003, 0.004]
"""
ONE_WAY = TABLE.partition("[reverse]")[0].replace('between = "cubic"', 'between = "linear"\nbacklash = "3 um"')


def predictors():
    rng = np.random.default_rng(0)
    networks = [
        LayeredNetwork(
            inputs=inputs,
            middle=rng.normal(size=len(inputs)),
            half=rng.uniform(0.1, 9.0, len(inputs)),
            hidden=hidden,
            weights=rng.normal(size=weights),
            bias_mm=rng.normal(),
            factor_mm=1.0 / 3.0,
        )
        for inputs, hidden, weights in ((("position", "direction"), (4, 3), 31), (("turn", "direction"), (8,), 33))
    ]
    yield TrainedNetworks(networks=tuple(networks), range_mm=(1.0 / 3.0, 100.1), pitch_mm=0.1 + 0.2)
    yield TrainedNetworks(networks=(networks[0],), range_mm=(-5.0, 1e-7))
    x = np.cumsum(rng.uniform(0.1, 1.0, 9))
    for between in Between:
        yield UnidirectionalTable(
            positions_mm=x, errors_mm=rng.normal(size=9), backlash_mm=1.0 / 7.0, between=between
        )
        yield BidirectionalTable(
            forward_positions_mm=x,
            forward_errors_mm=rng.normal(size=9),
            reverse_positions_mm=x,
            reverse_errors_mm=rng.normal(size=9),
            between=between,
        )


@pytest.mark.parametrize("predictor", list(predictors()), ids=lambda one: type(one).__name__)
@pytest.mark.parametrize("interval_mm", [0.0018, math.inf])
def test_what_is_written_comes_back_to_the_last_digit(tmp_path, predictor, interval_mm):
    file = tmp_path / "p.toml"
    known = KnownPredictor(predictor=predictor, name="a name", source="my file.csv", interval_mm=interval_mm)
    write_predictor(file, known)
    again = read_predictor(file)
    assert (again.name, again.source, again.interval_mm) == ("a name", "my file.csv", interval_mm)
    assert_array_equal(again.predictor.numbers, predictor.numbers)
    assert again.predictor.range_mm == predictor.range_mm
    assert is_predictor_file(file)


def test_a_name_with_quotes_and_control_characters_does_not_break_the_file(tmp_path):
    file = tmp_path / "p.toml"
    table = UnidirectionalTable(positions_mm=[0, 10], errors_mm=[0, 0.002], backlash_mm=0.003)
    write_predictor(file, KnownPredictor(predictor=table, name='x"\nversion = 9\\', source="C:\\data\tz.csv"))
    assert read_predictor(file).name == "x??version = 9?"


def test_the_shown_files_are_read(tmp_path):
    for text, kind in ((NETWORK, TrainedNetworks), (TABLE, BidirectionalTable), (ONE_WAY, UnidirectionalTable)):
        file = tmp_path / "p.toml"
        file.write_text(text)
        assert isinstance(read_predictor(file).predictor, kind)
    assert read_predictor(file).predictor.backlash_mm == pytest.approx(0.003)


def test_other_toml_is_no_predictor(tmp_path):
    file = tmp_path / "model.toml"
    file.write_text("[axis]\n")
    assert not is_predictor_file(file)
    with pytest.raises(FileFormatError, match='"networks" or "table"'):
        read_predictor(file)


def test_other_predictors_and_places_are_not_written(tmp_path):
    with pytest.raises(ArgumentError, match="tables or networks"):
        write_predictor(tmp_path / "p.toml", KnownPredictor(predictor=NoError(), name="none"))
    table = UnidirectionalTable(positions_mm=[0, 10], errors_mm=[0, 0.002], backlash_mm=0.003)
    with pytest.raises(OutputError):
        write_predictor(tmp_path / "no" / "p.toml", KnownPredictor(predictor=table, name="t"))


BAD = [
    ('"networks"', '"oracle"', "oracle"),
    ('predictor = "networks"', 'predictor = ["networks"]', "networks"),
    ("version = 1", "version = 2", "version = 2"),
    ("source", "sauce", "sauce"),
    ('name = "network 1 lm"\n', "", "name"),
    ('name = "network 1 lm"', "name = 7", "name"),
    ('["0 mm", "100 mm"]', '["0 mm"]', "range"),
    ('["0 mm", "100 mm"]', '["100 mm", "0 mm"]', "range"),
    ('["0 mm", "100 mm"]', '["0 deg", "100 deg"]', "range"),
    ('["0 mm", "100 mm"]', '["0 mm", "nan mm"]', "range"),
    ('range = ["0 mm", "100 mm"]\n', "", "range"),
    ("1.8 um", "-1.8 um", "interval"),
    ("1.8 um", "1.8 s", "interval"),
    ('pitch = "5 mm"', 'pitch = "0 mm"', "pitch"),
    ('pitch = "5 mm"\n', "", "pitch"),
    ("[[network]]", "[network]", "network"),
    ('["position", "turn"]', '["position", "phase"]', "inputs"),
    ('["position", "turn"]', '[["position"], "turn"]', "inputs"),
    ("middle = [50.0, 2.5]", "middle = [50.0]", "middle"),
    ("half = [50.0, 2.5]", "half = [50.0, 0.0]", "half"),
    ("half = [50.0, 2.5]", "half = [50.0, true]", "half"),
    ("hidden = [1]", "hidden = [1.0]", "hidden"),
    ("hidden = [1]", "hidden = []", "hidden"),
    ("hidden = [1]", "hidden = " + str([1] * 2000), "weights"),
    ("3.0, 4.0", "nan, 4.0", "weights"),
    ("3.0, 4.0", "1e300, 4.0", "weights"),
    ("3.0, 4.0", "3.0, 4.0, 6.0", "weights"),
    ("3.0, 4.0", '"3.0", 4.0', "weights"),
    ("weights = [1.0", "weights = [[1.0]", "weights"),
    ("bias_mm = 0.0783\n", "", "bias_mm"),
    ("factor_mm", "factor_um", "factor_um"),
]


@pytest.mark.parametrize(("old", "new", "named"), BAD)
def test_a_bad_file_of_networks_gives_one_error_with_file_and_key(tmp_path, old, new, named):
    refused(tmp_path, NETWORK, old, new, named)


@pytest.mark.parametrize(
    ("text", "old", "new", "named"),
    [
        (TABLE, '"cubic"', '"quintic"', "between"),
        (TABLE, '["0 mm", "10 mm"]', '["0 mm", "11 mm"]', "range"),
        (TABLE, "[0.0, 5.0, 10.0]", "[0.0, 5.0]", "forward"),
        (TABLE, "[0.0, 5.0, 10.0]", "[0.0, nan, 10.0]", "forward"),
        (TABLE, "[0.003, 0.004]", "[]", "reverse"),
        (TABLE, "[0.003, 0.004]", "{a = 1}", "reverse"),
        (TABLE, "[forward]", "[sideways]", "sideways"),
        (TABLE, "errors_mm = [0.003", "errors_um = [0.003", "errors_um"),
        (TABLE, 'between = "cubic"', 'between = "cubic"\nbacklash = "1 um"', "backlash"),
        (TABLE, 'between = "cubic"', 'between = "cubic"\npitch = "1 mm"', "pitch"),
        (ONE_WAY, 'backlash = "3 um"\n', "", "backlash"),
        (ONE_WAY, '"3 um"', '"3e9 m"', "backlash"),
        (ONE_WAY, "[0.0, 5.0, 10.0]", "[0.0, 5.0, 5.0]", "forward"),
        (ONE_WAY, "[forward]", "[reverse]", "forward"),
    ],
)
def test_a_bad_file_of_a_table_gives_one_error_with_file_and_key(tmp_path, text, old, new, named):
    refused(tmp_path, text, old, new, named)


def refused(folder, text, old, new, named):
    assert old in text
    file = folder / "p.toml"
    file.write_text(text.replace(old, new, 1))
    with pytest.raises((ArgumentError, FileFormatError)) as caught:
        read_predictor(file)
    message = str(caught.value)
    assert "p.toml" in message
    assert named in message.replace(str(folder), "")
    assert len(message.replace(str(folder), "")) < 500


@pytest.mark.parametrize(
    "content",
    [b"\xff\xfe", b"predictor = ", b"x = " + b"[" * 5000, b"a.b." * 3000, b"#" * 1_000_001, b"x = 1e999999"],
)
def test_what_is_hardly_toml_gives_one_error(tmp_path, content):
    file = tmp_path / "p.toml"
    file.write_bytes(content)
    with pytest.raises(FileFormatError, match=r"p\.toml"):
        read_predictor(file)


def test_a_table_of_many_points_is_read_back_and_one_of_absurd_magnitude_is_not(tmp_path, monkeypatch):
    x = np.arange(30_000) * 0.033
    table = UnidirectionalTable(positions_mm=x, errors_mm=np.sin(x) / 300.0, backlash_mm=0.0)
    file = tmp_path / "long.toml"
    write_predictor(file, KnownPredictor(predictor=table, name="table"))
    assert file.stat().st_size > 1_000_000
    assert is_predictor_file(file)
    assert read_predictor(file).predictor == table
    monkeypatch.setattr("rtec.predictors.predictor_file.MOST_BYTES", 500_000)
    with pytest.raises(FileFormatError, match="at most 500000 bytes"):
        read_predictor(file)
