"""Which regressors a file can hold, and which compiled model each of them makes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, ClassVar, Protocol, Self, runtime_checkable

from rtec.errors import ArgumentError
from rtec.predictors.warm import _warm_kernels as kernels
from rtec.predictors.warm.linear import Linear
from rtec.predictors.warm.lssvm import LsSvm
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


REGRESSORS: Mapping[str, type[KeptRegressor]] = MappingProxyType({each.kind: each for each in (Linear, LsSvm)})
"""By the kind that a file states."""
_COMPILED = {Linear.kind: kernels.warm_linear, LsSvm.kind: kernels.warm_ls_svm}


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
    found: Callable[..., float] = _COMPILED[kept(regressor).kind]
    return found
