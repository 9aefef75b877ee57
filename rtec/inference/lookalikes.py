"""Which effects look alike on this plan: cosines after projection, rivals that the data cannot reject, the datum."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rtec.effects import Effect, Floats, effect_named
from rtec.inference.forms import refined
from rtec.inference.results import Cosines
from rtec.inference.score import Background, orthonormal
from rtec.inference.workspace import Candidacy, Choice, Workspace, is_map

ALIKE = 0.95
"""Cosine from which on two contributions count as look-alikes."""
REJECTED = 6.0
"""Twice the log-likelihood by which the data must prefer an effect to a look-alike: odds of 20 to 1."""
SET_TO_ZERO = 0.02
"""Share of the noise within which the first reading is exactly zero: an instrument was set to zero there."""
DATUM_ERRORS = 3.5
"""A constant within so many standard errors of where an effect is zero is that effect's datum."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Rivalry:
    """An accepted effect and another that would do in its place."""

    effect: str
    rival: str
    cosine: float
    lack: float
    """Twice the log-likelihood by which the data prefer the accepted one."""
    candidacy: Candidacy | None = None
    permanent: bool = False

    @property
    def tied(self) -> bool:
        """Whether the data cannot tell the two apart, although another experiment could."""
        return not self.permanent and self.cosine > ALIKE and self.lack < REJECTED


def rivalries(workspace: Workspace, choices: Sequence[Choice], k: int) -> list[Rivalry]:
    """Return the effects that could stand in for choice ``k``, the most alike first.

    An effect that holds the accepted one as a special case is no rival: the simplest that explains the data wins.
    """
    effect, shape = choices[k]
    rest = [*choices[:k], *choices[k + 1 :]]
    back = workspace.beside(rest, effect)
    own = workspace.judge(effect, shape, back)
    basis = orthonormal(workspace.columns(effect, shape), back.basis)
    part = basis @ (basis.T @ back.residual)
    energy = float(part @ part)
    held = {other.name for other, _ in choices}
    found = []
    for other in workspace.library:
        if other.name in held or effect.name in other.contains or other.name in effect.contains or energy == 0.0:
            continue
        if "offset" in (other.name, effect.name):  # a constant is the simplest of all, and a datum for the others
            continue
        # the contribution itself takes the residual's place: what a rival explains of it is the squared cosine
        alike = _best_alike(workspace, other, Background(basis=back.basis, residual=part))
        if alike is None or alike.gain < ALIKE**2 * energy:
            continue
        cosine = min(1.0, float(np.sqrt(alike.gain / energy)))
        judged = max(
            (workspace.judge(other, alike.shape, back), _refined_or_none(workspace, other, rest, back)),
            key=lambda c: -np.inf if c is None else c.gain,
        )
        if judged is not None:
            lack = workspace.worth(own.gain, own.before) - workspace.worth(judged.gain, judged.before)
            lack += _parameters(judged) - _parameters(own)  # each explains so much by chance
            found.append(
                Rivalry(effect=effect.name, rival=other.name, cosine=cosine, lack=float(lack), candidacy=judged)
            )
    tied = {r.rival for r in found if r.tied}
    found = [
        r for r in found if not effect_named(r.rival).contains & tied
    ]  # the simplest of the rivals stands for them
    found += [
        Rivalry(effect=effect.name, rival=rival.name, cosine=1.0, lack=0.0, permanent=True)
        for rival in effect.rivals
        if rival.permanent
    ]
    return sorted(found, key=lambda r: -r.cosine)


def _parameters(candidacy: Candidacy) -> int:
    return candidacy.amplitudes + candidacy.effect.freedom(candidacy.shape)


def _best_alike(workspace: Workspace, other: Effect, part: Background) -> Candidacy | None:
    if is_map(other):
        found = [workspace.judge(other, shape, part) for shape in workspace.maps(other)]
        return max(found, key=lambda c: c.gain, default=None)
    return workspace.best_of_scan(other, part)


