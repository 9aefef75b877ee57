"""A circle test: radial deviations over the angle, in both senses, whole revolutions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rtec.errors import ArgumentError

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]

NEARLY_WHOLE_DEG = 355.0
"""From here on an arc counts as a revolution."""
_WIDEST_GAP_DEG = 15.0
_FEWEST, _MOST = 90, 1800
"""Points of a revolution; where there are more, means are taken."""
_MOST_PASSES = 40
_ROUNDS, _MOST_OFFSET = 3, 0.2
"""Of the search for the centre, whose offset is not more than a part of the radius."""
_RADIUS_MM = (1.0, 10_000.0)
_LARGEST_UM = 5000.0
_SENSES = {1.0: "counter-clockwise", -1.0: "clockwise"}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CircleTest:
    """Whole revolutions of a circle test, in both senses. Arrays have the shape (points,), pass after pass."""

    turn_rad: Floats
    """From +X towards +Y, going on over a whole turn within a pass."""
    deviation_um: Floats
    """Radius less nominal radius."""
    sense: Floats
    """+1 counter-clockwise, -1 clockwise."""
    number: Integers
    """Of the pass, from 0 on."""
    radius_mm: float
    """Nominal, or the mean where none is stated."""
    radius_known: bool
    feed_mm_s: float | None
    """Along the circle."""
    notes: tuple[str, ...] = ()

    @property
    def angle_rad(self) -> Floats:
        """From +X towards +Y, 0 to 2 pi."""
        return self.turn_rad % (2.0 * np.pi)

    @property
    def points_a_revolution(self) -> int:
        """Of the pass with the fewest."""
        return int(np.bincount(self.number).min())


def circle_test(
    angle_deg: npt.ArrayLike,
    deviation_um: npt.ArrayLike,
    sense: npt.ArrayLike,
    *,
    radius_mm: float,
    radius_known: bool = True,
    feed_mm_s: float | None = None,
    run: npt.ArrayLike | None = None,
    notes: Sequence[str] = (),
) -> CircleTest:
    """Return whole revolutions of a circle test; overshoot arcs in front of and behind them are cut off.

    Parameters
    ----------
    angle_deg
        From +X towards +Y, shape (points,), in the order of the recording; it may go on beyond 360.
    deviation_um
        Radius less nominal radius, shape (points,).
    sense
        +1 counter-clockwise, -1 clockwise, shape (points,).
    radius_mm
        Nominal, 1 mm to 10 m.
    radius_known
        Whether it is that of a calibrated bar, so that a change of the radius means something.
    feed_mm_s
        Along the circle, where it is known.
    run
        Tells passes of the same sense apart that follow each other, shape (points,).
    notes
        What was found out before.

    Raises
    ------
    ArgumentError
        Arrays of other shapes, values that are not finite, a radius outside its range, deviations beyond 5 mm, a
        constant deviation, one sense only, an arc below a revolution, a gap, or fewer than 90 points a revolution.

    Examples
    --------
    >>> way = np.linspace(-20.0, 380.0, 401)
    >>> test = circle_test([*way, *way[::-1]], np.sin(np.arange(802.0)), [1] * 401 + [-1] * 401, radius_mm=150.0)
    >>> test.points_a_revolution, test.notes
    (360, ('overshoot arcs are cut off: 20.5 deg in front of and behind each revolution',))
    """
    angle, deviation, way, runs = _checked(angle_deg, deviation_um, sense, run)
    if not _RADIUS_MM[0] <= radius_mm <= _RADIUS_MM[1]:
        raise ArgumentError("radius", f"{radius_mm:g} mm", "1 mm to 10 m")
    deviation = _straightened(np.radians(angle), deviation, radius_mm)
    said = list(notes)
    if np.count_nonzero(np.diff(way)) > _MOST_PASSES:
        order = np.lexsort((-way, runs))  # the rows of a table by angle, with both senses in turn
        angle, deviation, way, runs = (column[order] for column in (angle, deviation, way, runs))
        said.append("the senses change from row to row: the rows of each are taken together")
    begins = np.flatnonzero((np.diff(way) != 0.0) | (np.diff(runs) != 0.0)) + 1
    parts = [_whole(angle, part, _SENSES[float(way[part[0]])]) for part in np.split(np.arange(angle.size), begins)]
    if (beyond := max(cut for _, _, cut in parts)) > 1.0:
        said.append(f"overshoot arcs are cut off: {beyond:.3g} deg in front of and behind each revolution")
    together = max(1, *(rows.size // round(turns * _MOST) for rows, turns, _ in parts))
    if together > 1:
        said.append(f"the means of {together} points are taken for one: at most {_MOST} a revolution")
    means = [
        _means(np.radians(np.unwrap(angle[rows], period=360.0)), deviation[rows], together) for rows, *_ in parts
    ]
    sizes = [turn.size for turn, _ in means]
    return CircleTest(
        turn_rad=np.concatenate([turn for turn, _ in means]),
        deviation_um=np.concatenate([values for _, values in means]),
        sense=np.repeat([way[rows[0]] for rows, *_ in parts], sizes),
        number=np.repeat(np.arange(len(parts)), sizes),
        radius_mm=float(radius_mm),
        radius_known=radius_known,
        feed_mm_s=feed_mm_s,
        notes=tuple(said),
    )


def _checked(
    angle_deg: npt.ArrayLike, deviation_um: npt.ArrayLike, sense: npt.ArrayLike, run: npt.ArrayLike | None
) -> tuple[Floats, Floats, Floats, Floats]:
    """Return the columns as arrays, all of one shape and finite, with both senses and a circle in them."""
    angle, deviation, way = (np.asarray(x, dtype=np.float64) for x in (angle_deg, deviation_um, sense))
    runs = np.zeros(way.shape) if run is None else np.asarray(run, dtype=np.float64)
    for name, values in (("angle", angle), ("deviation", deviation), ("sense", way), ("run", runs)):
        if values.ndim != 1 or values.size != angle.size or not np.isfinite(values).all():
            raise ArgumentError(name, f"an array of shape {values.shape}", f"{angle.size} finite numbers")
    if not np.isin(way, (-1.0, 1.0)).all():
        wrong = way[~np.isin(way, (-1.0, 1.0))][0]
        raise ArgumentError("sense", f"{wrong:g}", "+1 (counter-clockwise) or -1 (clockwise)")
    for which, word in _SENSES.items():
        if not (way == which).any():
            allowed = "both senses: squareness and servo mismatch look alike in one"
            raise ArgumentError("sense", "", allowed, problem=f"has no {word} revolution")
    if not np.ptp(deviation) > 0.0:
        raise ArgumentError("deviation", "", "a recording of a circle", problem="is the same everywhere")
    largest = float(np.abs(deviation).max())
    if largest > _LARGEST_UM:
        allowed = "deviations up to 5 mm; are radius and unit right, and the lead-in cut off?"
        raise ArgumentError("deviation", "", allowed, problem=f"goes up to {largest / 1e3:.4g} mm")
    return angle, deviation, way, runs


def _straightened(angle_rad: Floats, deviation_um: Floats, radius_mm: float) -> Floats:
    """Return the deviation without what an offset of the centre does in second order: an oval of offset^2 / (4 R).

    The angle is that of the machine's command; the length of the bar is exact.
    """
    along = np.column_stack([np.cos(angle_rad), np.sin(angle_rad)])
    across = np.column_stack([-along[:, 1], along[:, 0]])
    basis = np.column_stack([along, np.ones(angle_rad.size)])
    length = radius_mm + 1e-3 * deviation_um
    found = deviation_um
    for _ in range(_ROUNDS):
        offset = 1e-3 * np.linalg.lstsq(basis, found, rcond=None)[0][:2]
        if np.hypot(*offset) > _MOST_OFFSET * radius_mm:
            return deviation_um
        found = 1e3 * (np.sqrt(np.maximum(length**2 - (across @ offset) ** 2, 0.0)) - radius_mm)
    return found


def _means(turn_rad: Floats, deviation_um: Floats, together: int) -> tuple[Floats, Floats]:
    """Return means of neighbouring points, shape (points // together,) each."""
    size = turn_rad.size // together * together
    return turn_rad[:size].reshape(-1, together).mean(axis=1), deviation_um[:size].reshape(-1, together).mean(axis=1)


def _whole(angle_deg: Floats, rows: Integers, sense: str) -> tuple[Integers, float, float]:
    """Return the rows of the whole revolutions in the middle of a pass, their number, and what is cut at each end."""
    way = np.unwrap(angle_deg[rows], period=360.0)
    away = np.abs(way - way[0]) if rows.size else way
    step = float(np.median(np.abs(np.diff(way)))) if rows.size > 1 else 0.0
    arc = float(away.max(initial=0.0)) + step
    if arc < NEARLY_WHOLE_DEG:
        allowed = "a whole revolution in each sense; partial arcs do not tell the errors apart"
        raise ArgumentError("angle", "", allowed, problem=f"of a {sense} pass covers {arc:.4g} deg only")
    turns = np.floor((arc + 360.0 - NEARLY_WHOLE_DEG) / 360.0) * 360.0
    beyond = max((arc - turns) / 2.0, 0.0)
    inside = (away >= beyond) & (away < beyond + turns - 1e-9)
    found = rows[inside]
    if found.size < _FEWEST * turns / 360.0:
        raise ArgumentError("angle", f"{found.size} points", f"at least {_FEWEST} a revolution")
    gap = float(np.abs(np.diff(way[inside])).max())
    if gap > _WIDEST_GAP_DEG:
        raise ArgumentError(
            "angle", "", f"at most {_WIDEST_GAP_DEG:g} deg between points", problem=f"jumps {gap:.3g} deg"
        )
    return found, turns / 360.0, beyond
