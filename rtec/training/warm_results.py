"""What a comparison of models of a warm machine gives: a row each, the one that is chosen, and which sensors."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from types import MappingProxyType

from rtec.predictors._columns import Floats
from rtec.predictors.warm.features import Feature
from rtec.training.warm_parts import WarmParts
from rtec.training.warm_task import Answers


class WarmKind(Enum):
    """What a model of a warm machine is made of; of nothing where it only shows what the others have to beat."""

    NONE = "none"
    LINEAR = "linear"
    PHYSICAL = "physical"
    FUZZY = "fuzzy network"
    KERNEL = "kernel"
    BAYES = "bayesian network"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ChannelFit:
    """One method at one channel.

    Parameters
    ----------
    features, regressor
        The model; None for a row that is none.
    rms_train_um, rms_blocks_um, rms_heldout_um, rms_rows_um
        Root mean square error over the training part, over its blocks each left out in turn, over what no fit saw,
        and over random rows of the training part left out.
    predicted_um, half_um
        What it says of the held-out rows and half the width of the 90 % interval about it, shape (rows,).
    """

    features: tuple[Feature, ...] = ()
    regressor: Answers | None = None
    rms_train_um: float
    rms_blocks_um: float | None
    rms_heldout_um: float
    rms_rows_um: float | None = None
    predicted_um: Floats
    half_um: Floats | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WarmRow:
    """One method; its figures are root mean squares over the channels.

    Parameters
    ----------
    name, kind
        What it is.
    needs_probe
        Whether it asks for displacements measured while the machine works; such a row is never chosen.
    channels
        Fits by channel.
    rms_train_um, rms_blocks_um, rms_heldout_um, rms_rows_um
        As of `ChannelFit`.
    rms_hourly_um
        Over the held-out part, where a probe reads once an hour and what it finds is added until the next reading.
    train_s, eval_ns
        What the fit took, and the value of one row of one channel.
    parameters
        Numbers that were fitted for one channel.
    interval_um
        Root mean square of the half widths of the 90 % intervals.
    coverage
        Share of the held-out readings within theirs.
    notes, reason
        What else is to be said of it; why it has no figures.
    """

    name: str
    kind: WarmKind
    needs_probe: bool = False
    channels: Mapping[str, ChannelFit] = field(default_factory=lambda: MappingProxyType({}))
    rms_train_um: float | None = None
    rms_blocks_um: float | None = None
    rms_heldout_um: float | None = None
    rms_rows_um: float | None = None
    rms_hourly_um: float | None = None
    train_s: float | None = None
    eval_ns: float | None = None
    parameters: int | None = None
    interval_um: float | None = None
    coverage: float | None = None
    notes: tuple[str, ...] = ()
    reason: str | None = None

    @property
    def works(self) -> bool:
        """Whether it has a figure, and may be chosen."""
        return self.rms_blocks_um is not None and self.kind is not WarmKind.NONE and not self.needs_probe


@dataclass(frozen=True, slots=True, kw_only=True)
class SensorRow:
    """The best set of so many thermometers, with the speed of the spindle where there is one.

    Parameters
    ----------
    sensors
        Names of the inputs.
    rms_blocks_um, rms_heldout_um, rms_hourly_um
        Root mean square error over the channels: by blocks of the training part, over the held-out part, and there
        with a probe that reads once an hour.
    share
        Of the repeats, each without one block of the training part: in which share each sensor is chosen for a set of
        this size.
    same
        Share of the repeats that choose this very set.
    is_all
        Whether these are all that there are.
    """

    sensors: tuple[str, ...]
    rms_blocks_um: float
    rms_heldout_um: float
    rms_hourly_um: float
    share: Mapping[str, float]
    same: float
    is_all: bool = False


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WarmComparison:
    """All methods on one log.

    Parameters
    ----------
    parts
        The rows that trained, and those that judge.
    rows
        In the order in which they were fitted.
    chosen
        Name of the row that the training part alone chose; None where none works.
    sensors
        A row for each number of thermometers; empty where there are none.
    notes
        On the parts, in sentences.
    interrupted
        Whether Ctrl-C ended it early.
    """

    parts: WarmParts
    rows: tuple[WarmRow, ...]
    chosen: str | None
    sensors: tuple[SensorRow, ...] = ()
    notes: tuple[str, ...] = ()
    interrupted: bool = False

    @property
    def ranked(self) -> tuple[WarmRow, ...]:
        """Rows with a figure, the lowest held-out error first; then those without, in their order."""
        return tuple(sorted(self.rows, key=lambda row: (row.rms_heldout_um is None, row.rms_heldout_um or 0.0)))

    def named(self, name: str | None) -> WarmRow | None:
        """Return the row of a name."""
        return next((row for row in self.rows if row.name == name), None)
