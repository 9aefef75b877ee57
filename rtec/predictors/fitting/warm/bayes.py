"""Bayesian networks of a warm machine: states, prior and causes of the output are chosen by leaving out blocks."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rtec.errors import ArgumentError
from rtec.predictors._columns import Floats
from rtec.predictors.fitting.warm._left_out_kernels import Places, answers_left_out
from rtec.predictors.fitting.warm.rows import rms, rows_of
from rtec.predictors.fitting.warm.states import Cutting, cuts_of
from rtec.predictors.warm.bayes import BayesRegressor
from rtec.predictors.warm.bayes_network import MOST_CELLS, BayesNetwork, Node, families_of
from rtec.predictors.warm.causes import OUTPUT, Structure, causal_structure, effects_of, with_stated
from rtec.predictors.warm.features import Feature
from rtec.predictors.warm.regressor import RegressorFit

STATES = (3, 5, 8, 12)
"""Of a feature, that are tried."""
OUTPUT_STATES = (8, 16, 32)
"""Of the output, that are tried; the middle one while causes are chosen."""
PRIORS = (1.0, 0.1, 0.01)
"""Added to each count, that are tried; the middle one while causes are chosen."""
MOST_CAUSES = 3
"""Of the output: its table grows with the states to the power of their number."""
WORTH = 0.99
"""A further cause has to bring the root mean square of left-out blocks below this share."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Cut:
    """Columns and output as states, the rows of each block together."""

    nodes: tuple[str, ...]
    cuts: tuple[Floats, ...]
    """Of the columns, then of the output."""
    states: Places
    """Shape (rows, columns + 1)."""
    output: Floats
    starts: Places

    @property
    def sizes(self) -> list[int]:
        """How many states each node has."""
        return [cuts.size + 1 for cuts in self.cuts]

    def with_output(self, count: int) -> Cut:
        """Return the same with another number of states of the output."""
        cuts = cuts_of(self.output, count, Cutting.EQUAL_COUNTS)
        states = self.states.copy()
        states[:, -1] = np.searchsorted(cuts, self.output)
        return Cut(
            nodes=self.nodes, cuts=(*self.cuts[:-1], cuts), states=states, output=self.output, starts=self.starts
        )

    def left_out(self, structure: Mapping[str, Sequence[str]], prior: float) -> Floats:
        """Return the output of each row less what the network says of it without its block.

        Nodes that are neither cause nor effect of the output, nor a further cause of such an effect, do not matter
        where all are observed.
        """
        sizes, place = self.sizes, {name: i for i, name in enumerate(self.nodes)}
        cells, strides, own, many, counts, begin = [], [], [], [], [], 0
        for name, causes in structure.items():
            if name != OUTPUT and OUTPUT not in causes:
                continue
            family = [*(place[cause] for cause in causes), place[name]]
            shape = [sizes[i] for i in family]
            stride = math.prod(shape[family.index(place[OUTPUT]) + 1 :])
            all_cells = np.ravel_multi_index(tuple(self.states[:, family].T), shape)
            cells.append(begin + all_cells - stride * self.states[:, -1])
            strides.append(stride)
            own.append(self.states[:, place[name]])
            many.append(0 if name == OUTPUT else sizes[place[name]])
            counts.append(np.bincount(all_cells, minlength=math.prod(shape)))
            begin += math.prod(shape)
        found = np.empty(self.output.size)
        answers_left_out(
            self.starts,
            np.array(cells),
            np.array(strides),
            np.array(own),
            np.array(many),
            np.concatenate(counts).astype(np.float64),
            prior,
            np.ascontiguousarray(self.states[:, -1]),
            self.output,
            np.empty((2, sizes[-1])),
            np.empty(sizes[-1]),
            found,
        )
        return self.output - found

    def fitted(self, structure: Structure, prior: float) -> BayesRegressor:
        """Return the network with the counts of all rows."""
        nodes = tuple(
            Node(name=name, states=size, parents=tuple(structure[name]))
            for name, size in zip(self.nodes, self.sizes, strict=True)
        )
        state, middle = self.states[:, -1], self.output - self.output.mean()
        count = np.bincount(state, minlength=self.sizes[-1])
        means, squares = (
            np.bincount(state, middle**power, minlength=count.size) / np.maximum(count, 1) for power in (1, 2)
        )
        return BayesRegressor(
            network=BayesNetwork.learn(nodes, self.states, prior=prior),
            cuts=self.cuts[:-1],
            means=means + self.output.mean(),
            variances=np.maximum(squares - means**2, 0.0),
        )


