"""The hidden-effect game: an emulated axis with something hidden in it, measured for others to find."""

from rtec.blind.answer import EXPERIMENTS, Answer, Judge, Rule, answer_of, is_right
from rtec.blind.confusion import Confusion, Game, LineScore, Refit, confusion, wilson
from rtec.blind.game import play
from rtec.blind.hidden import Hidden, Parameter
from rtec.blind.lines import Line, the_lines
from rtec.blind.noise import Noise
from rtec.blind.plan import PLANS, Plan, plan_named
from rtec.blind.scenario import INSIDE, LOOK_ALIKES, OUTSIDE, Scenario, scenario_of
from rtec.blind.sealing import document_of, new, reveal, sealed_path
from rtec.blind.secret import Secret

__all__ = [
    "EXPERIMENTS",
    "INSIDE",
    "LOOK_ALIKES",
    "OUTSIDE",
    "PLANS",
    "Answer",
    "Confusion",
    "Game",
    "Hidden",
    "Judge",
    "Line",
    "LineScore",
    "Noise",
    "Parameter",
    "Plan",
    "Refit",
    "Rule",
    "Scenario",
    "Secret",
    "answer_of",
    "confusion",
    "document_of",
    "is_right",
    "new",
    "plan_named",
    "play",
    "reveal",
    "scenario_of",
    "sealed_path",
    "the_lines",
    "wilson",
]
