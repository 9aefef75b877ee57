"""How large an effect is, as people say it: which of its numbers is meant, and hiding one of that size."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

from rtec.blind.game import play
from rtec.blind.hidden import Hidden, Parameter
from rtec.blind.plan import PLANS, Plan
from rtec.blind.scenario import Scenario, unfit
from rtec.effects.protocol import Effect
from rtec.errors import ArgumentError
from rtec.units import NUMBER, parse_in

PLAIN_SIGMA = 5.0
"""Strength of what is hidden without a size, in units of the noise."""
_TRIED_SIGMA = {"lost_counts": 30.0}
"""Strength at which the size is looked at where it is no multiple of the strength: counts are whole."""
_LEAST_SIGMA, _MOST_SIGMA = 0.01, 30.0

SIZES: Mapping[str, tuple[str, tuple[str, ...]]] = MappingProxyType(
    {
        "acceleration_lag": ("lag", ("ms^2",)),
        "backlash": ("play", ("um",)),
        "backlash_map": ("largest_play", ("um",)),
        "cyclic": ("amplitude", ("um",)),
        "dead_path": ("length", ("mm",)),
        "drift": ("rate", ("um/h",)),
        "eccentricity": ("peak_to_peak", ("arcsec",)),
        "hysteresis": ("width", ("um",)),
        "interpolation": ("peak", ("um",)),
        "lost_counts": ("counts", ("count",)),
        "pitch_map": ("peak_to_peak", ("um",)),
        "refraction": ("share", ("",)),
        "reversal_spike": ("spike", ("um",)),
        "run_offset": ("spread", ("um",)),
        "scale": ("scale", ("um/m",)),
        "servo_lag": ("delay", ("ms",)),
        "thermal_growth": ("expansion", ("um/m/K",)),
        "thermal_shift": ("shift", ("um/K",)),
        "warm_up": ("final", ("um",)),
        "warm_up_growth": ("growth", ("um/m",)),
        "windup": ("final", ("um",)),
        "inertia": ("mass", ("kg", "N*m/(deg/s^2)")),
        "viscous": ("viscous", ("N/(m/s)", "N*m/(deg/s)")),
        "coulomb": ("friction", ("N", "N*m")),
        "stribeck": ("friction", ("N", "N*m")),
        "cogging": ("amplitude", ("N", "N*m")),
        "force_offset": ("force", ("N", "N*m")),
        "gravity": ("largest", ("N*m",)),
        "force_map": ("peak_to_peak", ("N", "N*m")),
        "load_friction": ("friction", ("N/kg",)),
    }
)
"""The number of each effect that is its size, and its units: on a linear axis, and on a rotary one."""
_RENAMED = {"mass": ("mass", "inertia")}
"""Names of a number that has another one on a rotary axis."""
_OF_OWN = ("amplitude", ("um",))
"""The size of a player's own effect; in the secret it is named like the effect."""
_BETWEEN = re.compile(r"\s*(?:\+/?-|±)\s*")


@dataclass(frozen=True, slots=True, kw_only=True)
class Size:
    """A size, with its uncertainty where that is said."""

    value: float
    uncertainty: float
    """In ``unit``; the sign of a value says nothing. No uncertainty is 0."""
    unit: str
    """One of the effect's."""


def read_size(name: str, text: str, *, where: str, own: Collection[str] = ()) -> Size:
    """Read the size of an effect: ``12 um``, ``12 +- 0.5 um``, or as a diagnosis shows it, ``−12.0 ± 0.5 µm``.

    Parameters
    ----------
    name
        The effect.
    text
        Its size.
    where
        The option or argument, for the error message.
    own
        Names of a player's own effects.

    Raises
    ------
    ArgumentError
        An effect that has no size, a text that is none, or a unit of another dimension; a near one is suggested.

    Examples
    --------
    >>> read_size("backlash", "0.012 mm +- 1 um", where="--hide")
    Size(value=12.0, uncertainty=1.0, unit='um')
    >>> read_size("backlash", "12 +- 0.5 um", where="--hide").uncertainty
    0.5
    """
    if name not in SIZES and name not in own:
        raise ArgumentError(where, f"{name}={text}"[:60], f"{name} without a value", "it has no size that counts")
    parameter, units = SIZES.get(name, _OF_OWN)
    parts = _BETWEEN.split(text.replace("\N{MINUS SIGN}", "-").strip())
    if len(parts) == 2 and re.fullmatch(NUMBER, parts[0]):
        parts[0] += re.sub(rf"^{NUMBER}", "", parts[1])
    errors = []
    for unit in units if len(parts) <= 2 else ():
        try:
            value, *uncertainty = (abs(_read(part, unit, where)) for part in parts)
        except ArgumentError as error:
            errors.append(error)
            continue
        return Size(value=value, uncertainty=uncertainty[0] if uncertainty else 0.0, unit=unit)
    written = " or ".join(f"{name}='5 {unit}'".replace(" '", "'") if unit else f"{name}=5" for unit in units)
    allowed = f"the {parameter.replace('_', ' ')} of {name}, such as {written}"
    hint = next((error.hint for error in errors if "did you mean" in error.hint), "")
    raise ArgumentError(where, repr(f"{name}={text}"[:60]), allowed, hint)


