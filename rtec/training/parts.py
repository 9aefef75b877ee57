"""One measurement in four parts: what trains, what stops and chooses, what tells how sure, and what judges."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rtec.dataset.dataset import Dataset
from rtec.errors import ArgumentError
from rtec.predictors.binding import axis_name
from rtec.predictors.fitting.samples import Samples, together
from rtec.predictors.tables import SAME_TARGET_MM

HELD_OUT = 0.2
"""Share of the places that judge."""
SURE = 0.125
"""Share of the other places that tell how sure a predictor is."""
CHOOSING = 0.2
"""Share of what is left that stops a training."""
FEWEST_PLACES = 8


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Parts:
    """Readings by what they are for; nothing is in two parts."""

    train: Samples
    """What a predictor is fitted to."""
    choose: Samples
    """What stops a training: other readings of the same places where places were measured more than once, else other
    places."""
    sure: Samples
    """Places that show how far off a predictor is where it was not fitted."""
    heldout: Samples
    """What judges: places of which no reading was seen."""
    rows: NDArray[np.bool_]
    """Of the data set: those of ``train`` and ``choose``, shape (rows,)."""
    heldout_by: str
    """In words: ``places``, or the other file."""

    @property
    def seen(self) -> Samples:
        """Readings of ``train`` and ``choose``: all that a fit may take which needs no stopping."""
        return together([self.train, self.choose])


def samples_of(dataset: Dataset, axes: Sequence[int] | None = None) -> tuple[Samples, NDArray[np.int64]]:
    """Return the readings of a data set that have a direction, and their rows.

    Parameters
    ----------
    dataset
        The measurement.
    axes
        Other axes whose places are to be told; None: all that moved.

    Raises
    ------
    ArgumentError
        No deviation in mm over positions in mm, no direction, or no place of one of ``axes``.
    """
    units = dataset.units
    found = (dataset.observe, units.observed, units.position)
    if found != ("deviation", "mm", "mm") or dataset.coordinates.time_is_coordinate:
        over = "time" if dataset.coordinates.time_is_coordinate else f"positions in {units.position}"
        raise ArgumentError(
            dataset.source,
            f"{dataset.observe} in {units.observed} over {over}",
            "a deviation of a linear axis over its positions",
            "a predictor corrects positions",
        )
    c = dataset.coordinates
    if c.direction is None:
        raise ArgumentError(f"{dataset.source}: direction", "nothing", "a column direction, or runs to and fro")
    rows = np.flatnonzero(c.direction != 0.0)
    others = dataset.other_axes_mm
    if axes is None:
        axes = [axis for axis, x in others.items() if np.ptp(x) > SAME_TARGET_MM]
    for axis in axes:
        if axis not in others:
            raise ArgumentError(dataset.source, f"no column {axis_name(axis)}_mm", "one, as in the file that trains")
    samples = Samples(
        position_mm=c.position[rows],
        direction=np.sign(c.direction[rows]),
        error_mm=dataset.observed[rows],
        others_mm={axis: others[axis][rows] for axis in axes},
    )
    return samples, rows


def parts_of(dataset: Dataset, heldout: Dataset | None = None, *, seed: int = 0) -> Parts:
    """Return a measurement in its parts, drawn with a seed.

    The first and the last place always train: a predictor holds its ends.

    Parameters
    ----------
    dataset
        The measurement.
    heldout
        Another one that judges; else a fifth of the places of the first.
    seed
        Draws the places.

    Raises
    ------
    ArgumentError
        As for ``samples_of``, or too few places.
    """
    samples, rows = samples_of(dataset)
    place = samples.place()
    places = int(place.max()) + 1
    if places < FEWEST_PLACES:
        allowed = f"{FEWEST_PLACES} or more, as some train and some judge"
        raise ArgumentError(dataset.source, f"{places} targets", allowed, "measure at more targets")
    rng = np.random.default_rng(seed)
    inner = rng.permutation(np.arange(1, places - 1))
    judging = 0 if heldout is not None else max(1, round(HELD_OUT * places))
    telling = max(1, round(SURE * (places - judging)))
    judges, sure = np.isin(place, inner[:judging]), np.isin(place, inner[judging : judging + telling])
    chooses = _choosing(samples, place, judges | sure, inner[judging + telling :], rng)
    kept = np.zeros(dataset.rows, dtype=np.bool_)
    kept[rows[~(judges | sure)]] = True
    other = samples.take(judges) if heldout is None else samples_of(heldout, list(samples.others_mm))[0]
    return Parts(
        train=samples.take(~(judges | sure | chooses)),
        choose=samples.take(chooses),
        sure=samples.take(sure),
        heldout=other,
        rows=kept,
        heldout_by="places" if heldout is None else heldout.source,
    )


def _choosing(
    samples: Samples,
    place: NDArray[np.int64],
    away: NDArray[np.bool_],
    inner: NDArray[np.int64],
    rng: np.random.Generator,
) -> NDArray[np.bool_]:
    """Return which readings stop and choose: some of each place with others left there, else whole places."""
    cell = 2 * place + (samples.direction < 0.0)
    order = rng.permutation(samples.rows)
    order = order[~away[order]]
    first = np.zeros(samples.rows, dtype=np.bool_)  # one reading of each place and direction always trains
    first[order[np.unique(cell[order], return_index=True)[1]]] = True
    free = order[~first[order]]
    wanted = round(CHOOSING * order.size)
    found = np.zeros(samples.rows, dtype=np.bool_)
    if 2 * free.size >= wanted:
        found[free[:wanted]] = True
        return found
    return np.isin(place, inner[: max(1, round(CHOOSING * inner.size))])
