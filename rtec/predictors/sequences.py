"""Logs of something in motion, as dynamic models are trained on them and asked."""

from __future__ import annotations

from collections.abc import Sequence as TypingSequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
import numpy.typing as npt

from rtec.compiled import finite_array
from rtec.errors import ArgumentError

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Sequences:
    """Runs sampled at one period: what went in, and what came out.

    Raises
    ------
    ArgumentError
        Shapes that do not fit, numbers that are not finite, a period that is no time, or runs that do not begin in
        the data.

    Examples
    --------
    >>> data = Sequences(inputs=np.ones((5, 1)), output=np.zeros(5), names=("command",), period_s=1e-3)
    >>> data.part(2, 5).output.size, [len(run) for run in data.runs()]
    (3, [5])
    """

    inputs: Floats
    """Shape (samples, channels)."""
    output: Floats
    """Shape (samples,)."""
    names: tuple[str, ...]
    """Of the input channels."""
    period_s: float
    unit: str = "um"
    """Of the output."""
    starts: tuple[int, ...] = (0,)
    """First sample of each run: nothing is remembered across it."""

    def __post_init__(self) -> None:
        output = finite_array("output", self.output)
        inputs = np.ascontiguousarray(self.inputs, dtype=np.float64)
        object.__setattr__(self, "output", output)
        object.__setattr__(self, "inputs", inputs)
        if inputs.shape != (output.size, len(self.names)) or not np.isfinite(inputs).all():
            raise ArgumentError(
                "inputs", f"shape {inputs.shape}", f"finite, shape ({output.size}, {len(self.names)})"
            )
        if not 0.0 < self.period_s < np.inf:
            raise ArgumentError("period_s", f"{self.period_s:g}", "a time above 0")
        starts = np.asarray(self.starts)
        if starts.size == 0 or starts[0] != 0 or starts[-1] >= max(output.size, 1) or (np.diff(starts) <= 0).any():
            raise ArgumentError("starts", f"{self.starts}"[:60], f"0, then rising, below {output.size}")

    def __len__(self) -> int:
        """Return the number of samples."""
        return int(self.output.size)

    def part(self, first: int, end: int) -> Sequences:
        """Return samples ``first`` up to, but without, ``end``."""
        starts = (0, *(start - first for start in self.starts if first < start < end))
        return Sequences(
            inputs=self.inputs[first:end],
            output=self.output[first:end],
            names=self.names,
            period_s=self.period_s,
            unit=self.unit,
            starts=starts,
        )

    def runs(self) -> list[Sequences]:
        """Return each run on its own."""
        ends = (*self.starts[1:], len(self))
        return [self.part(first, end) for first, end in zip(self.starts, ends, strict=True)]


def joined(parts: TypingSequence[Sequences]) -> Sequences:
    """Return one after the other, each with runs of its own.

    Examples
    --------
    >>> part = Sequences(inputs=np.ones((5, 1)), output=np.zeros(5), names=("command",), period_s=1e-3)
    >>> joined([part, part]).starts
    (0, 5)
    """
    begins = np.cumsum([0, *map(len, parts)])[:-1].tolist()
    return replace(
        parts[0],
        inputs=np.concatenate([part.inputs for part in parts]),
        output=np.concatenate([part.output for part in parts]),
        starts=tuple(begin + start for begin, part in zip(begins, parts, strict=True) for start in part.starts),
    )


class DynamicModel(Protocol):
    """A model that predicts an output from inputs and from what it predicted before."""

    @property
    def lags(self) -> int:
        """Samples of a run that have to be measured before it predicts: no error counts there."""

    @property
    def parameters(self) -> int:
        """Numbers that were fitted."""

    def free_run(self, data: Sequences) -> Floats:
        """Return the output predicted from the inputs alone, shape (samples,).

        The first `lags` samples of each run are as measured; no later one is looked at.
        """


def check_same(data: Sequences, *, names: tuple[str, ...], period_s: float, unit: str) -> None:
    """Refuse data that are not of the kind that a model was trained on.

    Raises
    ------
    ArgumentError
        Other inputs, another period, or another unit.
    """
    if data.names != names:
        raise ArgumentError("inputs", ", ".join(data.names)[:60] or "none", ", ".join(names))
    if abs(data.period_s - period_s) > 1e-6 * period_s:
        raise ArgumentError("period_s", f"{data.period_s:g} s", f"{period_s:g} s, that of the training")
    if data.unit != unit:
        raise ArgumentError("unit", data.unit[:20], f"{unit}, that of the training")
