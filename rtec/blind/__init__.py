"""The hidden-effect game: an emulated axis with something hidden in it, measured for others to find."""

from rtec.blind.answer import Answer, Rule, answer_of, is_right
from rtec.blind.confusion import Confusion, confusion
from rtec.blind.drawn_plans import drawn_log, drawn_plan
from rtec.blind.game import again, play
from rtec.blind.guess import Points, guessed, points_of, read_answer, total_of
from rtec.blind.harder_lines import the_pools
from rtec.blind.hidden import Hidden, Parameter, Secret
from rtec.blind.kept_answers import KeptAnswer, answers_path, keep, read_answers
from rtec.blind.line import Line
from rtec.blind.lines import the_lines
from rtec.blind.noise import Noise
from rtec.blind.plan import PLANS, Plan, plan_named
from rtec.blind.scenario import CONFOUNDED, INSIDE, OF_DRIVE, OUTSIDE, Scenario, scenario_of
from rtec.blind.scored import Game, LineScore, wilson
from rtec.blind.sealing import document_of, measure, new, reveal, sealed_path
from rtec.blind.sizes import SIZES, Size, plans_showing, read_size, scenario_of_sizes, size_of

__all__ = [
    "CONFOUNDED",
    "INSIDE",
    "OF_DRIVE",
    "OUTSIDE",
    "PLANS",
    "SIZES",
    "Answer",
    "Confusion",
    "Game",
    "Hidden",
    "KeptAnswer",
    "Line",
    "LineScore",
    "Noise",
    "Parameter",
    "Plan",
    "Points",
    "Rule",
    "Scenario",
    "Secret",
    "Size",
    "again",
    "answer_of",
    "answers_path",
    "confusion",
    "document_of",
    "drawn_log",
    "drawn_plan",
    "guessed",
    "is_right",
    "keep",
    "measure",
    "new",
    "plan_named",
    "plans_showing",
    "play",
    "points_of",
    "read_answer",
    "read_answers",
    "read_size",
    "reveal",
    "scenario_of",
    "scenario_of_sizes",
    "sealed_path",
    "size_of",
    "the_lines",
    "the_pools",
    "total_of",
    "wilson",
]
