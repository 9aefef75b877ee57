"""Repeats of one motion as one record."""

import numpy as np
import pytest

from rtec.errors import ArgumentError
from rtec.predictors import Sequences
from rtec.predictors.fitting.repeats import averaged


def run(output, starts=(0,), names=("velocity",)):
    output = np.asarray(output, dtype=np.float64)
    return Sequences(inputs=np.arange(output.size)[:, None], output=output, names=names, period_s=1e-3, starts=starts)


@pytest.mark.parametrize("hertz", [20.0, 76.0, 150.0])
def test_of_a_sine_the_smoothing_passes_what_the_papers_filter_passes(hertz):
    t = np.arange(4000) * 1e-3
    found = averaged([run(np.sin(2.0 * np.pi * hertz * t))]).output[500:-500]
    # the spline's gain on unit spacing, with the difference operators of a cubic spline in place of w**4
    w = 2.0 * np.pi * hertz * 1e-3
    gain = 1.0 / (1.0 + 19.0 * 6.0 * (2.0 - 2.0 * np.cos(w)) ** 2 / (4.0 + 2.0 * np.cos(w)))
    assert np.abs(found).max() == pytest.approx(gain, rel=2e-3)
    assert gain == pytest.approx(1.0 / (1.0 + 19.0 * w**4), abs=0.03)


def test_ten_repeats_are_their_mean_run_by_run():
    draw = np.random.default_rng(0)
    runs = [run(np.repeat([1.0, 5.0], 50) + draw.normal(size=100), starts=(0, 50)) for _ in range(10)]
    plain = averaged(runs, smoothing=0.0)
    assert plain.output == pytest.approx(np.mean([one.output for one in runs], axis=0))
    smooth = averaged(runs)
    assert smooth.starts == (0, 50)
    assert np.std(smooth.output[:50]) < np.std(plain.output[:50])
    assert abs(smooth.output[49] - 1.0) < 1.0  # the step from run to run is not smoothed


@pytest.mark.parametrize(
    ("runs", "smoothing"),
    [
        ([], 19.0),
        ([run(np.ones(9)), run(np.ones(8))], 19.0),
        ([run(np.ones(9)), run(np.ones(9), names=("current",))], 19.0),
        ([run(np.ones(4))], 19.0),
        ([run(np.ones(9))], -1.0),
    ],
)
def test_what_are_no_repeats_is_refused(runs, smoothing):
    with pytest.raises(ArgumentError, match=r"runs|smoothing"):
        averaged(runs, smoothing=smoothing)
