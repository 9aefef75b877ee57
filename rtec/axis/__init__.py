"""What moves: programs of moves, motion profiles, encoders with their imperfections, servo and mechanical play."""

from rtec.axis.encoder import PERFECT, Encoder, Imperfections
from rtec.axis.plant import Plant
from rtec.axis.profile import Limits, MotionExtremes, MotionSegments, ProfileShape, plan
from rtec.axis.program import Block, Dwell, Move, Program, Rapid
from rtec.axis.servo import Servo

__all__ = [
    "PERFECT",
    "Block",
    "Dwell",
    "Encoder",
    "Imperfections",
    "Limits",
    "MotionExtremes",
    "MotionSegments",
    "Move",
    "Plant",
    "ProfileShape",
    "Program",
    "Rapid",
    "Servo",
    "plan",
]
