"""Every kind of predictor fitted to one measurement, judged by readings that none of them has seen."""

from rtec.training.compare_predictors import compare_predictors
from rtec.training.methods import all_methods
from rtec.training.results import PredictorComparison, Row

__all__ = [
    "PredictorComparison",
    "Row",
    "all_methods",
    "compare_predictors",
]
