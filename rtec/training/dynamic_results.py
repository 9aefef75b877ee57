"""What a comparison of models of motion gives: a row each, and the one that was chosen."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from rtec.dataset.dynamic_log import DynamicLog
from rtec.predictors.sequences import DynamicModel


class DynamicKind(Enum):
    """What a model of motion is made of; of nothing where it only shows what the others have to beat."""

    NONE = "none"
    LINEAR = "linear"
    PHYSICAL = "physical"
    NETWORK = "network"
    HYBRID = "hybrid"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DynamicRow:
    """One model; errors are those of free runs, in the unit of the output.

    Parameters
    ----------
    name, kind
        What it is.
    model
        None where there is none; ``reason`` says why.
    rms_train, rms_validation, rms_heldout
        Root mean square error over the training part, over its last quarter by a model fitted to the rest of it, and
        over what no model has seen.
    rms_first_tenth, rms_last_tenth
        Over the first and the last tenth of what no model has seen: whether errors grow.
    stable
        Whether every prediction stayed within ten times the range of the output.
    holds
        Whether it may be chosen: a network that does not come back from moved starts may not.
    train_s, eval_ns
        What the fit took, and a sample of a free run.
    parameters
        Numbers that were fitted.
    interval
        Half width of the interval about what it says that holds 90 % of the validation part (split-conformal).
    coverage
        Share of the held-out samples within it.
    notes
        What else is to be said of it, in sentences.
    reason
        Why it has no figures.
    """

    name: str
    kind: DynamicKind
    model: DynamicModel | None = None
    rms_train: float | None = None
    rms_validation: float | None = None
    rms_heldout: float | None = None
    rms_first_tenth: float | None = None
    rms_last_tenth: float | None = None
    stable: bool = False
    holds: bool = True
    train_s: float | None = None
    eval_ns: float | None = None
    parameters: int | None = None
    interval: float | None = None
    coverage: float | None = None
    notes: tuple[str, ...] = ()
    reason: str | None = None

    @property
    def works(self) -> bool:
        """Whether it has a figure, and is a model of motion."""
        return self.rms_heldout is not None and self.stable and self.kind is not DynamicKind.NONE


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DynamicComparison:
    """All models of one log.

    Parameters
    ----------
    log
        The log that trains.
    samples
        Of the parts ``train``, ``validation`` and ``heldout``.
    heldout_by
        What judges, in words: ``the second half``, or the other file.
    rows
        In the order in which they were fitted.
    chosen
        Name of the row that the training part alone chose; None where none works.
    notes
        On the parts, in sentences.
    interrupted
        Whether Ctrl-C ended it early.
    """

    log: DynamicLog
    samples: dict[str, int]
    heldout_by: str
    rows: tuple[DynamicRow, ...]
    chosen: str | None
    notes: tuple[str, ...]
    interrupted: bool

    @property
    def unit(self) -> str:
        """Of the output, and so of all errors."""
        return self.log.sequences.unit

    @property
    def ranked(self) -> tuple[DynamicRow, ...]:
        """Rows with a figure, the lowest held-out error first; then those without, in their order."""
        return tuple(sorted(self.rows, key=lambda row: (row.rms_heldout is None, row.rms_heldout or 0.0)))

    def named(self, name: str | None) -> DynamicRow | None:
        """Return the row of a name."""
        return next((row for row in self.rows if row.name == name), None)
