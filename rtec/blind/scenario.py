"""What to hide, and how strong: a scenario, given or drawn."""

from __future__ import annotations

import enum
from collections.abc import Sequence
from dataclasses import MISSING, Field, dataclass, field, fields
from typing import Any

import numpy as np

from rtec.blind.draws import Draw, checked_seed, stream
from rtec.blind.noise import Noise
from rtec.blind.outside import KINDS
from rtec.blind.own_errors import unfit_own
from rtec.blind.plan import PLANS, Plan
from rtec.blind.slow_errors import SLOW
from rtec.blind.static_errors import STATIC
from rtec.checks import number_within
from rtec.effects.protocol import Effect
from rtec.errors import ArgumentError, nearest
from rtec.metrology import Heating, Passes, Reading, Spacing, Weather

NOTHING = "nothing"
"""The answer where no effect is hidden."""
UNKNOWN = "unknown"
"""The answer where something is hidden that lies outside the library."""
OUTSIDE_OF_GAME = ("moving_bump", "chirped_cyclic", "dwell_reversal")
"""What `scenario_of` draws of it, so that a seed keeps its game."""
OUTSIDE = (*OUTSIDE_OF_GAME, *(name for name in KINDS if name not in OUTSIDE_OF_GAME))
"""What lies outside the library of effects."""
NOT_DRAWN = ("eccentricity", "refraction", "dead_path", "warm_up_growth", "reversal_spike", "run_offset")
"""Effects that are hidden where they are asked for: seeds had their games before these were known."""
OF_A_MAP = ("pitch_map", "backlash_map")
"""What shows where the end of the travel is not its beginning, as it is of a turn."""
LAGS = ("servo_lag", "acceleration_lag")
"""What is drawn of what shows in motion only."""
IN_MOTION = (*LAGS, "hysteresis")
"""What shows in motion only."""
OF_HEAT = ("thermal_growth", "thermal_shift")
"""What shows where the temperature changes."""
OF_AIR = ("refraction", "dead_path")
"""What shows where the air changes."""
OF_DRIVE_OF_GAME = ("inertia", "viscous", "coulomb", "stribeck", "cogging", "force_offset")
"""What is drawn of it for logs of a linear axis, so that a seed keeps its game."""
OF_DRIVE = (*OF_DRIVE_OF_GAME, "gravity", "force_map", "load_friction")
"""What the force of a drive shows."""
INSIDE_OF_GAME = tuple(sorted({*STATIC, *SLOW, "lost_counts", *LAGS} - set(OUTSIDE) - set(NOT_DRAWN)))
"""What is drawn of it, so that a seed keeps its game."""
INSIDE = tuple(sorted({*STATIC, *SLOW, "lost_counts", *IN_MOTION} - set(OUTSIDE)))
"""Effects of the library that the game can hide in an axis."""
CONFOUNDED: tuple[frozenset[str], ...] = tuple(
    frozenset(pair)
    for pair in (
        ("scale", "pitch_map"),
        ("scale", "thermal_growth"),
        ("pitch_map", "cyclic"),
        ("pitch_map", "windup"),
        ("pitch_map", "interpolation"),
        ("cyclic", "interpolation"),
        ("backlash", "backlash_map"),
        ("backlash", "windup"),
        ("backlash_map", "windup"),
        ("backlash", "servo_lag"),
        ("backlash_map", "servo_lag"),
        ("drift", "warm_up"),
        ("drift", "lost_counts"),
        ("warm_up", "lost_counts"),
        ("drift", "thermal_growth"),
        ("warm_up", "thermal_growth"),
        ("lost_counts", "thermal_growth"),
        ("drift", "thermal_shift"),
        ("warm_up", "thermal_shift"),
        ("lost_counts", "thermal_shift"),
        ("thermal_growth", "thermal_shift"),
    )
)
"""Pairs that the game does not hide together: one contains the other, or they are too alike for most plans."""
_OPEN_DEG = 270.0
"""Up to which the end of a turn is not its beginning."""
_TWO_WAYS = ("backlash", "backlash_map", *OUTSIDE)
_AFTER_REVERSALS = ("windup", "reversal_spike")
_KNOWN = INSIDE + OUTSIDE + OF_DRIVE


