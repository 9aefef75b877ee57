"""A model of a warm machine: the compiled model follows a log as the model itself does; files give it back."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from rtec.errors import ArgumentError, RtecError
from rtec.predictors import KnownPredictor, read_predictor, write_predictor
from rtec.predictors._kernels import SAID, SENSORS, TIME, predicted_mm
from rtec.predictors.binding import bound
from rtec.predictors.fitting.warm.begin import fit_begin
from rtec.predictors.warm.begin import Begin
from rtec.predictors.warm.features import Feature, columns_of
from rtec.predictors.warm.kinds import REGRESSORS
from rtec.predictors.warm.linear import Linear
from rtec.predictors.warm.warm_model import WarmModel
from tests.warm_regressors import one_of_each

FEATURES = (
    Feature(of="temperature_t1"),
    Feature(of="spindle_speed", lag_s=700.0, heat=True),
    Feature(of="temperature_t2", lag_s=90.0),
    Feature(of="spindle_speed", heat=True),
)
LINEAR = Linear(centre=[20.0, 0.0, 20.0, 0.0], intercept=1.0, slopes=[2.0, 3.0, -4.0, 0.5], noise_sd=0.5)

BEGIN = Begin(features=FEATURES, numbers=[[0.0, 9.0, 1.5, 0.1], [19.0, 19.5, 0.0, 1.0]])
"""Of a machine that may be warm: 1.5 + 0.1 t1 of heat; t1, held from 19 to 19.5 degrees, of what lags behind t2."""


def log(rows=300, seed=3):
    rng = np.random.default_rng(seed)
    time_s = np.cumsum(rng.uniform(0.5, 60.0, rows))
    speed = np.repeat(rng.uniform(0.0, 5000.0, rows // 50), 50)
    walk = 20.0 + np.cumsum(rng.normal(0.0, 0.2, (2, rows)), axis=1)
    return time_s, {"temperature_t1": walk[0], "temperature_t2": walk[1], "spindle_speed": speed}


def model(**changes):
    return WarmModel(**({"features": FEATURES, "regressor": LINEAR, "observe": "ch3", "unit": "um"} | changes))


def asked(made, time_s, inputs):
    """Call the compiled function as the PC does; return errors and standard deviations in mm."""
    numbers, memory, sd = np.array(made.numbers), np.array(made.memory), np.full(1, np.nan)
    found = []
    columns = np.array([time_s, *(inputs[name] for name in made.inputs[1:])])
    for row in np.ascontiguousarray(columns.T):
        found.append((made.function(numbers, row, memory, sd), sd[0]))
    return np.array(found).T


@pytest.mark.parametrize("begin", [None, BEGIN])
@pytest.mark.parametrize("kind", REGRESSORS)
def test_the_compiled_model_follows_a_log(kind, begin):
    made = model(regressor=one_of_each(kind, features=4), interval=0.0, cautious=True, sign=-1, begin=begin)
    time_s, inputs = log()
    value, sd = made.predict(time_s, inputs)
    error_mm, sd_mm = asked(made, time_s, inputs)
    assert error_mm == pytest.approx(-1e-3 * value, abs=1e-12, nan_ok=True)
    assert sd_mm == pytest.approx(1e-3 * sd, abs=1e-12, nan_ok=True)
    assert np.ptp(value[np.isfinite(value)]) > 0.1


def test_lags_are_those_of_first_order_bodies():
    time_s, inputs = log(rows=50)
    only = Linear(centre=np.zeros(4), intercept=0.0, slopes=[0.0, 1.0, 1.0, 0.0])
    found = model(regressor=only).predict(time_s, inputs)[0]
    heat, second = (inputs["spindle_speed"] / 1000.0) ** (5 / 3), inputs["temperature_t2"]

    def slopes(t, z):
        return [(heat[0] - z[0]) / 700.0, (np.interp(t, time_s, second) - z[1]) / 90.0]

    solved = solve_ivp(slopes, time_s[[0, -1]], [heat[0], second[0]], t_eval=time_s, rtol=1e-9, max_step=2.0)
    assert found == pytest.approx(solved.y.sum(axis=0), abs=2e-4)


def test_a_log_that_begins_anew_is_in_balance_there():
    time_s, inputs = log()
    whole = model().predict(time_s, inputs, (0, 120))[0]
    later = {name: values[120:] for name, values in inputs.items()}
    assert whole[120:] == pytest.approx(model().predict(time_s[120:], later)[0], abs=1e-12)
    assert abs(whole - model().predict(time_s, inputs)[0])[120] > 0.01


def test_temperatures_tell_where_what_lags_begins():
    inputs = {"temperature_t1": [22.0, 30.0], "temperature_t2": [25.0, 25.0], "spindle_speed": [0.0, 0.0]}
    inputs = {name: np.array(values) for name, values in inputs.items()}
    only = Linear(centre=np.zeros(4), intercept=0.0, slopes=[1.0, 1e3, 1e6, 0.0])
    found = model(regressor=only, begin=BEGIN).predict(np.array([0.0, 70.0]), inputs, (0,))[0]
    second = 25.0 + (19.5 - 25.0) * np.exp(-70.0 / 90.0)
    expected = [22.0 + 1e3 * 3.7 + 1e6 * 19.5, 30.0 + 1e3 * 3.7 * np.exp(-0.1) + 1e6 * second]
    assert found == pytest.approx(expected, rel=1e-12)


def test_a_log_cut_from_a_warm_machine_is_predicted_as_the_whole_of_it():
    time_s = np.arange(0.0, 40_000.0, 60.0)
    inputs = {"spindle_speed": np.where(time_s % 20_000.0 < 9000.0, 4000.0, 0.0)}
    heat = Feature(of="spindle_speed", lag_s=2000.0, heat=True)
    warm = columns_of((heat,), time_s, inputs)[:, 0]
    inputs["temperature_t1"] = 20.0 + warm  # a thermometer that follows as what it tells does
    features = (Feature(of="temperature_t1"), heat)
    begin = fit_begin(features, columns_of(features, time_s, inputs))
    made = model(features=features, regressor=Linear(centre=[0, 0], intercept=0.0, slopes=[0.0, 1.0]), begin=begin)
    cut = slice(120, None)  # in the middle of the first run
    later = made.predict(time_s[cut], {name: values[cut] for name, values in inputs.items()})[0]
    assert later == pytest.approx(made.predict(time_s, inputs)[0][cut], abs=0.02)
    assert warm[120] > 8.0


def test_a_clock_that_stands_or_goes_back_moves_nothing():
    _, inputs = log(rows=100)
    still = {name: np.full(4, values[0]) for name, values in inputs.items()}
    error_mm, _ = asked(model(), np.array([500.0, 500.0, 100.0, 500.0]), still)
    assert np.ptp(error_mm) == 0.0


@pytest.mark.parametrize(
    ("since_s", "share"), [(np.inf, 1.0), (700.0, 1.0 - np.exp(-1.0)), (0.0, 0.0)]
)  # fmt: skip
def test_in_balance_and_a_spindle_that_has_run_for_a_while(since_s, share):
    inputs = {"temperature_t1": 22.0, "temperature_t2": 25.0, "spindle_speed": 2000.0}
    heat = 2.0 ** (5 / 3)
    expected = 1.0 + 2.0 * 2.0 + 3.0 * heat * share - 4.0 * 5.0 + 0.5 * heat
    assert model().balanced(inputs, since_s) == pytest.approx(expected, abs=1e-12)


# as the PC's model

HEAT = {"features": FEATURES[:1], "regressor": Linear(centre=[20.0], intercept=5.0, slopes=[2.0], noise_sd=0.6)}


def requested(made, degc, time_s=0.0):
    sensors, model = np.zeros(SENSORS), bound(made, ["temperature_t1"])
    sensors[TIME], model[SAID][0] = time_s, degc
    return predicted_mm(model, sensors)


def test_the_pc_asks_for_all_of_it_or_cautiously_for_the_near_end_of_the_interval():
    assert requested(model(**HEAT), 25.0) == pytest.approx(0.015)
    assert requested(model(**HEAT, interval=2.0, cautious=True), 25.0) == pytest.approx(0.013)
    assert requested(model(**HEAT, interval=0.1, cautious=True), 25.0) == pytest.approx(0.015 - 1.6448536e-3 * 0.6)
    assert requested(model(**HEAT, sign=-1), 25.0) == pytest.approx(-0.015)
    assert requested(model(**HEAT, unit="mm"), 25.0) == pytest.approx(15.0)


def test_outside_of_its_trained_temperatures_it_says_nothing():
    made = model(**HEAT, ranges={"temperature_t1": (18.0, 30.0)})
    assert requested(made, 30.0) == pytest.approx(0.025)
    assert np.isnan([requested(made, degc) for degc in (30.01, 17.9, np.nan)]).all()


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        ({"features": ()}, "0 features"),
        ({"features": (Feature(of="pressure"),)}, "'pressure'"),
        ({"features": (Feature(of="temperature_t1", lag_s=-1.0),)}, "a lag of -1 s"),
        ({"sign": 2}, "sign"),
        ({"features": FEATURES[:1] * 4, "begin": BEGIN}, "of other features"),
        ({"interval": -1.0}, "interval"),
        ({"cautious": True}, "without an interval"),
        ({"ranges": {"temperature_t3": (0.0, 1.0)}}, "temperature_t3"),
        ({"ranges": {"temperature_t1": (1.0, 0.0)}}, "range of temperature_t1"),
    ],
)
def test_what_cannot_be_is_refused(wrong, says):
    with pytest.raises(ArgumentError, match=says):
        model(**wrong)


def test_a_channel_that_is_no_length_predicts_logs_and_no_axis():
    made = model(**HEAT, unit="N")
    assert made.predict(np.zeros(1), {"temperature_t1": np.array([25.0])})[0].tolist() == [15.0]
    with pytest.raises(ArgumentError, match="of ch3 in N"):
        bound(made, ["temperature_t1"])


# files


@pytest.mark.parametrize("kind", REGRESSORS)
def test_a_file_gives_back_the_same_numbers(tmp_path, kind):
    ranges = {"temperature_t1": (18.0, 1 / 3), "spindle_speed": (0.0, 5000.0)}
    ranges["temperature_t1"] = (1 / 3, 30.0)
    made = model(regressor=one_of_each(kind, features=4), ranges=ranges, interval=0.1 + 0.2, sign=-1, begin=BEGIN)
    file = tmp_path / "warm.toml"
    write_predictor(file, KnownPredictor(predictor=made, name="lags", source="spindle.csv", axis=3))
    known = read_predictor(file)
    found = known.predictor
    assert (known.name, known.source, known.axis, known.interval_mm) == ("lags", "spindle.csv", 3, 1e-3 * (0.1 + 0.2))
    assert (found.features, found.ranges, found.interval, found.sign) == (FEATURES, ranges, 0.1 + 0.2, -1)
    assert np.array_equal(found.numbers, made.numbers)
    time_s, inputs = log()
    assert np.array_equal(found.predict(time_s, inputs), made.predict(time_s, inputs), equal_nan=True)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (("predictor = \"warm\"", 'predictor = "warn"'), 'use "networks" or "table"'),
        (("version = 1", "version = 2"), "version = 2"),
        (("[[feature]]\nof", "[[feature]]\ncolour = 1\nof"), r"unknown key 'feature\[1\]\.colour'"),
        (("observe = ", "observed = "), "unknown key 'observed'.*did you mean 'observe'"),
        (('of = "temperature_t2"', 'of = "heat"'), "features: 'heat'"),
        (('lag = "700.0 s"', 'lag = "700"'), r"feature\[2\]\.lag"),
        (("begin = [0.0, 9.0, 1.5, 0.1]", "begin = [0.0, 9.0, 1.5]"), r"feature\[2\]\.begin: 3 numbers"),
        (("begin = [0.0, 9.0, 1.5, 0.1]\n", ""), r"feature\[2\]\.begin: none"),
        (('lag = "700.0 s"\n', ""), r"feature\[2\]\.begin: one that does not lag"),
        (("heat = true", "heat = 1"), "heat"),
        (("temperature_t1 = [", "temperature_t9 = ["), "temperature_t9"),
        (("temperature_t1 = [18.0, 30.0]", "temperature_t1 = [18.0]"), r"ranges\.temperature_t1"),
        (("temperature_t1 = [18.0, 30.0]", "temperature_t1 = [31.0, 30.0]"), "range"),
        (('kind = "linear"', 'kind = "linea"'), "did you mean 'linear'"),
        (('kind = "linear"', "kind = 3"), r"regressor\.kind"),
        (('kind = "linear"', 'kind = "linear"\nslope = 3'), r"unknown key 'regressor\.slope'.*slopes"),
        (("intercept = 1.0", 'intercept = "one"'), r"regressor\.intercept"),
        (("slopes = [2.0,", "slopes = ["), r"regressor\.slopes"),
        (("slopes = [2.0,", "slopes = [nan,"), r"regressor\.slopes"),
        (("unit = ", "unit == "), "not readable|TOML"),
        (("sign = -1", "sign = 0"), "sign"),
    ],
)  # fmt: skip
def test_a_damaged_file_is_one_clear_error(tmp_path, change, says):
    file = tmp_path / "warm.toml"
    made = model(ranges={"temperature_t1": (18.0, 30.0)}, sign=-1, begin=BEGIN)
    write_predictor(file, KnownPredictor(predictor=made, name="lags"))
    text = file.read_text()
    assert change[0] in text
    file.write_text(text.replace(*change, 1))
    with pytest.raises(RtecError, match=says) as caught:
        read_predictor(file)
    assert "warm.toml" in str(caught.value) and "\n" not in str(caught.value)


def test_a_file_is_no_larger_than_any_predictor_and_fits_its_features(tmp_path):
    file = tmp_path / "warm.toml"
    write_predictor(file, KnownPredictor(predictor=model(), name="lags"))
    text = file.read_text()
    file.write_text(text + "#" * 16_000_000)
    with pytest.raises(RtecError, match="larger"):
        read_predictor(file)
    file.write_text(text[: text.rindex("[[feature]]")] + text[text.index("[regressor]") :])
    with pytest.raises(RtecError, match="does not take 3 features"):
        read_predictor(file)
