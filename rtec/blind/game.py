"""Playing the game: the emulated axis with something hidden in it is measured, as a measurement file holds it."""

from __future__ import annotations

import numpy as np

from rtec.blind import noise as noises
from rtec.blind.axis_run import COUNT_MM, Pass, measure
from rtec.blind.hidden import Hidden, Parameter, rms, scaled
from rtec.blind.plan import PITCH_MM, SIGNAL_PERIOD_MM, Course, Floats, Heating, Plan, draw_course
from rtec.blind.scenario import OUTSIDE, Noise, Scenario
from rtec.blind.secret import Secret
from rtec.blind.slow_errors import (
    REFERENCE_DEGC,
    SLOW,
    Circumstances,
    sensed_temperature,
    simulate_temperature,
)
from rtec.blind.static_errors import STATIC, StaticError, at_readings, table_of
from rtec.checks import whole_within
from rtec.metrology import Column, Measurement

_COURSE, _NOISE, _HEAT, _SENSOR, _EFFECTS = range(1, 6)


def play(scenario: Scenario, seed: int) -> tuple[Measurement, Secret]:
    """Hide what a scenario asks for in the emulated axis and measure it.

    Parameters
    ----------
    scenario
        What to hide and how strong.
    seed
        Of targets, shapes of the effects, temperatures and noise.

    Returns
    -------
    Measurement
        Ready to be written; it tells nothing of what is hidden.
    Secret
        What is hidden.

    Raises
    ------
    ArgumentError
        A seed that is no whole number from 0 to 2^62.

    Notes
    -----
    The closed loop (servo, encoder of 1 um counts, controller) runs once, with the sum of the static errors between
    its encoder and the laser, and lost counts as what they do to a controller. What is slow is added to its readings
    afterwards, and so is the noise: neither reaches the encoder, so the loop would do the same with them.

    Examples
    --------
    >>> measurement, secret = play(Scenario(names=("backlash",), strength_sigma=3.0), seed=1)
    >>> measurement.rows, secret.names, round(secret.effects[0].rms_sigma, 3)
    (210, ('backlash',), 3.0)
    """
    whole_within("seed", seed, 0, 1 << 62)
    plan = scenario.plan
    course = draw_course(plan, _stream(seed, _COURSE))
    sigma_mm = plan.sigma_um * 1e-3
    wanted = dict(zip(scenario.names, scenario.strengths, strict=True))
    hidden: dict[str, Hidden] = {}
    static: list[tuple[StaticError, float]] = []
    for name in (name for name in wanted if name in STATIC):
        error = STATIC[name](plan, _stream(seed, _EFFECTS, name))
        added = at_readings(plan, error, course.target_mm, course.direction.astype(np.float64))
        factor = wanted[name] * sigma_mm / rms(added)
        static.append((error, factor))
        hidden[name] = _hidden(name, error.description, error.parameters, factor, factor * added, sigma_mm)
    shift_mm = np.zeros(course.target_mm.size)
    if "lost_counts" in wanted:
        shift_mm, hidden["lost_counts"] = _lost_counts(
            course, wanted["lost_counts"], sigma_mm, _stream(seed, _EFFECTS, "lost_counts")
        )
    measured = measure(course, table_of(plan, static), shift_mm=shift_mm, trace="windup" in wanted)
    heat = simulate_temperature(course, measured.time_s, _stream(seed, _HEAT))
    circumstances = Circumstances(course=course, measured=measured, temperature_degc=heat)
    deviation_mm = measured.deviation_mm.copy()
    for name in (name for name in wanted if name in SLOW):
        slow = SLOW[name](circumstances, _stream(seed, _EFFECTS, name))
        factor = wanted[name] * sigma_mm / rms(slow.added_mm)
        deviation_mm += factor * slow.added_mm
        hidden[name] = _hidden(name, slow.description, slow.parameters, factor, factor * slow.added_mm, sigma_mm)
    deviation_mm += _noise(scenario.noise, deviation_mm.size, sigma_mm, _stream(seed, _NOISE))
    shown_degc = sensed_temperature(heat, _stream(seed, _SENSOR))
    measurement = _measurement(course, measured, deviation_mm, shown_degc)
    return measurement, secret_of(scenario, seed, tuple(hidden[name] for name in scenario.names))


