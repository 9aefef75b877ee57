"""Every kind of predictor fitted to one measurement, judged by readings that none of them has seen."""

from rtec.training.compare_predictors import compare_predictors
from rtec.training.methods import Method, all_methods
from rtec.training.parts import Parts, parts_of, samples_of
from rtec.training.results import Kind, PredictorComparison, Row

__all__ = [
    "Kind",
    "Method",
    "Parts",
    "PredictorComparison",
    "Row",
    "all_methods",
    "compare_predictors",
    "parts_of",
    "samples_of",
]
