import numpy as np
import pytest
from scipy.signal import decimate

from rtec.dataset.dataset import Dataset
from rtec.dataset.drive_signals import Resample
from rtec.effects import Conditions, Observable, Units, effect_named
from rtec.errors import ArgumentError


def at_rest():
    position = np.tile([0.0, 5.0, 10.0, 15.0], 3)
    conditions = Conditions(position=position, position_unit="mm", run=np.repeat([1, 2, 3], 4))
    return Dataset(
        source="x.csv",
        observe="deviation",
        observable=Observable.DEVIATION,
        units=Units("mm", "mm", "reading"),
        observed=np.arange(12.0),
        conditions=conditions,
        cell=np.tile([0, 1, 2, 3], 3),
        unknown=(("pulse_v", np.arange(12.0) * 2),),
    )


def in_motion(samples=1003, picked=None):
    time = np.arange(samples) * 1e-3
    velocity = 50 * np.sin(2 * np.pi * 3 * time)
    conditions = Conditions(
        position=np.cumsum(velocity) * 1e-3,
        position_unit="mm",
        run=np.ones(samples, dtype=np.int64),
        direction=np.sign(velocity),
        time_s=time,
        velocity=velocity,
        acceleration=np.gradient(velocity, 1e-3),
        temperatures={"temperature": 20 + time},
        moving=True,
    )
    resample = Resample(stretches=((0, samples),), stages=(10,), picked=picked)
    return Dataset(
        source="log.csv",
        observe="force",
        observable=Observable.DRIVE,
        units=Units("n", "mm", "s"),
        observed=resample.apply(np.sign(velocity)),
        conditions=conditions,
        cell=np.full(resample.rows, -1),
        resample=resample,
    )


def test_columns_of_readings_at_rest_are_those_of_the_effect():
    data, scale = at_rest(), effect_named("scale")
    shape = scale.shapes(data.conditions)[0]
    np.testing.assert_array_equal(data.columns(scale, shape), scale.columns(data.conditions, shape))
    np.testing.assert_array_equal(data.scan(scale, [shape]), scale.scan(data.conditions, [shape]))
    assert data.coordinates is data.conditions
    assert data.has_repeats


def test_columns_of_a_log_pass_the_filter_of_the_force():
    data = in_motion()
    assert (data.rows, data.conditions.rows) == (101, 1003)
    coulomb = effect_named("coulomb")
    columns = data.columns(coulomb, coulomb.shapes(data.conditions)[0])
    np.testing.assert_allclose(columns[:, 0], decimate(data.conditions.direction, 10, ftype="iir"), atol=1e-12)
    # and so the right amplitude leaves nothing, which the sign at the remaining samples would not
    np.testing.assert_allclose(data.observed, columns[:, 0], atol=1e-12)
    assert np.abs(data.observed - data.coordinates.direction).max() > 0.05


@pytest.mark.parametrize("shapes", [1, 3, 40])
def test_a_scan_is_the_columns_of_each_shape(monkeypatch, shapes):
    data, cogging = in_motion(), effect_named("cogging")
    few = list(cogging.shapes(data.conditions))[:shapes]
    expected = np.stack([data.columns(cogging, shape).T for shape in few])
    np.testing.assert_allclose(data.scan(cogging, few), expected, atol=1e-9)
    # in portions that do not divide the whole
    monkeypatch.setattr("rtec.dataset.dataset._SCANNED_AT_ONCE", 7 * 2 * 1003)
    np.testing.assert_allclose(data.scan(cogging, few), expected, atol=1e-9)
    part = data.take(np.array([5, 90, 7]))
    np.testing.assert_allclose(part.scan(cogging, few), expected[..., [5, 90, 7]], atol=1e-9)


@pytest.mark.parametrize("make", [at_rest, in_motion])
def test_taking_rows(make):
    data = make()
    effect = effect_named("scale" if make is at_rest else "viscous")
    shape = effect.shapes(data.conditions)[0]
    mask = np.arange(data.rows) * 3 // data.rows == 1
    for rows in (mask, np.flatnonzero(mask)[::-1]):
        part = data.take(rows)
        np.testing.assert_array_equal(part.observed, data.observed[rows])
        np.testing.assert_array_equal(part.columns(effect, shape), data.columns(effect, shape)[rows])
        np.testing.assert_array_equal(part.coordinates.position, data.coordinates.position[rows])
        np.testing.assert_array_equal(part.coordinates.order, data.coordinates.order[rows])
        np.testing.assert_array_equal(part.cell, data.cell[rows])
        again = part.take(np.array([1, 0]))
        np.testing.assert_array_equal(again.columns(effect, shape), data.columns(effect, shape)[rows][[1, 0]])
    for name, values in data.take(mask).unknown:
        np.testing.assert_array_equal(values, dict(data.unknown)[name][mask])


def test_rows_that_do_not_fit_together():
    data = at_rest()
    common = {
        "source": "x",
        "observe": "deviation",
        "observable": Observable.DEVIATION,
        "units": data.units,
        "observed": data.observed,
        "conditions": data.conditions,
        "cell": data.cell,
    }
    for name in ("observed", "cell"):
        with pytest.raises(ArgumentError, match="row by row"):
            Dataset(**(common | {name: common[name][:-1]}))
    with pytest.raises(ArgumentError, match="row by row"):
        Dataset(**common, unknown=(("pulse_v", np.zeros(11)),))
    with pytest.raises(ArgumentError, match="12 samples; use 120"):
        Dataset(**common, resample=Resample(stretches=((0, 120),), stages=(10,)))
    with pytest.raises(ArgumentError, match="row by row"):
        Dataset(**common, resample=Resample(stretches=((0, 12),), stages=(10,)))
