"""Which parameter makes a result vary: Sobol indices of the numbers in the records of a plan."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rtec.verify.campaign.job import Value
from rtec.verify.campaign.plan import Plan
from rtec.verify.campaign.store import Done

_RESAMPLES = 999


@dataclass(frozen=True, slots=True, kw_only=True)
class SobolIndex:
    """The share of the variance of a result that comes from a parameter."""

    where: Mapping[str, Value]
    """The combination of the grid: its parameters that have several values."""
    of: str
    """The result: a number of the records."""
    parameter: str
    first: float
    first_95: tuple[float, float] | None
    """Share that the parameter makes alone, with its bootstrap interval of 95 %; None where the runs give none."""
    total: float
    total_95: tuple[float, float] | None
    """Share that it has a part in, alone and with others."""

    def to_dict(self) -> dict[str, object]:
        """Return plain data under stable names."""
        return {
            **self.where, "of": self.of, "parameter": self.parameter, "first": self.first, "first_95": self.first_95,
            "total": self.total, "total_95": self.total_95,
        }  # fmt: skip


def sensitivity(plan: Plan, records: Iterable[Done]) -> Iterator[SobolIndex]:
    """Yield first-order and total Sobol indices of every number in the records.

    Parameters
    ----------
    plan
        Whose parameters are drawn with ``draw = "sobol"``.
    records
        Of its jobs. A combination in which one has no record, or a number that is not in all records, has no indices.

    References
    ----------
    A. Saltelli et al., Variance based sensitivity analysis of model output, Computer Physics Communications 181
    (2010) 259: the estimators that `scipy.stats.sobol_indices` uses.
    """
    several = [name for name, values in plan.grid.items() if len(values) > 1]
    groups: dict[tuple[Value, ...], dict[int, Done]] = {}
    for done in records:
        groups.setdefault(tuple(done.job.parameters[name] for name in several), {})[done.job.run] = done
    for values, by_run in groups.items():
        if len(by_run) < plan.repeats:
            continue
        rows = [by_run[run].record for run in range(plan.repeats)]
        for name in rows[0]:
            numbers = [row.get(name) for row in rows]
            if not all(isinstance(number, int | float) for number in numbers):
                continue
            results = np.array(numbers, float)
            if np.ptp(results) > 0.0:
                yield from _indices(plan, dict(zip(several, values, strict=True)), name, results)


def _indices(plan: Plan, where: dict[str, Value], of: str, results: NDArray[np.float64]) -> Iterator[SobolIndex]:
    from scipy.stats import sobol_indices  # noqa: PLC0415 - half a second, and few plans ask for it

    first, second, *mixed = np.split(results, len(plan.sobol) + 2)
    sampled = {"f_A": first[None], "f_B": second[None], "f_AB": np.array(mixed)[:, None]}
    found: Any = sobol_indices(func=sampled, n=plan.runs, random_state=np.random.default_rng(plan.seed))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # few runs make the difference: the interval is None
        spread = found.bootstrap(confidence_level=0.95, n_resamples=_RESAMPLES)
    for k, parameter in enumerate(plan.sobol):
        yield SobolIndex(
            where=where,
            of=of,
            parameter=parameter,
            first=float(found.first_order.flat[k]),
            first_95=_interval(spread.first_order.confidence_interval, k),
            total=float(found.total_order.flat[k]),
            total_95=_interval(spread.total_order.confidence_interval, k),
        )


def _interval(interval: Any, k: int) -> tuple[float, float] | None:
    low, high = float(interval.low.flat[k]), float(interval.high.flat[k])
    return (low, high) if np.isfinite([low, high]).all() else None
