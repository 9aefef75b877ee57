"""A trained NARX network as C99: its memory in a struct, and a function that moves it on by one sample."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from rtec.predictors.narx import Narx
from rtec.predictors.predictor_file import KnownPredictor
from rtec.study.c_source import Precision, source_file

_TEMPLATE = "narx_source.c.j2"


def narx_lines(
    known: KnownPredictor, narx: Narx, name: str, *, precision: Precision = Precision.DOUBLE
) -> Iterator[str]:
    """Yield the lines of a C99 file with ``NAME_state`` and ``double NAME_step(NAME_state *, const double *)``.

    Parameters
    ----------
    known
        What the file of the network says of it.
    narx
        The network.
    name
        What all names in the file begin with.
    precision
        Of all constants and variables, the arguments included.

    Examples
    --------
    >>> from rtec.predictors import NarxShape
    >>> shape = NarxShape(channels=1, neurons=1, input_delays=(0,), feedback_delays=(1,))
    >>> narx = Narx(shape=shape, names=("command",), period_s=1e-3, middle=[0.0, 0.0], half=[1.0, 1.0],
    ...             weights=[0.0, 0.0, 0.0, 0.0, 0.0, 0.5, 0.5])
    >>> lines = list(narx_lines(KnownPredictor(predictor=narx, name="low pass"), narx, "axis"))
    >>> next(line for line in lines if line.startswith("double"))
    'double axis_step(axis_state *state, const double *inputs);'
    """
    shape, neurons = narx.shape, narx.shape.neurons
    begin = neurons * (shape.taps + 1)
    hidden = narx.weights[:begin].reshape(-1, neurons)
    head = (
        f"{name}_step: what comes next of an output, in {narx.unit}, by a NARX network; call it every "
        f"{narx.period_s:.9g} s.",
        f"Network: {known.name}{f', trained on {known.source}' if known.source else ''}.",
        f"inputs: {', '.join(narx.names)}; in the units of the training.",
        f"{name}_rest: inputs and output have long been the same. {name}_measured: a sample whose output is known;",
        f"{narx.lags} of them fill the memory. {name}_step: predicts the output of a sample, and remembers it.",
        precision.code("Nothing is allocated, and the only library function is tanh()."),
    )
    yield from source_file(
        _TEMPLATE,
        name,
        head,
        precision,
        narx=narx,
        shape=shape,
        rows=np.column_stack([hidden[-1], hidden[:-1].T]),
        outer=narx.weights[begin : begin + neurons],
        bias=narx.weights[begin + neurons],
        direct=narx.weights[begin + neurons + 1 :],
    )
