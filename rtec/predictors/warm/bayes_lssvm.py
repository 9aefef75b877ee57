"""Bayesian network and LS-SVM together: the network tells the operating condition, a machine for each answers."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from rtec.errors import ArgumentError
from rtec.predictors._columns import Floats
from rtec.predictors.warm import _plain
from rtec.predictors.warm._bayes_lssvm_kernels import PLACES, bayes_ls_svm_answer
from rtec.predictors.warm.bayes import BayesRegressor
from rtec.predictors.warm.lssvm import LsSvm

NONE = -1
"""In place of a column: nothing is taken off."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BayesLsSvm:
    """The answers of LS-SVMs, weighted by the probability of the condition that each was trained for.

    Parameters
    ----------
    signs
        What the network sees: a column, and another that is taken off (-1: none), such as a temperature and what
        lags behind it.
    classifier
        Whose features are the signs, and whose output states are the conditions.
    conditions
        In words.
    machines
        LS-SVMs of the columns.
    machine_of
        The machine of each condition; several may share one.

    Raises
    ------
    ArgumentError
        Parts that do not fit each other.

    Notes
    -----
    With the probability p of each condition, and m and s from its machine, the answer is ``sum p m`` and its variance
    ``sum p (s ** 2 + (m - answer) ** 2)``.

    References
    ----------
    Yao et al. 2013, section 4.2 and conclusion ("using the BN and LS-SVM methods together"); Ramesh et al. 2003, who
    classify by a Bayesian network with rules and predict by one machine for each class.
    """

    kind: ClassVar[str] = "bayes-ls-svm"

    signs: tuple[tuple[int, int], ...]
    classifier: BayesRegressor
    conditions: tuple[str, ...]
    machines: tuple[LsSvm, ...]
    machine_of: tuple[int, ...]

    def __post_init__(self) -> None:
        states = self.classifier.network.nodes[-1].states
        if not len(self.conditions) == len(self.machine_of) == states:
            found = f"{len(self.conditions)} conditions"
            raise ArgumentError("conditions", found, f"{states}, one for each state of the classifier's output")
        if len(self.signs) != len(self.classifier.names):
            raise ArgumentError("signs", len(self.signs), f"{len(self.classifier.names)}, as the classifier has")
        widths = {machine.centre.size for machine in self.machines}
        if len(widths) != 1:
            raise ArgumentError("machines", f"{len(widths)} numbers of features", "machines of the same columns")
        if not all(0 <= one < len(self.machines) for one in self.machine_of):
            raise ArgumentError("machine_of", max(self.machine_of), f"0 to {len(self.machines) - 1}")
        if not all(0 <= a < self.features and NONE <= b < self.features for a, b in self.signs):
            raise ArgumentError(
                "signs", f"{self.signs}"[:60], f"columns from 0 to {self.features - 1}, or -1 for none"
            )

    @property
    def features(self) -> int:
        """How many columns it sees."""
        return int(self.machines[0].centre.size)

    @property
    def parameters(self) -> int:
        """Those of the network and of all machines."""
        return self.classifier.network.parameters + sum(machine.parameters for machine in self.machines)

    def weights(self, columns: Floats) -> Floats:
        """Return the probability of each condition, shape (rows, conditions), of columns, shape (rows, features)."""
        return self.classifier.weights(signs_of(self._checked(columns), self.signs))

    def predict(self, columns: Floats) -> tuple[Floats, Floats]:
        """Return output and standard deviation, shape (rows,) each, of columns, shape (rows, features).

        Both are NaN where a column is: a machine needs them all.
        """
        columns = self._checked(columns)
        answers = np.full((2, len(columns)), np.nan)
        known = np.isfinite(columns).all(axis=1)
        if known.any():
            answers[:, known] = self._answers(columns[known])
        return answers[0], answers[1]

    def _answers(self, columns: Floats) -> tuple[Floats, Floats]:
        weights = self.weights(columns)
        answers = [machine.predict(columns) for machine in self.machines]
        means, sds = (np.stack([answers[m][k] for m in self.machine_of], axis=1) for k in (0, 1))
        found = np.sum(weights * means, axis=1)
        variance = np.sum(weights * (sds**2 + (means - found[:, None]) ** 2), axis=1)
        return found, np.sqrt(variance)

    def probable(self, row: npt.ArrayLike) -> tuple[tuple[str, float], ...]:
        """Return the conditions with their probabilities for one row, shape (features,), the most probable first."""
        weights = self.weights(np.asarray(row, dtype=np.float64)[None])[0]
        order = np.argsort(-weights, kind="stable")
        return tuple((self.conditions[c], float(weights[c])) for c in order)

    def _checked(self, columns: Floats) -> Floats:
        found = np.ascontiguousarray(columns, dtype=np.float64)
        if found.ndim != 2 or found.shape[1] != self.features:
            raise ArgumentError("columns", f"an array of shape {found.shape}", f"rows of {self.features} features")
        return found

    @property
    def function(self) -> Callable[..., float]:
        """Compiled, for one row."""
        found: Callable[..., float] = bayes_ls_svm_answer
        return found

    @property
    def numbers(self) -> Floats:
        """A new array; its layout stands in ``_bayes_lssvm_kernels.py``."""
        parts = [self.classifier.numbers, *(machine.numbers for machine in self.machines)]
        head = PLACES + len(parts) + 2 * len(self.signs) + len(self.conditions)
        places = np.cumsum([head, *(part.size for part in parts)])[:-1]
        counts = [len(self.signs), len(self.conditions), len(self.machines)]
        return np.concatenate([counts, places, np.ravel(self.signs), self.machine_of, *parts])

    @property
    def room(self) -> int:
        """For signs, the answers of the machines, and what the largest of the parts needs."""
        scratch = max(self.classifier.room, *(machine.room for machine in self.machines))
        return len(self.signs) + 2 * len(self.machines) + scratch

    @property
    def plain(self) -> _plain.Plain:
        """All that `of` needs to build the same function again."""
        found: _plain.Plain = {
            "conditions": list(self.conditions),
            "signs": [column for sign in self.signs for column in sign],
            "machine_of": list(self.machine_of),
        }
        found.update({f"classifier_{key}": value for key, value in self.classifier.plain.items()})
        for m, machine in enumerate(self.machines, 1):
            found.update({f"machine_{m}_{key}": value for key, value in machine.plain.items()})
        return found

    @classmethod
    def of(cls, plain: Mapping[str, Any]) -> BayesLsSvm:
        """Build the function from plain data.

        Raises
        ------
        ArgumentError
            A value is missing, no number, or of another length.
        """
        classifier = BayesRegressor.of(_part(plain, "classifier_"))
        signs = _plain.whole(plain, "signs", 2 * len(classifier.names))
        machine_of = _plain.whole(plain, "machine_of", classifier.network.nodes[-1].states)
        return cls(
            signs=tuple(zip(signs[::2], signs[1::2], strict=True)),
            classifier=classifier,
            conditions=_plain.names(plain, "conditions"),
            machines=tuple(LsSvm.of(_part(plain, f"machine_{m}_")) for m in range(1, 2 + max(machine_of))),
            machine_of=tuple(machine_of),
        )


def signs_of(columns: Floats, signs: tuple[tuple[int, int], ...]) -> Floats:
    """Return what the network sees of columns, shape (rows, signs)."""
    found = [columns[:, a] - columns[:, b] if b >= 0 else columns[:, a] for a, b in signs]
    return np.stack(found, axis=1)


def _part(plain: Mapping[str, Any], prefix: str) -> dict[str, Any]:
    return {key.removeprefix(prefix): value for key, value in plain.items() if key.startswith(prefix)}
