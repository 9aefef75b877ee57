"""Spectra against least squares written out, and their threshold against noise."""

from __future__ import annotations

import numpy as np
import pytest

from rtec.inference.noise import NoiseFloor
from rtec.inference.spectra import highest_frequency, mirrored, spectrum, threshold


def floor(sigma: float, correlation: float = 0.0, white_share: float = 1.0) -> NoiseFloor:
    return NoiseFloor(
        from_repeats=True, sigma=sigma, correlation=correlation, white_share=white_share,
        degrees_of_freedom=168.0, sigma_adjacent=None,
    )  # fmt: skip


def _least_squares(x: np.ndarray, y: np.ndarray, frequency: float) -> float:
    """Return √2 times the RMS that a sine, a cosine and a constant explain beyond the constant."""
    angle = 2 * np.pi * frequency * x
    design = np.stack([np.ones_like(x), np.sin(angle), np.cos(angle)], axis=1)
    solution, *_ = np.linalg.lstsq(design, y, rcond=None)
    left = y - design @ solution
    return float(np.sqrt(2 * max(np.mean((y - y.mean()) ** 2) - np.mean(left**2), 0.0)))


@pytest.mark.parametrize("irregular", [False, True])
def test_the_fast_spectrum_is_the_least_squares_one(irregular):
    rng = np.random.default_rng(5)
    x = np.linspace(0.0, 100.0, 300)
    if irregular:
        x = np.sort(rng.uniform(0.0, 100.0, 300))
    y = 0.4 * np.sin(2 * np.pi * 0.31 * x) + rng.normal(0.0, 0.3, 300) + 7.0
    found = spectrum(x, y, 1.2)
    picks = np.flatnonzero(found.frequency < 1.15)[:: max(1, found.frequency.size // 60)]
    exact = np.array([_least_squares(x, y, float(f)) for f in found.frequency[picks]])
    # readings moved to a grid of eight cells a cycle: a few per cent of the strongest line
    assert np.abs(found.amplitude[picks] - exact).max() < 0.04 * exact.max() + 0.02
    k = int(np.argmax(found.amplitude))
    assert found.frequency[k] == pytest.approx(0.31, abs=0.005)
    assert found.amplitude[k] == pytest.approx(_least_squares(x, y, 0.31), rel=0.05)


def test_a_constant_has_no_lines_and_places_of_one_phase_do_not_break():
    x = np.arange(40.0)
    assert spectrum(x, np.full(40, 3.0), 0.9).amplitude.max() < 1e-12
    found = spectrum(x, np.cos(np.pi * x), 1.0)  # half a cycle a step: one phase of a sine only
    assert np.isfinite(found.amplitude).all() and found.amplitude.max() < 2.0


def test_noise_alone_passes_the_threshold_as_seldom_as_it_says():
    rng = np.random.default_rng(7)
    x, trials = np.linspace(0.0, 100.0, 128), 600
    noise = floor(sigma=2.0)
    passed = 0
    for _ in range(trials):
        found = spectrum(x, rng.normal(0.0, 2.0, x.size), 0.5)
        level = threshold(found.frequency, noise, rows=x.size, resolved=0.5 * 100.0, spacing=100 / 127)
        passed += bool((found.amplitude > level).any())
    # p = 0.01, a little more where the grid is finer than the resolution
    assert 0.001 < passed / trials < 0.05


def test_correlated_noise_passes_no_oftener():
    rng = np.random.default_rng(8)
    n, trials, rho = 256, 300, 0.9
    noise = floor(sigma=1.0, correlation=rho, white_share=0.0)
    red = white = 0
    for _ in range(trials):
        e = rng.normal(0.0, np.sqrt(1 - rho**2), n)
        y = np.empty(n)
        y[0] = rng.normal()
        for k in range(1, n):
            y[k] = rho * y[k - 1] + e[k]
        found = spectrum(np.arange(n), y, 0.5)
        red += bool((found.amplitude > threshold(found.frequency, noise, rows=n, resolved=n / 2, spacing=1.0)).any())
        flat = floor(sigma=1.0)
        white += bool((found.amplitude > threshold(found.frequency, flat, rows=n, resolved=n / 2, spacing=1.0)).any())
    assert red / trials < 0.06 and white / trials > 0.9


@pytest.mark.parametrize(("frequency", "step"), [(0.3, 0.635), (1.9, 0.635), (0.01, 7.0), (0.2, 2.0)])
def test_mirrored_lines_cannot_be_told_apart_at_the_targets(frequency, step):
    x = step * np.arange(50)
    for alias in mirrored(frequency, step, 1.0 / step):
        assert alias != pytest.approx(frequency)
        same = np.exp(2j * np.pi * frequency * x)
        other = np.exp(2j * np.pi * alias * x)
        assert min(np.abs(same - other).max(), np.abs(same - other.conj()).max()) < 1e-6
    assert mirrored(frequency, step, 1.0 / step)


def test_a_spectrum_ends_where_the_longest_transform_does():
    assert highest_frequency(100.0, 3.0) == 3.0
    assert highest_frequency(1e6, 3.0) == pytest.approx(65536 / 1e6)
