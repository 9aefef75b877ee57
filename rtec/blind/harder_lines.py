"""Lines harder than a user's data: drawn plans, families of noise, errors outside the library, drives and logs."""

from __future__ import annotations

from functools import partial

import numpy as np

from rtec.blind.answer import Rule
from rtec.blind.drawn_plans import MOST_RUNS, MOST_TARGETS, drawn_log, drawn_plan
from rtec.blind.draws import Draw, stream
from rtec.blind.line import Line
from rtec.blind.noise import Noise
from rtec.blind.outside import KINDS
from rtec.blind.plan import Plan
from rtec.blind.scenario import LAGS, OF_DRIVE_OF_GAME, OUTSIDE, Scenario, companions
from rtec.metrology import Reading

STRENGTH = 3.0
STRENGTHS = (1.0, 5.0)
MOST_EFFECTS = 4
_CHIRP_TARGETS = 41
_SMALL = 21
"""Fewest targets that can show several effects at a time."""
_BESIDE_LAGS = ("scale", "pitch_map", "cyclic")
"""Static errors that a lag is not confounded with."""
SINGLE_RUN_OUTSIDE = tuple(name for name in OUTSIDE if name not in KINDS or KINDS[name].runs == 1)
"""Outside the library even where nothing is repeated."""
_COUNTS = {
    1: ("a single effect", 0.97),
    2: ("two effects", 0.93),
    3: ("three effects", 0.85),
    4: ("four effects", 0.85),
}


def _nothing(noise: Noise, runs: tuple[int, int], trial: int, seed: int) -> Scenario:
    return Scenario(noise=noise, plan=drawn_plan(stream(seed, Draw.PLAN), runs=runs))


def _outside(names: tuple[str, ...], most_runs: int, trial: int, seed: int) -> Scenario:
    name = names[trial % len(names)]
    fewest, targets = (KINDS[name].runs, KINDS[name].targets) if name in KINDS else (1, _CHIRP_TARGETS)
    runs = (min(max(fewest, 2), most_runs), most_runs)
    plan = drawn_plan(stream(seed, Draw.PLAN), targets=(targets, MOST_TARGETS), runs=runs, both=True)
    return Scenario(names=(name,), strength_sigma=STRENGTH, plan=plan)


def _effects(count: int, trial: int, seed: int) -> Scenario:
    rng = stream(seed, Draw.PLAN)
    plan = drawn_plan(rng, targets=(_SMALL, MOST_TARGETS), runs=(2, MOST_RUNS), both=True)
    return Scenario(names=_exactly(plan, count, rng), strength_sigma=STRENGTH, plan=plan)


def _anything(trial: int, seed: int) -> Scenario:
    rng = stream(seed, Draw.PLAN)
    names: tuple[str, ...] = ()
    while not names:
        plan = drawn_plan(rng)
        names = companions(plan, 1 + trial % MOST_EFFECTS, rng)
    strengths = tuple(float(x) for x in np.round(rng.uniform(*STRENGTHS, len(names)), 2))
    return Scenario(names=names, strength_sigma=strengths, plan=plan)


def _exactly(plan: Plan, count: int, rng: np.random.Generator) -> tuple[str, ...]:
    """Return so many effects that are not confounded: not every first one leaves room for so many others."""
    while True:
        names = companions(plan, count, rng)
        if len(names) == count:
            return names


def _drive_or_log(trial: int, seed: int) -> Scenario:
    rng = stream(seed, Draw.PLAN)
    if trial % 2:
        plan = drawn_log(rng, Reading.DRIVE)
        names = [str(name) for name in rng.permutation(OF_DRIVE_OF_GAME)[: int(rng.integers(1, MOST_EFFECTS + 1))]]
        # friction that falls with speed is what dry friction has more at creep
        if "stribeck" in names and "coulomb" not in names:
            names.append("coulomb")
    else:
        plan = drawn_log(rng, Reading.MOVING)
        names = [str(name) for name in rng.permutation(LAGS)[: int(rng.integers(1, 3))]]
        if rng.uniform() < 0.5:  # every other one
            names.append(str(rng.choice(_BESIDE_LAGS)))
    return Scenario(names=tuple(names), strength_sigma=STRENGTH, plan=plan)


def _null(noise: Noise) -> Line:
    # with one run, what is drawn anew for each pass is a map: nothing in the record tells them apart
    runs = (2 if noise is Noise.BY_PLACE else 1, MOST_RUNS)
    return Line(
        title=f"nothing, drawn plans, noise: {noise.value}",
        rule=Rule.WRONG_NAME,
        share=0.95,
        draw=partial(_nothing, noise, runs),
    )


def harder_lines() -> tuple[Line, ...]:
    """Return the lines that are harder than a user's data.

    Examples
    --------
    >>> sum(line.rule is Rule.WRONG_NAME for line in harder_lines())
    11
    """
    several = tuple(
        Line(
            title=f"{what}, 3 sigma, drawn plans with repeats, above the detectable amplitude",
            rule=Rule.NAMED,
            share=share,
            draw=partial(_effects, count),
            above_detectable=True,
            most_left_out=0.2,
        )
        for count, (what, share) in _COUNTS.items()
    )

    wrong = Rule.WRONG_NAME
    return (
        *(_null(noise) for noise in Noise),
        Line(
            "nothing, single runs, noise: correlated by place", wrong, 0.0,
            draw=partial(_nothing, Noise.BY_PLACE, (1, 1)),
        ),
        Line(
            f"outside the library, {len(OUTSIDE)} kinds, 3 sigma, drawn plans", wrong, 0.95,
            draw=partial(_outside, OUTSIDE, MOST_RUNS),
        ),
        Line(
            f"outside the library, {len(SINGLE_RUN_OUTSIDE)} kinds, 3 sigma, single runs", wrong, 0.0,
            draw=partial(_outside, SINGLE_RUN_OUTSIDE, 1),
        ),
        *several,
        Line("one to four effects, 1 to 5 sigma, any drawn plan", Rule.NAMED, 0.0, draw=_anything),
        Line("drives and moving logs, 3 sigma", Rule.NAMED, 0.95, draw=_drive_or_log),
    )  # fmt: skip


def the_pools() -> tuple[Line, ...]:
    """Return the bars that several lines must reach together.

    Examples
    --------
    >>> [(pool.share, len(pool.members)) for pool in the_pools()]
    [(0.98, 8)]
    """
    return (
        Line(
            title="nothing, drawn plans, all eight families of noise",
            rule=Rule.WRONG_NAME,
            share=0.98,
            members=tuple(_null(noise).title for noise in Noise),
        ),
    )
