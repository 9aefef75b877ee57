"""Compiled thermometers: each temperature goes from one value to another, as fast as what it is mounted on."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rtec._jit import Record, helper
from rtec.predictors._kernels import MOST_TEMPERATURES, TEMPERATURES
from rtec.units._time_kernels import PS_PER_S

THERMOMETERS = np.dtype(
    [
        ("count", np.int64),
        ("start_degc", np.float64, (MOST_TEMPERATURES,)),
        ("rise_k", np.float64, (MOST_TEMPERATURES,)),
        ("tau_s", np.float64, (MOST_TEMPERATURES,)),
    ],
    align=True,
)


@helper
def read_thermometers(th: Record, t_ps: int, sensors: NDArray[np.float64]) -> None:
    """Let the PC read every thermometer at ``t_ps``."""
    for k in range(th.count):
        share = 1.0 - math.exp(-t_ps / PS_PER_S / th.tau_s[k])
        sensors[TEMPERATURES + k] = th.start_degc[k] + th.rise_k[k] * share
