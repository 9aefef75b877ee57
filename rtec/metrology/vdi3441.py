"""Positioning figures of VDI/DGQ 3441, which German acceptance tests state beside those of ISO 230-2.

Index i is the target. Means x̄_i↑, x̄_i↓ and sample standard deviations s_i↑, s_i↓ of both directions are those of
ISO 230-2; here their means x̄_i = (x̄_i↑ + x̄_i↓) / 2 and s_i = (s_i↑ + s_i↓) / 2 count, and six standard deviations
instead of four.

References
----------
VDI/DGQ 3441:1977, Statistical testing of the operational and positional accuracy of machine tools (withdrawn). Its
text was not at hand; the article "Positioniergenauigkeit" of the German Wikipedia names the same three parts of P:
systematic deviation, reversal and scatter.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rtec.metrology.figures import PositioningFigures


@dataclass(frozen=True, slots=True, kw_only=True)
class VdiFigures:
    """Figures of VDI/DGQ 3441 of an axis, in the unit inside: mm or degrees."""

    uncertainty: float
    """P, Positionsunsicherheit: largest x̄_i + (U_i + P_si) / 2 minus smallest x̄_i - (U_i + P_si) / 2."""
    deviation: float
    """P_a, Positionsabweichung: largest minus smallest x̄_i."""
    max_reversal: float
    mean_reversal: float
    """``max_reversal``, ``mean_reversal``: U_max, Ū, Umkehrspanne: largest and mean U_i = abs(x̄_i↑ - x̄_i↓)."""
    max_scatter: float
    mean_scatter: float
    """``max_scatter``, ``mean_scatter``: P_smax, P̄_s, Positionsstreubreite: largest and mean P_si = 6 s_i."""

    def to_dict(self, factor: float) -> dict[str, float]:
        """Return the figures under their symbols, each times ``factor``: a number of the unit inside is one of them.

        Examples
        --------
        >>> VdiFigures(uncertainty=5, deviation=1, max_reversal=2, mean_reversal=1, max_scatter=3,
        ...            mean_scatter=2).to_dict(1e3)["P"]
        5000.0
        """
        values = {
            "P": self.uncertainty,
            "Pa": self.deviation,
            "U_max": self.max_reversal,
            "U_mean": self.mean_reversal,
            "Ps_max": self.max_scatter,
            "Ps_mean": self.mean_scatter,
        }
        return {key: float(value) * factor for key, value in values.items()}


def vdi_figures(figures: PositioningFigures) -> VdiFigures | None:
    """Return the figures of VDI/DGQ 3441 of the targets that were read twice each way at least; None without any.

    Examples
    --------
    >>> from rtec.metrology import Readings, positioning_figures
    >>> r = Readings(target_mm=[0, 1, 1, 0] * 2, deviation_mm=[0, 1, 4, 2, 0, 1, 4, 4],
    ...              direction=[1, 1, -1, -1] * 2, run=[1] * 4 + [2] * 4)
    >>> v = vdi_figures(positioning_figures(r))
    >>> v.deviation, v.max_reversal, round(v.max_scatter / 2**0.5, 9)  # s is sqrt(2) at target 0, backward
    (1.0, 3.0, 3.0)
    """
    at = figures.at_targets
    scatter = 3.0 * (at.spread_forward + at.spread_backward)
    known = np.isfinite(scatter)
    if not known.any():
        return None
    scatter, mean, reversal = scatter[known], at.mean[known], np.abs(at.reversal[known])
    half = (reversal + scatter) / 2.0
    return VdiFigures(
        uncertainty=float((mean + half).max() - (mean - half).min()),
        deviation=float(np.ptp(mean)),
        max_reversal=float(reversal.max()),
        mean_reversal=float(reversal.mean()),
        max_scatter=float(scatter.max()),
        mean_scatter=float(scatter.mean()),
    )
