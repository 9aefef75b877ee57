"""Models as files: the same numbers back, units as people write them, and errors that say where."""

import math
import time
import tomllib

import numpy as np
import pytest
from hypothesis import given, strategies as st

from rtec.effects import LIBRARY, Conditions, Observable, Quantity, Shape, Units, effect_named
from rtec.errors import ArgumentError, FileFormatError, OutputError, RtecError
from rtec.inference.model import Model, Term
from rtec.inference.model_file import MAX_BYTES, MAX_DOTS, read_model, read_observe, write_model

UNITS = Units("mm", "mm", "s")
DRIVE = Units("a", "deg", "s")


def model_of(folder, text, units=UNITS):
    file = folder / "m.toml"
    file.write_text(text, encoding="utf-8")
    return read_model(file, units)


def refused(folder, text, units=UNITS):
    with pytest.raises(RtecError) as caught:
        model_of(folder, text, units)
    message = str(caught.value)
    assert isinstance(caught.value, ArgumentError | FileFormatError)
    assert message.startswith(str(folder / "m.toml"))
    assert "\n" not in message
    assert len(message) < 600 + len(str(folder))
    return message


def term_of(folder, lines, units=UNITS, observe="deviation"):
    (term,) = model_of(folder, f'observe = "{observe}"\n[[effect]]\n' + lines, units).terms
    return term


def test_other_terms_make_another_model_whose_interval_nobody_knows():
    known = Model(observe="deviation", units=UNITS, interval=0.0017)
    assert known.with_terms(()).interval is None


# what people write


def test_the_example_of_the_documentation_is_open_to_a_fit(tmp_path):
    text = 'observe = "deviation"\n[[effect]]\nname = "cyclic"\nperiod = "6.35 mm"\nharmonics = 2\n'
    model = model_of(tmp_path, text)
    (term,) = model.terms
    assert (model.observe, model.units, model.datum) == ("deviation", UNITS, 0.0)
    assert (term.name, term.shape.period, term.shape.harmonics) == ("cyclic", 6.35, 2)
    assert not term.shape.by_direction
    assert (term.amplitudes, term.errors, term.fitted) == (None, None, False)


@pytest.mark.parametrize(
    ("lines", "units", "key", "value"),
    [
        ('name = "cyclic"\nperiod = "0.25 inch"', UNITS, "period", 6.35),
        ('name = "cyclic"\nperiod = "0.5 rev"', Units("deg", "deg", "s"), "period", 180.0),
        ('name = "cyclic"\nperiod = "6.4 min"', Units("deg", "s", "s"), "period", 384.0),
        ('name = "warm_up"\ntime_constant = "12 reading"', Units("mm", "mm", "reading"), "time_constant", 12.0),
    ],
)
def test_shapes_are_read_in_the_units_of_the_measurement(tmp_path, lines, units, key, value):
    assert getattr(term_of(tmp_path, lines, units).shape, key) == pytest.approx(value, rel=1e-14)


@pytest.mark.parametrize(
    ("lines", "units", "value"),
    [
        ('name = "backlash"\nbacklash = "12 um"', UNITS, 0.012),
        ('name = "backlash"\nbacklash = "20 arcsec"', Units("deg", "deg", "s"), 20 / 3600),
        ('name = "backlash"\namplitudes = ["12 um"]', UNITS, 0.012),
        ('name = "scale"\nscale = "20 ppm"', UNITS, 20e-6),
        ('name = "servo_lag"\nlag = "1 ms"', UNITS, 1e-3),
    ],
)
def test_amplitudes_are_read_in_units_as_people_write_them(tmp_path, lines, units, value):
    assert term_of(tmp_path, lines, units).amplitudes == (pytest.approx(value, rel=1e-14),)


def test_amplitudes_of_thermal_growth_and_drift_mean_what_their_units_say(tmp_path):
    # contributions computed by hand: 11.5 um/m/K over 2 m and 3 K; 36 um/h over 100 s
    c = Conditions(
        position=np.array([2000.0]),
        position_unit="mm",
        run=np.ones(1, dtype=np.int64),
        time_s=np.array([100.0]),
        temperatures={"temperature": np.array([23.0])},
    )
    growth = term_of(tmp_path, 'name = "thermal_growth"\nsensor = "temperature"\nexpansion = "11.5 um/m/K"')
    assert growth.contribution(c) == pytest.approx([0.069])
    drift = term_of(tmp_path, 'name = "drift"\namplitudes = ["36 um/h"]')
    assert drift.effect.columns(c, drift.shape) @ drift.amplitudes == pytest.approx([0.001])


