"""What an error may depend on that no effect knows: never a name, and it keeps names away."""

from dataclasses import replace

import numpy as np
import pytest
from inference_oracle import measured

from rtec.effects import Observable, Shape, Units
from rtec.inference.diagnose import diagnose
from rtec.inference.probes import probes_of
from rtec.inference.results import Verdict


def wandering(rows):
    return np.convolve(np.random.default_rng(7).normal(size=rows + 30), np.ones(31) / 5.0, "valid")


def heated(**plan):
    """Zero that moves by 10 um/K with a cabinet's temperature, which comes and goes."""
    data = measured(timed=False, **plan)
    heat = 20.0 + wandering(data.rows)
    conditions = replace(data.conditions, temperatures={"cabinet": heat})
    return replace(data, observed=data.observed + 0.01 * (heat - 20.0), conditions=conditions)


def loaded(**plan):
    """Zero that moves by 10 um with a column of no known quantity, which comes and goes."""
    data = measured(timed=False, **plan)
    load = wandering(data.rows)
    return replace(data, observed=data.observed + 0.01 * load, unknown=(("load", load),))


def names(data):
    return [probe.name for probe in probes_of(data)]


def test_columns_of_no_known_quantity_are_probed_and_for_a_force_temperatures():
    data = replace(heated(), observable=Observable.DRIVE)
    humid = np.random.default_rng(1).normal(size=data.rows)
    extra = (("humidity", humid), ("broken", np.full(data.rows, np.nan)), ("constant", np.full(data.rows, 3.0)))
    found = {probe.name: probe for probe in probes_of(replace(data, unknown=extra))}
    assert {"any cabinet", "any humidity"} <= set(found)
    assert not {"any broken", "any constant"} & set(found)
    assert found["any humidity"].depends_on == ("humidity",)
    assert found["any humidity"].at(data)[:, 0] == pytest.approx(humid - humid.mean())
    assert "any cabinet" not in names(heated()), "of a deviation it has a name"
    still = replace(data.conditions, temperatures={"cabinet": 20.0 + 0.01 * np.arange(data.rows) % 0.4})
    assert "any cabinet" not in names(replace(data, conditions=still)), "less than half a kelvin"


def test_a_force_is_probed_by_position():
    data = replace(measured(runs=2), observable=Observable.DRIVE)
    found = probes_of(data)
    assert found == (), "where the data can show it, it has a name: force_map"
    turn = 360.0 * (data.conditions.position - 20.0) / np.ptp(data.conditions.position)
    data = replace(data, conditions=replace(data.conditions, position=turn, position_unit="deg", revolution=360.0))
    found = probes_of(data)
    assert [probe.at(data).shape[1] for probe in found] == [5, 9, 17]
    assert {probe.depends_on for probe in found} == {("position",)}
    whole = found[0].at(data)
    angle = np.radians(turn)
    named = np.column_stack([np.ones(angle.size), *(f(k * angle) for k in (1, 2) for f in (np.sin, np.cos))])
    line = turn[:, None] - named @ np.linalg.lstsq(named, turn[:, None])[0]
    numbers = np.linalg.lstsq(whole, line)[0]
    assert whole @ numbers == pytest.approx(line, abs=1e-9), "a straight line is a smooth curve"
    assert named.T @ whole == pytest.approx(0.0, abs=1e-9), "a constant and a weight have names"


def test_a_probe_belongs_to_its_data():
    probe = probes_of(measured(runs=4))[0]
    assert len(probe.amplitudes(Shape(), Units("mm", "mm", "s"))) == probe.at(measured(runs=4)).shape[1]
    with pytest.raises(ValueError, match="168 rows for 42"):
        probe.at(measured(runs=1))


def test_a_zero_that_follows_a_temperature_is_a_thermal_shift():
    result = diagnose(heated())
    assert (result.verdict, result.effects) == (Verdict.NAMED, ("thermal_shift",))
    (term,) = result.model.terms
    assert term.shape.sensor == "cabinet"
    assert term.amplitudes[0] == pytest.approx(0.01, abs=0.001)


