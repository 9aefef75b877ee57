"""Fuzzy networks: rules where rows cluster, consequents by ridge regression, sizes chosen by leaving out blocks."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rtec.errors import ArgumentError
from rtec.predictors._columns import Floats
from rtec.predictors.fitting.warm.linear import Directions, LeftOut
from rtec.predictors.fitting.warm.rows import Rows, rms, rows_of
from rtec.predictors.warm.fuzzy import Conjunction, Fuzzy, parts_of
from rtec.predictors.warm.regressor import RegressorFit

COMPONENTS = (1, 2, 3, 5)
"""Numbers of principal components that are tried."""
RULES = (2, 3, 5, 8)
"""Numbers of rules that are tried."""
OVERLAPS = (0.5, 1.0, 2.0)
"""Widths of a rule that are tried, in units of the distance to the nearest other rule."""
SHARES = tuple(np.geomspace(1e-6, 1e2, 9).tolist())
"""Ridge parameters of the consequents that are tried, for each row."""
ROUNDS = 100
"""After which a clustering has settled or is taken as it is."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Net:
    """Rules over components, and the regression of their consequents."""

    axes: Floats
    """Of scaled columns."""
    rules: Floats
    widths: Floats
    conjunction: Conjunction
    mean: Floats
    """Of the table's columns."""
    found: Directions
    out: LeftOut

    @classmethod
    def of(cls, rows: Rows, axes: Floats, rules: Floats, overlap: float, conjunction: Conjunction) -> _Net | None:
        """Return the network, or nothing where rows lie outside all rules."""
        level = rows.scaled @ axes.T
        apart = np.sqrt(np.square(rules[:, None] - rules).sum(axis=2))
        np.fill_diagonal(apart, np.inf)
        widths = np.repeat(overlap * apart.min(axis=1)[:, None], len(axes), axis=1)
        table = np.hstack([level, parts_of(level, rules, widths, conjunction)])
        if not np.isfinite(table).all():
            return None
        mean = table.mean(axis=0)
        found = Directions.of(dataclasses.replace(rows, scaled=table - mean))
        return cls(
            axes=axes,
            rules=rules,
            widths=widths,
            conjunction=conjunction,
            mean=mean,
            found=found,
            out=LeftOut.of(found.basis, rows.output, rows),
        )

    def __str__(self) -> str:
        rules, components = self.rules.shape
        return f"{components} component{'s' * (components > 1)}, {rules} rules, {self.conjunction}"

    def errors(self, share: float) -> Floats:
        """Return the residuals of left-out rows."""
        return self.out.errors(self._penalty(share))

    def _penalty(self, share: float) -> Floats:
        return self.found.penalty(share * self.found.rows.output.size)

    def fitted(self, share: float, errors: Floats) -> Fuzzy:
        """Return the network for columns in their own units."""
        rows, ridge = self.found.rows, share * self.found.rows.output.size
        noise = rms(errors / np.sqrt(self.out.variances(self._penalty(share))))
        slopes, spread = self.found.slopes(ridge), noise * self.found.spread(ridge)
        return Fuzzy(
            centre=rows.centre,
            axes=self.axes * rows.per_unit,
            rules=self.rules,
            widths=self.widths,
            consequents=self._by_rule(slopes[None], rows.output.mean() - self.mean @ slopes)[0],
            conjunction=self.conjunction,
            noise_sd=noise * float(np.sqrt(1.0 + 1.0 / rows.output.size)),
            spread=self._by_rule(spread, -spread @ self.mean).reshape(len(spread), -1),
        )

    def _by_rule(self, slopes: Floats, constant: Floats) -> Floats:
        """Return slopes of the table as those of rules alone, shape (sets, rules, 1 + components).

        The shares of all rules add up to 1: what is common to all goes into each.
        """
        rules, components = self.rules.shape
        found = slopes[:, components:].reshape(len(slopes), rules, components + 1).copy()
        found[:, :, 0] += np.reshape(constant, (-1, 1))
        found[:, :, 1:] += slopes[:, None, :components]
        return found


