"""A data set in whitened space: products, the constant, parts in units of their own."""

from dataclasses import replace

import numpy as np
import pytest
from inference_oracle import covariance, measured, one_chain, whitened

from rtec.effects import Observable, Shape, effect_named
from rtec.inference import space as module
from rtec.inference.colour import COLOURS, Colour
from rtec.inference.evidence import SCALES, Sums, best_scales, posterior
from rtec.inference.space import Space, blocks_of

SCALE, CYCLIC = (effect_named(n) for n in ("scale", "cyclic"))
CHOICES = [(SCALE, Shape()), (CYCLIC, CYCLIC.shape_type(41.0, 2))]
AR = Colour(0.9, 0.3)


def force(data):
    return replace(data, observable=Observable.DRIVE, observe="force")


@pytest.mark.parametrize("colour", [Colour(), AR])
def test_sums_are_those_of_whitened_columns_beside_the_constant(colour):
    data = measured(lambda x, way, t, run: 5e-5 * x, runs=2, targets=9)
    space = Space(data)
    parts = space.parts_of(CHOICES)
    sums = space.sums(parts, colour)
    matrix = covariance(colour.rho, colour.white, one_chain(data.rows))
    raw = np.vstack([part.raw * part.unit for part in parts])
    table = whitened(np.vstack([raw, data.observed, np.ones(data.rows)]), matrix)
    constant = table[-1] / np.linalg.norm(table[-1])
    table = table[:-1] - np.outer(table[:-1] @ constant, constant)
    assert sums.products == pytest.approx(table @ table.T, rel=1e-6, abs=1e-8)
    assert sums.readings == data.rows - 1
    assert all(space.sums(parts[:k], colour).products.flags.c_contiguous for k in range(len(parts) + 1))
    again = space.sums(parts[::-1], colour)  # from what is kept, in another order
    order = np.concatenate([*(np.flatnonzero(blocks_of(parts) == k) for k in range(len(parts))[::-1]), [-1]])
    assert again.products == pytest.approx(sums.products[np.ix_(order, order)])


@pytest.mark.parametrize("place", [0, 1, 2])
def test_the_principal_columns_of_a_large_part_stand_for_it(place):
    space = Space(measured(lambda x, way, t, run: 5e-5 * x, runs=3, targets=20))
    rng = np.random.default_rng(1)
    parts = space.parts_of(CHOICES)
    parts.insert(place, space.part(rng.normal(size=(module.TURNED_FROM, space.dataset.rows))))
    sums, block = space.sums(parts, AR), blocks_of(parts)
    table = np.vstack([space.white(part, AR) for part in (*parts, space.observed_part)])
    plain = Sums(table @ table.T, space.readings)
    assert sums.turn is not None
    start = np.array([3, 4, 5])
    for together in (True, False):
        places, value = best_scales(sums, block, start, together=together)
        expected, known = best_scales(plain, block, start, together=together)
        assert places.tolist() == expected.tolist()
        assert value == pytest.approx(known)
    deviations = SCALES[start][block]
    mean, variance = posterior(sums, deviations)
    assert mean == pytest.approx(posterior(plain, deviations)[0], abs=1e-9)
    assert variance == pytest.approx(posterior(plain, deviations)[1])


def test_a_part_has_a_mean_square_of_one_about_its_mean():
    space = Space(measured(runs=2))
    for part in space.parts_of(CHOICES):
        shown = (part.raw - part.raw.mean(axis=1, keepdims=True)) * part.unit
        assert (shown**2).sum() / shown.shape[1] == pytest.approx(1.0)
    held = space.part(np.zeros((1, space.dataset.rows)))
    assert held.unit == 1.0


def test_the_constant_is_an_effect_of_a_force_and_a_datum_of_a_deviation():
    data = measured(runs=2)
    deviation, drive = Space(data), Space(force(data))
    assert (deviation.readings, drive.readings) == (data.rows - 1, data.rows)
    assert deviation.view(AR).constant.shape == (1, data.rows)
    assert drive.view(AR).constant.shape == (0, data.rows)
    assert deviation.view(AR).constant[0] @ deviation.observed(AR) == pytest.approx(0.0, abs=1e-9)
    matrix = covariance(0.9, 0.3, one_chain(data.rows))
    ones = np.ones(data.rows)
    det = np.linalg.slogdet(matrix)[1]
    assert drive.view(AR).log_determinant == pytest.approx(det)
    assert deviation.view(AR).log_determinant == pytest.approx(det + np.log(ones @ np.linalg.inv(matrix) @ ones))
    assert "offset" not in {e.name for e in deviation.library}


def test_noise_of_a_log_has_a_white_part():
    still = Space(measured(runs=2))
    assert still.colours == frozenset(COLOURS)
    moving = Space(replace(still.dataset, conditions=replace(still.dataset.conditions, moving=True)))
    assert min(colour.white for colour in moving.colours) == 0.3
    assert Colour() in moving.colours


def test_what_is_kept_is_forgotten_before_it_fills_the_memory(monkeypatch):
    data = measured(runs=2)
    expected = Space(data).sums(Space(data).parts_of(CHOICES), AR)
    monkeypatch.setattr(module, "_KEPT_BYTES", 100)
    space = Space(data)
    for colour in (AR, Colour(0.6, 0.3), AR):
        found = space.sums(space.parts_of(CHOICES), colour)
    assert found.products == pytest.approx(expected.products)


@pytest.mark.parametrize("at_once", [100_000_000, 40_000])
def test_a_scan_holds_every_shape_once_in_whitened_space(monkeypatch, at_once):
    monkeypatch.setattr(module, "_AT_ONCE_BYTES", at_once)
    data = measured(runs=2)
    space = Space(data)
    shapes, sound = space.shapes(CYCLIC)
    assert sound.tolist() == [False, *[True] * (len(shapes) - 1)], "but for the end of the scan"
    for _ in range(2):  # computed, then kept
        scan = np.concatenate([part.columns for part in space.scan(CYCLIC, shapes, AR)])
        assert scan.shape == (len(shapes), 2, data.rows)
        for k in (0, len(shapes) // 2, len(shapes) - 1):
            expected = whitened(data.columns(CYCLIC, shapes[k]).T, covariance(0.9, 0.3, one_chain(data.rows)))
            assert scan[k] == pytest.approx(expected, abs=1e-4)  # single precision
