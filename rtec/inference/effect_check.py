"""What an effect would show on a plan: whether it is finite, how fast it is, and what looks like it."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from rtec.dataset.dataset import Dataset
from rtec.dataset.many_rows import search_sample
from rtec.effects import Effect, Floats, Shape
from rtec.inference.candidates import detectable
from rtec.inference.probes import Probe
from rtec.inference.proposals import orthonormal
from rtec.inference.scored import Judge
from rtec.inference.space import Space

SAME = 0.9999
"""Cosine from which on two effects are one on a plan."""
ALIKE = 0.8
"""Cosine from which on an effect is told of."""
_MOST_SHAPES = 60


@dataclass(frozen=True, slots=True, kw_only=True)
class LookAlike:
    """An effect of the library that looks like the one that is checked."""

    effect: str
    cosine: float
    """The largest that any shape of it has with the usual shape of the effect, between 0 and 1."""
    most: float
    """With the shape of the effect that it resembles most."""


@dataclass(frozen=True, slots=True, kw_only=True)
class EffectCheck:
    """What an effect would show on a plan."""

    effect: Effect
    untestable: str | None
    """Why this plan cannot show it; nothing else is known then."""
    shapes: int = 0
    """Shapes of its scan."""
    call_s: float = 0.0
    """Time of one call for all readings."""
    alike: tuple[LookAlike, ...] = ()
    """Those with a cosine of 0.8 or more, the most alike first."""
    smallest: tuple[float, float] | None = None
    """Amplitude that would be found 95 times of 100 with the noise of this measurement, in the observed unit inside:
    of a usual shape, and of the least favourable."""

    @property
    def same(self) -> str | None:
        """The effect that it equals on this plan; None where there is none."""
        return next((one.effect for one in self.alike if one.cosine >= SAME), None)


def check_effect(effect: Effect, dataset: Dataset, seed: int = 0) -> EffectCheck:
    """Return what an effect would show on the plan of a measurement.

    Raises
    ------
    ArgumentError
        It fails, or returns what is no finite number for each reading; the error names line and parameters.
    """
    why = effect.untestable(dataset.conditions)
    if not effect.explains(dataset.observable):
        why = f"it is no effect of {dataset.observe}"
    if why is not None:
        return EffectCheck(effect=effect, untestable=why)
    begun = time.process_time()
    effect.columns(dataset.conditions, effect.shapes(dataset.conditions)[0])
    call_s = time.process_time() - begun
    space = Space(search_sample(dataset, seed))
    judge = Judge(space)
    noise = judge.score(())
    own = _bases(space, effect)
    alike = []
    for other in space.library:
        if other is effect or isinstance(other, Probe) or not own:
            continue
        others = _bases(space, other)
        best = [max((_cosine(one, two) for two in others), default=0.0) for one in own]
        if max(best) >= ALIKE:
            alike.append(LookAlike(effect=other.name, cosine=float(np.median(best)), most=max(best)))
    each = [
        found / size
        for shape in _some(space.shapes(effect)[0])
        if (size := _size(space, effect, shape)) > 0.0
        and (found := detectable(judge, effect, noise, shape)) is not None
    ]
    return EffectCheck(
        effect=effect,
        untestable=None,
        shapes=len(space.shapes(effect)[0]) if fields(effect.shape_type) else 1,
        call_s=call_s,
        alike=tuple(sorted(alike, key=lambda one: (-one.cosine, -one.most))),
        smallest=(float(np.median(each)), max(each)) if each else None,
    )


def _some(shapes: Sequence[Shape]) -> list[Shape]:
    if len(shapes) <= _MOST_SHAPES:
        return list(shapes)
    return [shapes[k] for k in np.linspace(0, len(shapes) - 1, _MOST_SHAPES).astype(int)]


def _bases(space: Space, effect: Effect) -> list[Floats]:
    """Return an orthonormal basis of what each of some shapes adds, shape (columns, rows), the constant taken out."""
    found = []
    for shape in _some(space.shapes(effect)[0]):
        raw = space.raw((effect, shape))
        basis = orthonormal(raw - raw.mean(axis=1, keepdims=True) if space.has_datum else raw)
        if basis.shape[0]:
            found.append(basis)
    return found


def _cosine(one: Floats, two: Floats) -> float:
    return min(1.0, float(np.linalg.norm(one @ two.T, ord=2)))


def _size(space: Space, effect: Effect, shape: Shape) -> float:
    """Return the RMS of a unit of an effect, the constant taken out."""
    raw = space.raw((effect, shape))[0]
    return float(np.std(raw) if space.has_datum else np.sqrt(np.mean(raw**2)))