def test_a_column_that_has_no_name_is_unknown_and_named_in_the_answer():
    result = diagnose(loaded())
    assert result.verdict is Verdict.UNKNOWN
    assert result.unknown.depends_on == ("load",)
    assert "load" in result.unknown.description
    assert result.effects == ()
    assert not any(name.startswith("any ") for name in result.probability)
    assert not any(c.effect.startswith("any ") for c in result.candidates)
    assert "vary load on purpose" in result.experiment.text


def test_beside_a_probe_the_effects_keep_their_names():
    data = loaded(runs=6)
    data = replace(data, observed=data.observed + 0.004 * data.conditions.direction)
    result = diagnose(data)
    assert result.verdict is Verdict.UNKNOWN
    assert result.effects == ("backlash",)
    assert result.unknown.depends_on == ("load",)
    assert result.model.terms[0].amplitudes[0] == pytest.approx(0.008, abs=0.0015)


def test_each_run_with_a_reversal_error_of_its_own_is_unknown():
    sizes = np.array([0.0, 0.010, -0.006, 0.012, 0.002])
    result = diagnose(measured(lambda x, way, t, run: sizes[run - 1] * way, timed=False))
    assert result.verdict is Verdict.UNKNOWN
    assert {"direction", "run"} <= set(result.unknown.depends_on)


def test_play_that_turns_round_in_the_second_of_two_runs_is_unknown():
    """Beside noise that wanders, four passes that lie high, low, low and high would be heat that comes and goes."""
    turned = lambda way, run: np.where(run == 1, way, -way)
    data = measured(lambda x, way, t, run: 0.01 * turned(way, run), runs=2)
    c = data.conditions
    heat = 20.0 + 2.0 * np.convolve(turned(c.direction, c.run), np.ones(15) / 15.0, "same")
    result = diagnose(replace(data, conditions=replace(c, temperatures={"bed": heat})))
    assert result.verdict is Verdict.UNKNOWN
    assert {"direction", "run"} <= set(result.unknown.depends_on)


def test_a_course_in_time_has_nodes_where_readings_are():
    data = measured(runs=3)
    later = replace(data.conditions, time_s=data.conditions.time_s + 1e6 * (data.conditions.run == 3))
    for one in (data, replace(data, conditions=later)):
        found = {probe.name: probe for probe in probes_of(one)}
        assert {"any time 9", "any time 17", "any time 33"} <= set(found)
        assert found["any time 9"].depends_on == ("time",)
        assert (np.abs(found["any time 9"].at(one)).max(axis=0) > 0.5).all()
    assert not any("time" in name for name in names(measured(runs=1))), "there time and position are one"
    assert not any("33" in name for name in names(measured(runs=2, targets=24))), "three readings to a node at least"


@pytest.mark.parametrize("seed", [0, *(pytest.param(n, marks=pytest.mark.sweep) for n in (1, 2))])
def test_a_course_in_time_that_comes_and_goes_is_unknown(seed):
    """Noise that wanders would leave a zero of each run, or a drift, beside it."""
    rng = np.random.default_rng(seed)
    turns = rng.uniform(1.3, 2.7)
    result = diagnose(
        measured(lambda x, way, t, run: 0.012 * np.sin(2 * np.pi * turns * t / t.max() + 1.0), runs=3, seed=seed)
    )
    assert result.verdict is Verdict.UNKNOWN
    assert result.effects == ()
    assert result.unknown.depends_on == ("time",)


def test_an_effect_that_changes_only_resembles_its_name():
    steady = lambda x, way, t, run: 0.008 * np.sin(2 * np.pi * x / 41.0)
    growing = lambda x, way, t, run: x / 150.0 * steady(x, way, t, run)
    for error, sure in ((steady, True), (growing, False)):
        result = diagnose(measured(error, targets=81, runs=3))
        (found,) = [one for one in result.candidates if one.accepted and one.effect == "cyclic"]
        assert (result.verdict is Verdict.NAMED) is sure
        assert result.probability["cyclic"] == found.probability
        assert found.probability > 0.9 if sure else found.probability < 0.05
        assert ("varies with position" in found.reason) is not sure
