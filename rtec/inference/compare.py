"""A measurement against a model: how much is left, and where it is."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from rtec.dataset.dataset import Dataset
from rtec.dataset.repeats import place_numbers
from rtec.dataset.standstill import Ints
from rtec.effects import Conditions, Floats
from rtec.errors import ArgumentError
from rtec.inference.chessboard import board_of, held_out_by, held_out_residual, row_by_row
from rtec.inference.fit import fit_model, opened_model, residual_of
from rtec.inference.model import Model
from rtec.inference.noise import noise_floor
from rtec.inference.results import NoiseFloor
from rtec.inference.scored import Judge
from rtec.inference.space import Space

MOST_PLACES = 200
"""With more positions than these they are put together in bins."""
MOST_BINS = 32
FEWEST_IN_BIN = 5
SHOWN_STRETCHES = 5
AT_THE_FLOOR = 1.1
"""Held-out RMS over noise floor up to which a model leaves nothing."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Stretch:
    """Readings that belong together, such as those at one target, and what the model leaves there."""

    low: float
    high: float
    """Of the quantity, in its unit inside."""
    direction: int
    """+1 or −1 where the stretch is of one direction, else 0."""
    mean: float
    rms: float
    """Of the residual, in the observed unit inside."""
    rows: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Where:
    """How much of the residual goes with one quantity, and where that is."""

    quantity: str
    """``position``, ``direction``, ``position and direction``, ``time``, ``run``, ``velocity``, ... or a column."""
    unit: str
    share: float
    """Share of the residual's variance between stretches beyond what chance gives, 0..1."""
    worst: tuple[Stretch, ...]
    """Stretches with the largest mean residual, the largest first."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Comparison:
    """What a model leaves of a measurement."""

    dataset: Dataset
    heldout: Dataset | None
    """The measurement, and the one held out, if it is another file."""
    model: Model
    """With what it left open fitted to ``dataset``."""
    stated: tuple[bool, ...]
    """Of each of its terms, whether its numbers were given and not fitted."""
    residual: Floats
    """Observed less model, shape (rows,), in the observed unit inside."""
    rms: float
    rms_heldout: float
    """Root mean square of the residual, and of that of readings that took no part in the fit."""
    heldout_by: str
    """What was held out: a ``stretch`` or a ``block`` at a time, or the name of the other file."""
    noise: NoiseFloor
    """Noise of one reading."""
    rms_heldout_rows: float | None = None
    """The same as ``rms_heldout``, single rows held out; None without blocks, or where nothing was fitted."""
    where: tuple[Where, ...]
    """The quantities that the residual goes with, the largest share first."""

    @property
    def at_the_floor(self) -> bool:
        """Whether readings that took no part in the fit are within 10 % of the noise floor; needs repeats."""
        return self.noise.floor is not None and self.rms_heldout <= AT_THE_FLOOR * self.noise.floor


def compare(dataset: Dataset, model: Model | None = None, heldout: Dataset | None = None) -> Comparison:
    """Fit what a model leaves open, and find how much it leaves of the measurement and where.

    Parameters
    ----------
    model
        None for a perfect axis: all that is observed is left.
    heldout
        Another measurement, on which the model fitted to the first is judged. Without, each block of the first is
        judged by a fit to the others.

    Raises
    ------
    ArgumentError
        The model explains another quantity, or holds an effect that the measurement cannot show.
    """
    start = Model(observe=dataset.observe, units=dataset.units) if model is None else model
    for data in (dataset,) if heldout is None else (dataset, heldout):
        check_model(start, data)
    fitted = fit_model(dataset, start)
    judge = Judge(Space(dataset))
    residual = dataset.observed - fitted.predict(dataset)
    if heldout is None:
        rms_heldout, by = blocked_rms(dataset, start), held_out_by(dataset)
    else:
        rms_heldout, by = heldout.rms(heldout.observed - fitted.predict(heldout)), heldout.source
    return Comparison(
        dataset=dataset,
        heldout=heldout,
        model=fitted,
        stated=tuple(term.fitted for term in start.terms),
        residual=residual,
        rms=dataset.rms(residual),
        rms_heldout=rms_heldout,
        heldout_by=by,
        rms_heldout_rows=None if heldout is not None else _rms_row_by_row(dataset, start),
        noise=noise_floor(judge, judge.score(())),
        where=residual_by(dataset, residual),
    )


def blocked_rms(dataset: Dataset, model: Model) -> float:
    """Return the RMS of a model on readings that took no part in the fit of what it leaves open.

    Every fold is predicted by the model fitted to the others; a model with nothing open is simply compared.
    """
    opened = opened_model(dataset, model)
    if opened is None:
        return dataset.rms(residual_of(dataset, model))
    return dataset.rms(held_out_residual(opened.judge, opened.scored, board_of(dataset)))


def _rms_row_by_row(dataset: Dataset, model: Model) -> float | None:
    opened = opened_model(dataset, model)
    return None if opened is None else row_by_row(opened.judge, opened.scored)


def check_model(model: Model, dataset: Dataset) -> None:
    """Refuse a model that a measurement has no place for.

    Raises
    ------
    ArgumentError
        The model explains another quantity or has other units; or an effect has nothing in the data to depend on, or
        has to be fitted where the data cannot show it.
    """
    if model.observe != dataset.observe:
        allowed = f"one of {dataset.observe}, which is looked at in {dataset.source}"
        raise ArgumentError("model", f"a model of {model.observe}", allowed)
    for what in ("observed", "position"):
        unit, wanted = getattr(model.units, what), getattr(dataset.units, what)
        if unit != wanted:
            raise ArgumentError("model", f"{what} in {unit}", f"{wanted}, as {dataset.source} has it")
    for term in model.terms:
        if not term.effect.explains(dataset.observable):
            allowed = f"effects of {dataset.observe}; 'rtec effects' lists them"
            raise ArgumentError("model", f"the effect {term.name}", allowed)
        reason = term.effect.untestable(dataset.conditions)
        if reason is None:
            continue
        try:
            if term.shape is not None and term.amplitudes is not None:
                dataset.columns(term.effect, term.shape)
                continue
        except ArgumentError:
            pass
        allowed = f"effects that {dataset.source} can show"
        raise ArgumentError("model", f"the effect {term.name}", allowed, f"{term.name}: {reason}")


def residual_by(dataset: Dataset, residual: Floats) -> tuple[Where, ...]:
    """Return how much of a residual goes with each quantity of the data, the largest share first.

    The residual is of shape (rows,), in the observed unit inside. Quantities that take a single value are left out.

    Notes
    -----
    The readings are put into bins of a quantity (targets, where they repeat); the share is the adjusted coefficient
    of determination of a one-way analysis of variance, ``1 - (SSW / (n - bins)) / (SST / (n - 1))``, which is 0 on
    average for pure noise, and is shown as 0 where it is below. Positions and directions come and go with time: where
    readings repeat, time and temperatures are looked at in what differs between repeats, as a share of the whole.
    """
    c = dataset.coordinates
    changing, kept = _between_repeats(residual, dataset.cell)
    slow = {"time", "row order", "spindle speed", *c.temperatures} if dataset.has_repeats else set()
    found = []
    for quantity, unit, values, labels in _quantities(dataset, c):
        bins = int(labels.max()) + 1
        if 1 < bins < residual.size:
            left, part = (changing, kept) if quantity in slow else (residual, 1.0)
            ways = c.direction if quantity in ("position and direction", "direction") else None
            worst = _worst(left, values, labels, ways)
            found.append(Where(quantity=quantity, unit=unit, share=part * _share(left, labels), worst=worst))
    return tuple(sorted(found, key=lambda where: -where.share))


def _quantities(dataset: Dataset, c: Conditions) -> Iterator[tuple[str, str, Floats, Ints]]:
    """Yield name, unit, value and bin of each reading of each quantity."""
    place = _places(c)
    yield "time" if c.time_is_coordinate else "position", c.position_unit, c.position, place
    if c.direction is not None and c.both_directions:
        way = np.sign(c.direction).astype(np.int64) + 1
        yield "direction", "", c.direction, _compact(way)
        yield "position and direction", c.position_unit, c.position, _compact(place * 3 + way)
    if not c.time_is_coordinate:
        name = "row order" if c.time_s is None else "time"
        yield name, c.clock_unit, c.clock, _bins(c.clock)
    yield "run", "", c.run.astype(np.float64), _compact(c.run)
    for name, unit, values in (
        ("velocity", f"{c.position_unit}/s", c.velocity),
        ("acceleration", f"{c.position_unit}/s^2", c.acceleration),
        ("distance since reversal", c.position_unit, c.since_reversal),
        ("spindle speed", "rpm", c.spindle_rpm),
        *((name, "degC", heat) for name, heat in c.temperatures.items()),
        *((name, "", column) for name, column in dataset.unknown),
    ):
        if values is not None and np.isfinite(values).all():
            yield name, unit, values, _bins(values)


def _between_repeats(residual: Floats, cell: Ints) -> tuple[Floats, float]:
    """Return the residual about the means of its repeats, 0 without, and its share of the variance."""
    found = np.zeros_like(residual)
    member = cell >= 0
    total = float(np.square(residual - residual.mean()).sum())
    if not member.any() or total <= 0.0:
        return found, 0.0
    numbers = _compact(cell[member])
    mean = np.bincount(numbers, weights=residual[member]) / np.bincount(numbers)
    found[member] = residual[member] - mean[numbers]
    return found, min(1.0, float(np.square(found).sum()) / total)


def _places(c: Conditions) -> Ints:
    """Return the number of each reading's target, where targets repeat and are not too many; else of a bin."""
    return _bins(c.position) if c.places.size > min(MOST_PLACES, c.rows // 2) else place_numbers(c.position)


def _bins(values: Floats) -> Ints:
    """Return the number of the bin of equal width that each value lies in; bins without values are not counted."""
    distinct = np.unique(values)
    count = min(MOST_BINS, max(2, values.size // FEWEST_IN_BIN))
    if distinct.size <= count:
        return _compact(np.searchsorted(distinct, values))
    low, width = float(distinct[0]), float(distinct[-1] - distinct[0])
    return _compact(np.minimum((values - low) / width * count, count - 1).astype(np.int64))


def _compact(labels: Ints) -> Ints:
    return np.unique(labels, return_inverse=True)[1].astype(np.int64)


def _share(residual: Floats, labels: Ints) -> float:
    count = np.bincount(labels)
    total = float(np.square(residual - residual.mean()).sum())
    if total <= 0.0:
        return 0.0
    mean = np.bincount(labels, weights=residual) / count
    within = float(np.square(residual - mean[labels]).sum()) / (residual.size - count.size)
    return max(0.0, 1.0 - within / (total / (residual.size - 1)))


def _worst(residual: Floats, values: Floats, labels: Ints, ways: Floats | None) -> tuple[Stretch, ...]:
    count = np.bincount(labels)
    mean = np.bincount(labels, weights=residual) / count
    square = np.bincount(labels, weights=np.square(residual)) / count
    found = []
    for label in np.argsort(-np.abs(mean), kind="stable")[:SHOWN_STRETCHES]:
        rows = np.flatnonzero(labels == label)
        found.append(
            Stretch(
                low=float(values[rows].min()),
                high=float(values[rows].max()),
                direction=0 if ways is None else int(np.sign(ways[rows[0]])),
                mean=float(mean[label]),
                rms=float(np.sqrt(square[label])),
                rows=rows.size,
            )
        )
    return tuple(found)