def test_errors_stand_beside_their_values(tmp_path):
    term = term_of(tmp_path, 'name = "backlash"\nbacklash = "12 um"\nbacklash_error = "0.5 um"')
    assert term.errors == (0.0005,)
    lines = 'name = "cyclic"\nperiod = "6 mm"\nperiod_error = "10 um"\namplitudes = ["1 um", "2 um"]\n'
    term = term_of(tmp_path, lines + 'errors = ["0.1 um", "0.2 um"]')
    assert (term.errors, term.shape_errors) == ((0.0001, 0.0002), (("period", 0.01),))


def test_a_shape_that_is_left_out_is_for_the_scan(tmp_path):
    assert term_of(tmp_path, 'name = "cyclic"').shape is None
    assert term_of(tmp_path, 'name = "backlash"').shape == Shape()


def test_a_model_read_without_measurement_states_its_units(tmp_path):
    file = tmp_path / "m.toml"
    file.write_text('observe = "deviation"\nobserved = "deg"\nposition = "deg"\nclock = "reading"\n')
    assert read_model(file).units == Units("deg", "deg", "reading")
    assert read_observe(file) == "deviation"
    file.write_text('observe = "deviation"\nposition = "deg"\n')
    with pytest.raises(FileFormatError, match="no unit of: observed, clock"):
        read_model(file)


def test_the_clock_of_the_measurement_counts(tmp_path):
    # a model without anything in time serves files with and without times
    text = 'observe = "deviation"\nclock = "s"\n[[effect]]\nname = "backlash"\n'
    units = Units("mm", "mm", "reading")
    assert model_of(tmp_path, text, units).units == units
    timed = text.replace("backlash", "warm_up") + 'time_constant = "3 s"'
    assert "such as '1.5 reading'" in refused(tmp_path, timed, units)


def test_a_step_beyond_its_period_is_refused_with_units(tmp_path):
    text = 'observe = "deviation"\n[[effect]]\nname = "cyclic"\nperiod = "6 mm"\nstep_at = "7000 um"\n'
    assert "step_at: '7000 um' is not valid; use 0 (no step) to the period, 6 mm" in refused(tmp_path, text)


# what is written


def finite():
    return st.floats(allow_nan=False, allow_infinity=False, allow_subnormal=True)


@st.composite
def shapes(draw, effect):
    values = {}
    for item in effect.shape_type.__dataclass_fields__.values():
        quantity = item.metadata["quantity"]
        if quantity is Quantity.COUNT and isinstance(item.default, tuple):
            numbers = draw(st.lists(st.integers(-1000, 1000), min_size=2, max_size=6, unique=True))
            values[item.name] = tuple(numbers)
        elif quantity is Quantity.COUNT:
            values[item.name] = draw(st.integers(1, 9))
        elif quantity is Quantity.CHOICE:
            values[item.name] = draw(st.booleans())
        elif quantity is Quantity.TEXT:
            letters = st.characters(exclude_categories=("C", "Z"))
            values[item.name] = draw(st.text(letters, min_size=1, max_size=20))
        elif isinstance(item.default, tuple):
            places = draw(st.lists(st.floats(-1e6, 1e6), min_size=4, max_size=20, unique=True))
            values[item.name] = tuple(sorted(place + 0.0 for place in places))
        else:
            values[item.name] = draw(st.floats(1e-9, 1e9))
    if "step_at" in values:  # within the period
        values["step_at"] = min(values["step_at"], values["period"])
    if "backward_right" in values:  # one of the two approaches at least is off
        values["backward_right"] &= not values["forward_right"]
    return effect.shape_type(**values)


@st.composite
def terms(draw, effect, units):
    shape = draw(st.one_of(shapes(effect)))
    count = len(effect.amplitudes(shape, units))
    value = finite().map(abs) if effect.not_negative else finite()
    amplitudes = draw(st.none() | st.tuples(*[value] * count))
    errors = None if amplitudes is None else draw(st.none() | st.tuples(*[finite().map(abs)] * count))
    tuned = [i.name for i in effect.shape_type.__dataclass_fields__.values() if i.name in ("period", "time_constant")]
    spread = draw(st.sampled_from([(), tuple((name, draw(st.floats(0, 1e3))) for name in tuned)]))
    return Term(effect=effect, shape=shape, amplitudes=amplitudes, errors=errors, shape_errors=spread)


