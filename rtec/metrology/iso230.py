"""Positioning figures of an axis: those of ISO 230-2 and those of the thesis.

The figures are defined where they are kept, in `figures.PositioningFigures`; here they are computed.

References
----------
ISO 230-2:2014, Test code for machine tools, part 2: accuracy and repeatability of positioning, clause 3; on
targets and runs, clauses 4 and 5.
Thesis, section 5.1 and Table 5-1.
"""

from __future__ import annotations

import math

import numpy as np

from rtec.metrology.cyclic import CyclicError, cyclic_error
from rtec.metrology.figures import Coordinate, PositioningFigures, TargetFigures
from rtec.metrology.readings import Floats, Integers, Readings, RotaryReadings

RUNS_OF_STANDARD = 5
"""Runs in each direction that the standard asks for."""
TARGETS_OF_STANDARD = 5
"""Least number of targets of a linear axis that the standard asks for, and least number a metre."""
LONG_AXIS_MM, LONG_STEP_MM = 2000.0, 250.0
"""Travel from which on one run in each direction will do, at targets that are so far apart on average."""
TARGETS_OF_ROTARY_AXIS = ((90.0, 3), (180.0, 5), (360.0, 8))
"""Travel in degrees up to which the standard asks for so many targets; beyond a turn, as many as that each turn."""

_SAME_TARGET = 1e-6
"""Targets closer than this, in mm or degrees, are one: positions that were added up differ in their last bits."""


def positioning_figures(
    readings: Readings | RotaryReadings, *, period: float | None = None, called: str = "target"
) -> PositioningFigures:
    """Return the figures of ISO 230-2 and of the thesis.

    Parameters
    ----------
    readings
        Of a linear or a rotary axis; runs are told by the number of readings at each target, not by their labels.
    period
        Length of a cycle for the cyclic error, in mm or degrees; None: not looked for.
    called
        What warnings call the column of the targets.

    Returns
    -------
    PositioningFigures
        With one direction only, what is defined on both is None; with a single run, what needs a standard deviation.

    Examples
    --------
    >>> r = Readings(target_mm=[0, 1, 1, 0] * 2, deviation_mm=[0, 1, 4, 2, 0, 1, 4, 4],
    ...              direction=[1, 1, -1, -1] * 2, run=[1] * 4 + [2] * 4)
    >>> f = positioning_figures(r)
    >>> f.iso["E"], f.iso["B"], f.iso["B_mean"], round(f.iso["R"], 6)
    (4.0, 3.0, -3.0, 5.828427)
    """
    if isinstance(readings, Readings):
        coordinate, target, deviation = Coordinate.LINEAR, readings.target_mm, readings.deviation_mm
    else:
        coordinate, target, deviation = Coordinate.ANGULAR, readings.target_deg, readings.deviation_deg
    at = _figures_of_targets(target, deviation, readings.direction > 0)
    both_sides = bool(np.isfinite(at.reversal).any())
    ways = {"_forward": (at.mean_forward, at.spread_forward), "_backward": (at.mean_backward, at.spread_backward)}
    high = {way: mean + 2 * spread for way, (mean, spread) in ways.items()}
    low = {way: mean - 2 * spread for way, (mean, spread) in ways.items()}
    two_spreads = bool(np.isfinite(at.repeatability).any())
    iso = {
        "A": _range(np.fmax(*high.values()), np.fmin(*low.values())) if two_spreads else None,
        **{f"A{way}": _range(high[way], low[way]) for way in ways},
        "R": _largest(at.repeatability),
        "R_forward": _largest(at.repeatability_forward),
        "R_backward": _largest(at.repeatability_backward),
        "E": _range(np.concatenate((at.mean_forward, at.mean_backward))) if both_sides else None,
        **{f"E{way}": _range(mean) for way, (mean, _) in ways.items()},
        "M": _range(at.mean),
        "B": _largest(np.abs(at.reversal)),
        "B_mean": float(np.nanmean(at.reversal)) if both_sides else None,
    }
    return PositioningFigures(
        coordinate=coordinate,
        at_targets=at,
        iso=iso,
        max_repeat=_largest(at.extent) if both_sides else None,
        cyclic_forward=_cyclic(at.target, at.mean_forward, period),
        cyclic_backward=_cyclic(at.target, at.mean_backward, period),
        rms=float(np.sqrt(np.mean(np.square(deviation)))),
        peak_to_peak=float(np.ptp(deviation)),
        runs=_runs(at),
        warnings=tuple(_warnings(at, readings, called)),
    )