@dataclass(frozen=True, slots=True, kw_only=True)
class Scenario:
    """What to hide and how strong.

    Raises
    ------
    ArgumentError
        A name that is not known or comes twice, a strength outside its range, or an effect that the plan cannot show.

    Examples
    --------
    >>> Scenario(names=("backlash", "drift"), strength_sigma=3.0).strengths
    (3.0, 3.0)
    """

    names: tuple[str, ...] = ()
    """Effects, of `INSIDE` and `OUTSIDE`, in a drive's log of `OF_DRIVE`; none hides nothing."""
    strength_sigma: float | tuple[float, ...] = 3.0
    """RMS contribution over the readings, the mean removed unless it is a force, in units of the repeat noise: one
    for all, or one each."""
    noise: Noise = Noise.WHITE
    """Its family."""
    plan: Plan = field(default=PLANS["base"])
    """What is measured."""
    own: tuple[Effect, ...] = field(default=(), compare=False)
    """Effects of a player's own, made by ``@rtec.effect``; hidden are those in `names`."""

    def __post_init__(self) -> None:
        """Check names, strengths and that the plan can show them."""
        object.__setattr__(self, "names", tuple(self.names))
        for effect in self.own:
            if effect.name in (*_KNOWN, NOTHING, UNKNOWN):
                problem = "has a name that the game uses for something else"
                raise ArgumentError("own", effect.name, "a name of its own", problem=problem)
        known = (*_KNOWN, *(effect.name for effect in self.own))
        for name in self.names:
            if name not in known:
                hint = nearest(name, known)
                raise ArgumentError("names", repr(name)[:60], "effects of the game", hint, problem="is not an effect")
            if (why := unfit(name, self.plan, self.own)) is not None:
                allowed = "an effect that it shows, or another plan"
                problem = f"cannot be seen with the plan {self.plan.name}"
                raise ArgumentError("names", name, allowed, why, problem=problem)
        if len(set(self.names)) != len(self.names):
            raise ArgumentError("names", ", ".join(self.names), "each effect once")
        given = self.strength_sigma
        if isinstance(given, tuple) and len(given) != len(self.names):
            raise ArgumentError("strength_sigma", f"{len(given)} numbers", f"{len(self.names)}, one for each name")
        for strength in self.strengths:
            number_within("strength_sigma", strength, 0.01, 30.0)

    @property
    def strengths(self) -> tuple[float, ...]:
        """The strength of each name."""
        if isinstance(self.strength_sigma, tuple):
            return self.strength_sigma
        return (self.strength_sigma,) * len(self.names)

    @property
    def wanted(self) -> dict[str, float]:
        """The strength by name."""
        return dict(zip(self.names, self.strengths, strict=True))

    @property
    def own_names(self) -> tuple[str, ...]:
        """Those of `names` that are a player's own effects."""
        return tuple(name for name in self.names if name not in _KNOWN)


def unfit(name: str, plan: Plan, own: Sequence[Effect] = ()) -> str | None:
    """Return why an effect, perhaps one of a player's own, cannot be hidden in a plan, or None where it can.

    Examples
    --------
    >>> unfit("servo_lag", PLANS["base"])
    'it shows in motion only'
    >>> unfit("backlash", PLANS["base"]) is None
    True
    """
    for effect in own:
        if effect.name == name:
            return unfit_own(effect, plan)
    moving, drive = plan.reading is Reading.MOVING, plan.reading is Reading.DRIVE
    runs, targets = (KINDS[name].runs, KINDS[name].targets) if name in KINDS else (1, 2)
    one_way = not moving and plan.passes is Passes.FORWARD
    reasons = (
        (name in OF_DRIVE and not drive, "it shows in the force of a drive only"),
        (drive and name not in OF_DRIVE, "it does not show in a force"),
        (name in IN_MOTION and not moving, "it shows in motion only"),
        (moving and name not in IN_MOTION and name not in STATIC, "a moving log is too short for what is slow"),
        (name in ("gravity", "eccentricity") and not plan.rotary, "it shows on a rotary axis only"),
        (name == "interpolation" and plan.rotary, "it shows on a linear axis only"),
        (name in OF_A_MAP and plan.rotary and plan.span_mm > _OPEN_DEG, "a turn closes"),
        (name == "load_friction" and "load" not in plan.columns, "the load does not change"),
        (name in OF_AIR and plan.weather is Weather.STEADY, "the air does not change"),
        (name in OF_HEAT and plan.heating is Heating.NONE, "the temperature does not change"),
        (name == "run_offset" and plan.runs < 2, "it needs several runs"),
        (one_way and name in _TWO_WAYS, "it needs both directions"),
        (one_way and name in _AFTER_REVERSALS and len(plan.shifts_mm) < 3, "it needs reversals at several places"),
        (plan.runs < runs, "it needs several runs"),
        (plan.targets < targets, "it needs more targets"),
    )
    return next((why for unfit_here, why in reasons if unfit_here), None)


_KINDS = (("nothing", 0.12), ("outside", 0.18), ("one", 0.30), ("two", 0.28), ("three", 0.12))
_PLANS_OF_GAME = ("base", "temperature", "dense", "moving", "dwell")
_MOST = 3
"""Effects in a game that a seed draws."""


def scenario_of(seed: int, own: Sequence[Effect] = ()) -> Scenario:
    """Draw what the game hides.

    Parameters
    ----------
    seed
        The same seed draws the same scenario.
    own
        Effects of a player's own. One of them is hidden, in place of what the seed draws without them or beside it.

    Returns
    -------
    Scenario
        Nothing, one to three effects that are not confounded, or one that lies outside the library.

    Raises
    ------
    ArgumentError
        A seed that is no whole number from 0 to 2^62, or own effects that no plan shows.

    Examples
    --------
    >>> scenario_of(3) == scenario_of(3)
    True
    """
    drawn = _scenario_of(checked_seed(seed))
    return _with_own(drawn, tuple(own), stream(seed, Draw.SCENARIO, "own")) if own else drawn


