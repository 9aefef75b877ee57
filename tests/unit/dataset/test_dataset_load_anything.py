"""Whatever columns a file has: a data set of finite numbers, or one clear line."""

import numpy as np
import pytest

from rtec.dataset.load import load_dataset
from rtec.errors import RtecError
from rtec.metrology import Column, Measurement

POSITION, SPEED = ["mm", "deg", "rev", "count"], ["mm_s", "deg_s"]
UNITS = {
    **{name: POSITION for name in ("target", "actual", "deviation")},
    **{name: SPEED for name in ("velocity", "feed")},
    **{"time": ["s"], "force": ["n"], "current": ["a"], "temperature_nut": ["degc"], "run": [""], "direction": [""]},
}


def some_values(generator, quantity, count):
    """Return a column: constant, stepping, swinging, wrapping, noisy, tiny, huge."""
    rows, size = np.arange(count), 10.0 ** generator.integers(-300, 300)
    if quantity == "run":
        choices = [np.ones(count), np.sort(generator.integers(0, 4, count)), generator.integers(0, 3, count), rows]
    elif quantity == "direction":
        choices = [generator.choice([-1.0, 1.0], count)]
    elif quantity == "time":
        uneven = np.cumsum(generator.exponential(1e-3, count))
        choices = [rows * 10.0 ** generator.integers(-5, 4), uneven, 0 * rows, rows % (count // 2 + 1), 1e9 + rows]
    else:
        noise = generator.normal(size=count)
        choices = [0 * rows, rows, rows % 5, 100 * np.sin(rows / 50), noise, noise * size, rows * 10.0 % 360]
    return np.asarray(choices[generator.integers(len(choices))], dtype=np.float64)


def some_measurement(generator):
    count = int(generator.choice([1, 2, 3, 4, 7, 12, 40, 100, 700, 1500]))
    linear = generator.random() < 0.5
    columns = {}
    for quantity in [name for name in UNITS if generator.random() < 0.45] or ["target"]:
        choices = UNITS[quantity]
        unit = choices[0 if linear else min(1, len(choices) - 1)]
        if generator.random() < 0.1:
            unit = str(generator.choice(choices))
        columns[quantity] = Column(quantity, unit, some_values(generator, quantity, count))
    facts = {"counts_per_rev": "8192"} if generator.random() < 0.3 else {}
    return Measurement(source="any.csv", facts=facts, columns=columns, unknown={})


@pytest.mark.parametrize("portion", range(8))
def test_any_columns(portion):
    loaded = 0
    for seed in range(portion * 50, portion * 50 + 50):
        measurement = some_measurement(np.random.default_rng(seed))
        try:
            data = load_dataset(measurement)
        except RtecError as error:
            assert "\n" not in str(error)
            assert len(str(error)) < 600
            continue
        loaded += 1
        coordinates = data.coordinates
        assert np.isfinite(data.observed).all()
        for name in ("position", "direction", "time_s", "velocity", "acceleration", "since_reversal"):
            values = getattr(coordinates, name)
            assert values is None or (np.isfinite(values).all() and values.shape == (data.rows,))
        if data.conditions.time_s is not None:
            assert (np.diff(data.conditions.time_s) >= 0).all()
        # loaded to score on itself, nothing changes
        np.testing.assert_array_equal(load_dataset(measurement, like=data).observed, data.observed)
    assert loaded > 3
