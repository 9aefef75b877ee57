"""How an axis is measured and judged: instrument files, measuring programs, ISO 230-2."""

from rtec.metrology.axis_facts import AxisFacts
from rtec.metrology.experiment_file import read_experiment, write_experiment
from rtec.metrology.experiment_plan import ExperimentPlan, Heating, Passes, Reading, Spacing, Strokes, Weather, Zero
from rtec.metrology.figures import UNITS, Coordinate, PositioningFigures, TargetFigures
from rtec.metrology.iso230 import positioning_figures
from rtec.metrology.judged_test import JudgedTest
from rtec.metrology.laser_file import write_laser_file
from rtec.metrology.measurement import Column, Measurement, Positions, direction_of_motion, measurement_of_readings
from rtec.metrology.measurement_file import measurement_of_columns, read_measurement, write_measurement
from rtec.metrology.measuring_plan import MachineAxis, MeasuringPlan
from rtec.metrology.measuring_program import Dwell, Move, measuring_program, parse_program, read_program
from rtec.metrology.readings import Readings, RotaryReadings, joined
from rtec.metrology.tables.choices import ColumnChoices, column_choices
from rtec.metrology.uncertainty import UncertaintyInputs, positioning_uncertainty
from rtec.metrology.vdi3441 import vdi_figures

__all__ = [
    "UNITS",
    "AxisFacts",
    "Column",
    "ColumnChoices",
    "Coordinate",
    "Dwell",
    "ExperimentPlan",
    "Heating",
    "JudgedTest",
    "MachineAxis",
    "Measurement",
    "MeasuringPlan",
    "Move",
    "Passes",
    "PositioningFigures",
    "Positions",
    "Reading",
    "Readings",
    "RotaryReadings",
    "Spacing",
    "Strokes",
    "TargetFigures",
    "UncertaintyInputs",
    "Weather",
    "Zero",
    "column_choices",
    "direction_of_motion",
    "joined",
    "measurement_of_columns",
    "measurement_of_readings",
    "measuring_program",
    "parse_program",
    "positioning_figures",
    "positioning_uncertainty",
    "read_experiment",
    "read_measurement",
    "read_program",
    "vdi_figures",
    "write_experiment",
    "write_laser_file",
    "write_measurement",
]
