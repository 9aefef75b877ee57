"""Lines and arcs joined to one curve, their corners rounded within a tolerance."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from rtec.toolpath.nurbs import Nurbs
from rtec.toolpath.path import Path

Floats = npt.NDArray[np.float64]
Frame = tuple[Floats, Floats, Floats]
"""Points, tangents and curvature vectors, each (n, 3), or (3,)."""

DEGREE = 5
HELIX_MM = 1e-9
"""Largest error of the quintics of a helix; lines and arcs in the plane are exact."""
_REVERSAL = -0.99
"""Cosine of the turn beyond which a corner is left as it is: a rounded one would be as sharp."""
_SMOOTH = 1e-9
_RISE = np.array([[math.comb(2, j) * math.comb(3, i - j) / math.comb(5, i) if 0 <= i - j <= 3 else 0.0
                   for j in range(3)] for i in range(6)])  # fmt: skip
"""Control points of degree 2 become those of degree 5."""
_U = np.linspace(0.0, 1.0, 65)
_BERNSTEIN = np.column_stack([math.comb(5, i) * _U**i * (1.0 - _U) ** (5 - i) for i in range(6)])


@dataclass(frozen=True, kw_only=True, eq=False)
class Piece:
    """A line, or an arc about an axis along z, which rises evenly.

    Parameters
    ----------
    start, end
        (3,) In mm.
    centre
        (2,) Of an arc.
    sweep
        Angle of an arc in radians, positive counter-clockwise; 0 for a line.
    feed_mm_s
        Largest feed allowed.
    blend_mm
        Tolerance of the blend at its end.
    """

    start: Floats
    end: Floats
    centre: Floats | None = None
    sweep: float = 0.0
    feed_mm_s: float = math.inf
    blend_mm: float = 0.0

    @cached_property
    def radius(self) -> float:
        """Of an arc, in mm; 0 for a line."""
        return 0.0 if self.centre is None else float(np.hypot(*(self.start[:2] - self.centre)))

    @cached_property
    def length(self) -> float:
        """In mm."""
        if self.centre is None:
            return float(np.linalg.norm(self.end - self.start))
        return math.hypot(self.radius * self.sweep, self.end[2] - self.start[2])

    def frame(self, along: Floats) -> Frame:
        """Return the frame at arc lengths (n,) from the start."""
        part = (np.asarray(along) / self.length)[..., None]
        chord = self.end - self.start
        if self.centre is None:
            flat = np.zeros((*np.shape(along), 3))
            return self.start + part * chord, flat + chord / self.length, flat
        rate = self.sweep / self.length
        begin = math.atan2(*(self.start[:2] - self.centre)[::-1])
        angle = begin + self.sweep * part[..., 0]
        out = self.radius * np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=-1)
        turned = np.stack([-out[..., 1], out[..., 0], np.zeros_like(angle)], axis=-1)
        lift = np.array([0.0, 0.0, 1.0])
        middle = np.array([*self.centre, self.start[2]])
        return (
            middle + out + part * chord[2] * lift,
            rate * turned + chord[2] / self.length * lift,
            -(rate**2) * out,
        )

    def curves(self, first: float, last: float) -> list[Floats]:
        """Return control points (6, 4), times the weight and with it, of the part between two arc lengths."""
        angle = abs(self.sweep) * (last - first) / self.length
        if self.centre is None:
            cuts = np.array([first, last])
        elif self.start[2] == self.end[2]:
            cuts = np.linspace(first, last, math.ceil(angle / (math.pi / 2.0) - 1e-9) + 1)
        else:
            widest = (46080.0 * HELIX_MM / self.radius) ** (1.0 / 6.0)  # what a quintic leaves of r a^6 / (2^6 6!)
            cuts = np.linspace(first, last, math.ceil(angle / widest) + 1)
        points, tangents, bends = self.frame(cuts)
        if self.centre is not None and self.start[2] != self.end[2]:
            frames = list(zip(points, tangents, bends, strict=True))
            return [hermite(a, b, cuts[1] - cuts[0]) for a, b in pairwise(frames)]
        half = abs(self.sweep) * (cuts[1] - cuts[0]) / self.length / 2.0
        legs = (self.radius * math.tan(half) if half else (cuts[1] - cuts[0]) / 2.0) * tangents
        return [
            _RISE @ np.array([[*a, 1.0], [*(a + leg) * math.cos(half), math.cos(half)], [*b, 1.0]])
            for a, leg, b in zip(points, legs, points[1:], strict=False)
        ]


def hermite(begin: Frame, end: Frame, length: float) -> Floats:
    """Return control points (6, 4) of a quintic with the point, tangent and curvature of two frames.

    ``length`` is its speed at both ends.
    """
    (a, ta, ka), (b, tb, kb) = begin, end
    step, bend = length / 5.0, length**2 / 20.0
    points = [a, a + step * ta, a + 2 * step * ta + bend * ka, b - 2 * step * tb + bend * kb, b - step * tb, b]
    return np.column_stack([points, np.ones(6)])


def joined(name: str, pieces: Sequence[Piece], dimensions: int) -> Path:
    """Return the path of pieces, each of which begins where the one before ends.

    Notes
    -----
    Where direction or curvature jumps, both pieces are cut at the same distance from the joint, at most at their
    middles. A quintic with the points, directions and curvatures of both cuts replaces what lies between, so that
    the curvature is continuous. Its deviation is measured between points of equal parameter, which is never less
    than the distance of the curves.
    """
    cut = [0.0, *(_cut(a, b) for a, b in pairwise(pieces)), 0.0]
    curves: list[Floats] = []
    feeds: list[float] = []
    for i, piece in enumerate(pieces):
        first, last = cut[i], piece.length - cut[i + 1]
        if last - first > _SMOOTH * piece.length:
            parts = piece.curves(first, last)
            curves += parts
            feeds += [piece.feed_mm_s] * len(parts)
        if cut[i + 1]:
            curves.append(_blend(piece, pieces[i + 1], cut[i + 1]))
            feeds.append(min(piece.feed_mm_s, pieces[i + 1].feed_mm_s))
    points = np.concatenate([curves[0][:1], *(each[1:] for each in curves)])
    knots = np.repeat(np.arange(len(curves) + 1.0), DEGREE)
    curve = Nurbs(
        degree=DEGREE,
        knots=np.concatenate([knots[:1], knots, knots[-1:]]),
        control_points_mm=points[:, :dimensions] / points[:, 3:],
        weights=points[:, 3],
    )
    limits = np.array(feeds)
    return Path(name=name, curve=curve, feed_limits=limits if np.isfinite(limits).any() else None)


def _blend(a: Piece, b: Piece, cut: float) -> Floats:
    return hermite(a.frame(np.array(a.length - cut)), b.frame(np.array(cut)), 2.0 * cut)


def _cut(a: Piece, b: Piece) -> float:
    """Return how far from the joint of two pieces their blend begins and ends; 0 where there is none."""
    (_, before, bent), (_, after, bends) = a.frame(np.array(a.length)), b.frame(np.array(0.0))
    turn = float(np.linalg.norm(after - before))
    smooth = turn < _SMOOTH and np.linalg.norm(bends - bent) < _SMOOTH / min(a.length, b.length)
    if smooth or a.blend_mm <= 0.0 or before @ after < _REVERSAL:
        return 0.0
    cut = min(a.length, b.length) / 2.0
    order = 1.0 if turn > _SMOOTH else 0.5  # how the deviation falls with the cut: at a corner as it, else faster
    for _ in range(50):
        along = (2.0 * _U - 1.0) * cut
        old = np.concatenate([a.frame(a.length + along[along < 0.0])[0], b.frame(along[along >= 0.0])[0]])
        off = float(np.linalg.norm(_BERNSTEIN @ _blend(a, b, cut)[:, :3] - old, axis=1).max())
        if off <= a.blend_mm:
            return cut
        if a.centre is None and b.centre is None:  # between lines everything scales with the cut
            return cut * a.blend_mm / off
        cut *= 0.999 * (a.blend_mm / off) ** order
    return 0.0
