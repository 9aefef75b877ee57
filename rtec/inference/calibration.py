"""The best of many: how many independent tests library and scan grid amount to."""

from __future__ import annotations

import numpy as np

from rtec.effects import Floats
from rtec.inference import tails
from rtec.inference.score import INDEPENDENT, orthonormal
from rtec.inference.workspace import Workspace, is_map

DRAWS = 64


def independent_tests(workspace: Workspace, rng: np.random.Generator, draws: int = DRAWS) -> float:
    """Return the number of independent tests to which the maximum over library and scan grid amounts.

    Notes
    -----
    White noise is drawn in whitened space, which is a parametric bootstrap from the noise's covariance; for each draw
    the smallest probability over all candidates and shapes is found. With N independent tests its median would be
    1 − 2^(−1/N); solved for N. A probability p is then adjusted to 1 − (1 − p)^N (Šidák), which reaches far beyond
    the 1 / draws of the draws themselves.
    """
    rows = workspace.dataset.rows
    back = workspace.background(())
    noise = rng.standard_normal((rows, draws))
    noise -= back.basis @ (back.basis.T @ noise)
    largest = np.zeros(draws)
    for effect in workspace.library:
        if is_map(effect):
            for shape in workspace.maps(effect):
                basis = orthonormal(workspace.columns(effect, shape), back.basis)
                if basis.shape[1]:
                    found = ((basis.T @ noise) ** 2).sum(axis=0)
                    largest = np.maximum(largest, -np.log(tails.chi_squared(found, basis.shape[1])))
            continue
        for _, columns, copies in workspace.scan(effect):
            own = noise if copies == 1 else noise.reshape(copies, -1, draws).sum(axis=0)
            basis = (
                back.basis
                if copies == 1
                else back.basis.reshape(copies, rows // copies, back.basis.shape[1]).sum(axis=0)
            )
            found = _falls(columns, own, basis, copies)
            largest = np.maximum(largest, -np.log(tails.chi_squared(found, columns.shape[1])))
    median = float(np.exp(-np.median(largest)))
    return max(1.0, float(np.log(0.5) / np.log1p(-min(median, 0.5))))


def _falls(candidates: Floats, noise: Floats, basis: Floats, copies: int) -> Floats:
    """Return the largest fall of the sum of squares over candidates (m, q, rows) for each draw (rows, draws)."""
    m, q, n = candidates.shape
    flat = candidates.reshape(m * q, n)
    b = (flat @ noise).reshape(m, q, -1)
    shared = (flat @ basis).reshape(m, q, -1)
    own = copies * np.einsum("mqn,mqn->mq", candidates, candidates)
    left = own - np.einsum("mqk,mqk->mq", shared, shared)
    tiny = left <= INDEPENDENT * own
    safe = np.where(tiny, 1.0, left)
    if q == 1:
        single: Floats = np.where(tiny, 0.0, b[:, 0] ** 2 / safe).max(axis=0)
        return single
    cross = copies * np.einsum("mn,mn->m", candidates[:, 0], candidates[:, 1])
    cross -= np.einsum("mk,mk->m", shared[:, 0], shared[:, 1])
    determinant = left[:, 0] * left[:, 1] - cross**2
    bad = tiny.any(axis=1) | (determinant <= INDEPENDENT * left[:, 0] * left[:, 1])
    if bad.all():
        return np.zeros(noise.shape[1])
    good = ~bad
    first, second, mixed = left[good, 0][:, None], left[good, 1][:, None], cross[good][:, None]
    fall = second * b[good, 0] ** 2 - 2.0 * mixed * b[good, 0] * b[good, 1] + first * b[good, 1] ** 2
    largest: Floats = (fall / determinant[good][:, None]).max(axis=0)
    return largest


def adjusted(p: float, tests: float) -> float:
    """Return a probability adjusted for the best of ``tests`` independent tests.

    Examples
    --------
    >>> round(adjusted(0.001, 100.0), 4)
    0.0952
    """
    return float(-np.expm1(tests * np.log1p(-min(p, 1.0 - 1e-15))))
