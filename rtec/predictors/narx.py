"""NARX networks: a layer of tanh neurons over past inputs and past outputs, fed back into itself."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from rtec.errors import ArgumentError
from rtec.predictors import _narx_kernels as kernels
from rtec.predictors._columns import Floats, column
from rtec.predictors.sequences import Sequences

MOST_NEURONS = 64
MOST_DELAY = 1000
"""Samples."""


@dataclass(frozen=True, slots=True, kw_only=True)
class NarxShape:
    """What a NARX network looks at, and how many neurons it has.

    Raises
    ------
    ArgumentError
        No input, too many neurons, or delays that do not rise.

    Examples
    --------
    >>> NarxShape(channels=1, neurons=12, input_delays=range(4), feedback_delays=range(1, 5), linear=False).weights
    121
    """

    channels: int
    """Inputs."""
    neurons: int
    input_delays: Sequence[int]
    """Samples, of each input; 0 is the present one."""
    feedback_delays: Sequence[int]
    """Samples, of the output, from 1 on."""
    linear: bool = True
    """Whether each tap adds to the output directly, too."""

    def __post_init__(self) -> None:
        if not 1 <= self.channels <= MOST_NEURONS:
            raise ArgumentError("inputs", self.channels, f"1 to {MOST_NEURONS} inputs")
        if not 1 <= self.neurons <= MOST_NEURONS:
            raise ArgumentError("neurons", self.neurons, f"1 to {MOST_NEURONS}")
        for name, least in (("input_delays", 0), ("feedback_delays", 1)):
            delays = tuple(int(delay) for delay in getattr(self, name))
            rising = all(a < b for a, b in itertools.pairwise(delays))
            if not delays or not rising or delays[0] < least or delays[-1] > MOST_DELAY:
                raise ArgumentError(name, f"{delays}"[:60], f"rising numbers of samples from {least} to {MOST_DELAY}")
            object.__setattr__(self, name, delays)

    @property
    def taps(self) -> int:
        """Numbers that each neuron sees."""
        return self.channels * len(self.input_delays) + len(self.feedback_delays)

    @property
    def weights(self) -> int:
        """Number of all weights and biases."""
        return self.neurons * (self.taps + 2) + 1 + (self.taps if self.linear else 0)

    @property
    def lags(self) -> int:
        """The longest delay."""
        return max(self.input_delays[-1], self.feedback_delays[-1])


class NarxKernel:
    """A network of some shape as the compiled loops take it, with the room that they need.

    All is scaled; see ``_narx_kernels.py`` for the order of the weights.
    """

    def __init__(self, shape: NarxShape) -> None:
        """Make room."""
        self.shape = shape
        inner = [(channel, delay) for channel in range(shape.channels) for delay in shape.input_delays]
        self._taps = np.array(inner, dtype=np.int64)
        self._back = np.array(shape.feedback_delays, dtype=np.int64)
        wide = kernels.EIGHT * -(-shape.neurons // kernels.EIGHT)
        self._hidden = np.zeros((shape.taps + 1, wide))
        self._outer = np.zeros(wide + 1)
        self._direct = np.zeros(shape.taps if shape.linear else 0)
        self._seen, self._level, self._rise = np.zeros(shape.taps), np.zeros(wide), np.zeros(wide)

    def take(self, weights: Floats) -> None:
        """Take other weights."""
        neurons, begin = self.shape.neurons, self.shape.neurons * (self.shape.taps + 1)
        self._hidden[:, :neurons] = weights[:begin].reshape(-1, neurons)
        self._outer[:neurons] = weights[begin : begin + neurons]
        self._outer[-1] = weights[begin + neurons]
        self._direct[:] = weights[begin + neurons + 1 :]

    @property
    def _network(self) -> tuple[Any, ...]:
        return self._taps, self._back, self._hidden, self._outer, self._direct, self._seen, self._level

    def predict(
        self, stretches: npt.NDArray[np.int64], inputs: Floats, measured: Floats, output: Floats, *, closed: bool
    ) -> float:
        """Write the outputs of stretches of samples; return the sum of squared errors, infinite if it diverges."""
        return float(kernels.predict(stretches, inputs, measured, output, closed, *self._network))

    def slopes(
        self,
        cursor: npt.NDArray[np.int64],
        stretches: npt.NDArray[np.int64],
        inputs: Floats,
        measured: Floats,
        output: Floats,
        rows: Floats,
        error: Floats,
        *,
        closed: bool,
    ) -> int:
        """Write the next rows of slopes behind the first ``lags``; return how many, negative if it diverged."""
        room = self._rise, rows, error, self.shape.neurons
        return int(kernels.slopes(cursor, stretches, inputs, measured, output, closed, *room, *self._network))

    def step(self, inputs: Floats, past: Floats) -> float:
        """Return the next output from inputs, shape (lags + 1, channels), and outputs before, shape (lags,)."""
        return float(kernels.one_step(inputs, past, *self._network))

    def feedback_slopes(self, seen: Floats) -> Floats:
        """Return the slopes of the output over each output that is fed back, for taps of shape (n, taps)."""
        levels = np.tanh(seen @ self._hidden[:-1] + self._hidden[-1])
        back = len(self.shape.feedback_delays)
        found: Floats = ((1.0 - levels**2) * self._outer[:-1]) @ self._hidden[-1 - back : -1].T
        return found + self._direct[-back:] if self.shape.linear else found


@dataclass(slots=True, eq=False)
class NarxState:
    """What a NARX network remembers: its tapped delay lines."""

    inputs: Floats
    """Scaled, the latest last, shape (lags + 1, channels)."""
    outputs: Floats
    """Scaled, the latest last, shape (lags,)."""
    kernel: NarxKernel

    def see(self, inputs: Floats) -> None:
        """Move the inputs on."""
        self.inputs[:-1] = self.inputs[1:]
        self.inputs[-1] = inputs

    def keep(self, output: float) -> None:
        """Move the outputs on."""
        self.outputs[:-1] = self.outputs[1:]
        self.outputs[-1] = output


def stretches_of(data: Sequences, lags: int) -> npt.NDArray[np.int64]:
    """Return first and end of what is predicted of each run; runs that are not longer than the lags fall out."""
    ends = np.array([*data.starts[1:], len(data)])
    both = np.stack([np.array(data.starts) + lags, ends], axis=1).astype(np.int64)
    return np.ascontiguousarray(both[both[:, 0] < both[:, 1]])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Narx:
    """A trained NARX network: output from past inputs and from the outputs that it predicted before.

    Raises
    ------
    ArgumentError
        Numbers that do not fit the shape or are not finite, or a period that is no time.

    References
    ----------
    Erwinski et al. 2016 (ball screw) and 2019 (linear motor), section 4.

    Examples
    --------
    >>> shape = NarxShape(channels=1, neurons=1, input_delays=(0,), feedback_delays=(1,))
    >>> low_pass = Narx(shape=shape, names=("command",), period_s=1e-3, middle=[0.0, 0.0], half=[1.0, 1.0],
    ...                 weights=[0.0, 0.0, 0.0, 0.0, 0.0, 0.5, 0.5])
    >>> data = Sequences(inputs=np.ones((4, 1)), output=np.zeros(4), names=("command",), period_s=1e-3)
    >>> low_pass.free_run(data)
    array([0.   , 0.5  , 0.75 , 0.875])
    """

    shape: NarxShape
    names: tuple[str, ...]
    """Of the inputs."""
    period_s: float
    """Sample time."""
    middle: Floats
    half: Floats
    """Scaled is a value less its middle, divided by its half width: one number for each input, then the output."""
    weights: Floats
    """See ``_narx_kernels.py``."""
    unit: str = "um"
    """Of the output."""

    def __post_init__(self) -> None:
        if len(self.names) != self.shape.channels:
            raise ArgumentError("inputs", f"{len(self.names)} names", f"{self.shape.channels}")
        if not 0.0 < self.period_s < np.inf:
            raise ArgumentError("period_s", f"{self.period_s:g}", "a time above 0")
        sizes = {"middle": len(self.names) + 1, "half": len(self.names) + 1, "weights": self.shape.weights}
        for name, size in sizes.items():
            values = column(name, getattr(self, name))
            if values.size != size:
                raise ArgumentError(name, f"{values.size} numbers", f"{size}, for a network of this shape")
            object.__setattr__(self, name, values)
        if not (self.half > 0.0).all():
            raise ArgumentError("half", f"{self.half.min():g}", "half widths above 0")

    @property
    def lags(self) -> int:
        """Samples of a run that have to be measured before it predicts."""
        return self.shape.lags

    @property
    def parameters(self) -> int:
        """Numbers that were fitted."""
        return self.shape.weights

    def scaled(self, data: Sequences) -> tuple[Floats, Floats]:
        """Return scaled inputs, shape (samples, channels), and the scaled output.

        Raises
        ------
        ArgumentError
            Other inputs than it was trained on, another period, or another unit.
        """
        if data.names != self.names:
            raise ArgumentError("inputs", ", ".join(data.names)[:60] or "none", ", ".join(self.names))
        if abs(data.period_s - self.period_s) > 1e-6 * self.period_s:
            raise ArgumentError("period_s", f"{data.period_s:g} s", f"{self.period_s:g} s, that of the training")
        if data.unit != self.unit:
            raise ArgumentError("unit", data.unit[:20], f"{self.unit}, that of the training")
        inputs = (data.inputs - self.middle[:-1]) / self.half[:-1]
        return np.ascontiguousarray(inputs), (data.output - self.middle[-1]) / self.half[-1]

    def kernel(self) -> NarxKernel:
        """Return its compiled loops."""
        made = NarxKernel(self.shape)
        made.take(self.weights)
        return made

    def free_run(self, data: Sequences) -> Floats:
        """Return the output predicted from the inputs alone, shape (samples,).

        The first `lags` samples of each run are as measured. Where it diverges, the rest of the run is not a number.
        """
        inputs, measured = self.scaled(data)
        kernel, output = self.kernel(), np.full(len(data), np.nan)
        for first, end in zip(data.starts, (*data.starts[1:], len(data)), strict=True):
            begin = min(end, first + self.lags)
            output[first:begin] = measured[first:begin]
            if begin < end:
                stretch = np.array([[begin, end]])
                kernel.predict(stretch, inputs, measured, output, closed=True)
        found: Floats = output * self.half[-1] + self.middle[-1]
        return found

    def at_rest(self, inputs: npt.ArrayLike, output: float) -> NarxState:
        """Return the memory of a network whose inputs and output have long been the same.

        Examples
        --------
        >>> shape = NarxShape(channels=1, neurons=1, input_delays=(0,), feedback_delays=(1,))
        >>> low_pass = Narx(shape=shape, names=("command",), period_s=1e-3, middle=[0.0, 0.0], half=[1.0, 1.0],
        ...                 weights=[0.0, 0.0, 0.0, 0.0, 0.0, 0.5, 0.5])
        >>> state = low_pass.at_rest([0.0], 0.0)
        >>> [low_pass.step(state, [1.0]) for _ in range(3)]
        [0.5, 0.75, 0.875]
        """
        scaled = self._scaled_inputs(inputs)
        before = np.full(self.lags, (output - self.middle[-1]) / self.half[-1])
        return NarxState(np.tile(scaled, (self.lags + 1, 1)), before, self.kernel())

    def remember(self, state: NarxState, inputs: npt.ArrayLike, output: float) -> None:
        """Move the memory on by a sample whose output was measured: as `step`, in a run's first `lags` samples."""
        state.see(self._scaled_inputs(inputs))
        state.keep((output - self.middle[-1]) / self.half[-1])

    def step(self, state: NarxState, inputs: npt.ArrayLike) -> float:
        """Return the output of the next sample, shape of the inputs (channels,), and move the memory on."""
        state.see(self._scaled_inputs(inputs))
        state.keep(state.kernel.step(state.inputs, state.outputs))
        return float(state.outputs[-1] * self.half[-1] + self.middle[-1])

    def _scaled_inputs(self, inputs: npt.ArrayLike) -> Floats:
        values = column("inputs", inputs)
        if values.size != len(self.names):
            raise ArgumentError("inputs", f"{values.size} numbers", f"{len(self.names)}: {', '.join(self.names)}")
        scaled: Floats = (values - self.middle[:-1]) / self.half[:-1]
        return scaled
