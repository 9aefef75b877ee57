"""The smallest contribution of an effect that the search would find on this plan, with this noise."""

from __future__ import annotations

import numpy as np

from rtec.effects import Effect
from rtec.inference.gate import WORTH
from rtec.inference.probes import Probe
from rtec.inference.proposals import Beside, beside, orthonormal
from rtec.inference.scored import Judge, Scored

ERRORS = 1.64
"""Standard errors that the noise may take away: so the effect is found 95 times of 100."""
IN_TIME = 2.0
"""For what changes in time beside slow noise or offsets of the runs, which are fitted together with it."""
RUN_OFFSET = "run_offset"
_SHAPES, _ROWS = 25, 60_000
"""Shapes looked at, and rows of all their columns: of few rows every shape, of many a sample."""


def minimum_detectable(judge: Judge, model: Scored) -> dict[str, float]:
    """Return the RMS contribution of each testable effect that would be found 95 times of 100, in the observed unit.

    Notes
    -----
    An effect of which a share of energy ``l`` (over the noise's variance) is new beside the constant raises the score
    by ``l / 2`` less its price and half a logarithm of the readings for each amplitude, give or take ``sqrt(l)``.
    Of several shapes the least favourable counts.
    """
    back = beside(judge.space, (), model.colour)
    sigma = float(np.sqrt(judge.fit(model, model.colour).variance))
    return {
        effect.name: found
        for effect in judge.space.library
        if not isinstance(effect, Probe) and (found := _of(judge, effect, back, sigma, model)) is not None
    }


def _of(judge: Judge, effect: Effect, back: Beside, sigma: float, model: Scored) -> float | None:
    space = judge.space
    shapes, sound = space.shapes(effect)
    shapes = [shape for shape, good in zip(shapes, sound, strict=True) if good]
    if effect.is_map:
        shapes = shapes[:1]
    elif len(shapes) > (most := max(_SHAPES, _ROWS // space.dataset.rows)):
        shapes = [shapes[k] for k in np.linspace(0, len(shapes) - 1, most).astype(int)]
    slow = effect.in_time and (RUN_OFFSET in model.names or model.colour.rho > 0.0)
    worst = None
    for shape in shapes:
        raw = space.raw((effect, shape))
        if space.has_datum:
            raw = raw - raw.mean(axis=1, keepdims=True)
        white = space.view(model.colour).whitening.of(raw)
        new = white - (white @ back.basis.T) @ back.basis
        whole, energy = float((white**2).sum()), float((new**2).sum())
        if energy <= 1e-8 * whole or not orthonormal(new).size:
            continue
        price = judge.price((effect, shape)) + 0.5 * raw.shape[0] * float(np.log(max(space.readings, 2)))
        root = ERRORS + float(np.sqrt(ERRORS**2 + 2.0 * (WORTH + price)))
        found = sigma * root * float(np.sqrt((raw**2).sum() / raw.shape[1] / energy)) * (IN_TIME if slow else 1.0)
        worst = found if worst is None else max(worst, found)
    return worst
