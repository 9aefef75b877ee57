"""A data set in whitened space: columns, backgrounds, scans, and the evidence for what they explain."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from scipy import stats

from rtec.effects import LIBRARY, Effect, Floats, Observable, Shape
from rtec.twin.dataset import Dataset
from rtec.twin.noise import Noise
from rtec.twin.repeat_space import equal_runs, run_starts
from rtec.twin.score import Background, background, gains, orthonormal
from rtec.twin.whitening import Correlation

Choice: TypeAlias = tuple[Effect, Shape]
"""An effect with its shape."""

WORTH_ADDING = 0.01
"""Share of the residual sum of squares that an effect has to explain where no repeats say what noise is."""
_KEEP_BYTES = 300_000_000
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

    Where there are no repeats the noise comes from a residual that holds what the model lacks; then nothing is whitened
    (ordinary least squares), and correlation only lowers the number of readings that count. While a model is still
    searched for (``searching``) all readings count, for the smooth effects that it lacks would pass as correlation.
    """

    def __init__(self, dataset: Dataset, noise: Noise, *, searching: bool = False) -> None:
        self.dataset, self.noise = dataset, noise
        self.conditions = dataset.conditions
        self.starts = run_starts(dataset.coordinates.run)
        self._correlation = noise.correlation if noise.from_repeats else Correlation()
        self.observed = self.whitened(dataset.observed[None, :])[0]
        self.constant = self.whitened(np.ones((1, dataset.rows)))
        self.has_datum = dataset.observable is Observable.DEVIATION
        runs = equal_runs(dataset) if noise.from_repeats else None
        self._runs = 1 if runs is None or not self._same_in_each_run(*runs) else runs[0]
        self._first = None if self._runs == 1 else dataset.take(np.arange(dataset.rows // self._runs))
        self._scans: dict[str, tuple[Sequence[Shape], Floats | None]] = {}
        self._kept = 0
        self.reasons = {
            e.name: e.untestable(self.conditions) for e in LIBRARY if e.observable is dataset.observable
        }
        self.library = tuple(e for e in LIBRARY if self.reasons.get(e.name, "") is None and not e.never_ranked)
        r = noise.correlation.to_next
        whole = noise.from_repeats or searching
        self.readings_that_count = dataset.rows if whole else dataset.rows * (1.0 - r) / (1.0 + r)

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

    def columns(self, effect: Effect, shape: Shape) -> Floats:
        """Return an effect's whitened columns, shape (amplitudes, rows)."""
        return self.whitened(np.ascontiguousarray(self.dataset.columns(effect, shape).T))

    def background(self, choices: Sequence[Choice], *, datum: bool | None = None) -> Background:
        """Return the background of a model; with the constant of the readings unless ``datum`` is False."""
        parts = [self.columns(effect, shape) for effect, shape in choices]
        if self.has_datum if datum is None else datum:
            parts.append(self.constant)
        return background(np.vstack(parts) if parts else np.empty((0, self.dataset.rows)), self.observed)

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
        data = self._first if folded and self._first is not None else self.dataset
        bytes_each = 8 * data.rows * 2
        at_once = max(1, _AT_ONCE_BYTES // bytes_each)
        keep = bytes_each * len(shapes) + self._kept <= _KEEP_BYTES
        if keep:
            at_once = len(shapes)
        for begin in range(0, len(shapes), at_once):
            part = shapes[begin : begin + at_once]
            raw = data.scan(effect, part)
            m, q, n = raw.shape
            white = self._correlation.whitened(raw.reshape(m * q, n), self.starts[:n]).reshape(m, q, n)
            if keep:
                self._scans[effect.name] = shapes, white
                self._kept += white.nbytes
            yield part, white, self._runs if folded else 1

    def best_of_scan(self, effect: Effect, back: Background) -> Candidacy | None:
        """Return the best shape of an effect's scan grid beside a background."""
        if is_map(effect):
            found = [self.judge(effect, shape, back) for shape in effect.shapes(self.conditions)]
            return max(found, key=lambda c: c.evidence, default=None)
        best: tuple[float, Shape, int] | None = None
        for shapes, columns, copies in self.scan(effect):
            own = back if copies == 1 else back.folded(copies)
            fall = gains(columns, own, copies=copies, not_negative=effect.not_negative)
            k = int(np.argmax(fall))
            if best is None or fall[k] > best[0]:
                best = float(fall[k]), shapes[k], columns.shape[1]
        return None if best is None else self._candidacy(effect, best[1], best[0], best[2], back.rss)

    def judge(self, effect: Effect, shape: Shape, back: Background) -> Candidacy:
        """Return what an effect with a given shape would explain beside a background."""
        columns = self.columns(effect, shape)
        basis = orthonormal(columns, back.basis)
        along = basis.T @ back.residual
        fall = float(along @ along)
        if effect.not_negative and columns.shape[0] == 1 and float(columns[0] @ back.residual) < 0.0:
            fall = 0.0
        return self._candidacy(effect, shape, fall, basis.shape[1], back.rss)

    def _candidacy(self, effect: Effect, shape: Shape, fall: float, amplitudes: int, rss: float) -> Candidacy:
        cost = (amplitudes + scan_cost(effect, shape)) * np.log(max(self.readings_that_count, 3.0))
        evidence = self.worth(fall, rss) - float(cost)
        if not self.noise.from_repeats and fall < WORTH_ADDING * rss:
            evidence = min(evidence, -1.0)
        return Candidacy(
            effect=effect,
            shape=shape,
            gain=fall,
            amplitudes=amplitudes,
            evidence=evidence,
            before=rss,
        )

    def worth(self, fall: float, rss: float) -> float:
        """Return a fall of the residual sum of squares as twice a log-likelihood."""
        if self.noise.from_repeats:
            return fall / self.noise.sigma**2
        return float(self.readings_that_count * np.log(rss / max(rss - fall, 1e-12 * rss))) if rss > 0.0 else 0.0

    def p_value(self, fall: float, amplitudes: int, rss: float) -> float:
        """Return the probability of so large a fall by noise alone, for one candidate."""
        if amplitudes == 0:
            return 1.0
        if self.noise.from_repeats:
            ratio = fall / amplitudes / self.noise.sigma**2
            return float(stats.f.sf(ratio, amplitudes, self.noise.freedom))
        return float(stats.chi2.sf(self.worth(fall, rss), amplitudes))

    def total(self, choices: Sequence[Choice]) -> float:
        """Return the evidence of a whole model against none."""
        empty, full = self.background(()), self.background(choices)
        parameters = full.basis.shape[1] + sum(scan_cost(effect, shape) for effect, shape in choices)
        return self.worth(empty.rss - full.rss, empty.rss) - parameters * float(
            np.log(max(self.readings_that_count, 3.0))
        )


def is_map(effect: Effect) -> bool:
    """Return whether an effect is a function of position through nodes, whose number is chosen like a shape."""
    return effect.name in ("pitch_map", "backlash_map")


def scan_cost(effect: Effect, shape: Shape) -> int:
    """Return what choosing a shape costs, in parameters.

    A moment at which something jumps costs twice a smooth parameter: the likelihood of a change point has no curvature,
    and its best place follows the noise.
    """
    free = 0 if is_map(effect) else effect.freedom(shape)
    return 2 * free if effect.name == "lost_counts" else free
