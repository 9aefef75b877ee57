"""Squared errors of a NARX network over runs, and their exact Jacobian, from measured outputs or from its own."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from rtec.predictors._columns import Floats
from rtec.predictors.narx import NarxKernel, NarxShape

_ROWS = 1024
"""Samples whose slopes are held at once: they stay in the processor's cache."""


class FreeRunSquares:
    """Sum of squared errors of a network over scaled data.

    Parameters
    ----------
    shape
        Of the network.
    inputs
        Scaled, shape (samples, channels).
    measured
        Scaled output, shape (samples,).
    stretches
        First and end of each stretch that is predicted, shape (n, 2). Before its first sample the outputs are as
        measured.
    closed
        Whether the network sees its own outputs (parallel) or those that were measured (series-parallel).

    Examples
    --------
    >>> shape = NarxShape(channels=1, neurons=1, input_delays=(0,), feedback_delays=(1,))
    >>> squares = FreeRunSquares(shape, np.ones((4, 1)), np.zeros(4), np.array([[1, 4]]), closed=True)
    >>> squares.squares(np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.5, 0.5]))  # of 0.5, 0.75 and 0.875
    1.578125
    """

    def __init__(
        self, shape: NarxShape, inputs: Floats, measured: Floats, stretches: npt.NDArray[np.int64], *, closed: bool
    ) -> None:
        """Make room."""
        self._kernel, self._stretches, self._closed = NarxKernel(shape), stretches, closed
        self._inputs, self._measured, self._output = inputs, measured, measured.copy()
        self._before = shape.feedback_delays[-1]
        self._rows = np.zeros((_ROWS + self._before, shape.weights))
        self._error = np.zeros(_ROWS)
        self.samples = int((stretches[:, 1] - stretches[:, 0]).sum())
        """Number of errors."""

    def squares(self, weights: Floats) -> float:
        """Return the sum of squared errors; infinite if the network diverges."""
        self._kernel.take(weights)
        return self._kernel.predict(self._stretches, self._inputs, self._measured, self._output, closed=self._closed)

    def blocks(self, weights: Floats) -> Iterator[tuple[Floats, Floats]]:
        """Yield the next slopes of the outputs, shape (n, weights), and their errors, in arrays that are used again.

        Where it diverges, the last error is infinite. In free run the slopes go through the recurrence: those of an
        output over the weights are its own, and those of the outputs before, as far as it depends on each.
        """
        self._kernel.take(weights)
        cursor = np.zeros(2, dtype=np.int64)
        data = self._stretches, self._inputs, self._measured, self._output
        while cursor[0] < len(self._stretches):
            used = self._kernel.slopes(cursor, *data, self._rows, self._error, closed=self._closed)
            if used < 0:
                yield self._rows[:1], np.full(1, np.inf)
                return
            yield self._rows[self._before : self._before + used], self._error[:used]
            self._rows[: self._before] = self._rows[used : used + self._before]

    def normal(self, weights: Floats) -> tuple[float, Floats, Floats]:
        """Return the sum of squared errors, J'J and J'e; the Jacobian J is never held whole."""
        squares, products, slope = 0.0, np.zeros((weights.size, weights.size)), np.zeros(weights.size)
        for rows, error in self.blocks(weights):
            squares += float(error @ error)
            if not squares < np.inf:
                break
            products += rows.T @ rows
            slope += rows.T @ error
        return squares, products, slope


def first_weights(shape: NarxShape, rng: np.random.Generator) -> Floats:
    """Return weights to begin with, for taps from -1 to 1 (Nguyen and Widrow 1990); direct terms begin with zero."""
    taps, neurons = shape.taps, shape.neurons
    length = 0.7 * neurons ** (1.0 / taps)
    inner = rng.uniform(-1.0, 1.0, (taps, neurons))
    inner *= length / np.linalg.norm(inner, axis=0)
    biases = np.linspace(-length, length, neurons) * np.sign(inner[0]) if neurons > 1 else np.zeros(1)
    outer = rng.uniform(-0.5, 0.5, neurons + 1) / neurons
    direct = np.zeros(taps if shape.linear else 0)
    return np.concatenate([inner.ravel(), biases, outer, direct])


def cut(stretches: npt.NDArray[np.int64], horizon: int) -> npt.NDArray[np.int64]:
    """Return stretches cut into pieces of so many samples; the last of each is what is left.

    Examples
    --------
    >>> cut(np.array([[2, 7]]), 3).tolist()
    [[2, 5], [5, 7]]
    """
    pieces = [
        (first, min(first + horizon, end))
        for begin, end in stretches.tolist()
        for first in range(begin, end, horizon)
    ]
    return np.array(pieces, dtype=np.int64).reshape(-1, 2)