@st.composite
def models(draw):
    observe, units = draw(
        st.sampled_from(
            [
                ("deviation", UNITS),
                ("deviation", Units("deg", "deg", "reading")),
                ("deviation", Units("deg", "s", "s")),
                ("deviation", Units("count", "count", "s")),
                ("force", Units("n", "mm", "s")),
                ("current", DRIVE),
                ("torque", Units("nm", "deg", "s")),
            ]
        )
    )
    kind = Observable.DEVIATION if observe == "deviation" else Observable.DRIVE
    fitting = [effect for effect in LIBRARY if effect.observable is kind]
    chosen = draw(st.lists(st.sampled_from(fitting), max_size=4, unique_by=lambda effect: effect.name))
    return Model(
        observe=observe,
        units=units,
        terms=tuple(draw(terms(effect, units)) for effect in chosen),
        datum=draw(st.just(0.0) | finite()),
        interval=draw(st.none() | finite().map(abs)),
    )


@given(models())
def test_a_model_reads_back_to_the_same_numbers(tmp_path_factory, model):
    file = tmp_path_factory.mktemp("models") / "m.toml"
    write_model(file, model)
    for found in (read_model(file), read_model(file, model.units)):
        assert (found.observe, found.units, found.datum) == (model.observe, model.units, model.datum)
        assert found.interval == model.interval
        for term, original in zip(found.terms, model.terms, strict=True):
            assert term.effect is original.effect
            assert term.shape == original.shape
            assert term.amplitudes == original.amplitudes
            assert term.errors == original.errors
            assert term.shape_errors == original.shape_errors


def test_a_written_model_is_read_by_any_toml_reader_and_by_people(tmp_path):
    shape = effect_named("cyclic").shape_type(period=6.35, harmonics=1)
    terms_ = (
        Term(effect=effect_named("cyclic"), shape=shape, amplitudes=(0.00125, -0.0004), errors=(1e-5, 2e-5)),
        Term(effect=effect_named("backlash"), shape=Shape(), amplitudes=(0.0123,), errors=(0.0004,)),
    )
    file = tmp_path / "m.toml"
    write_model(file, Model(observe="deviation", units=UNITS, terms=terms_, datum=0.0032, interval=0.0017))
    assert tomllib.loads(file.read_text()) == {
        "observe": "deviation",
        "observed": "mm",
        "position": "mm",
        "clock": "s",
        "datum": "3.2 um",
        "interval": "1.7 um",
        "effect": [
            {
                "name": "cyclic",
                "period": "6.35 mm",
                "harmonics": 1,
                "by_direction": False,
                "amplitudes": ["1.25 um", "-0.4 um"],
                "errors": ["0.01 um", "0.02 um"],
            },
            {"name": "backlash", "backlash": "12.3 um", "backlash_error": "0.4 um"},
        ],
    }


def test_a_term_without_shape_stays_open(tmp_path):
    file = tmp_path / "m.toml"
    write_model(file, Model(observe="deviation", units=UNITS, terms=(Term(effect=effect_named("cyclic")),)))
    assert read_model(file).terms[0].shape is None


@pytest.mark.parametrize("name", ["refraction", "quantisation"])
def test_a_share_has_no_unit(tmp_path, name):
    effect = effect_named(name)
    term = Term(effect=effect, shape=effect.shape_type(), amplitudes=(1 / 3,), errors=(2 / 3,))
    write_model(tmp_path / "m.toml", Model(observe="deviation", units=UNITS, terms=(term,)))
    assert read_model(tmp_path / "m.toml").terms == (term,)


def test_errors_that_are_no_numbers_are_left_out_and_values_that_are_none_refused(tmp_path):
    file = tmp_path / "m.toml"
    backlash = effect_named("backlash")
    good = Term(effect=backlash, shape=Shape(), amplitudes=(0.01,), errors=(math.nan,))
    write_model(file, Model(observe="deviation", units=UNITS, terms=(good,)))
    assert read_model(file).terms[0].errors is None
    before = file.read_bytes()
    bad = Term(effect=backlash, shape=Shape(), amplitudes=(math.inf,))
    with pytest.raises(ArgumentError, match="finite"):
        write_model(file, Model(observe="deviation", units=UNITS, terms=(bad,)))
    assert file.read_bytes() == before


