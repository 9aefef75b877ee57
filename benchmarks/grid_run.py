"""Several axes that visit a grid of places together, and a tracker that sees where the tool really is."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from volume import Volume

from rtec.axis.command import Move
from rtec.checks import number_within, whole_within
from rtec.errors import ArgumentError
from rtec.machine.cell import AxisOutcome, Cell
from rtec.machine.station_settings import StationSettings
from rtec.metrology import Column, Measurement
from rtec.predictors import Model, NoError
from rtec.units import PS_PER_MS

Floats = npt.NDArray[np.float64]
_LOOK_PS = 20 * PS_PER_MS
"""Between two looks at the axes; a reading is what the last one before they go on has seen."""
_LEAD_MM = 2.0
"""Below the first place, from where all axes come to it."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GridReadings:
    """What a tracker saw of all axes.

    Parameters
    ----------
    target_mm, direction, deviation_mm
        Place, direction of the last motion, and actual minus target of each axis, shape (readings, axes).
    run
        Number of the visit, from 1, shape (readings,).
    outcomes
        What came of each axis.
    held
        Whether the machine was held before the end: then there are fewer readings than places.
    """

    target_mm: Floats
    direction: Floats
    deviation_mm: Floats
    run: npt.NDArray[np.int64]
    outcomes: tuple[AxisOutcome, ...]
    held: bool

    def of_axis(self, axis: int) -> Measurement:
        """Return the readings of one axis as a measurement: what `rtec train` takes.

        Parameters
        ----------
        axis
            Its number; the places of the others are columns ``position_NUMBER_mm``.
        """
        count = self.target_mm.shape[1]
        if not 1 <= axis <= count:
            raise ArgumentError("axis", axis, f"1 to {count}")
        mine = axis - 1
        columns = {
            "run": Column("run", "", self.run.astype(np.float64)),
            "direction": Column("direction", "", self.direction[:, mine]),
            "target": Column("target", "mm", self.target_mm[:, mine]),
            "deviation": Column("deviation", "mm", self.deviation_mm[:, mine]),
        }
        others = {f"position_{k + 1}_mm": self.target_mm[:, k] for k in range(count) if k != mine}
        return Measurement(source="grid", facts={"axis": str(axis)}, columns=columns, unknown=others)


def measure_grid(
    stations: Sequence[StationSettings],
    volume: Volume,
    places_mm: Sequence[Sequence[float]],
    *,
    predictor: Model | Sequence[Model] | None = None,
    runs: int = 1,
    feed_mm_s: float = 100.0,
    rest_s: float = 0.6,
    repeatability_mm: float = 0.0005,
    seed: int = 0,
    progress: Callable[[float], None] = lambda share: None,
) -> GridReadings:
    """Let three axes of a cell visit places one after the other, and measure the tool at each of them.

    Parameters
    ----------
    stations
        Axes 1 to 3 with their boxes.
    volume
        What their slides do to the tool.
    places_mm
        Targets of the three axes, in the order in which they are visited.
    predictor
        What the PC corrects by, one model for all or one for each; None: it corrects nothing.
    runs
        How often the places are visited.
    feed_mm_s, rest_s
        Along the lines, and how long the axes rest at each place: a position loop of 1 m/min per mm takes half a
        second to stand within a tenth of a micrometre.
    repeatability_mm
        Standard deviation of a reading along each axis: normally distributed, drawn anew for each.
    seed
        Draws it.
    progress
        Told the share done.

    Returns
    -------
    GridReadings
        In the order of the visits.

    Raises
    ------
    ArgumentError
        Not three axes, places of another number of axes, or a value outside its range.

    Examples
    --------
    >>> from volume import Slide
    >>> leaning = Volume(slides=(Slide(), Slide(tilt_rad=(30e-6, 0.0, 0.0)), Slide()))
    >>> axes = [StationSettings(axis=axis) for axis in (1, 2, 3)]
    >>> found = measure_grid(axes, leaning, [(1.0, 0.0, 0.0), (1.0, 20.0, 0.0)], repeatability_mm=0.0)
    >>> float((found.deviation_mm[1, 0] - found.deviation_mm[0, 0]).round(9))
    0.0006
    """
    if len(stations) != 3:
        raise ArgumentError("stations", f"{len(stations)} axes", "three")
    if not places_mm:
        raise ArgumentError("places_mm", "none", "one or more")
    for place in places_mm:
        if len(place) != len(stations):
            raise ArgumentError("places_mm", f"a place of {len(place)} axes", f"{len(stations)} positions each")
    number_within("repeatability_mm", repeatability_mm, 0.0, 1.0, unit="mm")
    number_within("rest_s", rest_s, 0.1, 3600.0, unit="s")
    whole_within("runs", runs, 1, 10_000)
    visits = np.tile(np.asarray(places_mm, dtype=np.float64), (runs, 1))
    path = np.vstack([visits[:1] - _LEAD_MM, visits])
    step = np.diff(path, axis=0)
    # a place that is visited twice in a row is one stop: a line without length has no shares for the axes to be at
    new = np.append(True, step.any(axis=1))
    lines = [Move(target_mm=tuple(stop), speed_mm_s=feed_mm_s, rest_s=rest_s) for stop in path[new].tolist()]
    cell = Cell(stations, lines, NoError() if predictor is None else predictor)
    seen = _seen_at_stops(cell, len(lines), progress)
    stop = np.cumsum(new)[1:] - 1
    made = stop < len(seen)
    target, way = visits[made], _directions(step)[made]
    position = np.array(seen).reshape(-1, 3)[stop[made]]
    noise = np.random.default_rng(seed).normal(0.0, repeatability_mm, target.shape)
    return GridReadings(
        target_mm=target,
        direction=way,
        deviation_mm=position + volume.error_mm(position, way) - target + noise,
        run=1 + np.flatnonzero(made) // len(places_mm),
        outcomes=cell.axes,
        held=len(seen) < len(lines),
    )


def _directions(step: Floats) -> Floats:
    """Return the direction of the last motion of each axis, shape (visits, axes); the first step moves all."""
    way = np.sign(step)
    for k in range(1, way.shape[0]):
        way[k] = np.where(way[k] == 0.0, way[k - 1], way[k])
    return way


def _seen_at_stops(cell: Cell, stops: int, progress: Callable[[float], None]) -> list[tuple[float, ...]]:
    """Run a program to its end, or until the machine is held; return where the axes rested at each stop."""
    found: list[tuple[float, ...]] = []
    while len(found) < stops and cell.held_ps is None:
        places = cell.positions_mm
        cell.run(until_ps=cell.now_ps + _LOOK_PS)
        if int(cell._stations[0].moves) > len(found):
            found.append(places)
            progress(len(found) / stops)
    return found