def fit_bayes(
    columns: Floats,
    output: Floats,
    block: npt.ArrayLike,
    *,
    features: Sequence[Feature],
    structure: Mapping[str, Sequence[str]] | None = None,
    most_causes: int = MOST_CAUSES,
) -> RegressorFit:
    """Fit a discrete Bayesian network of features and output.

    Parameters
    ----------
    columns
        Shape (rows, features).
    output
        Shape (rows,).
    block
        The block of each row, shape (rows,).
    features
        What the columns are: their names tell what warms what (`causal_structure`).
    structure
        Causes by the name of what they act on, in place of what is known: names are ``str(feature)`` and ``output``.
        Where it names the causes of the output, none are chosen.
    most_causes
        Of the output, that are chosen one after the other by leaving out blocks.

    Raises
    ------
    ArgumentError
        Columns, output, block or features that do not fit, constant columns only, an unknown name, or causes that run
        in a circle.

    Notes
    -----
    Leaving out a block subtracts its counts, and its rows from the means of the output's states. Where columns and
    output are cut stays: that is chosen for all blocks together.

    Examples
    --------
    >>> warm = np.repeat(np.arange(8.0), 5)
    >>> fit = fit_bayes(warm[:, None], 2.0 * warm, np.tile(np.arange(5), 8), features=[Feature(of="temperature_t")])
    >>> fit.regressor.predict(np.array([[3.0]]))[0].round(1).tolist()
    [6.0]
    """
    rows = rows_of(columns, output, block)
    if len(features) != rows.scaled.shape[1]:
        raise ArgumentError("features", len(features), f"one for each of {rows.scaled.shape[1]} columns")
    known = with_stated(causal_structure(features), structure or {})
    names = tuple(known)
    families_of([Node(name=name, states=1, parents=known[name]) for name in names])
    effects = effects_of(OUTPUT, known)
    varies = [name for name, scale in zip(names, rows.per_unit, strict=False) if scale > 0.0 and name not in effects]
    chosen = OUTPUT in (structure or {})
    order = np.concatenate(rows.blocks)
    starts = np.cumsum([0, *(part.size for part in rows.blocks)])
    sorted_columns, sorted_output = np.asarray(columns, dtype=np.float64)[order], rows.output[order]
    tried: list[tuple[float, str, Structure, Cut, float]] = []
    for count in STATES:
        for cutting in Cutting:
            cut = _cut(names, sorted_columns, sorted_output, starts, count, cutting)
            found = known if chosen else _with_causes(cut, known, varies, most_causes)
            for figure, what, finer, prior in _priors(cut, found):
                tried.append((figure, f"{count} states of {cutting}, {what}", found, finer, prior))
    figure, what, found, cut, prior = min(tried, key=lambda one: one[0])
    left_out = np.empty(rows.output.size)
    left_out[order] = cut.left_out(found, prior)
    causes = ", ".join(found[OUTPUT]) or "nothing: no feature lowers the residual of left-out blocks"
    return RegressorFit(
        regressor=cut.fitted(found, prior),
        left_out=left_out,
        notes=(*rows.notes, f"{what.capitalize()}.", f"The output depends on {causes}."),
        tried=tuple((one[1], one[0]) for one in tried),
    )


def _cut(
    names: tuple[str, ...], columns: Floats, output: Floats, starts: Places, count: int, cutting: Cutting
) -> Cut:
    cuts = [cuts_of(column, count, cutting) for column in columns.T]
    states = [np.searchsorted(one, column) for one, column in zip(cuts, columns.T, strict=True)]
    found = Cut(
        nodes=names,
        cuts=(*cuts, np.zeros(0)),
        states=np.stack([*states, np.zeros(output.size, dtype=np.int64)], axis=1),
        output=output,
        starts=starts,
    )
    return found.with_output(OUTPUT_STATES[1])


def _with_causes(cut: Cut, known: Structure, candidates: Sequence[str], most_causes: int) -> Structure:
    """Add the cause that lowers the residual of left-out blocks most, as long as one does."""
    sizes = dict(zip(cut.nodes, cut.sizes, strict=True))
    found, causes = known, known[OUTPUT]
    best = rms(cut.left_out(found, PRIORS[1]))
    while len(causes) < most_causes:
        cells = math.prod(sizes[name] for name in causes) * max(OUTPUT_STATES)
        structures = [
            {**found, OUTPUT: (*causes, name)}
            for name in candidates
            if name not in causes and cells * sizes[name] <= MOST_CELLS
        ]
        figures = [rms(cut.left_out(one, PRIORS[1])) for one in structures]
        if not figures or min(figures) > WORTH * best:
            break
        best = min(figures)
        found = structures[figures.index(best)]
        causes = found[OUTPUT]
    return found


def _priors(cut: Cut, found: Structure) -> Iterator[tuple[float, str, Cut, float]]:
    for count in OUTPUT_STATES:
        finer = cut.with_output(count)
        for prior in PRIORS:
            yield rms(finer.left_out(found, prior)), f"{count} of the output, prior {prior:g}", finer, prior
