"""Where the tool of a machine stands: rigid slides on each other, none of them straight, square or level.

What a laser or a tracker sees of several axes at once. The error of each is made of the error motions of all slides
(ISO 230-1): three along and across the way, three angles, and a way that is not at right angles to the others.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rtec.checks import number_within
from rtec.errors import ArgumentError

Floats = npt.NDArray[np.float64]
Motion = Callable[[Floats], Floats]
"""An error motion by the position of its slide: mm in, mm or rad out, shape (n,)."""


def still(x_mm: Floats) -> Floats:
    """Return no error motion."""
    return np.zeros_like(x_mm)


@dataclass(frozen=True, slots=True, kw_only=True)
class Waves:
    """A smooth error motion: a sum of sines.

    Parameters
    ----------
    amplitudes
        In mm or rad.
    lengths_mm, phases_rad
        Of each.

    Examples
    --------
    >>> Waves(amplitudes=(0.002,), lengths_mm=(400.0,), phases_rad=(0.0,))(np.array([0.0, 100.0])).tolist()
    [0.0, 0.002]
    """

    amplitudes: tuple[float, ...]
    lengths_mm: tuple[float, ...]
    phases_rad: tuple[float, ...]

    def __call__(self, x_mm: Floats) -> Floats:
        """Return the error motion at positions of the slide."""
        waves = zip(self.amplitudes, self.lengths_mm, self.phases_rad, strict=True)
        total = np.zeros_like(np.asarray(x_mm, dtype=np.float64))
        for amplitude, length_mm, phase in waves:
            total += amplitude * np.sin(2.0 * math.pi * np.asarray(x_mm) / length_mm + phase)
        return total


@dataclass(frozen=True, slots=True, kw_only=True)
class Slide:
    """A slide on a way, and how it departs from moving straight along its axis.

    Parameters
    ----------
    shifts
        Along the axes of the machine, in mm: positioning along its own, straightness along the others.
    turns
        About the axes of the machine, in rad: roll, pitch and yaw.
    tilt_rad
        Of the way towards the other axes: the slope of its direction along each axis, that of its own is 0.
    backlash_mm
        By how much further it stands when it came from above.

    Raises
    ------
    ArgumentError
        Other than three error motions of a kind, a tilt along its own axis, or a backlash that is no length.
    """

    shifts: tuple[Motion, Motion, Motion] = (still, still, still)
    turns: tuple[Motion, Motion, Motion] = (still, still, still)
    tilt_rad: tuple[float, float, float] = (0.0, 0.0, 0.0)
    backlash_mm: float = 0.0

    def __post_init__(self) -> None:
        for name in ("shifts", "turns", "tilt_rad"):
            if len(getattr(self, name)) != 3:
                raise ArgumentError(name, f"{len(getattr(self, name))} values", "three, along or about x, y and z")
        for slope in self.tilt_rad:
            number_within("tilt_rad", slope, -0.1, 0.1, unit="rad")
        number_within("backlash_mm", self.backlash_mm, 0.0, 1.0, unit="mm")


@dataclass(frozen=True, slots=True, kw_only=True)
class Volume:
    """Slides of axes 1 to 3 on each other: the first one on the bed, each next one on the one before.

    Parameters
    ----------
    slides
        Of axes 1, 2 and 3.
    tool_mm
        Where the tool stands on the last slide.

    Raises
    ------
    ArgumentError
        Not three slides, a slide tilted along its own axis, or a tool that is no place.

    References
    ----------
    ISO 230-1; Schwenke et al. 2008, Geometric error measurement and compensation of machines: an update, CIRP Annals
    57, 660.

    Examples
    --------
    The second way leans by 30 µm in a metre towards the first axis:

    >>> volume = Volume(slides=(Slide(), Slide(tilt_rad=(30e-6, 0.0, 0.0)), Slide()))
    >>> volume.error_mm(np.array([[0.0, 300.0, 0.0]]), np.ones((1, 3))).round(9).tolist()
    [[0.009, 0.0, 0.0]]
    """

    slides: tuple[Slide, Slide, Slide]
    tool_mm: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        if len(self.slides) != 3:
            raise ArgumentError("slides", len(self.slides), "three, of axes 1, 2 and 3")
        for k, slide in enumerate(self.slides):
            if slide.tilt_rad[k] != 0.0:
                raise ArgumentError(f"tilt_rad of axis {k + 1}", slide.tilt_rad, "0 along its own axis")
        for value in self.tool_mm:
            number_within("tool_mm", value, -1e4, 1e4, unit="mm")

    def error_mm(self, position_mm: Floats, direction: Floats) -> Floats:
        """Return how far the tool is from where it should be, along each axis.

        Parameters
        ----------
        position_mm
            Of the three slides by their encoders, shape (n, 3), in mm.
        direction
            +1 or -1, in which each came, shape (n, 3).

        Returns
        -------
        numpy.ndarray
            Actual minus target, shape (n, 3), in mm.
        """
        place = np.tile(np.asarray(self.tool_mm), (position_mm.shape[0], 1))
        for k in (2, 1, 0):
            slide, x = self.slides[k], position_mm[:, k]
            turn = np.stack([motion(x) for motion in slide.turns], axis=1)
            shift = np.stack([motion(x) for motion in slide.shifts], axis=1)
            place = place + np.cross(turn, place) + shift + x[:, np.newaxis] * np.asarray(slide.tilt_rad)
            place[:, k] += x + np.where(direction[:, k] < 0.0, slide.backlash_mm, 0.0)
        return place - position_mm - np.asarray(self.tool_mm)


def drawn_volume(seed: int, *, length_mm: float = 300.0) -> Volume:
    """Return a machine of middling accuracy, drawn with a seed.

    Ways lean by some 30 µm in a metre and bend by some 2 µm, slides turn by some 20 µrad, screws err by some 5 µm
    with a backlash of 2 to 6 µm.

    Parameters
    ----------
    seed
        Draws it.
    length_mm
        Travel of each axis: error motions have waves of a half to twice of it.

    Examples
    --------
    >>> drawn_volume(1).slides[1].tilt_rad[1]
    0.0
    """
    rng = np.random.default_rng(seed)

    def waves(size: float) -> Waves:
        lengths = length_mm * rng.uniform(0.5, 2.0, 3)
        phases = rng.uniform(0.0, 2.0 * math.pi, 3)
        return Waves(
            amplitudes=tuple(size * rng.uniform(0.3, 1.0, 3)), lengths_mm=tuple(lengths), phases_rad=tuple(phases)
        )

    def slide(k: int) -> Slide:
        shifts = [waves(0.004 if axis == k else 0.0015) for axis in range(3)]
        turns = [waves(15e-6) for _ in range(3)]
        # a lower axis sets the direction that the ways above it lean away from
        tilt = [float(rng.normal(0.0, 30e-6)) if axis < k else 0.0 for axis in range(3)]
        return Slide(
            shifts=(shifts[0], shifts[1], shifts[2]),
            turns=(turns[0], turns[1], turns[2]),
            tilt_rad=(tilt[0], tilt[1], tilt[2]),
            backlash_mm=float(rng.uniform(0.002, 0.006)),
        )

    return Volume(slides=(slide(0), slide(1), slide(2)))


def there_and_back(*grids_mm: Sequence[float]) -> list[tuple[float, ...]]:
    """Return the places of a grid, line by line to and fro, then the whole way back: each axis comes from both sides.

    Parameters
    ----------
    *grids_mm
        Positions of each axis, ascending.

    Examples
    --------
    >>> there_and_back([0.0, 1.0], [0.0, 5.0])
    [(0.0, 0.0), (1.0, 0.0), (1.0, 5.0), (0.0, 5.0), (0.0, 5.0), (1.0, 5.0), (1.0, 0.0), (0.0, 0.0)]
    """
    way: list[tuple[float, ...]] = [()]
    for grid in grids_mm[::-1]:
        way = [(x, *rest) for number, rest in enumerate(way) for x in (grid if number % 2 == 0 else grid[::-1])]
    return way + way[::-1]
