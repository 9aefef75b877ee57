"""rtec add: an effect goes into a model, the model is refitted and written, and the error falls."""

from dataclasses import fields

import numpy as np
import pytest

from rtec.cli.add import ShapeOptions, shape_from_options
from rtec.dataset.load import load_dataset
from rtec.effects import LIBRARY, effect_named
from rtec.errors import ArgumentError
from rtec.inference.model_file import read_model
from rtec.inference.shape_text import field_keys

VERB = "add"

LEAD = 'observe = "deviation"\n[[effect]]\nname = "scale"\nscale = "30 um/m"\n'


def text_of(seed=1):
    """Five bidirectional runs of 21 targets with backlash, lead and a wave of 47 mm, and 1 um of noise."""
    rng = np.random.default_rng(seed)
    up = np.linspace(0.0, 400.0, 21) + rng.uniform(-4, 4, 21)
    lines = ["run,direction,target_mm,deviation_um"]
    for run in range(1, 6):
        for way, places in ((1, up), (-1, up[::-1])):
            for x in places:
                y = 5.0 * way + 0.03 * x + 4.0 * np.sin(2 * np.pi * x / 47.0) + rng.normal()
                lines.append(f"{run},{way},{x:.4f},{y:.5f}")
    return "\n".join(lines) + "\n"


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "z.csv").write_text(text_of())
    (tmp_path / "other.csv").write_text(text_of(seed=2))
    (tmp_path / "lead.toml").write_text(LEAD)
    return tmp_path


def table(folder, file="z.csv"):
    return np.loadtxt(folder / file, delimiter=",", skiprows=1)


def rms(values):
    return float(np.sqrt(np.mean(values**2)))


# adding


def test_an_effect_is_added_to_nothing(here, answer):
    document = answer("backlash", "z.csv", "-o", "m.toml")
    rows = table(here)
    columns = np.stack([rows[:, 1] / 2, np.ones(210)], axis=1)
    numbers = np.linalg.lstsq(columns, rows[:, 3], rcond=None)[0]
    (step,) = document["steps"]
    assert step["effect"] == "backlash"
    assert step["params"]["backlash_um"] == pytest.approx(numbers[0], abs=0.3)
    assert step["rms_train"] == pytest.approx(rms(rows[:, 3] - columns @ numbers), rel=0.02)
    assert (document["effects"], document["model"], document["unit"]) == (["backlash"], "m.toml", "um")
    (term,) = read_model("m.toml").terms
    assert term.amplitudes[0] * 1000.0 == pytest.approx(step["params"]["backlash_um"])


def test_a_number_of_nodes_is_spread_over_the_axis(here, answer):
    answer("pitch_map", "z.csv", "-o", "m.toml", "--nodes", "9")
    x = table(here)[:, 2]
    (term,) = read_model("m.toml").terms
    assert term.shape.nodes == pytest.approx(np.linspace(x.min(), x.max(), 9))
    answer("pitch_map", "z.csv", "-o", "n.toml", "--nodes", "0 mm, 1 cm, 0.4 m")
    assert read_model("n.toml").terms[0].shape.nodes == (0.0, 10.0, 400.0)


def test_several_sensors_are_added_at_once_with_a_lag_each(here, answer):
    hours = np.arange(240) / 30.0
    speed = np.repeat([0.0, 3000.0, 0.0, 5000.0, 1000.0, 0.0], 40)
    nut = 20.0 + 0.5 * np.cumsum(speed / 3000.0 - 0.4) / 40.0
    moved = 3.0 * (nut - 20.0) + (speed / 1000.0) ** (5 / 3)
    lines = ["time_s,spindle_rpm,temperature_nut_degc,temperature_bed_degc,ch1_um"]
    lines += [
        f"{3600 * t:.0f},{n:.0f},{k:.4f},{20 + np.sin(t):.4f},{y + 0.1 * np.sin(40 * t):.4f}"
        for t, n, k, y in zip(hours, speed, nut, moved, strict=True)
    ]
    (here / "warm.csv").write_text("\n".join(lines) + "\n")
    both = ["thermal_shift", "warm.csv", "--observe", "ch1", "--sensor", "nut,spindle"]
    document = answer(*both, "-o", "warm.toml")
    assert [step["effect"] for step in document["steps"]] == ["thermal_shift", "thermal_shift"]
    assert document["rms_after"] < 0.15 < document["rms_before"]
    assert document["heldout_by"] == "block"
    assert document["rms_heldout_rows"] < 0.15
    nut_term, spindle_term = read_model("warm.toml").terms
    assert (nut_term.shape.sensor, spindle_term.shape.sensor) == ("temperature_nut", "spindle")
    assert 1e3 * nut_term.amplitudes[0] == pytest.approx(3.0, rel=0.05)
    assert 1e3 * spindle_term.amplitudes[0] == pytest.approx(1.0, rel=0.05)
    assert 'at_1000_rpm = "' in (here / "warm.toml").read_text()
    answer(*both, "--lag", "10 min, 1 h", "-o", "lagged.toml")
    assert [term.shape.lag for term in read_model("lagged.toml").terms] == [600.0, 3600.0]