def _with_own(drawn: Scenario, own: tuple[Effect, ...], rng: np.random.Generator) -> Scenario:
    for plan in (drawn.plan, *(PLANS[name] for name in _PLANS_OF_GAME), *PLANS.values()):
        if fit := [effect for effect in own if unfit_own(effect, plan) is None]:
            break
    else:
        why = unfit_own(own[0], drawn.plan) or ""
        raise ArgumentError("own", own[0].name, "another effect", why, problem="is shown by no plan of the game")
    chosen, beside = fit[int(rng.integers(len(fit)))], rng.uniform() < 0.5
    room = plan is drawn.plan and len(drawn.names) < _MOST and set(drawn.names).isdisjoint(OUTSIDE)
    others = drawn.wanted if beside and room else {}
    names, strengths = (*others, chosen.name), (*others.values(), *_strengths(1, rng))
    return Scenario(names=names, strength_sigma=strengths, noise=drawn.noise, plan=plan, own=own)


def _scenario_of(seed: int) -> Scenario:
    rng = stream(seed, Draw.SCENARIO)
    kind = str(rng.choice([name for name, _ in _KINDS], p=[share for _, share in _KINDS]))
    noise = Noise.WHITE if rng.uniform() < 0.7 else Noise.CORRELATED
    if kind == "outside":
        name = str(rng.choice(OUTSIDE_OF_GAME))
        plan = PLANS["dwell"] if name == "dwell_reversal" and rng.uniform() < 0.5 else PLANS["base"]
        return Scenario(names=(name,), strength_sigma=_strengths(1, rng), noise=Noise.WHITE, plan=plan)
    plan = PLANS[str(rng.choice(_PLANS_OF_GAME, p=[0.5, 0.2, 0.1, 0.1, 0.1]))]
    count = {"nothing": 0, "one": 1, "two": 2, "three": 3}[kind]
    names = companions(plan, count, rng)
    return Scenario(names=names, strength_sigma=_strengths(len(names), rng), noise=noise, plan=plan)


def _strengths(count: int, rng: np.random.Generator) -> tuple[float, ...]:
    return tuple(float(x) for x in np.round(rng.uniform(1.5, 4.0, count), 2))


def companions(plan: Plan, count: int, rng: np.random.Generator) -> tuple[str, ...]:
    """Draw so many effects, or fewer, that the plan can show and that are not confounded with each other.

    Examples
    --------
    >>> len(companions(PLANS["base"], 2, np.random.default_rng(0)))
    2
    """
    names: list[str] = []
    for name in (
        str(name) for name in rng.permutation([name for name in INSIDE_OF_GAME if unfit(name, plan) is None])
    ):
        if len(names) == count:
            break
        # dense points just after the reversal show what builds up there; elsewhere it passes for lost motion
        if name == "windup" and plan.spacing is not Spacing.DENSE_AT_ENDS:
            continue
        if all(frozenset((name, other)) not in CONFOUNDED for other in names):
            names.append(name)
    return tuple(names)


def scenario_document(scenario: Scenario) -> dict[str, Any]:
    """Return a scenario as a JSON document, to be read back bit for bit: with its seed it is the hidden axis.

    Examples
    --------
    >>> scenario_document(Scenario(names=("drift",)))["plan"]["reading"]
    'position at rest'
    """
    return {
        "names": list(scenario.names),
        "strengths_sigma": list(scenario.strengths),
        "noise": scenario.noise.value,
        "plan": {f.name: _written(getattr(scenario.plan, f.name)) for f in fields(Plan)},
        **({"own": list(scenario.own_names)} if scenario.own_names else {}),
    }


def scenario_from(document: dict[str, Any], own: Sequence[Effect] = ()) -> Scenario:
    """Return the scenario that a JSON document holds; ``own`` has the effects of a player's own that it names.

    Raises
    ------
    KeyError, TypeError, ValueError
        It holds none.

    Examples
    --------
    >>> scenario = Scenario(names=("drift", "backlash"), strength_sigma=(2.5, 1 / 3))
    >>> scenario_from(scenario_document(scenario)) == scenario
    True
    """
    return Scenario(
        names=tuple(document["names"]),
        strength_sigma=tuple(document["strengths_sigma"]),
        noise=Noise(document["noise"]),
        plan=Plan(**{f.name: _read(f, document["plan"][f.name]) for f in fields(Plan)}),
        own=tuple(own),
    )


def _written(value: object) -> object:
    if isinstance(value, enum.Enum):
        return value.value
    return list(value) if isinstance(value, tuple) else value


def _read(field: Field[Any], value: Any) -> Any:
    """Return a field of a plan, of the kind of its default."""
    if isinstance(field.default, enum.Enum):
        return type(field.default)(value)
    if field.default is not MISSING and isinstance(field.default, tuple):
        return tuple(value)
    return value
