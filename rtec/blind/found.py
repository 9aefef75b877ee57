"""What a judge says about what it named: periods, numbers with standard errors, probabilities, beside the truth."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from rtec.blind.answer import WAVES, Answer, wrong_names
from rtec.blind.secret import Secret
from rtec.inference.results import Value

PERIOD_SHARE = 0.005
"""Of the true period: a period so near is right, however small its standard error."""
PERIOD_ERRORS = 2.5
COVERED_ERRORS = 2.0
_MULTIPLE_SHARE = 0.01


@dataclass(frozen=True, slots=True, kw_only=True)
class Wave:
    """The period of a wave that was hidden and named.

    Parameters
    ----------
    effect
        Its name.
    found_mm, error_mm
        What was found, and its standard error; None where none is given.
    truth_mm
        What was hidden.
    """

    effect: str
    found_mm: float
    error_mm: float | None
    truth_mm: float

    @property
    def right(self) -> bool:
        """Whether it is within half a percent, or within 2.5 standard errors.

        Examples
        --------
        >>> [Wave(effect="cyclic", found_mm=f, error_mm=0.02, truth_mm=5.0).right for f in (5.02, 5.05, 5.06)]
        [True, True, False]
        """
        allowed = max(PERIOD_SHARE * self.truth_mm, PERIOD_ERRORS * (self.error_mm or 0.0))
        return abs(self.found_mm - self.truth_mm) <= allowed * (1.0 + 1e-9)

    @property
    def multiple(self) -> bool:
        """Whether it is twice the true period, or another multiple of it.

        Examples
        --------
        >>> Wave(effect="cyclic", found_mm=10.02, error_mm=None, truth_mm=5.0).multiple
        True
        """
        times = self.found_mm / self.truth_mm
        return round(times) > 1 and abs(times - round(times)) <= _MULTIPLE_SHARE * times


@dataclass(frozen=True, slots=True, kw_only=True)
class Figure:
    """A number of an effect that was hidden and named.

    Parameters
    ----------
    name
        Effect and number, such as ``backlash.backlash``.
    found, error, truth
        What was found, its standard error, what was hidden; in the same unit.
    """

    name: str
    found: float
    error: float
    truth: float

    @property
    def covered(self) -> bool:
        """Whether the truth is within two standard errors.

        Examples
        --------
        >>> Figure(name="drift.rate", found=3.0, error=0.5, truth=4.1).covered
        False
        """
        return abs(self.found - self.truth) <= COVERED_ERRORS * self.error


@dataclass(frozen=True, slots=True, kw_only=True)
class Belief:
    """How probable a judge holds an effect that it accepted, and whether it was there."""

    effect: str
    probability: float
    right: bool


TRUTHS: Mapping[tuple[str, str], tuple[str, str, float]] = MappingProxyType(
    {
        ("scale", "scale"): ("um/m", "scale", 1.0),
        # the library's is the shift of the backward readings against the forward ones
        ("backlash", "backlash"): ("um", "play", -1.0),
        ("drift", "rate"): ("um/h", "rate", 1.0),
        ("warm_up", "time_constant"): ("s", "time_constant", 1.0),
        ("warm_up", "final"): ("um", "final", 1.0),
        ("thermal_growth", "expansion"): ("um/m/K", "expansion", 1.0),
        ("thermal_shift", "shift"): ("um/K", "shift", 1.0),
        # the encoder's count is 1 um
        ("lost_counts", "step"): ("um", "counts", 1.0),
        ("inertia", "inertia"): ("kg", "mass", 1.0),
        ("viscous", "viscous"): ("N/(m/s)", "viscous", 1.0),
        ("coulomb", "coulomb"): ("N", "friction", 1.0),
        ("stribeck", "stribeck"): ("N", "friction", 1.0),
        ("force_offset", "force_offset"): ("N", "force", 1.0),
        ("load_friction", "load_friction"): ("N/kg", "friction", 1.0),
        ("warm_up_growth", "time_constant"): ("s", "time_constant", 1.0),
        ("warm_up_growth", "growth"): ("um/m", "growth", 1.0),
        ("refraction", "refraction"): ("", "share", 1.0),
        ("dead_path", "dead_path"): ("mm", "length", 1.0),
    }
)
"""Numbers of the library that the game knows: their unit, the game's own name for them, and the factor from it.

The lags of a moving log are left out: the loop that makes them adds a little of its own.
"""


def waves_of(answer: Answer, secret: Secret) -> tuple[Wave, ...]:
    """Return the waves that were hidden and named, with their periods.

    Examples
    --------
    >>> from rtec.blind.game import play
    >>> from rtec.blind.scenario import Scenario
    >>> _, secret = play(Scenario(names=("cyclic",)), 5)
    >>> answer = Answer("NAMED", ("cyclic",), values=(("cyclic", (Value("period", 107.9, 0.5, "mm"),)),))
    >>> waves_of(answer, secret)[0].right
    True
    """
    found = []
    for hidden in (one for one in secret.effects if one.name in WAVES):
        truth = next(p.value for p in hidden.parameters if p.name == "period")
        for value in _values(answer, hidden.name):
            if value.name == "period" and value.unit == "mm" and isinstance(value.value, float):
                found.append(
                    Wave(effect=hidden.name, found_mm=value.value, error_mm=_finite(value.error), truth_mm=truth)
                )
    return tuple(found)


def figures_of(answer: Answer, secret: Secret) -> tuple[Figure, ...]:
    """Return the numbers of what was hidden and named, as far as both sides know them.

    Examples
    --------
    >>> from rtec.blind.game import play
    >>> from rtec.blind.scenario import Scenario
    >>> _, secret = play(Scenario(names=("backlash",)), 5)
    >>> answer = Answer("NAMED", ("backlash",), values=(("backlash", (Value("backlash", -12.2, 0.3, "um"),)),))
    >>> figures_of(answer, secret)[0].covered
    True
    """
    found = []
    for hidden in secret.effects:
        truths = {p.name: p.value for p in hidden.parameters}
        for value in _values(answer, hidden.name):
            unit, own, factor = TRUTHS.get((hidden.name, value.name), ("", "", 0.0))
            error = _finite(value.error)
            if own and unit == value.unit and error is not None and isinstance(value.value, float):
                found.append(
                    Figure(
                        name=f"{hidden.name}.{value.name}",
                        found=value.value,
                        error=error,
                        truth=factor * truths[own],
                    )
                )
    return tuple(found)


def beliefs_of(answer: Answer, secret: Secret) -> tuple[Belief, ...]:
    """Return the probabilities of the effects that a judge accepted, whatever its verdict.

    Examples
    --------
    >>> from rtec.blind.secret import Secret
    >>> nothing = Secret(effects=(), noise="white", sigma_um=2.0, seed=1, plan="base", outside=())
    >>> beliefs_of(Answer("NAMED", ("drift",), probability={"drift": 0.9}), nothing)[0].right
    False
    """
    put_forward = Answer("NAMED", answer.effects)
    wrong = wrong_names(put_forward, secret)
    return tuple(
        Belief(effect=name, probability=float(answer.probability[name]), right=name not in wrong)
        for name in dict.fromkeys(answer.effects)
        if name != "offset" and _finite(answer.probability.get(name)) is not None
    )


def _values(answer: Answer, name: str) -> tuple[Value, ...]:
    return tuple(value for effect, values in answer.values if effect == name for value in values)


def _finite(number: float | None) -> float | None:
    return None if number is None or not math.isfinite(number) else float(number)