def test_the_terminal_shows_the_staircase_and_the_file(here, said):
    code, out, err = said("backlash", "z.csv", "--model", "lead.toml", "-o", "m.toml")
    assert code == 0
    assert "+ backlash" in out
    assert "Model: m.toml" in out
    assert all(line.startswith("rtec: ") for line in err.splitlines())


# options


def test_shapes_from_options(here):
    data = load_dataset(here / "z.csv")
    warm = shape_from_options(effect_named("warm_up"), {"time_constant": "12 reading"}, data)
    assert warm.time_constant == 12.0
    assert shape_from_options(effect_named("cyclic"), {}, data) is None
    for name, given, says in (
        ("cyclic", {"harmonics": 2}, "^--period is missing"),
        ("cyclic", {"period": "3"}, "^--period: .*unit"),
        ("cyclic", {"nodes": "3"}, "^--nodes is no option for cyclic.*--period, --harmonics, --by-direction"),
        ("backlash", {"period": "3 mm"}, "^--period is no option for backlash; use it without options"),
        ("pitch_map", {"nodes": "1"}, "^--nodes: 1"),
        ("pitch_map", {"nodes": "1000000000"}, "^--nodes"),
        ("pitch_map", {"nodes": "9" * 5000}, "^--nodes"),
        ("pitch_map", {"nodes": "5 mm, 1 mm"}, "^--nodes: .*ascend"),
        ("warm_up", {"time_constant": "12 s"}, "^--time-constant: .*reading"),
    ):
        with pytest.raises(ArgumentError, match=says):
            shape_from_options(effect_named(name), given, data)


# what is refused


def test_what_exists_is_not_overwritten(here, said, refused):
    before = (here / "lead.toml").read_text()
    words = ["backlash", "z.csv", "--model", "lead.toml", "-o", "lead.toml"]
    assert "--force" in refused(*words)
    assert (here / "lead.toml").read_text() == before
    assert said(*words, "--force")[0] == 0
    assert read_model("lead.toml").names == ("scale", "backlash")


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ([], "'rtec add --help'"),
        (["backlash", "z.csv"], "'-o'"),
        (["backlsh", "z.csv", "-o", "m.toml"], "did you mean 'backlash'?"),
        (["thermal_growth", "z.csv", "-o", "m.toml"], "no temperature column"),
        (["scale", "z.csv", "--model", "lead.toml", "-o", "m.toml"], "scale"),
        (["cyclic", "z.csv", "-o", "m.toml", "--harmonics", "two"], "--harmonics"),
        (["cyclic", "z.csv", "-o", "m.toml", "--period", "5"], "--period"),
        (["backlash", "z.csv", "-o", "m.toml", "--perod", "5 mm"], "did you mean '--period'?"),
        (["backlash", "z.csv", "-o", "m.toml", "--blocks", "batch"], "--blocks: 'batch' is not valid"),
        (
            ["thermal_shift", "z.csv", "-o", "m.toml", "--sensor", "a,b,c", "--lag", "1 h, 2 h"],
            "--lag: 1 h, 2 h is not valid; use one lag, or one for each of 3 sensors",
        ),
    ],
)
def test_bad_words_are_one_line_and_2(here, refused, words, says):
    assert says in refused(*words)
    assert not (here / "m.toml").exists()


def test_every_shape_parameter_is_an_option():
    options = {item.name for item in fields(ShapeOptions)}
    for effect in LIBRARY:
        assert set(field_keys(effect.shape_type)) <= options, effect.name
