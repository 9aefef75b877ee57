"""Feed drives: what moves an axis, from the current of the motor to the carriage; one file a drive."""

from rtec.axis.plants.ball_screw import BallScrew, Feedback, ScrewRunout, TorqueRipple
from rtec.axis.plants.cascade import Cascade
from rtec.axis.plants.friction import Friction
from rtec.axis.plants.linear_motor import LinearMotor
from rtec.axis.plants.run import DriveRun, log_columns, run_current, run_drive

__all__ = [
    "BallScrew",
    "Cascade",
    "DriveRun",
    "Feedback",
    "Friction",
    "LinearMotor",
    "ScrewRunout",
    "TorqueRipple",
    "log_columns",
    "run_current",
    "run_drive",
]
