"""A network of logistic neurons as a function of its weights: output, gradient, and exact Jacobian.

All weights stand in one array, so that every training algorithm sees a plain function of a vector. Inputs and targets
are scaled by whoever calls.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rtec.errors import ArgumentError

Floats = npt.NDArray[np.float64]

_ACTIVE = 4.0
"""Half width of the inputs to which a logistic neuron answers (Nguyen and Widrow 1990, as MATLAB has it)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Shape:
    """How many inputs and neurons a network has; one linear neuron gives its output.

    Parameters
    ----------
    inputs
        Number of inputs.
    hidden
        Neurons of each hidden layer, from the inputs on.

    Examples
    --------
    >>> Shape(inputs=2, hidden=(30,)).weights, Shape(inputs=3, hidden=(30, 10)).weights
    (121, 441)
    """

    inputs: int
    hidden: tuple[int, ...]

    def __post_init__(self) -> None:
        for name, value in (("inputs", self.inputs), *(("hidden", n) for n in self.hidden)):
            if not 1 <= value <= 64:
                raise ArgumentError(name, value, "1 to 64")
        if not 1 <= len(self.hidden) <= 3:
            raise ArgumentError("hidden", f"{len(self.hidden)} layers", "1 to 3 hidden layers")

    @property
    def widths(self) -> tuple[int, ...]:
        """Inputs, neurons of each hidden layer, and the one output."""
        return (self.inputs, *self.hidden, 1)

    @property
    def weights(self) -> int:
        """Number of all weights and biases."""
        return sum((before + 1) * after for before, after in itertools.pairwise(self.widths))

    def first_weights(self, rng: np.random.Generator) -> Floats:
        """Return weights to begin with, for inputs from -1 to 1 (Nguyen and Widrow 1990).

        The active regions of a layer's neurons are spread over the range of its inputs.
        """
        parts: list[Floats] = []
        low, high = -1.0, 1.0
        for before, after in zip(self.widths[:-2], self.widths[1:-1], strict=True):
            length = 0.7 * after ** (1.0 / before)
            weights = rng.uniform(-1.0, 1.0, (before, after))
            weights *= length / np.linalg.norm(weights, axis=0)
            biases = np.linspace(-length, length, after) if after > 1 else np.zeros(1)
            biases = biases * np.sign(weights[0])
            # from inputs of -1 to 1 and neurons active from -1 to 1 to those that are there
            weights *= _ACTIVE * 2.0 / (high - low)
            biases = _ACTIVE * biases - 0.5 * (high + low) * weights.sum(axis=0)
            parts += [weights.ravel(), biases]
            low, high = 0.0, 1.0
        parts += [rng.uniform(-1.0, 1.0, self.widths[-2]), rng.uniform(-1.0, 1.0, 1)]
        return np.concatenate(parts)


class Layers:
    """A network over given inputs, with room for everything that is computed anew each time.

    The weights of a layer stand input by input, ``[input, neuron]``, its biases behind them; layer follows layer.

    Parameters
    ----------
    shape
        Inputs and neurons.
    inputs
        Scaled inputs, shape (n, inputs).

    Examples
    --------
    >>> net = Layers(Shape(inputs=1, hidden=(1,)), np.array([[0.0], [1.0]]))
    >>> net.output(np.array([0.0, 0.0, 2.0, -1.0]))  # 2 logsig(0) - 1
    array([0., 0.])
    """

    def __init__(self, shape: Shape, inputs: Floats) -> None:
        """Make room."""
        rows = inputs.shape[0]
        self.shape = shape
        self._pairs = list(itertools.pairwise(shape.widths))
        self._begins = np.cumsum([0, *((before + 1) * after for before, after in self._pairs)]).tolist()
        # what a layer sees, kept neuron by neuron: a row of numbers for each is read from end to end
        self._seen = [np.ascontiguousarray(inputs.T), *(np.empty((n, rows)) for n in shape.hidden)]
        self._delta = [np.empty((n, rows)) for n in shape.hidden]
        self._jacobian = np.empty((0, rows))
        self._rows = rows

    def _weights(self, weights: Floats, layer: int) -> tuple[Floats, Floats]:
        before, after = self._pairs[layer]
        begin = self._begins[layer]
        end = begin + before * after
        return weights[begin:end].reshape(before, after), weights[end : end + after]

    def output(self, weights: Floats) -> Floats:
        """Return the output for every row of inputs, shape (n,)."""
        for layer, level in enumerate(self._seen[1:]):
            matrix, biases = self._weights(weights, layer)
            np.matmul(matrix.T, self._seen[layer], out=level)
            np.add(level, biases[:, None], out=level)
            logistic(level)
        matrix, bias = self._weights(weights, len(self._seen) - 1)
        found: Floats = matrix[:, 0] @ self._seen[-1] + bias[0]
        return found

    def _back(self, weights: Floats, carried: Floats) -> None:
        """Carry a factor of the output, shape (n,) or a number, back to what each hidden neuron is given."""
        last = len(self._delta) - 1
        for layer in range(last, -1, -1):
            matrix, _ = self._weights(weights, layer + 1)
            there, level = self._delta[layer], self._seen[layer + 1]
            if layer == last:
                np.multiply(matrix, carried, out=there)
            else:
                np.matmul(matrix, self._delta[layer + 1], out=there)
            there *= level
            there -= there * level  # times the slope of the logistic function, level (1 - level)

    def gradient(self, weights: Floats, residual: Floats) -> Floats:
        """Return the gradient of half the sum of squares, shape (weights,), after ``output`` of the same weights."""
        self._back(weights, residual)
        parts: list[Floats] = []
        for seen, delta in zip(self._seen, [*self._delta, residual[None, :]], strict=True):
            parts += [(seen @ delta.T).ravel(), delta.sum(axis=1)]
        return np.concatenate(parts)

    def jacobian(self, weights: Floats) -> Floats:
        """Return the slopes of the output, shape (weights, n), after ``output`` of the same weights.

        The array is the same in every call.
        """
        if not self._jacobian.size:
            self._jacobian = np.empty((self.shape.weights, self._rows))
        self._back(weights, np.ones(1))
        row = 0
        for seen, delta in zip(self._seen, [*self._delta, np.ones((1, self._rows))], strict=True):
            for one in seen:
                np.multiply(one, delta, out=self._jacobian[row : row + delta.shape[0]])
                row += delta.shape[0]
            self._jacobian[row : row + delta.shape[0]] = delta
            row += delta.shape[0]
        return self._jacobian


def logistic(values: Floats) -> None:
    """Turn values into 1 / (1 + exp(-value)) where they stand; far outside it is 0 or 1, without an overflow."""
    np.clip(values, -_FAR, _FAR, out=values)
    np.negative(values, out=values)
    np.exp(values, out=values)
    values += 1.0
    np.reciprocal(values, out=values)


_FAR = math.log(2.0**1000)
