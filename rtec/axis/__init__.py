"""What moves: programs of moves, motion profiles, encoders with their imperfections, servo and mechanical play."""

from rtec.axis._aimed import Window
from rtec.axis.encoder import Encoder, Imperfections
from rtec.axis.profile import Limits, MotionSegments, ProfileShape, plan
from rtec.axis.program import Block, Dwell, Move, Program, Rapid
from rtec.axis.servo import Servo

__all__ = [
    "Block",
    "Dwell",
    "Encoder",
    "Imperfections",
    "Limits",
    "MotionSegments",
    "Move",
    "ProfileShape",
    "Program",
    "Rapid",
    "Servo",
    "Window",
    "plan",
]
