"""The log of a warm machine in two parts: whole blocks that train, and whole blocks, or another file, that judge."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rtec.dataset.warm_blocks import BY_SPEED
from rtec.dataset.warm_log import WarmLog
from rtec.errors import ArgumentError
from rtec.predictors._columns import Floats
from rtec.predictors.fitting.warm.begin import fit_begin
from rtec.predictors.warm.begin import Begin, begun_columns
from rtec.predictors.warm.features import SPINDLE_SPEED, Feature, columns_of

JUDGING = 0.15
"""Share of the rows that judge, at least."""
PERIOD_S = 60.0
"""Between two rows that train: temperatures hardly change in less."""
_MOST_NAMED = 3
Places = npt.NDArray[np.int64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WarmParts:
    """Rows that train, and rows that judge.

    Parameters
    ----------
    log, judge
        The logs whose rows train and judge; the same one where no other file judges.
    until
        The first row of ``log`` that does not train.
    judging
        Rows of ``judge`` that judge, ascending, shape (rows,): those in which every displacement was measured.
    rows
        Rows of ``log`` that a fit sees, one a minute, shape (rows,), likewise.
    heldout_by
        What judges, in words.
    """

    log: WarmLog
    judge: WarmLog
    until: int
    judging: Places
    rows: Places
    heldout_by: str

    @property
    def block(self) -> Places:
        """Number of the block of each row that a fit sees."""
        return self.log.blocks.of_row[self.rows]

    @property
    def blocks(self) -> int:
        """Number of blocks that train."""
        return int(np.unique(self.block).size)

    @property
    def outputs(self) -> Mapping[str, Floats]:
        """Displacements of the rows that a fit sees, in um, by channel: those that are observed, then the others."""
        every = {**self.log.outputs, **self.log.others}
        return {name: values[self.rows] for name, values in every.items()}

    @property
    def judged(self) -> Mapping[str, Floats]:
        """Displacements that judge, in um, by channel."""
        return {name: values[self.judging] for name, values in self.judge.outputs.items()}

    def columns(self, features: tuple[Feature, ...]) -> Floats:
        """Return features at the rows that a fit sees, shape (rows, features)."""
        return columns_of(features, self.log.time_s, self.log.inputs, self.log.starts)[self.rows]

    def judging_columns(self, features: tuple[Feature, ...]) -> Floats:
        """Return features at the rows that judge, with all that went before them, shape (rows, features).

        Another log may begin beside a warm machine: temperatures tell where what lags begins.
        """
        begin = None if self.judge is self.log else self.begin(features)
        judge = self.judge
        return begun_columns(features, begin, judge.time_s, judge.inputs, judge.starts)[self.judging]

    def begin(self, features: tuple[Feature, ...]) -> Begin | None:
        """Return what temperatures of the rows that train tell of what lags."""
        return fit_begin(features, self.columns(features))

    @property
    def hours(self) -> Floats:
        """Time of the rows that judge, in hours, shape (rows,)."""
        return self.judge.hours[self.judging]


def parts_of(log: WarmLog, heldout: WarmLog | None = None) -> WarmParts:
    """Return the rows that train and those that judge.

    Without another log the last blocks judge: from the last step at which the spindle turns on, or from an earlier
    one where these are less than 15 % of the rows. Without a speed, the last blocks that are 15 % of the rows.
    """
    if heldout is not None:
        return _parts(log, heldout, log.rows, 0, heldout.source)
    of_row = log.blocks.of_row
    begins = np.concatenate([[0], 1 + np.flatnonzero(np.diff(of_row))])
    late = begins[(begins > 0) & (begins <= (1.0 - JUDGING) * log.rows)]
    if log.blocks.by == BY_SPEED:
        turning = [begin for begin in late.tolist() if np.median(_block_at(log, begin)) > 0.0]
        late = np.array(turning) if turning else late
    until = int(late[-1]) if late.size else int(begins[-1]) or round((1.0 - JUDGING) * log.rows)
    hours = log.hours
    names = dict.fromkeys(log.blocks.names[number] for number in np.unique(of_row[until:]))
    named = f" ({', '.join(names)})" if len(names) <= _MOST_NAMED else ""
    heldout_by = f"the last blocks{named}, from {hours[until]:.4g} h on"
    return _parts(log, log, until, until, heldout_by)


def _parts(log: WarmLog, judge: WarmLog, until: int, first: int, heldout_by: str) -> WarmParts:
    rows = _one_a_minute(log, until)
    judging = first + np.flatnonzero(judge.measured[first:])
    if rows.size < 2 or judging.size < 1:
        found = f"{rows.size} rows that train and {judging.size} that judge"
        raise ArgumentError(log.source, found, "some of each with every displacement")
    return WarmParts(log=log, judge=judge, until=until, judging=judging, rows=rows, heldout_by=heldout_by)


def _block_at(log: WarmLog, row: int) -> Floats:
    return np.asarray(np.abs(log.inputs[SPINDLE_SPEED][log.blocks.of_row == log.blocks.of_row[row]]))


def _one_a_minute(log: WarmLog, until: int) -> Places:
    """Return rows of the training part that are about a minute apart, with every displacement."""
    steps = np.diff(log.time_s[:until])
    usual_s = float(np.median(steps[steps > 0.0])) if (steps > 0.0).any() else PERIOD_S
    rows = np.arange(0, until, max(1, round(PERIOD_S / usual_s)))
    return rows[log.measured[rows]]
