"""Playing the game: the emulated axis with something hidden in it is measured, as a measurement file holds it."""

from __future__ import annotations

from rtec.blind.at_rest import measure_at_rest
from rtec.blind.draws import checked_seed
from rtec.blind.drive_log import measure_drive
from rtec.blind.in_motion import measure_in_motion
from rtec.blind.plan import PITCH_MM, SIGNAL_PERIOD_MM, Heating, Plan, Reading
from rtec.blind.scenario import OUTSIDE, Scenario
from rtec.blind.secret import Secret
from rtec.blind.slow_errors import REFERENCE_DEGC
from rtec.metrology import Measurement

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
    checked_seed(seed)
    plan = scenario.plan
    columns, unknown, hidden = _MEASURED[plan.reading](scenario, seed)
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
        outside=tuple(name for name in scenario.names if name in OUTSIDE),
    )


def facts_of(plan: Plan) -> dict[str, str]:
    """Return what a file says of its axis.

    Examples
    --------
    >>> from rtec.blind.plan import PLANS
    >>> facts_of(PLANS["base"])["screw_pitch"]
    '5 mm'
    """
    if plan.reading is Reading.DRIVE:
        return {"axis": "emulated"}
    facts = {"axis": "emulated", "screw_pitch": f"{PITCH_MM:g} mm", "scale_signal_period": f"{SIGNAL_PERIOD_MM:g} mm"}
    if plan.heating is not Heating.NONE:
        facts["reference_temperature"] = f"{REFERENCE_DEGC:g} degC"
    return facts
