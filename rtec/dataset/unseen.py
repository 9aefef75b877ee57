"""What the targets of a measurement cannot show: periods that look constant, and the change that shows them."""

from __future__ import annotations

import numpy as np

from rtec.effects import Conditions
from rtec.effects.frequency_grid import ENOUGH_PHASES, phases_seen

_HARMONICS = 6  # of a stated period that are looked at; screws and gears show few more
_FINEST_HALVES = 10  # in the usual gap: places on a grid finer than a fifth of it hide nothing that anyone looks for
_MISSED = 1e-6  # of a step, by which a place may miss its multiple
_SHIFT = 0.3  # of the hidden period: 0, 0.3 and 0.6 of it are three phases of every harmonic below the tenth
_VERNIER, _SWEEPS = 23, 6  # targets until they are one old step further, a prime; how often they get there at least
_SAME = 1e-4  # share by which two periods may differ and be the same


def unseen_periods(conditions: Conditions) -> tuple[str, ...]:
    """Return the periods that readings at these targets cannot show.

    Targets on a grid of step h show nothing of the periods h, h/2, h/3, ...: each looks constant. Of a stated period
    (screw pitch, turn, scale) also the harmonics are named of which the targets see two phases only, so that sine and
    cosine cannot be told apart. They are in the unit of the positions, such as ``5 mm / k`` (for k = 1, 2, ...) or
    ``10 mm``; none for irregular targets, a log of a moving axis, one place, and where time is the coordinate.

    Examples
    --------
    >>> x, run = np.arange(0.0, 101.0, 5.0), np.ones(21, dtype=np.int64)
    >>> unseen_periods(Conditions(position=x, position_unit="mm", run=run, screw_pitch=10.0))
    ('5 mm / k', '10 mm', '3.33333 mm', '2 mm')
    """
    unit, step = conditions.position_unit, _grid(conditions)
    found = [] if step is None else [f"{step:.6g} {unit} / k"]
    return tuple(dict.fromkeys([*found, *(f"{period:.6g} {unit}" for period in _half_seen(conditions, step))]))


def other_step(conditions: Conditions) -> float | None:
    """Return the distance of targets that would meet every unseen period at other places each time, or None.

    As a vernier does: after so many targets they are one step of the old grid further. None where nothing is hidden,
    and where the targets are too few to go round several times.
    """
    step = _grid(conditions)
    if step is None or conditions.places.size < _SWEEPS * _VERNIER:
        return None
    return float(f"{step * (1.0 + 1.0 / _VERNIER):.9g}")


def shifted_targets(conditions: Conditions) -> str | None:
    """Return the smallest change of the targets that would show the unseen periods; None where nothing is hidden."""
    unit = conditions.position_unit
    if (other := other_step(conditions)) is not None:
        apart = f"{other:.4g} {unit} apart instead of {_grid(conditions):.4g} {unit}"
        return f"measure once more with targets {apart}: hardly any period is hidden from both"
    once = target_shift(conditions)
    if once is None:
        return None
    one, two = f"{once:.4g}", f"{2 * once:.4g} {unit}"
    if np.unique(conditions.run).size < ENOUGH_PHASES:
        return f"add targets {one} {unit} and {two} beyond each of the targets"
    shifts = f"by {one} {unit} in the second run, by {two} in the third"
    return f"shift the targets {shifts}, and go on so in turn: 0, {one}, {two}"


def target_shift(conditions: Conditions) -> float | None:
    """Return by how much targets that are moved once and twice show the unseen periods; None where nothing is hidden.

    Examples
    --------
    >>> x, run = np.tile(np.arange(0.0, 101.0, 5.0), 3), np.repeat([1, 2, 3], 21)
    >>> target_shift(Conditions(position=x, position_unit="mm", run=run))
    1.5
    """
    step = _grid(conditions)
    stated = [period for period in _stated(conditions) if phases_seen(conditions.places, period) < ENOUGH_PHASES]
    hidden = _half_seen(conditions, step) + stated
    if step is None and not hidden:
        return None
    period = max([p for p in hidden if step is None or p <= 2.0 * step * (1.0 + _SAME)] or [step or max(hidden)])
    return _SHIFT * period


def _of_targets(conditions: Conditions) -> bool:
    return not (conditions.moving or conditions.time_is_coordinate or conditions.places.size < ENOUGH_PHASES)


def _grid(conditions: Conditions) -> float | None:
    """Return the step of the grid on which all targets lie, or None where there is none worth the name."""
    if not _of_targets(conditions):
        return None
    away = conditions.places - conditions.places[0]
    usual = float(np.median(np.diff(away)))
    for halves in range(2, _FINEST_HALVES + 1):  # a median of gaps is so many halves of the step
        counts = np.round(halves / 2.0 * away / usual)
        step = float(counts @ away) / float(counts @ counts)
        if np.abs(away - counts * step).max() <= _MISSED * step:
            return float(f"{step:.9g}")
    return None


def _stated(conditions: Conditions) -> list[float]:
    stated = (conditions.screw_pitch, conditions.signal_period, conditions.revolution)
    return [period for period in stated if period is not None and _of_targets(conditions)]


def _half_seen(conditions: Conditions, step: float | None) -> list[float]:
    """Return the harmonics of stated periods that too few phases show, beside those that divide the step."""
    found = []
    for stated in _stated(conditions):
        for period in stated / np.arange(1, _HARMONICS + 1):
            divides = step is not None and abs(step / period - round(step / period)) < _SAME * step / period
            if phases_seen(conditions.places, period) < ENOUGH_PHASES and not divides:
                found.append(float(period))
    return found
