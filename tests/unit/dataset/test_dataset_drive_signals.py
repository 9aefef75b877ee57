import numpy as np
import pytest
from scipy.signal import butter, decimate, filtfilt

from rtec.dataset.drive_signals import (
    Resample,
    cutoff_of,
    local_derivatives,
    low_pass,
    settling_samples,
    shortest_stretch,
    stages_of,
)


@pytest.mark.parametrize(
    ("rate", "cutoff", "stages"),
    [
        (1000.0, 100.0, (10,)),
        (999.7, 100.0, (10,)),
        (500.0, 100.0, (5,)),
        (100.0, 20.0, ()),
        (1250.0, 100.0, (12,)),
        (2000.0, 100.0, (10, 2)),
        (10_000.0, 100.0, (10, 10)),
    ],
)
def test_filters_follow_the_sampling_rate(rate, cutoff, stages):
    assert cutoff_of([np.arange(9.0)], rate) == pytest.approx(cutoff)
    assert stages_of(rate) == stages
    if stages:
        assert 70 < rate / np.prod(stages) < 145
    assert settling_samples(rate) == max(1, round(rate / 5))


@pytest.mark.parametrize("rate", [1000.0, 600.0, 2000.0, 20_000.0, 100.0, 2.0])
def test_the_shortest_stretch_is_just_long_enough(rate):
    size = shortest_stretch(rate)
    low_pass(np.arange(float(size)), rate, cutoff_of([np.arange(float(size))], rate))
    left = size - 2 * settling_samples(rate)
    assert left >= 1
    if stages_of(rate):
        resample = Resample(stretches=((0, left),), stages=stages_of(rate))
        assert resample.apply(np.ones((20, left))).shape == (20, resample.rows)
        # a constant lies where the ripple is lowest, 0.05 dB, forwards and backwards
        gain = 10 ** (-2 * 0.05 / 20 * len(stages_of(rate)))
        np.testing.assert_allclose(resample.apply(np.ones(left)), gain, rtol=1e-9)


def test_low_pass_is_the_textbook_filter():
    values = np.random.default_rng(1).normal(size=500)
    b, a = butter(4, 0.2)
    np.testing.assert_array_equal(low_pass(values, 1000.0, 100.0), filtfilt(b, a, values))
    # what is slow passes without phase, what is fast does not
    t = np.arange(2000) * 1e-3
    middle = slice(300, -300)
    slow, fast = np.sin(2 * np.pi * 5 * t), np.sin(2 * np.pi * 400 * t)
    np.testing.assert_allclose(low_pass(slow, 1000.0, 100.0)[middle], slow[middle], atol=1e-4)
    assert np.abs(low_pass(fast, 1000.0, 100.0)[middle]).max() < 1e-4


@pytest.mark.parametrize("many", [1, 17])
@pytest.mark.parametrize(("samples", "stages"), [(700, (10,)), (301, (5,)), (900, (10, 2)), (28, (13,))])
def test_decimation_is_that_of_scipy(many, samples, stages):
    signals = np.cumsum(np.random.default_rng(many).normal(size=(many, samples)), axis=1)
    resample = Resample(stretches=((0, samples),), stages=stages)
    expected = signals
    for factor in stages:
        expected = decimate(expected, factor, ftype="iir", axis=-1)
    assert resample.rows == expected.shape[1]
    np.testing.assert_allclose(resample.apply(signals), expected, rtol=0, atol=1e-11 * np.abs(signals).max())


def test_stretches_are_filtered_each_for_itself_and_rows_picked_after():
    signals = np.random.default_rng(2).normal(size=(2, 3, 900))
    resample = Resample(stretches=((0, 405), (405, 900)), stages=(10,))
    expected = np.concatenate(
        [decimate(part, 10, ftype="iir", axis=-1) for part in (signals[..., :405], signals[..., 405:])], axis=-1
    )
    found = resample.apply(signals)
    np.testing.assert_allclose(found, expected, atol=1e-12)
    assert resample.kept[[0, 40, 41]].tolist() == [0, 400, 405]
    rows = np.array([3, 50, 4])
    part = resample.take(rows)
    assert (part.rows, part.samples, part.kept.tolist()) == (3, 900, [30, 495, 40])
    np.testing.assert_array_equal(part.apply(signals), found[..., rows])
    mask = np.array([False, True, True])
    np.testing.assert_array_equal(part.take(mask).apply(signals), found[..., [50, 4]])


def test_local_derivatives_fit_the_nearest_rows():
    generator = np.random.default_rng(3)
    time, values = np.sort(generator.uniform(0, 1, 60)), generator.normal(size=60)
    first, second = local_derivatives(time, values)
    for row in (0, 5, 10, 30, 49, 59):
        begin = min(max(row - 10, 0), 60 - 21)
        window = slice(begin, begin + 21)
        fit = np.polyfit(time[window] - time[row], values[window], 2)
        np.testing.assert_allclose([first[row], second[row]], [fit[1], 2 * fit[0]], rtol=1e-7)


def test_local_derivatives_of_hardly_any_or_equal_times():
    first, second = local_derivatives(np.array([0.0, 1.0]), np.array([0.0, 3.0]))
    np.testing.assert_allclose(first, 3.0)
    np.testing.assert_allclose(second, 0.0)
    first, second = local_derivatives(np.ones(5), np.arange(5.0))
    assert not first.any()
    assert not second.any()
    first, second = local_derivatives(np.zeros(1), np.ones(1))
    assert (first.tolist(), second.tolist()) == ([0.0], [0.0])


def test_local_derivatives_are_the_same_in_parts():
    """More rows than are computed at once."""
    time = np.cumsum(np.random.default_rng(4).uniform(1, 2, 50_030))
    first, second = local_derivatives(time, time**2)
    np.testing.assert_allclose(first, 2 * time, rtol=1e-6)
    np.testing.assert_allclose(second, 2.0, rtol=1e-4)


def test_a_command_is_differentiated_nearly_up_to_half_of_the_rate():
    ramp = np.abs(np.arange(400.0) % 80.0 - 40.0)  # turns round within a sample
    assert cutoff_of([ramp], 25.0, 1e-4) == pytest.approx(5.0)
    assert cutoff_of([ramp], 25.0, 1e-4, commanded=True) == pytest.approx(11.25)
