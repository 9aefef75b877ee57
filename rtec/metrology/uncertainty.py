"""Measurement uncertainty of positioning figures, from what is stated of device, set-up, temperature and drift.

The contributions are those that ISO 230-2:2014, annex A, and ISO/TR 230-9:2005, annex C, name. How they act on a
figure follows from this model by the GUM, and may differ from the standards' own formulae:

- Device, misalignment and temperature stretch the measured length. Their errors are the same in all readings at a
  target, and largest at the end of the travel L: they act on E, M and A, and cancel in B and R.
- The drift of the surroundings, as the environmental variation error EVE shows it, makes an error of its own in each
  reading. It lessens in the means of n runs, and adds to every standard deviation.

With U_L for what stretches and U_V for the drift, all with the coverage factor k = 2::

    U_L² = device² + misalignment² + thermometer² + expansion²
    U(B)² = 2 U_V² / n        U(E)² = U_L² + 2 U_V² / n        U(M)² = U_L² + U_V² / n
    U(R↑) = 2 U_V             U(R)² = (2 U_V)² + U(B)²         U(A)² = U(E)² + (2 U_V)²

References
----------
JCGM 100:2008, Evaluation of measurement data - Guide to the expression of uncertainty in measurement (GUM), 4.3.7
(rectangular distribution), 5.1.2 (combination), 6.2 (expanded uncertainty).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields

import numpy as np

from rtec.errors import ArgumentError
from rtec.metrology.figures import Coordinate, PositioningFigures
from rtec.units import parse_in

_RECTANGULAR = 2.0 / math.sqrt(3.0)
"""Expanded uncertainty, k = 2, of what lies anywhere within ± 1."""
_KELVIN, _EXPANSION = "K", "um/m/K"
_NAMES = {
    "device": "device",
    "misalignment": "alignment",
    "thermometer": "temperature",
    "expansion": "coefficient of expansion",
    "eve": "surroundings, EVE",
}
"""Contributions as people call them."""
_STATED_BY = {
    "device": "device_uncertainty",
    "misalignment": "misalignment",
    "thermometer": "temperature_uncertainty, expansion",
    "expansion": "expansion_uncertainty, off_reference",
    "eve": "eve",
}
_FIGURES = ("A", "A_forward", "A_backward", "E", "E_forward", "E_backward", "M", "R", "R_forward", "R_backward", "B")


@dataclass(frozen=True, slots=True, kw_only=True)
class UncertaintyInputs:
    """What is known of the measurement; None: not stated.

    Parameters
    ----------
    device_uncertainty
        Expanded uncertainty (k = 2) of the measuring device from its certificate: a share of the length, or for a
        rotary axis an angle in degrees.
    misalignment
        Largest distance in mm, across, between the line that is measured and the axis, over the travel.
    temperature_uncertainty
        Limits ± in K of the temperature of the machine that the readings were compensated with.
    expansion
        Coefficient of expansion that they were compensated with, 1/K.
    expansion_uncertainty
        Limits ± of that coefficient, 1/K.
    off_reference
        Largest difference in K of the machine from the reference temperature during the test.
    eve
        Environmental variation error: range of the readings, in mm or degrees, of the axis at rest, over as long as
        the test took.

    Raises
    ------
    ArgumentError
        A number below zero or not finite.

    Examples
    --------
    >>> UncertaintyInputs.read({"eve": "1.2 um", "misalignment": "1 mm"}, Coordinate.LINEAR).eve
    0.0012
    """

    device_uncertainty: float | None = None
    misalignment: float | None = None
    temperature_uncertainty: float | None = None
    expansion: float | None = None
    expansion_uncertainty: float | None = None
    off_reference: float | None = None
    eve: float | None = None

    def __post_init__(self) -> None:
        for item in fields(self):
            value = getattr(self, item.name)
            if value is not None and not 0.0 <= value < math.inf:
                raise ArgumentError(item.name, value, "a number of at least 0")

    @staticmethod
    def names(coordinate: Coordinate) -> tuple[str, ...]:
        """Return the inputs that an axis of this kind has."""
        if coordinate is Coordinate.LINEAR:
            return tuple(item.name for item in fields(UncertaintyInputs))
        return "device_uncertainty", "eve"

    @classmethod
    def read(cls, texts: Mapping[str, str], coordinate: Coordinate) -> UncertaintyInputs:
        """Read inputs that are written with their units, as options and ``# key: value`` lines are.

        Any key that names no field is left alone. The kind of the axis decides on the units: of the device, for
        example, ``um/m`` or ``arcsec``.

        Raises
        ------
        ArgumentError
            A text that is no such quantity, is below zero, or says nothing of a rotary axis.
        """
        linear = coordinate is Coordinate.LINEAR
        units = {
            "device_uncertainty": ("um/m", 1e6) if linear else ("arcsec", 3600.0),
            "misalignment": ("mm", 1.0),
            "temperature_uncertainty": (_KELVIN, 1.0),
            "expansion": (_EXPANSION, 1e6),
            "expansion_uncertainty": (_EXPANSION, 1e6),
            "off_reference": (_KELVIN, 1.0),
            "eve": ("um", 1e3) if linear else ("arcsec", 3600.0),
        }
        found = {}
        for name, text in texts.items():
            if name not in units:
                continue
            if name not in cls.names(coordinate):
                raise ArgumentError(name, repr(text[:60]), "it for a linear axis", "this one is rotary: leave it out")
            unit, inside = units[name]
            found[name] = parse_in(text, unit, name=name, inside=inside)
            if found[name] < 0.0:
                raise ArgumentError(name, repr(text[:60]), f"at least 0 {unit}")
        return cls(**found)


@dataclass(frozen=True, slots=True, kw_only=True)
class PositioningUncertainty:
    """Expanded uncertainties (k = 2) in the unit inside: mm or degrees."""

    travel: float
    """Length L between the outermost targets."""
    runs: int
    """Readings n that each mean has, at least."""
    contributions: Mapping[str, float]
    """By name: ``device``, ``misalignment``, ``thermometer``, ``expansion``, ``eve``; those that were stated."""
    missing: tuple[str, ...]
    """Names of those that were not."""
    figures: Mapping[str, float | None]
    """U(A), U(E), U(M), U(R), U(B) and of the single directions (``A_forward``, ...), by the symbol; None where the
    figure is not available, or nothing that was stated acts on it."""
    spread_share: float | None
    """Share by which a standard deviation of n readings is uncertain by chance alone (one standard deviation),
    1 / sqrt(2 (n - 1)), which is not in the figures; None for a single run."""

    def statement(self, unit: str, factor: float) -> tuple[str, ...]:
        """Return in sentences what the uncertainty contains and what it does not; ``factor`` leads to ``unit``."""
        named = [f"{_NAMES[name]} {value * factor:.2g} {unit}" for name, value in self.contributions.items()]
        left = [f"{_NAMES[name]} ({_STATED_BY[name]})" for name in self.missing]
        if not named:
            return (
                f"No measurement uncertainty can be given: nothing is stated about {'; '.join(left)}. ISO 230-2 asks "
                "for it; state what is known in options or '# key: value' lines of these names.",
            )
        sure = [
            f"U({key}) {value * factor:.2g} {unit}" for key in "AREMB" if (value := self.figures[key]) is not None
        ]
        sentences = [f"Expanded measurement uncertainty, k = 2: {', '.join(sure) or 'of no figure'}."]
        sentences.append(f"It contains: {'; '.join(named)}.")
        if left:
            sentences.append(f"Not included, because not stated: {'; '.join(left)}.")
        if self.spread_share is not None:
            sentences.append(
                f"Chance is not included either: {self.runs} readings give a standard deviation to "
                f"{100.0 * self.spread_share:.0f} %, and R and A of another test of the axis may differ by as much."
            )
        return tuple(sentences)

    def to_dict(self, factor: float) -> dict[str, object]:
        """Return everything for JSON, lengths or angles times ``factor``."""

        def scaled(values: Mapping[str, float | None]) -> dict[str, float | None]:
            return {key: None if value is None else value * factor for key, value in values.items()}

        return {
            "coverage_factor": 2,
            "contributions": scaled(dict(self.contributions)),
            "missing": list(self.missing),
            **{f"U_{key}": value for key, value in scaled(self.figures).items()},
        }


def positioning_uncertainty(figures: PositioningFigures, inputs: UncertaintyInputs) -> PositioningUncertainty:
    """Return the uncertainty of positioning figures that follows from what was stated.

    Examples
    --------
    >>> from rtec.metrology import Readings, positioning_figures
    >>> r = Readings(target_mm=[0, 1000, 1000, 0] * 2, deviation_mm=[0, 1, 4, 2, 0, 1, 4, 4],
    ...              direction=[1, 1, -1, -1] * 2, run=[1] * 4 + [2] * 4)
    >>> u = positioning_uncertainty(positioning_figures(r), UncertaintyInputs(device_uncertainty=1e-6))
    >>> u.figures["E"], u.figures["B"], u.missing
    (0.001, None, ('misalignment', 'thermometer', 'expansion', 'eve'))
    """
    travel, linear = float(np.ptp(figures.at_targets.target)), figures.coordinate is Coordinate.LINEAR
    stated = {
        "device": _times(inputs.device_uncertainty, travel if linear else 1.0),
        "misalignment": _cosine(inputs.misalignment, travel),
        "thermometer": _times(inputs.temperature_uncertainty, inputs.expansion, travel, _RECTANGULAR),
        "expansion": _times(inputs.expansion_uncertainty, inputs.off_reference, travel, _RECTANGULAR),
        "eve": _times(inputs.eve, _RECTANGULAR / 2.0),
    }
    if not linear:
        stated = {name: stated[name] for name in ("device", "eve")}
    contributions = {name: value for name, value in stated.items() if value is not None}
    length = [value for name, value in contributions.items() if name != "eve"]
    drift, n = contributions.get("eve"), figures.runs
    of_reversal = [] if drift is None else [drift * math.sqrt(2.0 / n)]
    of_middle = [] if drift is None else [drift / math.sqrt(n)]
    scatter = [] if drift is None else [2.0 * drift]
    parts = {
        "A": [*length, *of_reversal, *scatter],
        "E": [*length, *of_reversal],
        "M": [*length, *of_middle],
        "R": [*scatter, *of_reversal],
        "B": of_reversal,
    }
    acting = {key: scatter if key in ("R_forward", "R_backward") else parts[key[0]] for key in _FIGURES}
    return PositioningUncertainty(
        travel=travel,
        runs=n,
        contributions=contributions,
        missing=tuple(name for name, value in stated.items() if value is None),
        figures={
            key: math.hypot(*parts) if parts and figures.iso[key] is not None else None
            for key, parts in acting.items()
        },
        spread_share=1.0 / math.sqrt(2.0 * (n - 1)) if n > 1 else None,
    )


def _times(*factors: float | None) -> float | None:
    """Return the product, or None where a factor is not stated."""
    known = [factor for factor in factors if factor is not None]
    return math.prod(known) if len(known) == len(factors) else None


def _cosine(misalignment: float | None, travel: float) -> float | None:
    """Return the expanded uncertainty of a length measured askew: it is too long by anything from 0 to a² / (2 L)."""
    if misalignment is None or travel == 0.0:
        return None
    return misalignment**2 / (2.0 * travel) * _RECTANGULAR / 2.0