def test_a_place_that_cannot_be_written_is_said(tmp_path):
    with pytest.raises(OutputError, match=r"no\.such"):
        write_model(tmp_path / "no.such" / "m.toml", Model(observe="deviation", units=UNITS))


# what is refused

HEAD = 'observe = "deviation"\n[[effect]]\n'


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ('observed = "mm"', ["no key 'observe'", 'observe = "deviation"']),
        ("observe = 3", ["observe = 3"]),
        ('observ = "deviation"', ["unknown key 'observ'", "did you mean 'observe'?"]),
        ('observe = "deviation"\neffects = []', ["unknown key 'effects'", "[[effect]]"]),
        ('observe = "deviation"\neffect = 3', ["no list of tables", "[[effect]]"]),
        ('observe = "deviation"\n[effect]\nname = "scale"', ["no list of tables"]),
        (HEAD + 'period = "3 mm"', ["effect 1 has no name"]),
        (HEAD + 'name = "cyclik"', ["effect 1", "'cyclik'", "did you mean 'cyclic'?"]),
        (HEAD + 'name = "jitter"', ["effect 1", "'jitter'", "capture"]),
        (HEAD + 'name = "cyclic"\nperod = "3 mm"', ["effect 1 (cyclic)", "'perod'", "did you mean 'period'?"]),
        (HEAD + 'name = "backlash"\nbacklsh = "3 mm"', ["'backlsh'", "did you mean 'backlash'?"]),
        (HEAD + 'name = "scale"\n[[effect]]\nname = "scale"', ["effect 2", "scale stands there 2 times; use once"]),
        (HEAD + 'name = "viscous"', ["effect 1", "viscous belongs to force", "not to 'deviation'"]),
        (HEAD + 'name = "cyclic"\nperiod = 6.35', ["effect 1 (cyclic): period", "6.35", "unit"]),
        (HEAD + 'name = "cyclic"\nperiod = "6.35"', ["effect 1 (cyclic): period", "write the unit"]),
        (HEAD + 'name = "cyclic"\nperiod = "6.35 s"', ["period", "such as '1.5 mm'"]),
        (HEAD + 'name = "cyclic"\nperiod = "0 mm"', ["period", "1e-12 to 1e+12 mm"]),
        (HEAD + 'name = "cyclic"\nperiod = "1e999 mm"', ["period", "not finite"]),
        (HEAD + 'name = "cyclic"\nharmonics = 2', ["period is missing", "beside harmonics"]),
        (HEAD + 'name = "cyclic"\nperiod = "3 mm"\nharmonics = 0', ["harmonics", "use 1 to 1000"]),
        (HEAD + 'name = "cyclic"\nperiod = "3 mm"\nharmonics = true', ["harmonics"]),
        (HEAD + 'name = "cyclic"\nperiod = "3 mm"\nby_direction = 1', ["by_direction", "true or false"]),
        (HEAD + 'name = "cyclic"\nperiod = "3 mm"\namplitudes = ["1 um"]', ["amplitudes: 1 of them", "a list of 2"]),
        (HEAD + 'name = "cyclic"\namplitudes = ["1 um", "2 um"]', ["amplitudes without period"]),
        (HEAD + 'name = "cyclic"\nperiod = "3 mm"\nerrors = ["1 um", "2 um"]', ["errors without amplitudes"]),
        (HEAD + 'name = "backlash"\nbacklash = "1 um"\namplitudes = ["1 um"]', ["amplitudes and backlash", "one of"]),
        (HEAD + 'name = "backlash"\nbacklash = "1 s"', ["effect 1 (backlash): backlash", "such as '1.5 um'"]),
        (HEAD + 'name = "backlash"\nbacklash = "1 um"\nbacklash_error = "-1 um"', ["backlash_error", "0 or more"]),
        (HEAD + 'name = "pitch_map"\nnodes = "3 mm"', ["nodes", "a list"]),
        (HEAD + 'name = "pitch_map"\nnodes = ["0 mm"]', ["nodes", "1 of them"]),
        (
            HEAD + 'name = "pitch_map"\nnodes = ["0 mm", "5 mm", "5 mm", "9 mm"]',
            ["nodes", "5 mm behind 5 mm", "ascend"],
        ),
        (
            HEAD + 'name = "backlash_map"\nnodes = ["0 mm", "5 mm"]\nforward_right = true\nbackward_right = true',
            ["effect 1 (backlash_map): backward_right", "one of the two"],
        ),
        (HEAD + 'name = "thermal_growth"\nsensor = 3', ["sensor"]),
        (HEAD + 'name = "thermal_growth"\nsensor = "a\\nb"', ["sensor", "printable"]),
        ('observe = "deviation"\ndatum = "3 s"', ["datum", "such as '1.5 um'"]),
        ('observe = "deviation"\ninterval = "-1 um"', ["interval", "0 or more"]),
        ('observe = "deviation"\ninterval = ["1 um"]', ["interval"]),
        ('observe = "deviation"\nposition = "deg"', ["position in deg", "the measurement has mm"]),
        ('observe = "deviation"\nposition = 3', ["position = 3"]),
        ('observe = "deviation"\nobserved = \nclock = "s"', ["line 2"]),
    ],
)
def test_what_is_wrong_is_said_with_its_place(tmp_path, text, says):
    message = refused(tmp_path, text)
    for words in says:
        assert words in message


