"""A data set in whitened space: columns, backgrounds, scans, and the evidence for what they explain."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TypeAlias

import numpy as np

from rtec.dataset.dataset import Dataset
from rtec.effects import LIBRARY, Effect, Floats, Observable, Shape
from rtec.effects._periodic import Periodic
from rtec.inference import tails
from rtec.inference.noise import Noise
from rtec.inference.repeat_space import equal_runs, run_starts
from rtec.inference.score import INDEPENDENT, Background, background, gain_of_block, gains
from rtec.inference.whitening import Correlation

Choice: TypeAlias = tuple[Effect, Shape]
"""An effect with its shape."""

WORTH_ADDING = 0.02
"""Share of the residual sum of squares that each amplitude has to explain where no repeats say what noise is."""
NODES_WITHOUT_REPEATS = 8
_KEEP_BYTES = 300_000_000
ALIAS_COST = 2
"""In parameters, of a wave that the mean spacing of the targets does not resolve, but their irregularity may."""
WAVES_APART = 0.01
"""Waves that are nearly constant at the places measured, or nearly alike there, explain nothing: their amplitudes
would grow beyond the data and cancel."""
_KEPT_SHAPES = 200
_KEPT_BACKGROUNDS = 8
_AT_ONCE_BYTES = 60_000_000


@dataclass(frozen=True, slots=True, kw_only=True)
class Candidacy:
    """What one effect would explain beside a model."""

    effect: Effect
    shape: Shape
    gain: float
    """Fall of the whitened residual sum of squares."""
    amplitudes: int
    """Independent ones."""
    evidence: float
    """Of the effect against none: fall in units of the noise, less what its parameters cost (BIC, doubled)."""
    before: float
    """Whitened residual sum of squares without it."""


class Workspace:
    """One data set, whitened by one noise.

    Where there are no repeats the noise comes from a residual that holds what the model lacks, and smooth effects
    that are missing look like correlated noise. Then nothing is whitened (ordinary least squares), and a fall is
    judged relative to what is left; tests of a finished model are made by its ``strict`` counterpart, which whitens.
    ``quick`` takes waves of a decimated log at its rows instead of passing every sample through the filter.
    """

    def __init__(self, dataset: Dataset, noise: Noise, *, quick: bool = False, ordinary: bool | None = None) -> None:
        self.dataset, self.noise, self.quick = dataset, noise, quick
        self._at_rows = (
            replace(dataset, conditions=dataset.coordinates, resample=None)
            if dataset.resample is not None
            else dataset
        )
        self.conditions = dataset.conditions
        self.starts = run_starts(dataset.coordinates.run)
        self.ordinary = not noise.from_repeats if ordinary is None else ordinary
        if not noise.from_repeats:
            self.starts = np.arange(dataset.rows) == 0
        self._correlation = Correlation() if self.ordinary else noise.correlation
        self.observed = self.whitened(dataset.observed[None, :])[0]
        self.constant = self.whitened(np.ones((1, dataset.rows)))
        self.has_datum = dataset.observable is Observable.DEVIATION
        runs = equal_runs(dataset) if noise.from_repeats else None
        self._runs = 1 if runs is None or not self._same_in_each_run(*runs) else runs[0]
        self._first = None if self._runs == 1 else dataset.take(np.arange(dataset.rows // self._runs))
        self._columns: dict[tuple[str, Shape], Floats] = {}
        self._backgrounds: dict[tuple[tuple[tuple[str, Shape], ...], bool], Background] = {}
        self._scans: dict[str, tuple[Sequence[Shape], Floats | None]] = {}
        self._kept = 0
        self.reasons = {e.name: e.untestable(self.conditions) for e in LIBRARY if e.observable is dataset.observable}
        self.library = tuple(e for e in LIBRARY if self.reasons.get(e.name, "") is None and not e.never_ranked)
        self.most: dict[str, int] = {}
        """How many of a kind a search may take, where that is less than usual."""
        self.cost = float(np.log(max(dataset.rows, 3)))

    @cached_property
    def strict(self) -> Workspace:
        """The same data, whitened: for tests of a finished model."""
        return Workspace(self.dataset, self.noise, quick=self.quick, ordinary=False) if self.ordinary else self

    @cached_property
    def likely(self) -> tuple[tuple[float, Workspace], ...]:
        """The same data, whitened by each noise that a few repeats leave possible, with its share; else itself."""
        if self.ordinary or not self.noise.likely:
            return ((1.0, self),)
        return tuple((share, Workspace(self.dataset, noise, quick=self.quick)) for share, noise in self.noise.likely)

    @cached_property
    def mean_run(self) -> Workspace | None:
        """The mean of equal runs, which holds all that repeatable effects can explain; None where runs differ."""
        if self._first is None:
            return None
        mean = self.dataset.observed.reshape(self._runs, -1).mean(axis=0)
        alone = replace(self._first, observed=mean, cell=np.full(mean.size, -1, dtype=np.int64))
        noise = replace(self.noise, sigma=self.noise.sigma / float(np.sqrt(self._runs)), likely=())
        found = Workspace(alone, noise, quick=self.quick, ordinary=self.ordinary)
        found.library = tuple(effect for effect in self.library if not effect.in_time)
        found.cost = self.cost
        return found

    def _same_in_each_run(self, runs: int, slots: int) -> bool:
        """Return whether everything but time and temperature is the same in each run."""
        c = self.conditions
        for column in (c.position, c.direction, c.velocity, c.acceleration, c.since_reversal):
            if column is not None:
                table = column.reshape(runs, slots)
                if np.abs(table - table[0]).max() > 1e-9 * (np.abs(table).max() or 1.0):
                    return False
        return True

    def whitened(self, columns: Floats) -> Floats:
        """Return columns, shape (columns, rows), in whitened space."""
        return self._correlation.whitened(columns, self.starts)

    def whitened_part(self, columns: Floats) -> Floats:
        """Return columns of the first rows only, shape (columns, first rows), in whitened space."""
        return self._correlation.whitened(columns, self.starts[: columns.shape[1]])

    def columns(self, effect: Effect, shape: Shape) -> Floats:
        """Return an effect's whitened columns, shape (amplitudes, rows)."""
        key = effect.name, shape
        if key not in self._columns:
            if len(self._columns) >= _KEPT_SHAPES:
                self._columns.clear()
            raw = self._rows_for(effect, scan=False).columns(effect, shape)
            self._columns[key] = self.whitened(np.ascontiguousarray(raw.T))
        return self._columns[key]

    def background(self, choices: Sequence[Choice], *, datum: bool | None = None) -> Background:
        """Return the background of a model; with the constant of the readings unless ``datum`` is False."""
        datum = self.has_datum if datum is None else datum
        key = tuple((effect.name, shape) for effect, shape in choices), datum
        if key not in self._backgrounds:
            parts = [self.columns(effect, shape) for effect, shape in choices]
            if datum:
                parts.append(self.constant)
            if len(self._backgrounds) >= _KEPT_BACKGROUNDS:
                del self._backgrounds[next(iter(self._backgrounds))]  # the oldest
            table = np.vstack(parts) if parts else np.empty((0, self.dataset.rows))
            self._backgrounds[key] = background(table, self.observed)
        return self._backgrounds[key]

    def beside(self, choices: Sequence[Choice], effect: Effect) -> Background:
        """Return the background for judging ``effect``: the constant is no background for a constant."""
        return self.background(choices, datum=False if effect.name == "offset" else None)

    def scan(self, effect: Effect) -> Iterator[tuple[Sequence[Shape], Floats, int]]:
        """Yield stretches of the scan grid: shapes, whitened columns (shapes, amplitudes, rows), and copies.

        ``copies`` is the number of equal runs that the rows stand for.
        """
        folded = self._first is not None and not effect.in_time
        if effect.name in self._scans:
            shapes, kept = self._scans[effect.name]
            if kept is not None:
                yield shapes, kept, self._runs if folded else 1
                return
        else:
            shapes = effect.shapes(self.conditions)
            self._scans[effect.name] = shapes, None
        data = self._first if folded and self._first is not None else self._rows_for(effect, scan=True)
        bytes_each = 8 * data.rows * 2
        at_once = max(1, _AT_ONCE_BYTES // bytes_each)
        keep = bytes_each * len(shapes) + self._kept <= _KEEP_BYTES
        if keep:
            at_once = len(shapes)
        for begin in range(0, len(shapes), at_once):
            part = shapes[begin : begin + at_once]
            raw = data.scan(effect, part)
            m, q, n = raw.shape
            white = self.whitened_part(raw.reshape(m * q, n)).reshape(m, q, n)
            if keep:
                self._scans[effect.name] = shapes, white
                self._kept += white.nbytes
            yield part, white, self._runs if folded else 1

    def _rows_for(self, effect: Effect, *, scan: bool) -> Dataset:
        """Return the data on which an effect's columns are computed.

        A wave slower than the decimation's limit passes it unchanged, so a scan takes it at the rows, which costs a
        tenth; what the scan finds is judged by exact columns, unless everything is to be quick.
        """
        return self._at_rows if (scan or self.quick) and isinstance(effect, Periodic) else self.dataset

    def best_of_scan(
        self, effect: Effect, back: Background, fits: Callable[[Shape], bool] = lambda shape: True
    ) -> Candidacy | None:
        """Return the best shape of an effect's scan grid beside a background; of a map, among the shapes that fit."""
        if is_map(effect):
            found = [self.judge(effect, shape, back) for shape in self.maps(effect) if fits(shape)]
            return max(found, key=lambda c: c.evidence, default=None)
        best: tuple[float, Shape, int] | None = None
        for shapes, columns, copies in self.scan(effect):
            own = back if copies == 1 else back.folded(copies)
            apart = WAVES_APART if isinstance(effect, Periodic) else INDEPENDENT
            fall = gains(columns, own, copies=copies, not_negative=effect.not_negative, independent=apart)
            k = int(np.argmax(fall))
            if best is None or fall[k] > best[0]:
                best = float(fall[k]), shapes[k], columns.shape[1]
        return None if best is None else self._candidacy(effect, best[1], best[0], best[2], back.rss)

    def maps(self, effect: Effect) -> Sequence[Shape]:
        """Return the shapes of a map to try: without repeats few nodes, for many fit anything."""
        shapes = effect.shapes(self.conditions)
        if self.noise.from_repeats:
            return shapes
        return [shape for shape in shapes if len(getattr(shape, "nodes", ())) <= NODES_WITHOUT_REPEATS]

    def judge(self, effect: Effect, shape: Shape, back: Background) -> Candidacy:
        """Return what an effect with a given shape would explain beside a background."""
        columns = self.columns(effect, shape)
        fall, amplitudes, independent = gain_of_block(columns, back)
        if isinstance(effect, Periodic) and independent < WAVES_APART:
            fall = 0.0
        if effect.not_negative and columns.shape[0] == 1 and float(columns[0] @ back.residual) < 0.0:
            fall = 0.0
        return self._candidacy(effect, shape, fall, amplitudes, back.rss)

    def _candidacy(self, effect: Effect, shape: Shape, fall: float, amplitudes: int, rss: float) -> Candidacy:
        # what says nothing new costs its place in the model all the same
        spent = max(amplitudes, 1) + scan_cost(effect, shape) + self._alias_cost(shape)
        evidence = self.worth(fall, rss) - spent * self.cost
        if self.ordinary and fall < WORTH_ADDING * amplitudes * rss:
            evidence = min(evidence, -1.0)
        return Candidacy(
            effect=effect,
            shape=shape,
            gain=fall,
            amplitudes=amplitudes,
            evidence=evidence,
            before=rss,
        )

    def _alias_cost(self, shape: Shape) -> int:
        """Return what a wave beyond half a cycle a target costs, unless its pitch is stated."""
        period, pitch = getattr(shape, "period", None), self.conditions.screw_pitch
        places = self.conditions.places
        if period is None or places.size < 2 or period >= 2.0 * float(np.median(np.diff(places))):
            return 0
        order = 0.0 if pitch is None else pitch / period
        return 0 if pitch is not None and order > 0.5 and abs(order - round(order)) < 0.01 * order else ALIAS_COST

    def worth(self, fall: float, rss: float) -> float:
        """Return a fall of the residual sum of squares as twice a log-likelihood."""
        if not self.ordinary:
            return fall / self.noise.sigma**2
        return float(self.dataset.rows * np.log(rss / max(rss - fall, 1e-12 * rss))) if rss > 0.0 else 0.0

    def p_value(self, candidacy: Candidacy) -> float:
        """Return the probability of so large a fall by noise alone, for one candidate of a strict workspace."""
        if candidacy.amplitudes == 0:
            return 1.0
        ratio = candidacy.gain / candidacy.amplitudes / self.noise.sigma**2
        return tails.f_ratio(ratio, candidacy.amplitudes, self.noise.freedom)

    def total(self, choices: Sequence[Choice]) -> float:
        """Return the evidence of a whole model against none."""
        empty, full = self.background(()), self.background(choices)
        parameters = full.basis.shape[1] + sum(scan_cost(effect, shape) for effect, shape in choices)
        value: float = self.worth(empty.rss - full.rss, empty.rss) - parameters * self.cost
        return value


def is_map(effect: Effect) -> bool:
    """Return whether an effect is a function of position through nodes, whose number is chosen like a shape."""
    return effect.name in ("pitch_map", "backlash_map")


def scan_cost(effect: Effect, shape: Shape) -> int:
    """Return what choosing a shape costs, in parameters.

    A moment at which something jumps costs twice a smooth parameter: the likelihood of a change point has no
    curvature, and its best place follows the noise.
    """
    free = 0 if is_map(effect) else effect.freedom(shape)
    return 2 * free if effect.name == "lost_counts" else free
