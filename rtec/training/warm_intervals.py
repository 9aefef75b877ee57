"""How sure a model of a warm machine is at other duty cycles: intervals calibrated by blocks that it has not seen."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from rtec.predictors._columns import Floats

COVERED = 0.9
"""Share of the readings of another duty cycle that an interval is to hold."""


def calibrated_factor(left_out: Floats, sd: Floats, block: npt.NDArray[np.int64]) -> float | None:
    """Return by what the standard deviation of a model is multiplied to give half an interval; None with one block.

    Parameters
    ----------
    left_out
        Residuals of rows whose blocks the fit had not seen, shape (rows,).
    sd
        Standard deviation that the model states at these rows, shape (rows,); zeros where it states none.
    block
        Of each row, shape (rows,).

    Notes
    -----
    Rows of a block err together, so that what is exchangeable are blocks, and they are few: conformal prediction over
    fewer than nine blocks has no finite 90 % interval. So the mean squares of blocks, of residuals over their
    standard deviations, count as draws of a variance, and the factor is Student's quantile with one degree of freedom
    less than blocks.

    References
    ----------
    Student 1908; Vovk, Gammerman and Shafer 2005, section 2.2, on the number that conformal intervals need.

    Examples
    --------
    >>> residuals = np.tile([1.0, -1.0], 12)
    >>> round(calibrated_factor(residuals, np.zeros(24), np.arange(24) // 4), 2)
    2.02
    """
    from scipy.special import stdtrit  # noqa: PLC0415 - slow to load, and only a comparison needs it

    blocks = np.unique(block)
    if blocks.size < 2:
        return None
    scores = np.square(left_out / np.where(sd > 0.0, sd, 1.0))
    size = np.sqrt(np.mean([scores[block == one].mean() for one in blocks]))
    return float(stdtrit(blocks.size - 1, (1.0 + COVERED) / 2.0) * size)


def half_widths(factor: float | None, sd: Floats) -> Floats | None:
    """Return half the width of the interval of each row, shape (rows,)."""
    return None if factor is None else factor * np.where(sd > 0.0, sd, 1.0)