def test_keys_within_keys_take_neither_time_nor_memory(tmp_path):
    begun = time.process_time()
    assert "line 1: 99994 dots" in refused(tmp_path, ".".join("a" * 99_995) + " = 1")
    lines = (".".join(f"{letter}" * MAX_DOTS) + " = 1" for letter in "abcdefghijklmnopqrstuvwxyz" * 7)
    refused(tmp_path, "\n".join(lines))
    assert time.process_time() - begun < 20.0


def test_drive_models_refuse_deviations_and_negative_friction(tmp_path):
    head = 'observe = "current"\n[[effect]]\n'
    assert "backlash belongs to a position deviation" in refused(tmp_path, head + 'name = "backlash"', DRIVE)
    assert "coulomb: -1.0 is not valid; use 0 or more" in refused(
        tmp_path, head + 'name = "coulomb"\ncoulomb = "-1 A"', DRIVE
    )


def test_a_second_family_is_no_second_of_the_same(tmp_path):
    text = 'observe = "current"\n' + 2 * '[[effect]]\nname = "cogging"\nperiod = "30 deg"\n'
    assert model_of(tmp_path, text, DRIVE).names == ("cogging",)


@pytest.mark.parametrize(
    ("data", "says"),
    [
        (b"", "empty"),
        (b"\xff\xfe", "UTF-8"),
        (b'observe = "a\0b"', "NUL"),
        (b"#" * (MAX_BYTES + 1), "at most"),
        (b"effect = [" + b"{name='scale'}," * 5000 + b"]\nobserve='deviation'", "5000 effects"),
    ],
)
def test_files_that_are_no_models(tmp_path, data, says):
    file = tmp_path / "m.toml"
    file.write_bytes(data)
    with pytest.raises(FileFormatError, match=says):
        read_model(file, UNITS)


@pytest.mark.parametrize("make", [lambda path: None, lambda path: path.mkdir()])
def test_no_file_there(tmp_path, make):
    make(tmp_path / "m.toml")
    with pytest.raises(FileFormatError, match=r"m\.toml"):
        read_model(tmp_path / "m.toml", UNITS)


@given(
    st.dictionaries(
        st.sampled_from(["name", "period", "amplitudes", "nodes", "x"]),
        st.sampled_from(
            [
                "1",
                "nan",
                "-inf",
                '"cyclic"',
                '"pitch_map"',
                '"3 mm"',
                "[]",
                "[[]]",
                "{}",
                '["1 um", "2 um"]',
                "1979-05-27",
                "true",
            ]
        ),
    )
)
def test_any_table_is_read_or_refused_in_one_line(tmp_path_factory, table):
    file = tmp_path_factory.mktemp("models") / "m.toml"
    file.write_text(HEAD + "\n".join(f"{key} = {value}" for key, value in table.items()))
    try:
        read_model(file, UNITS)
    except RtecError as error:
        assert "\n" not in str(error)
