"""Error models that tell the PC what to correct.

A model maps what sensors say - position, direction, velocity, time, temperatures, positions of other axes - to the
error of the axis: actual minus target, in mm, as measured. A predictor is a model of position and direction, and
perhaps of where other axes stand.
The correction counters are driven towards the error (added counts pull the axis back); a compensation table of a
control holds its negative.
"""

from rtec.predictors.axis_tables import AxisTables
from rtec.predictors.curve import Cautious, NoError
from rtec.predictors.long_run import Stability, stability
from rtec.predictors.narx import Narx, NarxShape
from rtec.predictors.network import LatheNetwork
from rtec.predictors.predictor_file import KnownPredictor, is_predictor_file, read_predictor, write_predictor
from rtec.predictors.protocol import FORWARD, REVERSE, Model, Predictor
from rtec.predictors.sequences import DynamicModel, Sequences
from rtec.predictors.step_model import StepModel, growth
from rtec.predictors.table_files import LengthUnit, read_linuxcnc_table, read_table, write_table
from rtec.predictors.tables import BidirectionalTable, UnidirectionalTable

__all__ = [
    "FORWARD",
    "REVERSE",
    "AxisTables",
    "BidirectionalTable",
    "Cautious",
    "DynamicModel",
    "KnownPredictor",
    "LatheNetwork",
    "LengthUnit",
    "Model",
    "Narx",
    "NarxShape",
    "NoError",
    "Predictor",
    "Sequences",
    "Stability",
    "StepModel",
    "UnidirectionalTable",
    "growth",
    "is_predictor_file",
    "read_linuxcnc_table",
    "read_predictor",
    "read_table",
    "stability",
    "write_predictor",
    "write_table",
]
