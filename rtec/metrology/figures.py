"""The result of a positioning test: every figure with its definition, and its form under the contract's names.

Index i is the target, j the run, an up arrow the forward direction, a down arrow the backward one. n readings x_ij of
the deviation (actual minus target) give at each target and direction the mean x̄_i and the sample standard deviation
s_i (with n - 1). Every figure names the term of ISO 230-2:2014, clause 3, that defines it.
"""

from __future__ import annotations

import enum
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from rtec.errors import unknown
from rtec.metrology.cyclic import CyclicError
from rtec.metrology.readings import Floats, Integers
from rtec.units import UNITS as TABLE


class Coordinate(enum.Enum):
    """Kind of axis; the value is the unit of its figures inside."""

    LINEAR = "mm"
    ANGULAR = "deg"


UNITS: dict[Coordinate, dict[str, float]] = {
    Coordinate.LINEAR: {name: 1.0 / TABLE[name].factor for name in ("um", "mm", "nm", "inch")},
    Coordinate.ANGULAR: {name: 1.0 / TABLE[name].factor for name in ("arcsec", "deg", "urad")},
}
"""Units of the results; the first is the default."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TargetFigures:
    """Figures of each target, shape (targets,), in the unit inside; NaN where readings are lacking."""

    target: Floats
    """Target positions P_i, increasing."""
    count_forward: Integers
    count_backward: Integers
    """Of each direction, number of readings n."""
    mean_forward: Floats
    mean_backward: Floats
    """Of each direction, x̄_i: mean unidirectional positioning deviation at a position."""
    spread_forward: Floats
    spread_backward: Floats
    """Of each direction, s_i: estimator of the unidirectional repeatability at a position, the standard deviation
    with n - 1."""
    mean: Floats
    """Mean bidirectional positioning deviation at a position, (x̄_i↑ + x̄_i↓) / 2."""
    reversal: Floats
    """B_i: reversal error at a position, x̄_i↑ - x̄_i↓."""
    repeatability_forward: Floats
    repeatability_backward: Floats
    """R_i↑, R_i↓: unidirectional positioning repeatability at a position, 4 s_i."""
    repeatability: Floats
    """R_i: bidirectional positioning repeatability at a position, the largest of 2 s_i↑ + 2 s_i↓ + abs(B_i), R_i↑
    and R_i↓."""
    extent: Floats
    """Largest minus smallest of all readings at the target, both directions."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PositioningFigures:
    """Figures of an axis, in mm for a linear axis and in degrees for a rotary one; None where not available."""

    coordinate: Coordinate
    """Linear or angular."""
    at_targets: TargetFigures
    """Figures of each target."""
    iso: Mapping[str, float | None]
    """The figures of ISO 230-2 by their symbols, those of one direction as ``A_forward`` and ``A_backward``:

    - A: bidirectional accuracy of positioning of an axis, largest x̄_i + 2 s_i of both directions minus smallest
      x̄_i - 2 s_i of both; A↑, A↓: the same in one direction (unidirectional accuracy).
    - R: bidirectional positioning repeatability of an axis, the largest R_i; R↑, R↓: the largest R_i↑, R_i↓.
    - E: bidirectional systematic positioning error, largest minus smallest x̄_i of both directions; E↑, E↓:
      of one.
    - M: mean bidirectional positioning error, largest minus smallest (x̄_i↑ + x̄_i↓) / 2.
    - B: reversal error of an axis, the largest abs(B_i).
    - B̄ (``B_mean``): mean reversal error of an axis, the mean of the signed B_i."""
    max_repeat: float | None
    """Thesis, Table 5-1, which prints "Max Repeat" without saying what it is. Here: largest minus smallest of all
    readings at one target, both directions, at the target where that is largest."""
    cyclic_forward: CyclicError | None
    cyclic_backward: CyclicError | None
    """Cyclic error of each direction, or None where no period was given."""
    rms: float
    """Root mean square of all deviations, about zero."""
    peak_to_peak: float
    """Largest minus smallest of all deviations."""
    runs: int
    """Smallest number of readings at a target from a direction that was measured."""
    warnings: tuple[str, ...]
    """What the reader of the figures has to know."""

    @property
    def max_average_error(self) -> float | None:
        """Thesis, section 5.1: highest minus lowest average value over both directions, which is E."""
        return self.iso["E"]

    @property
    def max_reversal_error(self) -> float | None:
        """Thesis, section 5.1: largest difference of the averages of both directions at one target, which is B."""
        return self.iso["B"]

    @property
    def cyclic_pp(self) -> float | None:
        """Cyclic error peak to peak, forward as in the thesis (Figure 5.2), backward where that is all there is."""
        first = self.cyclic_forward or self.cyclic_backward
        return None if first is None else first.peak_to_peak

    @property
    def lengths(self) -> dict[str, float | None]:
        """The figures that are lengths or angles, in the unit inside, under the contract's names."""
        cyclic = {"_forward": self.cyclic_forward, "_backward": self.cyclic_backward}
        return {
            **self.iso,
            "max_average_error": self.max_average_error,
            "max_reversal_error": self.max_reversal_error,
            "max_repeat": self.max_repeat,
            "cyclic_pp": self.cyclic_pp,
            **{f"cyclic_pp{way}": None if fit is None else fit.peak_to_peak for way, fit in cyclic.items()},
            "rms": self.rms,
            "pp": self.peak_to_peak,
        }

    def to_dict(self, unit: str | None = None) -> dict[str, object]:
        """Return the figures under the contract's names, ready for JSON.

        Parameters
        ----------
        unit
            ``um``, ``mm``, ``nm``, ``inch``; for a rotary axis ``arcsec``, ``deg``, ``urad``. None: the first.

        Returns
        -------
        dict
            ``unit``, ``targets`` (their number), ``at_targets`` (an entry each, its position in ``target_mm`` or
            ``target_deg``), ``A``, ``R``,
            ``E`` with ``_forward`` and ``_backward``, ``M``, ``B``, ``B_mean``, the thesis's figures, ``warnings``.

        Raises
        ------
        ArgumentError
            A unit that the axis does not have.

        Examples
        --------
        >>> from rtec.metrology import Readings, positioning_figures
        >>> r = Readings(target_mm=[0, 1, 1, 0], deviation_mm=[0, 0.001, 0.004, 0.002],
        ...              direction=[1, 1, -1, -1], run=[1, 1, 1, 1])
        >>> d = positioning_figures(r).to_dict("um")
        >>> d["unit"], round(d["E"], 6), round(d["B"], 6), d["R"], d["targets"]
        ('um', 4.0, 3.0, None, 2)
        """
        name, factor = self.unit_of(unit)

        def scaled(value: float | None) -> float | None:
            return None if value is None or np.isnan(value) else float(value) * factor

        lengths = {key: scaled(value) for key, value in self.lengths.items()}
        rms, pp = lengths.pop("rms"), lengths.pop("pp")
        fit = self.cyclic_forward or self.cyclic_backward
        return {
            "unit": name,
            "targets": int(self.at_targets.target.size),
            "at_targets": self._targets(factor),
            **lengths,
            "cyclic_note": "no period given" if fit is None else fit.note,
            "rms": rms,
            "pp": pp,
            "runs": self.runs,
            "warnings": list(self.warnings),
        }

    def unit_of(self, unit: str | None) -> tuple[str, float]:
        """Return the name of a unit of results, and the factor to it from the unit inside; errors as of `to_dict`."""
        units = UNITS[self.coordinate]
        name = next(iter(units)) if unit is None else unit.strip().replace("µ", "u").replace("μ", "u")
        if name not in units:
            raise unknown("unit", name, units, noun="unit of results")
        return name, units[name]

    def _targets(self, factor: float) -> list[dict[str, float | int | None]]:
        at = self.at_targets
        columns = {
            "mean_forward": at.mean_forward,
            "mean_backward": at.mean_backward,
            "mean": at.mean,
            "reversal": at.reversal,
            "s_forward": at.spread_forward,
            "s_backward": at.spread_backward,
            "R_forward": at.repeatability_forward,
            "R_backward": at.repeatability_backward,
            "R": at.repeatability,
        }
        rows: list[dict[str, float | int | None]] = []
        for index, target in enumerate(at.target.tolist()):
            row: dict[str, float | int | None] = {f"target_{self.coordinate.value}": target}
            for key, values in columns.items():
                value = float(values[index])
                row[key] = None if np.isnan(value) else value * factor
            row["n_forward"], row["n_backward"] = int(at.count_forward[index]), int(at.count_backward[index])
            rows.append(row)
        return rows
