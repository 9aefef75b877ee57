"""Linear models of motion: ARX, and a servo that lags behind velocity and acceleration."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rtec.errors import ArgumentError
from rtec.predictors._columns import Floats
from rtec.predictors.sequences import Sequences, check_same


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Arx:
    """Output from its own past and from present and past inputs, linearly.

    ``y(t) = constant + sum feedback[i] y(t - 1 - i) + sum forward[c, j] u_c(t - j)``

    Parameters
    ----------
    names
        Of the inputs.
    period_s, unit
        Sample time, and unit of the output.
    feedback
        Shape (feedback delays,), of delays 1, 2, ...
    forward
        Shape (inputs, input delays), of delays 0, 1, ...
    constant
        In the unit of the output.

    References
    ----------
    L. Ljung, System Identification: Theory for the User, 2nd edition, section 4.2.

    Examples
    --------
    >>> low_pass = Arx(names=("command",), period_s=1e-3, unit="V", feedback=[0.5], forward=[[0.5]])
    >>> data = Sequences(inputs=np.ones((4, 1)), output=np.zeros(4), names=("command",), period_s=1e-3, unit="V")
    >>> low_pass.free_run(data)
    array([0.   , 0.5  , 0.75 , 0.875])
    """

    names: tuple[str, ...]
    period_s: float
    unit: str
    feedback: Floats
    forward: Floats
    constant: float = 0.0

    def __post_init__(self) -> None:
        feedback = np.array(self.feedback, dtype=np.float64)
        forward = np.array(self.forward, dtype=np.float64)
        object.__setattr__(self, "feedback", feedback)
        object.__setattr__(self, "forward", forward)
        if feedback.ndim != 1 or forward.ndim != 2 or forward.shape[0] != len(self.names) or forward.shape[1] < 1:
            found = f"shape {forward.shape}"
            raise ArgumentError(
                "forward", found, f"a row for each of {len(self.names)} inputs, and feedback as a list"
            )
        if not (np.isfinite(feedback).all() and np.isfinite(forward).all() and np.isfinite(self.constant)):
            raise ArgumentError("ARX", "numbers that are not finite", "finite numbers")

    @property
    def lags(self) -> int:
        """Samples of a run that have to be measured before it predicts."""
        return max(len(self.feedback), int(self.forward.shape[1]) - 1)

    @property
    def parameters(self) -> int:
        """Numbers that were fitted."""
        return len(self.feedback) + int(self.forward.size) + 1

    def free_run(self, data: Sequences) -> Floats:
        """Return the output predicted from the inputs alone, shape (samples,).

        The first `lags` samples of each run are as measured.
        """
        from scipy.signal import lfilter, lfiltic  # noqa: PLC0415 - 0.5 s, for those who predict

        check_same(data, names=self.names, period_s=self.period_s, unit=self.unit)
        found, lags = data.output.copy(), self.lags
        poles = np.append(1.0, -self.feedback)
        with np.errstate(over="ignore", invalid="ignore"):  # what diverges is for the caller to judge
            for first, end in zip(data.starts, (*data.starts[1:], len(data)), strict=True):
                if end - first <= lags:
                    continue
                driven = np.full(end - first, self.constant)
                for inputs, weights in zip(data.inputs[first:end].T, self.forward, strict=True):
                    driven += np.convolve(inputs, weights)[: end - first]
                before = found[first : first + lags][::-1]
                state = lfiltic([1.0], poles, before[: self.feedback.size])
                found[first + lags : end] = lfilter([1.0], poles, driven[lags:], zi=state)[0]
        return found


@dataclass(frozen=True, slots=True, kw_only=True)
class ServoLag:
    """An error in proportion to commanded velocity and acceleration: `servo_lag` and `acceleration_lag`.

    Parameters
    ----------
    names
        Of the inputs; velocity and acceleration among them.
    period_s, unit
        Sample time, and unit of the output.
    constant
        In the unit of the output.
    per_velocity, per_acceleration
        Output for a unit of each: for an error in um and mm/s, thousandths of a second.

    Examples
    --------
    >>> lag = ServoLag(names=("velocity", "acceleration"), period_s=1e-3, unit="um", per_velocity=16.0)
    >>> data = Sequences(inputs=[[2.0, 0.0]], output=[0.0], names=lag.names, period_s=1e-3)
    >>> lag.free_run(data)
    array([32.])
    """

    names: tuple[str, ...]
    period_s: float
    unit: str
    constant: float = 0.0
    per_velocity: float = 0.0
    per_acceleration: float = 0.0

    def __post_init__(self) -> None:
        if not {"velocity", "acceleration"} <= set(self.names):
            raise ArgumentError("inputs", ", ".join(self.names)[:60] or "none", "velocity and acceleration")

    @property
    def lags(self) -> int:
        """None: it remembers nothing."""
        return 0

    @property
    def parameters(self) -> int:
        """Numbers that were fitted."""
        return 3

    def free_run(self, data: Sequences) -> Floats:
        """Return the output predicted from the inputs alone, shape (samples,)."""
        check_same(data, names=self.names, period_s=self.period_s, unit=self.unit)
        velocity, acceleration = (data.inputs[:, self.names.index(name)] for name in ("velocity", "acceleration"))
        found: Floats = self.constant + self.per_velocity * velocity + self.per_acceleration * acceleration
        return found


@dataclass(frozen=True, slots=True, kw_only=True)
class Held:
    """The last measured output for ever, or a constant: what any model has to beat.

    Examples
    --------
    >>> data = Sequences(inputs=np.zeros((3, 1)), output=[1.0, 2.0, 4.0], names=("command",), period_s=1e-3)
    >>> Held().free_run(data), Held(constant=2.0).free_run(data)
    (array([1., 1., 1.]), array([2., 2., 2.]))
    """

    constant: float | None = None

    @property
    def lags(self) -> int:
        """The sample that is held."""
        return 1 if self.constant is None else 0

    @property
    def parameters(self) -> int:
        """Numbers that were fitted."""
        return 0 if self.constant is None else 1

    def free_run(self, data: Sequences) -> Floats:
        """Return the output predicted, shape (samples,)."""
        if self.constant is not None:
            return np.full(len(data), self.constant)
        lengths = np.diff([*data.starts, len(data)])
        return np.repeat(data.output[list(data.starts)], lengths)
