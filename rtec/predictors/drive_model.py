"""The physical model of a drive under its position controller: what it lags behind its command."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from rtec.errors import ArgumentError
from rtec.predictors import _drive_kernels as kernels
from rtec.predictors._columns import Floats
from rtec.predictors.sequences import Sequences, check_same

MOTION = ("velocity", "acceleration")
"""Inputs of every drive: those of its command, in the unit of position a second, and a second squared."""
NUMBERS = (
    "stiffness", "damping", "velocity_forward", "acceleration_forward", "coulomb", "width", "offset", "asymmetry",
)  # fmt: skip
"""Of a drive, in the order of the kernel."""


def runs_of(data: Sequences) -> np.ndarray[tuple[int, int], np.dtype[np.int64]]:
    """Return first sample and end of each run, shape (runs, 2)."""
    return np.stack([np.array(data.starts), np.array([*data.starts[1:], len(data)])], axis=1).astype(np.int64)


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveModel:
    """A mass with friction that a controller pulls towards its command.

    ::

        q'' = stiffness (r - q) - damping q' + velocity_forward r' + acceleration_forward r''
              - coulomb tanh(q' / width) - offset - asymmetry |q'| + sum of gain * input

    q is the actual position, r the command. All is per unit of mass, which a following error cannot tell: forces are
    accelerations. ``damping`` holds the viscous friction as well as the gain of the velocity loop, which a following
    error cannot tell apart either.

    Parameters
    ----------
    names
        Of the inputs; velocity and acceleration among them.
    period_s
        Sample time.
    unit
        Of the output.
    output_per_error
        Output for a following error of 1 mm or 1 degree: 1000 in um, -1000 for a deviation.
    stiffness
        Gain of the position loop times that of the velocity loop, in 1/s².
    damping, velocity_forward, asymmetry
        In 1/s; ``asymmetry`` is the difference of viscous friction between the directions, halved.
    acceleration_forward
        Share of the acceleration that the controller commands in advance.
    coulomb, offset
        In mm/s² (degrees/s²).
    width
        Speed in mm/s (degrees/s) at which three quarters of the Coulomb friction act.
    gains
        Acceleration by a unit of each other input, in the order of ``names``.

    Raises
    ------
    ArgumentError
        No velocity or acceleration among the inputs, a width that is not above 0, or gains that do not fit.

    References
    ----------
    Erwinski et al. 2019, section 3 (mass, friction); Janot et al. 2019, the controller of EMPS.

    Examples
    --------
    >>> drive = DriveModel(names=MOTION, period_s=1e-3, unit="um", output_per_error=1e3, stiffness=1e4, damping=100.0)
    >>> steady = Sequences(inputs=np.tile([50.0, 0.0], (999, 1)), output=np.zeros(999), names=MOTION, period_s=1e-3)
    >>> round(float(drive.free_run(steady)[-1]), 3)  # 50 mm/s * 100 / 10000 s
    500.0
    """

    names: tuple[str, ...]
    period_s: float
    unit: str
    output_per_error: float
    stiffness: float
    damping: float
    velocity_forward: float = 0.0
    acceleration_forward: float = 0.0
    coulomb: float = 0.0
    width: float = 1.0
    offset: float = 0.0
    asymmetry: float = 0.0
    gains: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        if not set(MOTION) <= set(self.names):
            raise ArgumentError("inputs", ", ".join(self.names)[:60] or "none", "velocity and acceleration")
        if len(self.gains) != len(self.names) - 2:
            raise ArgumentError("gains", f"{len(self.gains)} numbers", f"{len(self.names) - 2}, one for each input")
        if not np.isfinite([*self.numbers, *self.gains, self.output_per_error]).all() or self.output_per_error == 0.0:
            raise ArgumentError("drive", "numbers that are not finite", "finite numbers, output_per_error not 0")
        if not self.width > 0.0:
            raise ArgumentError("width", self.width, "a speed above 0")

    @property
    def numbers(self) -> Floats:
        """As the kernel takes them, shape (8,)."""
        return np.array([getattr(self, name) for name in NUMBERS])

    def with_numbers(self, numbers: Sequence[float], gains: Sequence[float]) -> DriveModel:
        """Return another drive of the same kind, with these `numbers` and gains."""
        named: dict[str, Any] = dict(zip(NUMBERS, numbers, strict=True))
        return replace(self, gains=tuple(gains), **named)

    @property
    def lags(self) -> int:
        """Samples of a run that have to be measured before it predicts."""
        return kernels.LAGS

    @property
    def parameters(self) -> int:
        """Numbers that were fitted."""
        return len(NUMBERS) + len(self.gains)

    def free_run(self, data: Sequences) -> Floats:
        """Return the output predicted from the inputs alone, shape (samples,).

        The first `lags` samples of each run are as measured. Where it diverges, the rest of the run is not a number.
        """
        check_same(data, names=self.names, period_s=self.period_s, unit=self.unit)
        velocity, acceleration = (data.inputs[:, self.names.index(name)].copy() for name in MOTION)
        others = [place for place, name in enumerate(self.names) if name not in MOTION]
        push = data.inputs[:, others] @ np.array(self.gains)
        error = data.output / self.output_per_error
        kernels.follow(runs_of(data), self.numbers, velocity, acceleration, push, self.period_s, error)
        found: Floats = error * self.output_per_error
        return found
