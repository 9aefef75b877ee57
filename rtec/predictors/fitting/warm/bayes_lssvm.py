"""Bayesian network with LS-SVMs: conditions named by rules, told by the network, each with a machine of its own."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import cast

import numpy as np
import numpy.typing as npt

from rtec.errors import ArgumentError
from rtec.predictors._columns import Floats
from rtec.predictors.fitting.warm._left_out_kernels import Places
from rtec.predictors.fitting.warm.conditions import Labels, divisions, signs_among
from rtec.predictors.fitting.warm.lssvm import fit_ls_svm, train_ls_svm
from rtec.predictors.fitting.warm.rows import Rows, rms, rows_of
from rtec.predictors.fitting.warm.states import Cutting, cuts_of
from rtec.predictors.warm.bayes import BayesRegressor
from rtec.predictors.warm.bayes_lssvm import BayesLsSvm, signs_of
from rtec.predictors.warm.bayes_network import BayesNetwork, Node
from rtec.predictors.warm.causes import OUTPUT
from rtec.predictors.warm.features import Feature
from rtec.predictors.warm.lssvm import LsSvm
from rtec.predictors.warm.regressor import RegressorFit

SIGN_STATES = 5
LEAST_ROWS = 20
"""Of a condition that has a machine of its own; others are answered by the machine of all rows."""
NEARBY = (0.5, 1.0, 2.0)
"""Widths of a condition's machine, and its gammas squared, that are tried: in those of the machine of all rows."""
NEGLIGIBLE = 1e-9
"""Probability below which the machine of a condition is not asked."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Experts:
    """The machines of one way to divide rows."""

    columns: Floats
    rows: Rows
    labels: Labels
    alone: RegressorFit
    """The machine of all rows."""
    own: dict[int, LsSvm]
    """Machines by condition."""
    signs: dict[str, tuple[int, int]]
    states: Places
    """Of the signs and the condition, shape (rows, signs + 1)."""
    classifier: BayesRegressor

    @classmethod
    def of(
        cls,
        columns: Floats,
        rows: Rows,
        labels: Labels,
        alone: RegressorFit,
        own: dict[int, LsSvm],
        signs: dict[str, tuple[int, int]],
    ) -> _Experts:
        """Count how often each sign goes with each condition."""
        seen = signs_of(columns, tuple(signs.values()))
        cuts = [cuts_of(column, SIGN_STATES, Cutting.EQUAL_COUNTS) for column in seen.T]
        inner = [np.searchsorted(one, column) for one, column in zip(cuts, seen.T, strict=True)]
        states = np.stack([*inner, labels.of_row], axis=1)
        conditions = len(labels.names)
        nodes = [Node(name=n, states=one.size + 1, parents=(OUTPUT,)) for n, one in zip(signs, cuts, strict=True)]
        classifier = BayesRegressor(
            network=BayesNetwork.learn([*nodes, Node(name=OUTPUT, states=conditions)], states),
            cuts=tuple(cuts),
            means=np.arange(float(conditions)),
            variances=np.zeros(conditions),
        )
        return cls(
            columns=columns,
            rows=rows,
            labels=labels,
            alone=alone,
            own=own,
            signs=signs,
            states=states,
            classifier=classifier,
        )

    def left_out(self) -> Floats:
        """Return the output of each row less what network and machines say of it without its block."""
        found = self.rows.output.copy()
        for block, at in enumerate(self.rows.blocks):
            weights = self._weights_without(at)
            for condition in range(len(self.labels.names)):
                if weights[:, condition].max() > NEGLIGIBLE:
                    found[at] -= weights[:, condition] * self._answers_without(block, condition)
        return found

    def _weights_without(self, at: Places) -> Floats:
        """Return the probability of each condition in the rows of a block: its counts are subtracted."""
        network = self.classifier.network
        block = BayesNetwork.learn(network.nodes, self.states[at])
        counts = tuple(every - one for every, one in zip(network.counts, block.counts, strict=True))
        others = replace(self.classifier, network=replace(network, counts=counts))
        return others.weights(signs_of(self.columns[at], tuple(self.signs.values())))

    def _answers_without(self, block: int, condition: int) -> Floats:
        """Return what the machine of a condition says of the rows of a block that it does not know."""
        at, rows = self.rows.blocks[block], self.rows
        members = self.labels.of_row == condition
        others = members & (rows.which != block)
        if condition not in self.own or np.count_nonzero(others) < LEAST_ROWS:
            answers: Floats = rows.output[at] - self.alone.left_out[at]
            return answers
        machine = self.own[condition]
        if np.array_equal(others, members):
            return machine.predict(self.columns[at])[0]
        scaled = (self.columns - machine.centre) * machine.per_unit
        again = train_ls_svm(
            scaled[others], rows.output[others], width=machine.width, gamma=machine.gamma, linear=machine.linear
        )
        return again.predict(scaled[at])[0]

    def fitted(self) -> BayesLsSvm:
        """Return network and machines of all rows."""
        shared = [c for c in range(len(self.labels.names)) if c not in self.own]
        machines = [*self.own.values(), *([cast(LsSvm, self.alone.regressor)] if shared else [])]
        places = {condition: place for place, condition in enumerate(self.own)}
        return BayesLsSvm(
            signs=tuple(self.signs.values()),
            classifier=self.classifier,
            conditions=self.labels.names,
            machines=tuple(machines),
            machine_of=tuple(places.get(c, len(self.own)) for c in range(len(self.labels.names))),
        )


def fit_bayes_ls_svm(
    columns: Floats,
    output: Floats,
    block: npt.ArrayLike,
    *,
    features: Sequence[Feature],
    alone: RegressorFit | None = None,
) -> RegressorFit:
    """Fit a Bayesian network that tells the operating condition, and an LS-SVM for each condition.

    Parameters
    ----------
    columns
        Shape (rows, features): not many more than 2000 rows, as for `fit_ls_svm`.
    output
        Shape (rows,).
    block
        The block of each row, shape (rows,).
    features
        What the columns are. Rules name the condition of each row: heating, steady or cooling by the temperatures
        that have a column that lags behind them, and the class of the speed. The network tells it from the speeds and
        from each sensor less what lags behind it.
    alone
        What `fit_ls_svm` gives for the same rows, where that is there already. The machine of a condition looks for
        its width and gamma around those of this one, and has its linear part.

    Raises
    ------
    ArgumentError
        As `fit_ls_svm`; or there is neither a speed nor a sensor with a lag, or nothing but one condition.

    Notes
    -----
    Whether trend, speed or both divide the rows is chosen by leaving out blocks. Without a block, its counts are
    subtracted, and each machine that has rows of the block is trained again without them.

    References
    ----------
    Yao et al. 2013, section 4.2; Ramesh et al. 2003.
    """
    rows = rows_of(columns, output, block)
    columns = np.asarray(columns, dtype=np.float64)
    if len(features) != columns.shape[1]:
        raise ArgumentError("features", len(features), f"one for each of {columns.shape[1]} columns")
    signs = signs_among(features)
    ways = list(divisions(features, columns)) if signs else []
    if not ways:
        found = "one operating condition"
        raise ArgumentError("features", found, "a speed that varies, or a temperature and what lags behind it")
    alone = alone or fit_ls_svm(columns, output, block)
    experts = [
        _Experts.of(columns, rows, way, alone, dict(_machines(columns, rows, way, alone)), signs) for way in ways
    ]
    errors = [one.left_out() for one in experts]
    figures = [rms(one) for one in errors]
    best = int(np.argmin(figures))
    chosen = experts[best]
    notes = (
        f"Conditions by {chosen.labels.by}: {'; '.join(chosen.labels.names)}.",
        f"{len(chosen.own)} of {len(chosen.labels.names)} have a machine of their own.",
        f"Left-out blocks: {figures[best]:.3g}, one LS-SVM for all rows {rms(alone.left_out):.3g}.",
    )
    return RegressorFit(
        regressor=chosen.fitted(),
        left_out=errors[best],
        notes=(*rows.notes, *notes),
        tried=tuple((f"conditions by {way.by}", figure) for way, figure in zip(ways, figures, strict=True)),
    )


def _machines(columns: Floats, rows: Rows, labels: Labels, alone: RegressorFit) -> Iterator[tuple[int, LsSvm]]:
    """Yield a machine for each condition with enough rows in two blocks or more, and its number."""
    whole = cast(LsSvm, alone.regressor)
    used = np.count_nonzero(rows.per_unit)
    for condition in range(len(labels.names)):
        at = np.flatnonzero(labels.of_row == condition)
        varies = np.ptp(columns[at], axis=0).any()
        if at.size < LEAST_ROWS or np.unique(rows.which[at]).size < 2 or not varies:
            continue
        fit = fit_ls_svm(
            columns[at],
            rows.output[at],
            rows.which[at],
            widths=[whole.width / np.sqrt(used) * share for share in NEARBY],
            gammas=[whole.gamma * share**2 for share in NEARBY],
            linear=[whole.linear * used],
        )
        yield condition, cast(LsSvm, fit.regressor)
