"""A search's state, and the test of one effect for removal."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from rtec.dataset.dataset import Dataset
from rtec.effects import Floats
from rtec.inference.calibration import adjusted
from rtec.inference.fit import fitted_terms, jointly_refitted, needs_datum, noise_after, residual_of
from rtec.inference.forms import families_joined, stated_period
from rtec.inference.heldout import HeldOutGain, gain_of, gain_on, held_out_residual, rms_by_folds
from rtec.inference.leftover import MATTERS
from rtec.inference.model import Model
from rtec.inference.noise import Noise, noise_from_repeats, noise_from_residual
from rtec.inference.structure import ChanceInTime, reversal_changes_instead
from rtec.inference.workspace import Candidacy, Choice, Workspace

LEVEL = 0.01
"""Of the adjusted probability below which an effect is named."""
MATTERS_WITHOUT_REPEATS = 0.005
"""Share by which an effect has to lower the RMS where there is no noise floor to compare it with."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Trial:
    """An effect of the model, tested for removal."""

    candidacy: Candidacy
    p_adjusted: float
    held_out: HeldOutGain
    small: bool
    outdone: bool = False
    """By something that is no effect of the library."""

    @property
    def passes(self) -> bool:
        """Whether the effect stays."""
        return self.p_adjusted < LEVEL and self.held_out.passes and not self.small and not self.outdone

    @property
    def reason(self) -> str:
        """Why it stays or goes."""
        if self.p_adjusted >= LEVEL:
            return f"adjusted p {self.p_adjusted:.2g} is not below {LEVEL:g}"
        if not self.held_out.passes:
            return "the held-out error does not fall by more than two standard errors"
        if self.small:
            return "significant, but too small to matter"
        if self.outdone:
            return "a reversal error that differs from run to run explains more"
        return f"adjusted p {self.p_adjusted:.2g}, held-out error falls"


@dataclass(slots=True, kw_only=True, eq=False)
class Search:
    """The state of a search."""

    dataset: Dataset
    heldout: Dataset | None
    start: Model
    workspace: Workspace
    rng: np.random.Generator
    locked: bool = False
    """Whether ``heldout`` has no say in what is accepted: it is scored at the end."""
    tests: float = 1.0
    searched: bool = True
    """False where one effect is added as the user says."""
    kept: list[Choice] = field(default_factory=list)
    rejected: dict[str, Trial] = field(default_factory=dict)
    removed: dict[str, str] = field(default_factory=dict)
    banned: set[str] = field(default_factory=set)
    """Effects that were struck out: the search has to do without."""
    chance: ChanceInTime | None = None
    most: dict[str, int] = field(default_factory=dict)
    """How many of a kind are left after one was struck out."""

    @property
    def judge(self) -> Dataset | None:
        """The other measurement, where it has a say in what is accepted."""
        return None if self.locked else self.heldout

    def model(self, choices: Sequence[Choice]) -> Model:
        """Return a fitted model."""
        datum = needs_datum(self.workspace, choices)
        terms, zero = fitted_terms(self.workspace, choices, datum=datum)
        return self.start.with_terms(terms, datum=zero)


def trial_of(state: Search, choices: Sequence[Choice], k: int) -> Trial:
    """Test choice ``k`` beside the others."""
    workspace = state.workspace
    effect = choices[k][0]
    rest = [*choices[:k], *choices[k + 1 :]]
    strict = workspace.strict
    same = sum(own.name == effect.name for own, _ in choices)
    grid = len(effect.shapes(workspace.conditions)) if same > 1 and workspace.noise.from_repeats else 1
    single = sum(share * work.p_value(_judged(work, choices, choices[k])) for share, work in strict.likely)
    p = adjusted(single, state.tests * grid ** (same - 1))
    correlated = workspace.noise.from_repeats and not workspace.noise.correlation.is_white
    if p < LEVEL and effect.in_time and correlated:
        own = _judged(strict, choices, choices[k]).gain
        larger = [c for c in rest if not c[0].in_time or _judged(strict, choices, c).gain > own]
        if state.chance is None:
            state.chance = ChanceInTime(state.dataset, workspace.library, state.rng)
        p = max(p, state.chance.p_value(larger, choices[k]))
    judged = _judged(workspace, choices, choices[k])
    return Trial(
        candidacy=judged,
        p_adjusted=p,
        held_out=held_out_gain(state, rest, choices),
        small=_small(state, judged),
        outdone=effect.name == "lost_counts" and reversal_changes_instead(state.dataset, choices),
    )


def _judged(workspace: Workspace, choices: Sequence[Choice], choice: Choice) -> Candidacy:
    rest = [other for other in choices if other is not choice]
    return workspace.judge(*choice, workspace.beside(rest, choice[0]))


def _small(state: Search, judged: Candidacy) -> bool:
    rows = state.dataset.rows
    if state.workspace.noise.from_repeats:
        # beside noise, or beside structure that is larger than it and that nothing explains
        left = max(state.workspace.noise.sigma, float(np.sqrt(max(judged.before - judged.gain, 0.0) / rows)))
        return bool(np.sqrt(judged.gain / rows) < MATTERS * left)
    return bool(np.sqrt(max(1.0 - judged.gain / judged.before, 0.0)) > 1.0 - MATTERS_WITHOUT_REPEATS)


def held_out_gain(state: Search, rest: Sequence[Choice], choices: Sequence[Choice]) -> HeldOutGain:
    """Return the held-out gain of ``choices`` over ``rest``, on the other file where there is one."""
    workspace = state.workspace
    in_time = any(effect.in_time for effect, _ in choices if (effect, _) not in rest)
    if state.judge is not None and not (in_time and workspace.noise.from_repeats):
        # what happened once in time tells nothing about another measurement
        return gain_on(state.model(rest), state.model(choices), state.judge, workspace.noise)
    names = [effect.name for effect, _ in choices]
    datum = workspace.has_datum and "offset" not in names
    # an offset is judged against nothing in its place; any other effect against a free constant
    before = held_out_residual(
        workspace, rest, datum=datum or (workspace.has_datum and "offset" in [e.name for e, _ in rest])
    )
    return gain_of(workspace, before, held_out_residual(workspace, choices, datum=datum))


def first_noise(dataset: Dataset, base: Sequence[Choice]) -> Noise:
    """Return the noise with which a search begins."""
    found = noise_from_repeats(dataset, base)
    if found is not None:
        return found
    flat = Workspace(dataset, noise_from_residual(dataset, dataset.observed, 0))
    return noise_after(flat, base, datum=flat.has_datum)


def refitted(workspace: Workspace, choices: list[Choice]) -> list[Choice]:
    """Return the choices with shapes refitted jointly, families joined, stated periods where they do as well."""
    choices = families_joined(choices)
    stated = [stated_period(workspace, c, [*choices[:k], *choices[k + 1 :]]) for k, c in enumerate(choices)]
    return jointly_refitted(workspace, stated, datum=needs_datum(workspace, stated))


def rms_held_out(state: Search, choices: Sequence[Choice], fitted: Model) -> float:
    """Return the held-out RMS of a fitted model: on the other file, else fold by fold."""
    if state.heldout is not None:
        return rms_of(residual_of(state.heldout, fitted))
    return rms_by_folds(state.workspace, choices, datum=needs_datum(state.workspace, choices))


def rms_of(residual: Floats) -> float:
    """Return the root mean square."""
    return float(np.sqrt(np.mean(residual**2)))
