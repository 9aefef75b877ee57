"""Playing the game: the emulated axis with something hidden in it is measured, as a measurement file holds it."""

from __future__ import annotations

from dataclasses import fields, replace

from rtec.blind.at_rest import measure_at_rest
from rtec.blind.circumstances import REFERENCE_DEGC
from rtec.blind.draws import checked_seed
from rtec.blind.drive_log import measure_drive
from rtec.blind.hidden import Secret
from rtec.blind.in_motion import measure_in_motion
from rtec.blind.plan import PITCH_MM, SIGNAL_PERIOD_MM, TARGET_ROOM_MM, Plan
from rtec.blind.scenario import OUTSIDE, Scenario
from rtec.blind.static_errors import travel_of
from rtec.checks import whole_within
from rtec.errors import ArgumentError
from rtec.metrology import ExperimentPlan, Heating, Measurement, Reading

_ALWAYS = ("run", "target", "actual")
_MEASURED = {
    Reading.AT_REST: measure_at_rest,
    Reading.MOVING: measure_in_motion,
    Reading.DRIVE: measure_drive,
}


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
    How the measurement comes about stands in `rtec.blind.at_rest`, `rtec.blind.in_motion` and
    `rtec.blind.drive_log`.

    Examples
    --------
    >>> measurement, secret = play(Scenario(names=("backlash",), strength_sigma=3.0), seed=1)
    >>> measurement.rows, secret.names, round(secret.effects[0].rms_sigma, 3)
    (210, ('backlash',), 3.0)
    """
    return measured(scenario, checked_seed(seed), scenario.plan, 0)


def again(scenario: Scenario, seed: int, experiment: ExperimentPlan, number: int = 1) -> tuple[Measurement, Secret]:
    """Measure the axis of a game once more, by another plan.

    What is hidden keeps its numbers: they are those of the first measurement. Targets, heat, air and noise are drawn
    anew, and so is the zero of each run; counts go lost again after the same share of the readings.

    Parameters
    ----------
    scenario, seed
        Of the game.
    experiment
        What is measured now.
    number
        Of the measurement, from 1; another one is another draw.

    Returns
    -------
    Measurement
        Ready to be written; it tells nothing of what is hidden.
    Secret
        What is hidden, with its strength in these readings.

    Raises
    ------
    ArgumentError
        A plan that the emulated axis cannot carry out: another kind of reading than the first measurement's, beyond
        the ends of the travel, too fast, or a column that it does not record.

    Examples
    --------
    >>> from rtec.blind.plan import PLANS
    >>> game = Scenario(names=("backlash",), plan=PLANS["turned_once"])
    >>> first, second = play(game, 1), again(game, 1, ExperimentPlan(runs=3, targets=11))
    >>> second[0].rows, second[1].effects[0].parameters == first[1].effects[0].parameters
    (66, True)
    """
    checked_seed(seed)
    whole_within("number", number, 1, 1 << 62)
    return measured(scenario, seed, continued(scenario.plan, experiment), number)


def continued(plan: Plan, experiment: ExperimentPlan) -> Plan:
    """Return an experiment as a plan of the game, for the axis that was first measured by ``plan``.

    Raises
    ------
    ArgumentError
        As in `again`.

    Examples
    --------
    >>> from rtec.blind.plan import PLANS
    >>> continued(PLANS["base"], ExperimentPlan(runs=9)).sigma_um
    2.0
    """
    unit = "deg" if plan.rotary else "mm"
    if experiment.reading is not plan.reading:
        allowed = f"'{plan.reading.value}', as this game measures its axis"
        raise ArgumentError("reading", f"'{experiment.reading.value}'", allowed)
    if experiment.rotary is not plan.rotary:
        raise ArgumentError("start_mm", "mm" if plan.rotary else "deg", f"a position in {unit}, as the axis has it")
    low, high = travel_of(plan)
    room = experiment.overshoot_mm + (0.0 if experiment.in_motion else TARGET_ROOM_MM)
    first = experiment.start_mm + min(0.0, *experiment.shifts_mm) - room
    last = experiment.end_mm + max(0.0, *experiment.shifts_mm) + room
    allowed = f"targets, with the way to turn, within {low:g} to {high:g} {unit}: the travel of the axis"
    if first < low:
        raise ArgumentError("start_mm", f"{experiment.start_mm:g} {unit}", allowed)
    if last > high:
        raise ArgumentError("span_mm", f"an end at {experiment.end_mm:g} {unit}", allowed)
    of_experiment = {f.name: getattr(experiment, f.name) for f in fields(ExperimentPlan)}
    return replace(plan, name="measured again", **of_experiment)


def measured(scenario: Scenario, seed: int, plan: Plan, number: int) -> tuple[Measurement, Secret]:
    """Measure the axis of a scenario by a plan.

    Examples
    --------
    >>> measured(Scenario(), 1, Scenario().plan, 0)[0].source
    'blind game, base plan'
    """
    columns, unknown, hidden = _MEASURED[plan.reading](scenario, seed, plan, number)
    kept = {*_ALWAYS, *plan.columns}
    measurement = Measurement(
        source=f"blind game, {plan.name} plan",
        facts=facts_of(plan),
        columns={column.quantity: column for column in columns if column.quantity in kept},
        unknown={heading: values for heading, values in unknown.items() if heading.partition("_")[0] in kept},
    )
    return measurement, Secret(
        effects=tuple(hidden[name] for name in scenario.names),
        noise=scenario.noise.value,
        sigma_um=plan.sigma_um,
        seed=seed,
        plan=plan.name,
        outside=tuple(name for name in scenario.names if name in (*OUTSIDE, *scenario.own_names)),
    )


def facts_of(plan: Plan) -> dict[str, str]:
    """Return what a file says of its axis.

    Examples
    --------
    >>> from rtec.blind.plan import PLANS
    >>> facts_of(PLANS["base"])["screw_pitch"]
    '5 mm'
    """
    if plan.reading is Reading.DRIVE or plan.rotary:
        return {"axis": "emulated"}
    facts = {"axis": "emulated", "screw_pitch": f"{PITCH_MM:g} mm", "scale_signal_period": f"{SIGNAL_PERIOD_MM:g} mm"}
    if plan.heating is not Heating.NONE:
        facts["reference_temperature"] = f"{REFERENCE_DEGC:g} degC"
    return facts
