"""The square of the feed over the path: quadratic pieces, which in time are hyperbolic or circular functions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rtec.toolpath._feed_grid import Floats, Grid, Ints


@dataclass(frozen=True, slots=True)
class Profile:
    """The square ``q`` of the feed on each piece.

    Notes
    -----
    Between the stops ``q = q0 + q1 u + q2 u^2`` with ``u = s - start``. Since the acceleration along the path is half
    the derivative of ``q`` by ``s``, ``u`` obeys the linear equation ``u'' = q1 / 2 + q2 u``: it is known in closed
    form, and so is the time. At a stop the jerk along the path is constant, so that ``q = q0 (r / length)^(4/3)``
    with ``r`` the distance from the stop.
    """

    breaks_mm: Floats
    """Shape (n + 1,): the ends of the pieces."""
    end: Ints
    """+1 for a piece that leaves a stop, -1 for one that comes to a stop, else 0."""
    q0: Floats
    """mm2/s2; of an end piece its largest value."""
    q1: Floats
    q2: Floats
    start_s: Floats
    """Shape (n + 1,): the times at the breaks, from zero."""

    @property
    def length_mm(self) -> Floats:
        """Length of each piece, shape (n,)."""
        return np.diff(self.breaks_mm)

    def at_place(self, piece: Ints, share: Floats) -> tuple[Floats, Floats, Floats]:
        """Return ``q`` and its two derivatives by ``s`` at places 0 to 1 of pieces, each of shape (p,)."""
        length, end, q0 = self.length_mm[piece], self.end[piece], self.q0[piece]
        u = share * length
        q1 = self.q1[piece] + 2.0 * self.q2[piece] * u
        q, q2 = q0 + (self.q1[piece] + self.q2[piece] * u) * u, 2.0 * self.q2[piece]
        e = np.flatnonzero(end)
        r = np.maximum(np.where(end[e] > 0, share[e], 1.0 - share[e]), 1e-12)
        q[e] = q0[e] * np.cbrt(r) ** 4
        q1[e] = 4.0 / 3.0 * end[e] * q[e] / (r * length[e])
        q2[e] = 4.0 / 9.0 * q[e] / (r * length[e]) ** 2
        return q, q1, q2

    def at_time(self, t_s: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        """Return arc length and its three derivatives by time, each of shape (n,)."""
        piece = np.clip(np.searchsorted(self.start_s, t_s, side="right") - 1, 0, self.q0.size - 1)
        end, a, b = self.end[piece], self.q1[piece] / 2.0, self.q2[piece]
        t, k = t_s - self.start_s[piece], np.sqrt(abs(b))
        v = np.sqrt(self.q0[piece])
        x = k * t
        grows = b > 0.0
        half = np.where(grows, np.sinh(np.minimum(x, 300.0) / 2.0), np.sin(x / 2.0))
        with np.errstate(invalid="ignore", divide="ignore"):
            s1 = np.where(x < 1e-8, t, np.where(grows, np.sinh(np.minimum(x, 300.0)), np.sin(x)) / k)
            c1 = np.where(x < 1e-8, t * t / 2.0, 2.0 * (half / k) ** 2)
        c = 1.0 + b * c1
        s, speed, acceleration = v * s1 + a * c1, v * c + a * s1, a * c + b * v * s1
        jerk = b * speed
        e = np.flatnonzero(end)
        left = np.where(end[e] > 0, t[e], self.start_s[piece[e] + 1] - t_s[e])
        length, sign = self.length_mm[piece[e]], end[e]
        jerk[e] = 2.0 / 9.0 * v[e] ** 3 / length**2
        r = jerk[e] * left**3 / 6.0
        s[e] = np.where(sign > 0, r, length - r)
        speed[e], acceleration[e] = jerk[e] * left**2 / 2.0, sign * jerk[e] * left
        s = np.clip(s, 0.0, self.length_mm[piece])
        return self.breaks_mm[piece] + s, np.maximum(speed, 0.0), acceleration, jerk


def profile_of(grid: Grid, values: tuple[Floats, Floats, Floats]) -> Profile:
    """Return the profile of Bernstein ordinates (first, middle, last), each of shape (n,).

    Those of an end piece are all three its largest value.
    """
    first, middle, last = values
    length, end = np.diff(grid.breaks_mm), grid.end
    inner = end == 0
    q1 = np.where(inner, 2.0 * (middle - first) / length, 0.0)
    q2 = np.where(inner, (first - 2.0 * middle + last) / length**2, 0.0)
    k, speeds = np.sqrt(abs(q2)), np.sqrt(first) + np.sqrt(last)
    # with both end speeds the time has no difference of near numbers: k h / (v0 + v1) = tanh(k t / 2), or tan
    x = k * length / speeds
    with np.errstate(invalid="ignore", divide="ignore"):
        exact = 2.0 / k * np.where(q2 > 0.0, np.arctanh(np.minimum(x, 1.0 - 1e-16)), np.arctan(x))
    duration = np.where(x < 1e-8, 2.0 * length / speeds, exact)
    duration = np.where(inner, duration, 3.0 * length / np.sqrt(first))
    start = np.concatenate(([0.0], np.cumsum(duration)))
    return Profile(grid.breaks_mm, end, first, q1, q2, start)
