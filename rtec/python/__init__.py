"""What ``import rtec`` offers: the commands as functions, for notebooks and programs.

The words are those of the command line; numbers come back in the units in which people read them.
"""

from rtec.python.calls import add, compare, diagnose, run, simulate, train
from rtec.python.data import Data, read
from rtec.python.models import Model
from rtec.python.results import Comparison, Diagnosis, Result

__all__ = [
    "Comparison",
    "Data",
    "Diagnosis",
    "Model",
    "Result",
    "add",
    "compare",
    "diagnose",
    "read",
    "run",
    "simulate",
    "train",
]
