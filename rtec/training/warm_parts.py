"""The log of a warm machine in two parts: whole blocks that train, and whole blocks, or another file, that judge."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rtec.dataset.warm_log import WarmLog
from rtec.predictors._columns import Floats
from rtec.predictors.warm.features import SPINDLE_SPEED, Feature, columns_of

JUDGING = 0.15
"""Share of the rows that judge, at least."""
PERIOD_S = 60.0
"""Between two rows that train: temperatures hardly change in less."""
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
    first
        The first row of ``judge`` that judges.
    rows
        Rows of ``log`` that a fit sees, one a minute, shape (rows,).
    heldout_by
        What judges, in words.
    """

    log: WarmLog
    judge: WarmLog
    until: int
    first: int
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
        return {name: values[self.first :] for name, values in self.judge.outputs.items()}

    def columns(self, features: tuple[Feature, ...]) -> Floats:
        """Return features at the rows that a fit sees, shape (rows, features)."""
        return columns_of(features, self.log.time_s, self.log.inputs, self.log.starts)[self.rows]

    def judging_columns(self, features: tuple[Feature, ...]) -> Floats:
        """Return features at the rows that judge, with all that went before them, shape (rows, features)."""
        return columns_of(features, self.judge.time_s, self.judge.inputs, self.judge.starts)[self.first :]


def parts_of(log: WarmLog, heldout: WarmLog | None = None) -> WarmParts:
    """Return the rows that train and those that judge.

    Without another log the last blocks judge: from the last step at which the spindle turns on, or from an earlier
    one where these are less than 15 % of the rows. Without a speed, the last blocks that are 15 % of the rows.
    """
    if heldout is not None:
        rows = _one_a_minute(log.time_s, log.rows)
        return WarmParts(log=log, judge=heldout, until=log.rows, first=0, rows=rows, heldout_by=heldout.source)
    of_row = log.blocks.of_row
    begins = np.concatenate([[0], 1 + np.flatnonzero(np.diff(of_row))])
    late = begins[(begins > 0) & (begins <= (1.0 - JUDGING) * log.rows)]
    if SPINDLE_SPEED in log.inputs:
        turning = [begin for begin in late.tolist() if np.median(_block_at(log, begin)) > 0.0]
        late = np.array(turning) if turning else late
    until = int(late[-1]) if late.size else int(begins[-1]) or round((1.0 - JUDGING) * log.rows)
    hours = log.hours
    names = dict.fromkeys(log.blocks.names[number] for number in np.unique(of_row[until:]))
    heldout_by = f"the last blocks ({', '.join(names)}), from {hours[until]:.4g} h on"
    return WarmParts(
        log=log, judge=log, until=until, first=until, rows=_one_a_minute(log.time_s, until), heldout_by=heldout_by
    )


def _block_at(log: WarmLog, row: int) -> Floats:
    return np.asarray(np.abs(log.inputs[SPINDLE_SPEED][log.blocks.of_row == log.blocks.of_row[row]]))


def _one_a_minute(time_s: Floats, until: int) -> Places:
    """Return rows of the training part that are about a minute apart."""
    steps = np.diff(time_s[:until])
    usual_s = float(np.median(steps[steps > 0.0])) if (steps > 0.0).any() else PERIOD_S
    return np.arange(0, until, max(1, round(PERIOD_S / usual_s)))