def _read(text: str, unit: str, where: str) -> float:
    if unit:
        return parse_in(text, unit, name=where)
    if re.fullmatch(NUMBER, text.strip()) is None:
        raise ArgumentError(where, repr(text[:60]), "a number without a unit")
    return float(text)


def size_of(hidden: Hidden) -> Parameter | None:
    """Return the number of a hidden effect that is its size; None for what the game hides outside the library.

    Examples
    --------
    >>> _, secret = play(Scenario(names=("cyclic",)), 1)
    >>> size_of(secret.effects[0]).name
    'amplitude'
    """
    wanted = SIZES.get(hidden.name, (hidden.name, ()))[0]
    names = _RENAMED.get(wanted, (wanted,))
    return next((parameter for parameter in hidden.parameters if parameter.name in names), None)


def scenario_of_sizes(
    wanted: Sequence[tuple[str, Size | None]], plan: Plan, seed: int, own: Sequence[Effect] = ()
) -> Scenario:
    """Return what hides effects of given sizes in the axis of a seed.

    Parameters
    ----------
    wanted
        Effects, each with its size, or without for five times the noise.
    plan, seed
        Of the game; a seed decides shapes, places and signs.
    own
        A player's own effects.

    Raises
    ------
    ArgumentError
        As `Scenario`, or a size that is too small or too large for the noise of the plan.

    Examples
    --------
    >>> size = read_size("backlash", "6 um", where="--hide")
    >>> scenario_of_sizes([("backlash", size)], PLANS["base"], 1).strengths
    (1.5,)
    """
    names = tuple(name for name, _ in wanted)
    tried = tuple(_TRIED_SIGMA.get(name, PLAIN_SIGMA) if size else PLAIN_SIGMA for name, size in wanted)
    scenario = Scenario(names=names, strength_sigma=tried, plan=plan, own=tuple(own))
    if not any(size for _, size in wanted):
        return scenario
    _, secret = play(scenario, seed)
    strengths = [
        strength if size is None else strength * _share(size, hidden, strength)
        for (_, size), hidden, strength in zip(wanted, secret.effects, tried, strict=True)
    ]
    return replace(scenario, strength_sigma=tuple(strengths))


def _share(size: Size, hidden: Hidden, strength: float) -> float:
    """Return how many times as large a hidden effect shall be."""
    parameter = size_of(hidden)
    if parameter is None or parameter.unit != size.unit:
        unit = parameter.unit if parameter else ""
        raise ArgumentError("names", f"{hidden.name} in {size.unit}", f"a size in {unit}", "as the axis has it")
    share = size.value / abs(parameter.value)
    if not _LEAST_SIGMA <= strength * share <= _MOST_SIGMA:
        low, high = (abs(parameter.value) * sigma / strength for sigma in (_LEAST_SIGMA, _MOST_SIGMA))
        value = f"{hidden.name}={size.value:g} {size.unit}".rstrip()
        allowed = f"a size from {low:.3g} to {high:.3g} {parameter.unit}".rstrip()
        raise ArgumentError("names", value, allowed, "0.01 to 30 times the noise of the readings")
    return share


def plans_showing(name: str, own: Sequence[Effect] = ()) -> tuple[str, ...]:
    """Return the plans in which an effect, perhaps one of a player's own, can be hidden.

    Examples
    --------
    >>> plans_showing("eccentricity")
    ('turn',)
    """
    return tuple(key for key, plan in PLANS.items() if unfit(name, plan, own) is None)
