"""What stands behind the features of a model of a warm machine: a function of one row, and how sure it is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from rtec.predictors._columns import Floats


@runtime_checkable
class Regressor(Protocol):
    """A fitted function of the columns of features, in their own units; it scales them itself.

    Where it has no answer, as a fuzzy network beside all its rules, both results are NaN.
    """

    @property
    def parameters(self) -> int:
        """How many numbers were fitted."""

    def predict(self, columns: Floats) -> tuple[Floats, Floats]:
        """Return the output and its standard deviation, shape (rows,) each, of columns, shape (rows, features).

        The standard deviation is 0 where the regressor knows none of its own.
        """

    @property
    def function(self) -> Callable[..., float]:
        """The same compiled for one row: ``function(numbers, columns, room, sd)``, which writes ``sd[0]``."""

    @property
    def numbers(self) -> Floats:
        """What the compiled function computes with."""

    @property
    def room(self) -> int:
        """How many numbers of scratch room it needs."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RegressorFit:
    """What a fit gives.

    Parameters
    ----------
    regressor
        Fitted to all rows.
    left_out
        Output less what a fit without the block of a row says of it, shape (rows,): hyperparameters chosen for all
        blocks together, the numbers fitted anew without each block.
    notes
        In sentences: what was chosen.
    tried
        What was chosen from: a setting in words, and its root mean square of ``left_out``.
    """

    regressor: Regressor
    left_out: Floats
    notes: tuple[str, ...] = ()
    tried: tuple[tuple[str, float], ...] = ()