def secret_of(scenario: Scenario, seed: int, effects: tuple[Hidden, ...]) -> Secret:
    """Return the secret of a scenario that was played."""
    return Secret(
        effects=effects,
        noise=scenario.noise.value,
        sigma_um=scenario.plan.sigma_um,
        seed=seed,
        plan=scenario.plan.name,
        outside=tuple(name for name in scenario.names if name in OUTSIDE),
    )


def _stream(seed: int, *what: int | str) -> np.random.Generator:
    """Return a stream of random numbers of its own for each thing drawn, so that none depends on another."""
    keys = [seed]
    for part in what:
        keys += [part] if isinstance(part, int) else list(part.encode())
    return np.random.default_rng(keys)


def _hidden(
    name: str, description: str, parameters: tuple[Parameter, ...], factor: float, added: Floats, sigma_mm: float
) -> Hidden:
    return Hidden(
        name=name,
        description=description,
        parameters=scaled(parameters, factor),
        rms_sigma=rms(added) / sigma_mm,
    )


def _lost_counts(
    course: Course, strength_sigma: float, sigma_mm: float, rng: np.random.Generator
) -> tuple[Floats, Hidden]:
    """Return by how much the controller is misled at each reading, and what was hidden.

    With one run the counts go lost as the axis turns, where nothing tells them from play.
    """
    n = course.target_mm.size
    first = n // 2 if course.plan.runs == 1 else int(rng.integers(n // 4, 3 * n // 4))
    share = 1.0 - first / n
    counts = max(round(strength_sigma * sigma_mm / COUNT_MM / np.sqrt(share * (1.0 - share))), 1)
    counts *= int(rng.choice([-1, 1]))
    shift = np.where(np.arange(n) >= first, counts * COUNT_MM, 0.0)
    return shift, Hidden(
        name="lost_counts",
        description="the controller loses counts once, and takes the axis to a place so much further on",
        parameters=(Parameter("counts", float(counts), "count"), Parameter("before_reading", float(first + 1), "")),
        rms_sigma=rms(shift) / sigma_mm,
    )


def _noise(kind: Noise, count: int, sigma_mm: float, rng: np.random.Generator) -> Floats:
    draw = noises.white if kind is Noise.WHITE else noises.correlated
    return draw(count, sigma_mm, rng)


def facts_of(plan: Plan) -> dict[str, str]:
    """Return what a file says of its axis."""
    facts = {"axis": "emulated", "screw_pitch": f"{PITCH_MM:g} mm", "scale_signal_period": f"{SIGNAL_PERIOD_MM:g} mm"}
    if plan.heating is not Heating.NONE:
        facts["reference_temperature"] = f"{REFERENCE_DEGC:g} degC"
    return facts


def _measurement(course: Course, measured: Pass, deviation_mm: Floats, shown_degc: Floats) -> Measurement:
    plan = course.plan
    columns = [
        Column("run", "", course.run.astype(np.float64)),
        Column("direction", "", course.direction.astype(np.float64)),
        Column("time", "s", measured.time_s),
        Column("target", "mm", course.target_mm),
        Column("actual", "mm", noises.resolved(course.target_mm + deviation_mm)),
        Column("feed", "mm_s", course.feed_mm_s),
        Column("temperature", "degc", shown_degc),
    ]
    kept = {"run", "direction", "target", "actual", *plan.columns}
    unknown = {"dwell_s": course.turn_dwell_s} if "dwell" in plan.columns else {}
    by_quantity = {column.quantity: column for column in columns if column.quantity in kept}
    return Measurement(
        source=f"blind game, {plan.name} plan", facts=facts_of(plan), columns=by_quantity, unknown=unknown
    )