def _refined_or_none(
    workspace: Workspace, other: Effect, rest: Sequence[Choice], back: Background
) -> Candidacy | None:
    best = workspace.best_of_scan(other, back)
    return None if best is None else refined(workspace, best, rest, back)


def cosines(workspace: Workspace, choices: Sequence[Choice]) -> Cosines | None:
    """Return how alike the testable effects look on this plan, after projection off a constant.

    Each in the shape that the model has, else in the one that suits what the model leaves best; between effects with
    several columns the largest cosine that any two of their contributions can have.
    """
    back = workspace.background(())
    left = workspace.background(choices)
    shapes = {effect.name: shape for effect, shape in choices}
    names, bases = [], []
    for effect in workspace.library:
        if effect.name == "offset":
            continue
        if effect.name in shapes:
            shape = shapes[effect.name]
        else:
            best = workspace.best_of_scan(effect, left)
            if best is None:
                continue
            shape = best.shape
        basis = orthonormal(workspace.columns(effect, shape), back.basis)
        if basis.shape[1]:
            names.append(effect.name)
            bases.append(basis)
    if len(names) < 2:
        return None
    table = np.eye(len(names))
    for i, j in itertools.combinations(range(len(names)), 2):
        largest = float(np.linalg.norm(bases[i].T @ bases[j], ord=2))
        table[i, j] = table[j, i] = min(1.0, largest)
    return Cosines(names=tuple(names), cosine=table)


def constant_is_datum(workspace: Workspace, choices: Sequence[Choice]) -> bool:
    """Return whether the constant of the readings only says where an effect was set to zero.

    A deviation is measured from a datum: an instrument is set to zero at the first reading, or the mean is taken
    off. A scale error so measured has a constant beside it, and so has a backlash read from its forward side; neither
    is an offset of its own. The constant is a datum where, for some choice of zero of each effect, it is
    insignificant.
    """
    others = [choice for choice in choices if choice[0].name != "offset"]
    if not others:
        return False
    white = np.vstack([*(workspace.columns(effect, shape) for effect, shape in others), workspace.constant]).T
    length = np.sqrt((white**2).sum(axis=0))
    inverse = np.linalg.pinv(white / length, rcond=1e-9) / length[:, None]
    numbers = inverse @ workspace.observed
    covariance = inverse @ inverse.T * workspace.noise.sigma**2
    # the reading that was set to zero keeps its own noise: the constant then has that, too
    zeroed = abs(float(workspace.dataset.observed[0])) < SET_TO_ZERO * workspace.noise.sigma
    of_first = workspace.noise.sigma**2 if zeroed else 0.0
    zeros: list[list[tuple[Floats, float]]] = []
    at = 0
    for effect, shape in others:
        raw = workspace.dataset.columns(effect, shape)
        zeros.append([(np.zeros(numbers.size), 0.0)])
        for value, first in _zero_values(workspace, raw):
            weights = np.zeros(numbers.size)
            weights[at : at + raw.shape[1]] = value
            zeros[-1].append((weights, of_first if first else 0.0))
        at += raw.shape[1]
    constant = np.zeros(numbers.size)
    constant[-1] = 1.0
    for chosen in itertools.product(*zeros):
        weights = constant + np.sum([weight for weight, _ in chosen], axis=0)
        variance = float(weights @ covariance @ weights) + max(extra for _, extra in chosen)
        if abs(float(weights @ numbers)) < DATUM_ERRORS * float(np.sqrt(max(variance, 0.0))):
            return True
    return False


def _zero_values(workspace: Workspace, raw: Floats) -> list[tuple[Floats, bool]]:
    """Return what an effect's columns are where it may have been set to zero: on the mean, at the start, forward."""
    values = [(raw.mean(axis=0), False), (raw[0], True)]
    direction = workspace.dataset.coordinates.direction
    if direction is not None and (direction > 0).any():
        values.append((raw[direction > 0].mean(axis=0), False))
    return values