def _figures_of_targets(target: Floats, deviation: Floats, forward: np.ndarray) -> TargetFigures:
    order = np.argsort(target, kind="stable")
    ordered = target[order]
    first = np.concatenate(([True], np.diff(ordered) > _SAME_TARGET))
    index = np.empty(target.size, dtype=np.int64)
    index[order] = np.cumsum(first) - 1
    starts = np.flatnonzero(first)
    n_up, mean_up, s_up = _mean_and_spread(index[forward], deviation[forward], starts.size)
    n_down, mean_down, s_down = _mean_and_spread(index[~forward], deviation[~forward], starts.size)
    reversal = mean_up - mean_down
    total = 2 * s_up + 2 * s_down + np.abs(reversal)
    # where one spread is lacking the total is NaN, and so is what needs both
    both = np.where(np.isnan(total), np.nan, np.fmax(total, np.fmax(4 * s_up, 4 * s_down)))
    by_target = deviation[order]
    extent = np.maximum.reduceat(by_target, starts) - np.minimum.reduceat(by_target, starts)
    return TargetFigures(
        target=ordered[starts],
        count_forward=n_up,
        count_backward=n_down,
        mean_forward=mean_up,
        mean_backward=mean_down,
        spread_forward=s_up,
        spread_backward=s_down,
        mean=(mean_up + mean_down) / 2,
        reversal=reversal,
        repeatability_forward=4 * s_up,
        repeatability_backward=4 * s_down,
        repeatability=both,
        extent=extent,
    )


def _mean_and_spread(index: Integers, deviation: Floats, targets: int) -> tuple[Integers, Floats, Floats]:
    """Return number, mean and sample standard deviation of the readings of each target, NaN where undefined."""
    count = np.bincount(index, minlength=targets)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = np.bincount(index, deviation, targets) / count
        squares = np.bincount(index, np.square(deviation - mean[index]), targets)
        spread = np.where(count > 1, np.sqrt(squares / np.maximum(count - 1, 1)), np.nan)
    return count, mean, spread


def _range(high: Floats, low: Floats | None = None) -> float | None:
    """Return the largest of ``high`` minus the smallest of ``low``, leaving out NaN; None where nothing is left."""
    low = high if low is None else low
    return None if np.isnan(high).all() else float(np.nanmax(high) - np.nanmin(low))


def _largest(values: Floats) -> float | None:
    return None if np.isnan(values).all() else float(np.nanmax(values))


def _cyclic(target: Floats, mean: Floats, period: float | None) -> CyclicError | None:
    known = ~np.isnan(mean)
    return cyclic_error(target[known], mean[known], period) if period is not None and known.any() else None


def _runs(at: TargetFigures) -> int:
    counts = [count[count > 0] for count in (at.count_forward, at.count_backward)]
    return int(np.concatenate(counts).min())


def _warnings(at: TargetFigures, readings: Readings | RotaryReadings, called: str) -> list[str]:
    found = []
    runs = _runs(at)
    up, down = at.count_forward.any(), at.count_backward.any()
    one_sided = int(np.isnan(at.reversal).sum())
    if not (up and down):
        found.append(f"only the {'forward' if up else 'backward'} direction was measured: no bidirectional figures")
    elif one_sided:
        found.append(f"{one_sided} of {at.target.size} targets lack one direction: no bidirectional figures there")
    travel = float(np.ptp(at.target))
    linear = isinstance(readings, Readings)
    least, which = _targets_asked(travel, linear=linear)
    asked = 1 if linear and travel > LONG_AXIS_MM else RUNS_OF_STANDARD
    if runs < asked:
        times = "once" if runs == 1 else f"{runs} times"
        first = _first_read_so_often(at, runs, "mm" if linear else "deg")
        what = f"a target was read only {times} from a direction, the first {first}"
        found.append(f"column {called}: {what}; ISO 230-2 asks for {asked} runs each way")
    if (at.count_forward < 2).all() and (at.count_backward < 2).all():
        found.append("a single run has no standard deviation: no R and no A")
    if at.target.size < least:
        found.append(f"column {called}: {at.target.size} targets; ISO 230-2 asks for at least {least} {which}")
    status = readings.status if isinstance(readings, Readings) else None
    if status is not None and (odd := int(np.count_nonzero(status))):
        found.append(f"{odd} readings carry a status other than 0; their meaning is not known and they are counted")
    return found


def _targets_asked(travel: float, *, linear: bool) -> tuple[int, str]:
    """Return the least number of targets on a travel in mm or degrees, and why so many."""
    if not linear:
        for up_to, least in TARGETS_OF_ROTARY_AXIS:
            if travel <= up_to:
                return least, f"on a travel of up to {up_to:g} deg"
        return math.ceil(travel / up_to * least), f"on {travel:g} deg, {least} each turn"
    if travel > LONG_AXIS_MM:
        return math.ceil(travel / LONG_STEP_MM), f"on {travel:g} mm, {LONG_STEP_MM:g} mm apart on average"
    least = max(TARGETS_OF_STANDARD, math.ceil(TARGETS_OF_STANDARD * travel / 1000.0))
    return least, f"on {travel:g} mm, {TARGETS_OF_STANDARD} a metre"


def _first_read_so_often(at: TargetFigures, runs: int, unit: str) -> str:
    """Return the first target that was read so often, and from where."""
    ways = (("forward", at.count_forward), ("backward", at.count_backward))
    way, counts = next((way, counts) for way, counts in ways if (counts == runs).any())
    return f"at {at.target[np.argmax(counts == runs)]:.9g} {unit} {way}"
