"""The smallest contribution of an effect that the search would find on this plan, with this noise."""

from __future__ import annotations

import numpy as np
from scipy import special
from scipy.optimize import brentq

from rtec.effects import Effect
from rtec.inference.score import INDEPENDENT, orthonormal
from rtec.inference.workspace import Workspace, is_map, scan_cost

POWER = 0.95
"""Probability with which an effect so large is found."""
LEVEL = 0.01
HELD_OUT = 16.0
"""Fall, in units of the noise's variance, from which on the held-out gain lies above two standard errors."""
IN_TIME = 3.0
"""For what changes in time beside correlated noise: the correlation comes from the same few repeats, and slow noise
feigns slow effects."""
_SHAPES, _ROWS = 25, 60_000
"""Shapes looked at, and rows of all their columns: of few rows every shape, of many a sample."""


def minimum_detectable(workspace: Workspace, tests: float) -> dict[str, float]:
    """Return the RMS contribution of each testable effect that would be found 95 times of 100, in the observed unit.

    Notes
    -----
    The fall of the residual sum of squares is noncentral chi-square (Wald 1943) with the contribution's energy beside
    a constant, in whitened space, over the noise's variance. It has to pass the adjusted probability, the cost of its
    parameters and the held-out test. Of several shapes the least favourable counts.
    """
    strict = workspace.strict
    return {effect.name: found for effect in strict.library if (found := _of(strict, effect, tests)) is not None}


def _of(workspace: Workspace, effect: Effect, tests: float) -> float | None:
    back = workspace.background((), datum=False if effect.name == "offset" else None)
    shapes = effect.shapes(workspace.conditions)
    if is_map(effect):
        shapes = workspace.maps(effect)[:1]
    elif len(shapes) > (most := max(_SHAPES, _ROWS // workspace.dataset.rows)):
        shapes = [shapes[k] for k in np.linspace(0, len(shapes) - 1, most).astype(int)]
    worst = None
    for shape in shapes:
        white = workspace.columns(effect, shape)
        raw = workspace.dataset.columns(effect, shape)
        if workspace.has_datum and effect.name != "offset":
            raw = raw - raw.mean(axis=0)
        basis = orthonormal(white, back.basis)
        whole = float((white**2).sum())
        energy = whole - float(((white @ back.basis) ** 2).sum())
        if not basis.shape[1] or energy < INDEPENDENT * whole:
            continue
        widen = IN_TIME if effect.in_time and not workspace.noise.correlation.is_white else 1.0
        needed = widen * _noncentrality(workspace, basis.shape[1], scan_cost(effect, shape), tests)
        found = workspace.noise.sigma * float(np.sqrt(needed / energy * (raw**2).sum() / raw.shape[0]))
        worst = found if worst is None else max(worst, found)
    return worst


def _noncentrality(workspace: Workspace, amplitudes: int, cost: int, tests: float) -> float:
    """Return the noncentrality at which the fall passes every test with the wanted probability."""
    single = -np.expm1(np.log1p(-LEVEL) / tests)
    by_chance = float(special.fdtri(amplitudes, max(workspace.noise.freedom, 1.0), 1.0 - single)) * amplitudes
    by_cost = (amplitudes + cost) * workspace.cost
    threshold = max(by_chance, by_cost, HELD_OUT)

    def lack(noncentrality: float) -> float:
        return 1.0 - float(special.chndtr(threshold, amplitudes, noncentrality)) - POWER

    return float(brentq(lack, 1e-6, 40.0 * threshold + 100.0))
