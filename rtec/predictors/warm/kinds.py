"""Which regressors a file can hold, and which compiled model each of them makes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib import import_module
from types import MappingProxyType
from typing import Any, ClassVar, Protocol, Self, runtime_checkable

from rtec.errors import ArgumentError
from rtec.predictors.warm import _warm_kernels as kernels
from rtec.predictors.warm.regressor import Regressor


@runtime_checkable
class KeptRegressor(Regressor, Protocol):
    """A regressor that can be written down."""

    kind: ClassVar[str]

    @property
    def plain(self) -> Mapping[str, Any]:
        """Numbers, texts and lists of them, by name: all that `of` needs."""

    @classmethod
    def of(cls, plain: Mapping[str, Any]) -> Self:
        """Build the same regressor again."""


REGRESSORS: Mapping[str, tuple[str, str, Callable[..., float]]] = MappingProxyType({
    "linear": ("linear", "Linear", kernels.warm_linear),
    "ls-svm": ("lssvm", "LsSvm", kernels.warm_ls_svm),
    "fuzzy": ("fuzzy", "Fuzzy", kernels.warm_fuzzy),
    "bayes": ("bayes", "BayesRegressor", kernels.warm_bayes),
    "bayes-ls-svm": ("bayes_lssvm", "BayesLsSvm", kernels.warm_bayes_ls_svm),
})  # fmt: skip
"""By the kind that a file states: module and class, loaded when a file asks for them, as some take scipy along; and
the compiled model."""


def regressor_of(kind: str, plain: Mapping[str, Any]) -> KeptRegressor:
    """Return the regressor of a kind and its plain data.

    Raises
    ------
    ArgumentError
        Data that do not fit.
    """
    module, name, _ = REGRESSORS[kind]
    found: type[KeptRegressor] = getattr(import_module(f"rtec.predictors.warm.{module}"), name)
    return found.of(plain)


def kept(regressor: Regressor) -> KeptRegressor:
    """Return a regressor as one of the kinds of files.

    Raises
    ------
    ArgumentError
        It is none of them.
    """
    if getattr(regressor, "kind", None) not in REGRESSORS or not isinstance(regressor, KeptRegressor):
        raise ArgumentError("regressor", type(regressor).__name__, " or ".join(REGRESSORS))
    return regressor


def compiled_model(regressor: Regressor) -> Callable[..., float]:
    """Return the compiled model of a regressor, which follows the lags and asks it.

    Raises
    ------
    ArgumentError
        As for `kept`.
    """
    return REGRESSORS[kept(regressor).kind][2]
