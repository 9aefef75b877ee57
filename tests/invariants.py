"""What holds of every diagnosis, whatever was measured: checks that return in words what a file breaks.

They share no statistics with the search: trends of a residual are looked for with numpy and scipy alone.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from rtec.dataset.dataset import Dataset
from rtec.dataset.load import load_dataset
from rtec.effects import LIBRARY
from rtec.errors import ArgumentError, RtecError
from rtec.inference.compare import compare
from rtec.inference.diagnose import add, diagnose
from rtec.inference.model import Model
from rtec.inference.results import Diagnosis, Verdict

SURE = 0.01
"""Adjusted probability below which a step of ``rtec add`` counts."""
MORE = 1.05
"""RMS of a diagnosis over that which effects added one after another leave, at most."""
DEGREE, MATERIAL, BY_CHANCE = 3, 0.1, 1e-4
"""Of curves beside a residual; the share of its square, and the probability, from which on they are a trend."""
ROUNDING = 1e-9
SAME = 1e-4
"""Share by which RMS may differ where only units, signs or the order of rows do: refined shapes differ a little."""
SIGNED = (
    "target",
    "actual",
    "command",
    "deviation",
    "direction",
    "velocity",
    "force",
    "current",
    "torque",
    "voltage",
)
OTHER_UNITS = {
    "um": ("mm", 1e-3),
    "mm": ("inch", 1.0 / 25.4),
    "arcsec": ("deg", 1.0 / 3600.0),
    "m": ("mm", 1e3),
    "inch": ("mm", 25.4),
}
LENGTHS = ("target", "actual", "command", "deviation")


@dataclass(frozen=True, slots=True)
class Table:
    """A measurement file as text: its lines of facts, and its columns by heading."""

    facts: tuple[str, ...]
    columns: Mapping[str, tuple[str, ...]]

    @classmethod
    def of(cls, text: str) -> Table:
        """Return the table of a file with commas."""
        lines = [line for line in text.splitlines() if line.strip()]
        facts = tuple(line for line in lines if line.startswith("#"))
        names, *rows = [line.split(",") for line in lines if not line.startswith("#")]
        return cls(facts, dict(zip(names, zip(*rows, strict=True), strict=True)))

    @property
    def rows(self) -> int:
        """Number of rows."""
        return len(next(iter(self.columns.values())))

    def numbers(self, name: str) -> NDArray[np.float64]:
        """Return a column, shape (rows,)."""
        return np.array(self.columns[name], dtype=np.float64)

    def take(self, order: NDArray[np.int64]) -> Table:
        """Return the rows in another order."""
        return replace(self, columns={name: tuple(c[k] for k in order) for name, c in self.columns.items()})

    def place(self) -> str | None:
        """Return the heading of the position."""
        return next((name for name in self.columns if name.split("_")[0] in ("target", "actual", "command")), None)

    def write(self, path: Path) -> Path:
        """Write the file; return where it is."""
        rows = map(",".join, zip(*self.columns.values(), strict=True))
        path.write_text("\n".join([*self.facts, ",".join(self.columns), *rows]) + "\n", encoding="utf-8")
        return path


# the same measurement, told in another way


def with_columns(table: Table, seed: int = 0) -> Iterator[tuple[str, Table]]:
    """Yield the file with columns more that explain nothing."""
    rng = np.random.default_rng([seed, 3])
    more = {
        "random": rng.normal(size=table.rows),
        "constant": np.full(table.rows, 7.5),
        "counter": np.arange(1.0, table.rows + 1.0),
    }
    if (name := table.place()) is not None:
        place = table.numbers(name)
        more["copy"] = place + rng.normal(0.0, 0.01 * float(np.ptp(place)), table.rows)
    columns = {f"{name}_value": _written(values) for name, values in more.items()}
    yield "more columns", replace(table, columns={**table.columns, **columns})


def in_other_units(table: Table) -> Iterator[tuple[str, Table]]:
    """Yield the file with its lengths or angles in other units."""
    found = {}
    for name, column in table.columns.items():
        quantity, _, unit = name.partition("_")
        if quantity in LENGTHS and unit in OTHER_UNITS:
            other, factor = OTHER_UNITS[unit]
            found[f"{quantity}_{other}"] = _written(table.numbers(name) * factor)
        else:
            found[name] = column
    if set(found) != set(table.columns):
        yield "other units", replace(table, columns=found)


def reversed_axis(table: Table) -> Iterator[tuple[str, Table]]:
    """Yield the file of the same axis with its positive direction the other way."""
    signed = [name for name in table.columns if name.split("_")[0] in SIGNED]
    if table.place() in signed:
        turned = {name: tuple(map(_negative, table.columns[name])) for name in signed}
        yield "the axis reversed", replace(table, columns={**table.columns, **turned})


def in_other_orders(table: Table, seed: int = 0) -> Iterator[tuple[str, Table]]:
    """Yield the file of several runs with its rows in other orders, where its clock says in which they were taken.

    Of a single run a clock that goes back is an error.
    """
    clock = next((name for name in table.columns if name.split("_")[0] == "time"), None)
    if clock is None or len(set(table.columns.get("run", ()))) < 2 or len(set(table.columns[clock])) < table.rows:
        return
    if np.any(np.diff(table.numbers(clock)) < 0.0):
        return
    yield "rows shuffled", table.take(np.random.default_rng([seed, 4]).permutation(table.rows))
    if (place := table.place()) is not None:
        yield "rows sorted by place", table.take(np.argsort(table.numbers(place), kind="stable"))


def _written(values: NDArray[np.float64]) -> tuple[str, ...]:
    return tuple(f"{value:.12g}" for value in values)


def _negative(number: str) -> str:
    return number[1:] if number.startswith("-") else f"-{number}"


TELLINGS: dict[str, Callable[[Table], Iterator[tuple[str, Table]]]] = {
    "columns": with_columns,
    "units": in_other_units,
    "reversed": reversed_axis,
    "orders": in_other_orders,
}


def said(result: Diagnosis) -> tuple[str, list[str]]:
    """Return verdict and names."""
    return result.verdict.value, sorted(result.effects)


def differs(first: Diagnosis, told: str, path: Path) -> Iterator[str]:
    """Yield what a diagnosis of the same measurement, told in another way, says otherwise."""
    try:
        second = diagnose(load_dataset(path))
    except RtecError as error:
        yield f"{told}: refused, {error}"
        return
    if said(first) != said(second):
        yield f"{told}: {said(first)} becomes {said(second)}"
    elif not math.isclose(first.rms_after, second.rms_after, rel_tol=SAME, abs_tol=1e-12):
        yield f"{told}: {first.rms_after:.4g} left becomes {second.rms_after:.4g}"


# one diagnosis


def rises(result: Diagnosis) -> Iterator[str]:
    """Yield the accepted steps that raise what is left, or what is left of readings held out."""
    names = [step.effect for step in result.steps]
    for what, values in (
        ("rms_train", [result.rms_before, *(step.rms_train for step in result.steps)]),
        ("rms_heldout", [result.rms_heldout_before, *(step.rms_heldout for step in result.steps)]),
    ):
        for name, (before, after) in zip(names, pairwise(values), strict=True):
            if after > before * (1.0 + ROUNDING):
                yield f"{name} raises {what} from {before:.4g} to {after:.4g}"


def trends(result: Diagnosis) -> Iterator[str]:
    """Yield the trends of what a model that is NAMED leaves: over position, time, order, direction and run.

    Least squares with cubics (each direction its own), straight lines in each run and means of runs, against what
    their neighbours do not tell: residual and curves lose the correlation with the reading before first.
    """
    if result.verdict is not Verdict.NAMED:
        return
    data, c = result.dataset, result.dataset.coordinates
    left = data.observed - result.model.predict(data)
    if float(left @ left) <= ROUNDING**2 * float(data.observed @ data.observed):
        return
    curves = {"order": _curve(np.arange(data.rows, dtype=np.float64))}
    if c.time_s is not None:
        curves["time"] = _curve(c.time_s)
    if not c.time_is_coordinate:
        curves["position"] = _curve(c.position)
        if c.direction is not None:
            way = np.sign(c.direction)[:, None]
            curves["direction"] = np.hstack([way, way * _curve(c.position)])
    curves["run"] = (c.run[:, None] == np.unique(c.run)[1:]).astype(np.float64)
    for name, table in curves.items():
        share, p = _explained(left, table, c.run)
        if share > MATERIAL and p < BY_CHANCE:
            yield f"NAMED, and {share:.0%} of the residual follows {name} (p {p:.1g})"


def _curve(values: NDArray[np.float64]) -> NDArray[np.float64]:
    reach = float(np.ptp(values)) or 1.0
    return np.polynomial.legendre.legvander(2.0 * (values - values.min()) / reach - 1.0, DEGREE)[:, 1:]


def _explained(left: NDArray[np.float64], table: NDArray[np.float64], run: NDArray[np.int64]) -> tuple[float, float]:
    """Return the share of a residual that columns explain, adjusted, and the probability of Fisher's F test."""
    whole = left - left.mean()
    follows = run[1:] == run[:-1]
    rho = min(max(float((whole[1:] * whole[:-1])[follows].sum() / (whole @ whole)), 0.0), 0.95)
    before = np.where(np.append(False, follows), rho, 0.0)[:, None]
    both = np.column_stack([np.ones(left.size), table, left])
    both = both - before * np.roll(both, 1, axis=0)
    base, full, y = both[:, :1], both[:, :-1], both[:, -1]
    none, some = (float(np.sum((y - x @ np.linalg.lstsq(x, y, rcond=None)[0]) ** 2)) for x in (base, full))
    k = int(np.linalg.matrix_rank(full)) - 1
    below = left.size - 1 - k
    if k < 1 or below < 3 or none <= 0.0:
        return 0.0, 1.0
    f = (none - some) / k / (some / below)
    return 1.0 - some / below / (none / (left.size - 1)), float(stats.f.sf(f, k, below))


