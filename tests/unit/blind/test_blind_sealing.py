"""Data files and their sealed secrets: what is written, what is refused, what a change does."""

import base64
import hashlib
import json

import pytest

from rtec.blind.game import play
from rtec.blind.plan import PLANS
from rtec.blind.scenario import Scenario
from rtec.blind.sealing import new, reveal, sealed_path
from rtec.errors import ArgumentError, FileFormatError, OutputError
from rtec.metrology import read_measurement

QUICK = Scenario(names=("scale",), plan=PLANS["single_pass"])


@pytest.fixture
def data(tmp_path):
    file = tmp_path / "data.csv"
    new(5, file, scenario=QUICK)
    return file


def test_a_data_file_reads_back_as_the_measurement_played(data):
    played, _ = play(QUICK, 5)
    read = read_measurement(data)
    assert set(read.columns) == set(played.columns)
    for quantity, column in played.columns.items():
        assert read.columns[quantity].unit == column.unit
        assert read.columns[quantity].values.tolist() == column.values.tolist()
    assert read.facts == played.facts


def test_a_secret_comes_back_whole(data):
    _, secret = play(QUICK, 5)
    shown = reveal(data)
    assert shown.names == ("scale",)
    assert (shown.seed, shown.plan, shown.noise, shown.sigma_um) == (5, "single_pass", "white", 2.0)
    assert shown.effects[0].rms_sigma == secret.effects[0].rms_sigma
    assert [(p.name, p.value, p.unit) for p in shown.effects[0].parameters] == [
        (p.name, p.value, p.unit) for p in secret.effects[0].parameters
    ]


def test_nothing_is_overwritten_unasked(data):
    before = data.read_bytes(), sealed_path(data).read_bytes()
    with pytest.raises(OutputError, match="exists; choose another name, or overwrite it with --force"):
        new(6, data, scenario=QUICK)
    data.unlink()
    with pytest.raises(OutputError, match=r"sealed: exists"):
        new(6, data, scenario=QUICK)
    assert not data.exists()
    assert sealed_path(data).read_bytes() == before[1]
    new(6, data, scenario=QUICK, force=True)
    assert reveal(data).seed == 6
    assert data.read_bytes() != before[0]


def test_of_two_games_of_one_name_at_once_the_second_is_refused(tmp_path, monkeypatch):
    """The second begins while the first is played, and has seen the name free as the first did."""
    data, refused = tmp_path / "data.csv", []

    def played(scenario, seed):
        monkeypatch.setattr("os.path.lexists", lambda _: False)
        with pytest.raises(OutputError, match=r"data\.csv\.sealed: exists; choose another name"):
            new(6, data, scenario=QUICK)
        refused.append(seed)
        return play(scenario, seed)

    monkeypatch.setattr("rtec.blind.sealing.play", played)
    new(5, data, scenario=QUICK)
    assert refused == [5]
    assert reveal(data).seed == 5


def test_a_game_that_fails_leaves_its_name_free(tmp_path, monkeypatch):
    data = tmp_path / "data.csv"

    def fails(scenario, seed):
        raise KeyboardInterrupt

    with monkeypatch.context() as here:
        here.setattr("rtec.blind.sealing.play", fails)
        with pytest.raises(KeyboardInterrupt):
            new(5, data, scenario=QUICK)
    assert not list(tmp_path.iterdir())
    new(5, data, scenario=QUICK)


def test_a_folder_is_no_data_file(tmp_path):
    with pytest.raises(ArgumentError, match="a regular file"):
        new(1, tmp_path, scenario=QUICK, force=True)


def test_a_missing_folder_is_one_clear_error(tmp_path):
    with pytest.raises(OutputError, match="cannot be written"):
        new(1, tmp_path / "none" / "data.csv", scenario=QUICK)


@pytest.mark.parametrize("seed", [-1, 1.5, True])
def test_a_seed_that_is_no_whole_number_is_refused(tmp_path, seed):
    for scenario in (QUICK, None):
        with pytest.raises(ArgumentError, match="seed"):
            new(seed, tmp_path / "data.csv", scenario=scenario)
    assert list(tmp_path.iterdir()) == []


def test_a_changed_data_file_is_noticed(data):
    data.write_text(data.read_text().replace("0", "1", 1))
    with pytest.raises(FileFormatError, match="is not the one that was sealed"):
        reveal(data)


def test_the_seal_of_another_file_is_noticed(data, tmp_path):
    other = tmp_path / "other.csv"
    new(6, other, scenario=QUICK)
    sealed_path(data).write_bytes(sealed_path(other).read_bytes())
    with pytest.raises(FileFormatError, match="is not the one that was sealed"):
        reveal(data)


def test_a_missing_file_is_named(data):
    sealed_path(data).unlink()
    with pytest.raises(FileFormatError, match=r"data\.csv\.sealed: there is no such file.* they go together"):
        reveal(data)


def _changed(data, **fields):
    seal = sealed_path(data)
    seal.write_text(json.dumps({**json.loads(seal.read_text()), **fields}))


def _encoded(text):
    raw = text.encode()
    return {"secret": base64.b64encode(raw).decode(), "secret_sha256": hashlib.sha256(raw).hexdigest()}


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"format": "else"}, "no secret of the game"),
        ({"secret": 7}, "cannot be read"),
        ({"secret": "§"}, "cannot be read"),
        ({"secret": base64.b64encode(b"{}").decode()}, "was changed"),
        (_encoded("{}"), "cannot be read"),
        (_encoded("[]"), "cannot be read"),
        (_encoded("no JSON"), "cannot be read"),
        (_encoded('{"effects": 3}'), "cannot be read"),
        (_encoded("[" * 100_000), "cannot be read"),
    ],
)
def test_a_seal_that_was_meddled_with_is_one_clear_error(data, fields, message):
    _changed(data, **fields)
    with pytest.raises(FileFormatError, match=message):
        reveal(data)


@pytest.mark.parametrize("text", ["no JSON", "[1]", "[" * 100_000])
def test_a_seal_that_is_no_json_object_is_one_clear_error(data, text):
    sealed_path(data).write_text(text)
    with pytest.raises(FileFormatError, match="this is no JSON"):
        reveal(data)
