"""How an axis is measured and judged: instrument files, measuring programs, ISO 230-2."""

from rtec.metrology.cyclic import CyclicError, cyclic_error
from rtec.metrology.experiment_file import read_experiment, write_experiment
from rtec.metrology.experiment_plan import (
    ExperimentPlan,
    Heating,
    Passes,
    Reading,
    Spacing,
    Strokes,
    Weather,
    Zero,
)
from rtec.metrology.figures import UNITS, Coordinate, PositioningFigures, TargetFigures
from rtec.metrology.iso230 import positioning_figures
from rtec.metrology.judged_test import JudgedTest
from rtec.metrology.laser_file import is_laser_file, read_laser_file, write_laser_file
from rtec.metrology.load import PositioningTest, positioning_test, read_positioning_test
from rtec.metrology.measurement import Column, Measurement, direction_of_motion, measurement_of_readings
from rtec.metrology.measurement_csv import write_measurement
from rtec.metrology.measurement_file import read_measurement
from rtec.metrology.measuring_plan import AxisMeasure, InchMode, MachineAxis, MeasuringPlan
from rtec.metrology.measuring_program import (
    Block,
    Comment,
    Dwell,
    Move,
    Setup,
    Stop,
    StopKind,
    measuring_program,
    parse_program,
)
from rtec.metrology.program_file import read_program
from rtec.metrology.readings import Readings, RotaryReadings, joined
from rtec.metrology.tables.choices import ColumnChoices, column_choices
from rtec.metrology.uncertainty import PositioningUncertainty, UncertaintyInputs, positioning_uncertainty
from rtec.metrology.vdi3441 import VdiFigures, vdi_figures

__all__ = [
    "UNITS",
    "AxisMeasure",
    "Block",
    "Column",
    "ColumnChoices",
    "Comment",
    "Coordinate",
    "CyclicError",
    "Dwell",
    "ExperimentPlan",
    "Heating",
    "InchMode",
    "JudgedTest",
    "MachineAxis",
    "Measurement",
    "MeasuringPlan",
    "Move",
    "Passes",
    "PositioningFigures",
    "PositioningTest",
    "PositioningUncertainty",
    "Reading",
    "Readings",
    "RotaryReadings",
    "Setup",
    "Spacing",
    "Stop",
    "StopKind",
    "Strokes",
    "TargetFigures",
    "UncertaintyInputs",
    "VdiFigures",
    "Weather",
    "Zero",
    "column_choices",
    "cyclic_error",
    "direction_of_motion",
    "is_laser_file",
    "joined",
    "measurement_of_readings",
    "measuring_program",
    "parse_program",
    "positioning_figures",
    "positioning_test",
    "positioning_uncertainty",
    "read_experiment",
    "read_laser_file",
    "read_measurement",
    "read_positioning_test",
    "read_program",
    "vdi_figures",
    "write_experiment",
    "write_laser_file",
    "write_measurement",
]
