"""The hidden-effect game: an emulated axis with something hidden in it, measured for others to find."""

from rtec.blind.game import play
from rtec.blind.hidden import Hidden, Parameter
from rtec.blind.noise import Noise
from rtec.blind.plan import PLANS, Plan, plan_named
from rtec.blind.scenario import INSIDE, OUTSIDE, Scenario, scenario_of
from rtec.blind.secret import Secret

__all__ = [
    "INSIDE",
    "OUTSIDE",
    "PLANS",
    "Hidden",
    "Noise",
    "Parameter",
    "Plan",
    "Scenario",
    "Secret",
    "plan_named",
    "play",
    "scenario_of",
]
