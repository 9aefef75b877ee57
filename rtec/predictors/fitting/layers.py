"""A network of logistic neurons as a function of its weights: output, gradient, and exact Jacobian.

All weights stand in one array, so that every training algorithm sees a plain function of a vector. Inputs and targets
are scaled by whoever calls.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from rtec.errors import ArgumentError
from rtec.predictors._columns import Floats
from rtec.predictors.fitting._layers_kernels import answer, bend, bend_last, through, through_last

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
        pairs = list(itertools.pairwise(shape.widths))
        ends = np.cumsum([(before + 1) * after for before, after in pairs]).tolist()
        self._places = list(zip([0, *ends], ends, [after for _, after in pairs], strict=False))
        # what a layer sees, kept neuron by neuron: a row of numbers for each is read from end to end; the last row is
        # that of the biases
        self._seen = [np.ones((n + 1, rows)) for n in shape.widths[:-1]]
        self._seen[0][:-1] = inputs.T
        self._delta = [np.empty((n, rows)) for n in shape.hidden]
        # first and second derivatives of levels along a direction of the weights
        self._along = [(np.empty((n, rows)), np.empty((n, rows))) for n in shape.hidden]
        self._rows, self._ones = rows, np.ones(rows)
        self._sign = _sign_of(inputs)
        self._jacobian = np.empty((0, rows))

    def _weights(self, weights: Floats, layer: int) -> Floats:
        """Return the weights of a layer, ``[input, neuron]``, its biases in the last row."""
        begin, end, after = self._places[layer]
        return weights[begin:end].reshape(-1, after)

    def output(self, weights: Floats) -> Floats:
        """Return the output for every row of inputs, shape (n,)."""
        for layer in range(len(self._delta)):
            level = self._seen[layer + 1][:-1]
            np.matmul(self._weights(weights, layer).T, self._seen[layer], out=level)
            answer(level)
        return self._weights(weights, len(self._delta))[:, 0] @ self._seen[-1]

    def _back(self, weights: Floats, residual: Floats) -> None:
        """Find the slope of half the sum of squares over what each neuron is given; with ones, that of the output."""
        last = len(self._delta) - 1
        outer = self._weights(weights, last + 1)[:-1, 0]
        through_last(self._seen[-1][:-1], outer, residual, self._delta[last])
        for layer in range(last - 1, -1, -1):
            np.matmul(self._weights(weights, layer + 1)[:-1], self._delta[layer + 1], out=self._delta[layer])
            through(self._seen[layer + 1][:-1], self._delta[layer])

    def gradient(self, weights: Floats, residual: Floats) -> Floats:
        """Return the gradient of half the sum of squares, shape (weights,), after ``output`` of the same weights."""
        self._back(weights, residual)
        parts = [seen @ delta.T for seen, delta in zip(self._seen, self._delta, strict=False)]
        return np.concatenate([*(part.ravel() for part in parts), self._seen[-1] @ residual])

    def curvature(self, weights: Floats, along: Floats, residual: Floats) -> float:
        """Return the second derivative of half the sum of squares along a direction of the weights.

        After ``output`` of the same weights. It is exact (Pearlmutter 1994), and takes no exponential.
        """
        last = len(self._along) - 1
        first = second = self._along[0][0]
        for layer, here in enumerate(self._along):
            matrix, change = self._weights(weights, layer), self._weights(along, layer)
            np.matmul(change.T, self._seen[layer], out=here[0])
            if layer:
                np.add(here[0], matrix[:-1].T @ first, out=here[0])
                np.matmul(matrix[:-1].T, second, out=here[1])
                np.add(here[1], 2.0 * (change[:-1].T @ first), out=here[1])
            if layer < last:
                bend(self._seen[layer + 1][:-1], *here, layer > 0)
            first, second = here
        outer, change = (self._weights(one, last + 1)[:, 0] for one in (weights, along))
        rise, turn = np.full(self._rows, change[-1]), np.zeros(self._rows)
        bend_last(self._seen[-1][:-1], first, second, last > 0, outer[:-1], change[:-1], rise, turn)
        return float(rise @ rise + residual @ turn)

    def jacobian(self, weights: Floats) -> Floats:
        """Return the slopes of the output, shape (weights, n), after ``output`` of the same weights."""
        found = np.empty((self.shape.weights, self._rows))
        self._slopes(weights, found, None)
        return found

    def _slopes(self, weights: Floats, out: Floats, without: int | None) -> None:
        """Write the slopes of the output, those of the weights of one input left out."""
        self._back(weights, self._ones)
        row = 0
        for layer, delta in enumerate(self._delta):
            for number, one in enumerate(self._seen[layer]):
                if layer == 0 and number == without:
                    continue
                np.multiply(one, delta, out=out[row : row + delta.shape[0]])
                row += delta.shape[0]
        out[row:] = self._seen[-1]

    def normal(self, weights: Floats, residual: Floats) -> tuple[Floats, Floats]:
        """Return the Jacobian times its transpose and times the residual, after ``output`` of the same weights.

        Where an input is a sign, -1 in the first rows and 1 in the others, the slopes of its weights are those of the
        biases with that sign: their products are sums and differences of products that are there anyway.
        """
        if self._sign is None:
            jacobian = self.jacobian(weights)
            return jacobian @ jacobian.T, jacobian @ residual
        number, split = self._sign
        width = self.shape.hidden[0]
        if not self._jacobian.size:
            self._jacobian = np.empty((self.shape.weights - width, self._rows))
        self._slopes(weights, self._jacobian, number)
        halves = self._jacobian[:, :split], self._jacobian[:, split:]
        minus, plus = (half @ half.T for half in halves)
        down, up = halves[0] @ residual[:split], halves[1] @ residual[split:]
        # places of the sign's weights among all, and of the biases among those that are left
        begin = number * width
        biases = slice((self.shape.inputs - 1) * width, self.shape.inputs * width)
        total, difference = plus + minus, plus[biases] - minus[biases]
        rows = np.concatenate([total[:begin], difference, total[begin:]])
        columns = np.concatenate([difference[:, :begin], total[biases, biases], difference[:, begin:]], axis=1).T
        products = np.concatenate([rows[:, :begin], columns, rows[:, begin:]], axis=1)
        slope = up + down
        return products, np.concatenate([slope[:begin], up[biases] - down[biases], slope[begin:]])


def _sign_of(inputs: Floats) -> tuple[int, int] | None:
    """Return which input is -1 in the first rows and 1 in all others, and the first of these; None where none is."""
    for number, column in enumerate(inputs.T):
        split = int(np.count_nonzero(column == -1.0))
        if 0 < split < column.size and (column[:split] == -1.0).all() and (column[split:] == 1.0).all():
            return number, split
    return None
