"""What a diagnosis must show: the lines of the confusion matrix, each a rule, a bar, and scenarios in turn."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

from rtec.blind.answer import Rule
from rtec.blind.harder_lines import harder_lines
from rtec.blind.line import Line
from rtec.blind.noise import Noise
from rtec.blind.plan import PLANS
from rtec.blind.scenario import CONFOUNDED, LAGS, OF_AIR, OF_HEAT, OUTSIDE_OF_GAME, Scenario

SINGLES = (
    "scale", "pitch_map", "cyclic", "backlash", "backlash_map", "windup", "reversal_spike", "thermal_growth",
    "thermal_shift", "warm_up", "warm_up_growth", "run_offset", "drift", "refraction", "dead_path", "interpolation",
    "lost_counts",
)  # fmt: skip
"""Effects that show at rest, each on the plan that can show it."""
_PLAN_OF = (
    dict.fromkeys(OF_HEAT, "temperature") | dict.fromkeys(OF_AIR, "weather")
    | dict.fromkeys(("windup", "reversal_spike"), "dense")
    | {"gravity": "joint", "force_map": "drive", "load_friction": "loads", "hysteresis": "moving"}
)  # fmt: skip
"""Where it is not the base plan."""
_STRONG, _WEAK, _ALIKE = 3.0, 1.0, 5.0
_PAIRED = (
    "scale", "pitch_map", "cyclic", "backlash", "backlash_map", *OF_HEAT, "drift", "lost_counts",
)  # fmt: skip


def _singles(strength: float, noise: Noise, names: Sequence[str] = SINGLES) -> tuple[Scenario, ...]:
    return tuple(
        Scenario(names=(name,), strength_sigma=strength, noise=noise, plan=PLANS[_PLAN_OF.get(name, "base")])
        for name in names
    )


def _pairs() -> tuple[Scenario, ...]:
    """Return every pair that is not confounded, on the plan that can show both."""
    return tuple(
        Scenario(names=pair, plan=PLANS["base" if set(OF_HEAT).isdisjoint(pair) else "temperature"])
        for pair in itertools.combinations(_PAIRED, 2)
        if frozenset(pair) not in CONFOUNDED
    )


def _confounded() -> tuple[Scenario, ...]:
    """Return the confounded effects, each on a poor plan that cannot separate it from its rival."""
    hidden = (
        ("scale", "single_pass"),
        ("drift", "single_pass"),
        ("backlash", "one_feed"),
        ("backlash", "turned_once"),
        ("lost_counts", "turned_once"),
        ("thermal_growth", "one_heating"),
        ("thermal_shift", "one_heating"),
        ("refraction", "one_day"),
        ("drift", "one_day"),
        ("viscous", "one_speed"),
    )
    return tuple(Scenario(names=(name,), strength_sigma=_ALIKE, plan=PLANS[plan]) for name, plan in hidden)


def the_lines() -> tuple[Line, ...]:
    """Return the lines that are published.

    Examples
    --------
    >>> [line.rule.name for line in the_lines()][:3]
    ['NOTHING', 'NOTHING', 'NAMED']
    """
    white, correlated = Noise.WHITE, Noise.CORRELATED
    plans = [PLANS[name] for name in ("base", "temperature", "dense")]
    above = "above the detectable amplitude"
    forces = ("gravity", "force_map", "load_friction", "hysteresis")
    return (
        Line("nothing, white noise", Rule.NOTHING, 0.95, tuple(Scenario(plan=plan) for plan in plans)),
        Line(
            "nothing, correlated noise", Rule.NOTHING, 0.95,
            tuple(Scenario(noise=correlated, plan=plan) for plan in plans),
        ),
        Line("a single effect, 3 sigma, white noise", Rule.NAMED, 0.95, _singles(_STRONG, white)),
        Line("a single effect, 1 sigma, white noise", Rule.NAMED, 0.80, _singles(_WEAK, white)),
        Line(
            f"a single effect, 3 sigma, correlated noise, {above}", Rule.NAMED, 0.95,
            _singles(_STRONG, correlated), above_detectable=True,
        ),
        Line(
            f"a single effect, 1 sigma, correlated noise, {above}", Rule.NAMED, 0.80,
            _singles(_WEAK, correlated), above_detectable=True,
        ),
        Line("two effects that are no look-alikes, 3 sigma each, white noise", Rule.NAMED, 0.85, _pairs()),
        Line(
            "outside the library, 3 sigma, white noise", Rule.UNKNOWN, 0.80,
            tuple(Scenario(names=(name,)) for name in OUTSIDE_OF_GAME),
        ),
        Line("look-alikes on a poor plan, 5 sigma, white noise", Rule.TIED, 0.95, _confounded()),
        Line(
            "after the true effects are added, white noise", Rule.FLOOR, 0.95,
            _singles(_STRONG, white) + _pairs(),
        ),
        Line(
            "a lag in a moving log, 3 sigma, white noise", Rule.NAMED, 0.95,
            tuple(Scenario(names=(name,), plan=PLANS["moving"]) for name in LAGS),
        ),
        Line(
            "forces by angle, position or load, and hysteresis in a moving log, 3 sigma, white noise", Rule.NAMED,
            0.95, _singles(_STRONG, white, forces),
        ),
        *harder_lines(),
    )  # fmt: skip