def floors(data: Dataset, result: Diagnosis) -> Iterator[str]:
    """Yield commands that print another noise floor of the same measurement than its diagnosis."""
    first = result.noise.floor
    others = {"compare": compare(data).noise.floor}
    name = next(
        (e.name for e in LIBRARY if e.observable is data.observable and not e.untestable(data.conditions)), None
    )
    if name is not None:
        others[f"add {name}"] = add(name, data).noise.floor
    for command, other in others.items():
        if (first is None) != (other is None) or (first is not None and not math.isclose(first, other, rel_tol=1e-6)):
            yield f"{command} prints a noise floor of {other}, diagnose {first}"


def chain(data: Dataset, most: int = 6) -> Iterator[tuple[str, Diagnosis]]:
    """Add the effect that lowers the error held out most, again and again as long as it is significant.

    Yields
    ------
    tuple
        Each effect, and what ``rtec add`` says of the model with it.
    """
    model, held = None, math.inf
    for _ in range(most):
        best: tuple[str, Diagnosis] | None = None
        for effect in LIBRARY:
            if effect.observable is not data.observable or effect.untestable(data.conditions) is not None:
                continue
            try:
                found = add(effect.name, data, model)
            except ArgumentError:  # the model holds it
                continue
            if found.steps[-1].p_adjusted < SURE and found.rms_heldout < min(held, found.rms_heldout_before):
                best, held = (effect.name, found), found.rms_heldout
        if best is None:
            return
        yield best
        model = _open(best[1].model)


def _open(model: Model) -> Model:
    """Return a model whose shapes stay and whose amplitudes are fitted anew."""
    return model.with_terms([replace(term, amplitudes=None, errors=None) for term in model.terms], datum=0.0)


def misses(data: Dataset, result: Diagnosis) -> Iterator[str]:
    """Yield that a chain of additions leaves materially less than a diagnosis that does not tell its effects.

    Of the readings and of those held out: many nodes of a map leave less of the readings by following their noise.
    """
    added = list(chain(data))
    if not added:
        return
    names, last = [name for name, _ in added], added[-1][1]
    if result.rms_after <= MORE * last.rms_after or result.rms_heldout <= MORE * last.rms_heldout:
        return
    listed = {one for c in result.candidates for one in (c.effect, *c.tied_with)}
    if result.verdict not in (Verdict.TIED, Verdict.UNKNOWN) or not set(names) <= listed | set(result.effects):
        yield f"{said(result)} leaves {result.rms_after:.4g}; {' + '.join(names)} {last.rms_after:.4g}"