def fit_fuzzy(
    columns: Floats,
    output: Floats,
    block: npt.ArrayLike,
    *,
    components: Sequence[int] = COMPONENTS,
    rules: Sequence[int] = RULES,
    overlaps: Sequence[float] = OVERLAPS,
    conjunctions: Sequence[Conjunction] = tuple(Conjunction),
    shares: Sequence[float] = SHARES,
    seed: int = 0,
) -> RegressorFit:
    """Fit a fuzzy network; its components, rules, widths and conjunction are chosen by leaving out blocks.

    Parameters
    ----------
    columns
        Shape (rows, features); each is scaled to a standard deviation of 1.
    output
        Shape (rows,).
    block
        The block of each row, shape (rows,).
    components, rules, overlaps, conjunctions, shares
        What is tried: numbers of principal components and of rules, widths in units of the distance to the nearest
        other rule, the kind of conjunction, and ridge parameters of the consequents for each row.
    seed
        Of the clustering.

    Raises
    ------
    ArgumentError
        Shapes that do not fit, a value that is not finite, fewer than two blocks, constant columns only, nothing to
        try, or rows that lie outside all rules whatever is tried.

    Notes
    -----
    Consequents are ``common + deviation of the rule``, and both are kept small: a rule without rows says what all
    rows say. Components and rules come from the columns of all rows, without their output; the consequents are
    fitted anew without each block.

    Examples
    --------
    >>> x = np.linspace(-2.0, 2.0, 60)[:, None]
    >>> fit = fit_fuzzy(x, np.abs(x[:, 0]), np.arange(60) // 5)
    >>> bool(np.abs(fit.left_out).max() < 0.2)
    True
    """
    for name, values in (("components", components), ("rules", rules), ("overlaps", overlaps), ("shares", shares)):
        if not len(values) or not all(0 < value < np.inf for value in values):
            raise ArgumentError(name, f"{tuple(values)}"[:60], "numbers above 0")
    if not min(rules) > 1:
        raise ArgumentError("rules", min(rules), "2 rules or more")
    rows = rows_of(columns, output, block)
    tried: list[tuple[str, float]] = []
    best: tuple[float, _Net, float, float] | None = None
    for net, overlap in _nets(rows, components, rules, overlaps, conjunctions, seed):
        figures = [rms(net.errors(share)) for share in shares]
        least = int(np.argmin(figures))
        tried.append((f"{net}, overlap {overlap:g}, ridge {shares[least]:.3g}", figures[least]))
        if best is None or figures[least] < best[0]:
            best = figures[least], net, overlap, shares[least]
    if best is None:
        raise ArgumentError("overlaps", f"{tuple(overlaps)}"[:60], "wider ones: rows lie outside all rules")
    _, net, overlap, share = best
    errors = net.errors(share)
    note = f"{net}, overlap {overlap:g}, ridge parameter {share:.3g} for each row."
    return RegressorFit(
        regressor=net.fitted(share, errors),
        left_out=errors,
        notes=(*rows.notes, note),
        tried=tuple(tried),
    )


def _nets(
    rows: Rows,
    components: Sequence[int],
    rules: Sequence[int],
    overlaps: Sequence[float],
    conjunctions: Sequence[Conjunction],
    seed: int,
) -> Iterator[tuple[_Net, float]]:
    """Yield what can be made of the rows, with its overlap."""
    _, sizes, turns = np.linalg.svd(rows.scaled, full_matrices=False)
    most = int(np.count_nonzero(sizes > 1e-6 * sizes[0]))
    axes = turns / np.where(sizes > 0.0, sizes, 1.0)[:, None] * np.sqrt(rows.output.size)
    for count in sorted({min(count, most) for count in components}):
        level = rows.scaled @ axes[:count].T
        for centres in (_clusters(level, number, seed) for number in rules):
            if len(centres) > 1:
                # with one component product and minimum are the same
                kinds = conjunctions if count > 1 else conjunctions[:1]
                for overlap, kind in itertools.product(overlaps, kinds):
                    net = _Net.of(rows, axes[:count], centres, overlap, kind)
                    if net is not None:
                        yield net, overlap


def _clusters(points: Floats, count: int, seed: int) -> Floats:
    """Return the centres of clusters by k-means, drawn apart as in k-means++; fewer where points repeat."""
    draw = np.random.default_rng(seed)
    centres = points[draw.integers(len(points))][None]
    nearest = np.square(points - centres[0]).sum(axis=1)
    while len(centres) < count and nearest.max() > 0.0:
        centres = np.vstack([centres, points[draw.choice(len(points), p=nearest / nearest.sum())]])
        nearest = np.minimum(nearest, np.square(points - centres[-1]).sum(axis=1))
    which = np.full(len(points), -1)
    for _ in range(ROUNDS):
        before = which
        which = np.square(points[:, None] - centres).sum(axis=2).argmin(axis=1)
        centres = np.array([points[which == i].mean(axis=0) for i in range(len(centres)) if (which == i).any()])
        if np.array_equal(which, before):
            break
    found: Floats = centres
    return found
