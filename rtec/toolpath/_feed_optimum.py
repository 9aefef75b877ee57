"""The shortest time on a grid: a primal-dual interior point method whose matrices have five diagonals."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solveh_banded

from rtec.toolpath._feed_grid import SAMPLES, Floats, Grid

JERK_POWER, FREE_POWER = 4.0 / 3.0, 1.0
"""Power of the distance from a stop with which the square of the feed grows, with and without a limit of jerk."""
_END_SHARES = np.linspace(1e-3, 1.0, 25) ** 3
_GAP = 1e-4
"""The time is found to this share of itself: the gap between the primal and the dual problem."""
_MOST_STEPS = 150


@dataclass(frozen=True, slots=True)
class Bounds:
    """What limits the feed at each point of a grid, and at the end pieces."""

    feed: Floats
    """Limit of ``q``, shape (p,): of the feed and of the velocity of every axis."""
    along: Floats
    """Limit of the feed along the path, shape (p,), mm/s."""
    acceleration: Floats
    """Shape (p, d)."""
    jerk: Floats
    """Shape (p, d)."""

    def lowered(self, by: Floats) -> Bounds:
        """Return the limits divided by numbers for feed, velocity, acceleration and jerk, shape (p, 1 + 3 d)."""
        axes = self.jerk.shape[1]
        feed = self.feed / by[:, : 1 + axes].max(axis=1) ** 2
        return Bounds(feed, self.along, self.acceleration / by[:, 1 + axes : -axes], self.jerk / by[:, -axes:])


def ordinates(grid: Grid, z: Floats, power: float) -> tuple[Floats, Floats, Floats]:
    """Return first, middle and last Bernstein ordinates of all pieces from the unknowns, shape (inner pieces,)."""
    inner = np.flatnonzero(grid.end == 0)
    first, middle, last = np.zeros((3, grid.pieces))
    middle[inner] = z
    before, own_first, own_last, after = _weights(grid, power)
    first[inner] = before * middle[inner - 1] + own_first * z
    last[inner] = after * middle[inner + 1] + own_last * z
    for ends, value in ((grid.first, first[grid.first + 1]), (grid.last, last[grid.last - 1])):
        first[ends] = middle[ends] = last[ends] = value
    return first, middle, last


def _weights(grid: Grid, power: float) -> tuple[Floats, Floats, Floats, Floats]:
    """Return the weights of the middle ordinates in the first and the last one of each inner piece.

    They are: of the piece before, of itself in the first, of itself in the last, of the piece after. Then ``q`` and
    its derivative are continuous: beside an end piece of length ``e`` the derivative is ``power q / e``.
    """
    h, end = np.diff(grid.breaks_mm), grid.end
    inner = np.flatnonzero(end == 0)
    others, own = [], []
    for beside in (inner - 1, inner + 1):
        share, stop = h[inner] / (h[inner] + h[beside]), end[beside] != 0
        others.append(np.where(stop, 0.0, share))
        own.append(np.where(stop, 1.0 / (1.0 + power * h[inner] / (2.0 * h[beside])), 1.0 - share))
    return others[0], own[0], own[1], others[1]


class Problem:
    """Least time subject to the bounds at some points of a grid.

    Notes
    -----
    With ``q`` the square of the feed, velocity and acceleration of an axis are linear, and its jerk is
    ``sqrt(q) (x_sss q + 1.5 x_ss q' + 0.5 x_s q'')``. Divided by ``sqrt(q)`` its limit is linear against the convex
    ``J / sqrt(q)``. Each step replaces that by its tangent, which is below it. The steps come to a point within the
    limits where no small change is faster; nothing shows that no other plan is.
    """

    def __init__(self, grid: Grid, bounds: Bounds, *, jerk: bool) -> None:
        self.grid, self.jerk = grid, jerk
        self.power = JERK_POWER if jerk else FREE_POWER
        end = grid.end
        number = np.cumsum(end == 0) - 1
        at_knot = np.arange(grid.piece.size) >= grid.pieces * (SAMPLES + 1)
        at = np.flatnonzero((end[grid.piece] == 0) & (np.isin(grid.share, (0.0, 0.5, 1.0)) | at_knot))
        self.points, piece, u = at, grid.piece[at], grid.share[at]
        self.index = number[piece]
        self.size = int(number[-1]) + 1
        h = np.diff(grid.breaks_mm)[piece]
        before, own_first, own_last, after = (each[self.index] for each in _weights(grid, self.power))
        bernstein = (
            ((1 - u) ** 2, 2 * u * (1 - u), u**2),
            (-2 * (1 - u) / h, 2 * (1 - 2 * u) / h, 2 * u / h),
            (2 / h**2, -4 / h**2, 2 / h**2),
        )
        rows = [
            np.stack([b0 * before, b0 * own_first + b1 + b2 * own_last, b2 * after], axis=-1)
            for b0, b1, b2 in bernstein
        ]
        self.rows = np.stack(rows, axis=1)
        """Of q, q' and q'' at each point in the three unknowns around it, shape (p, 3, 3)."""
        # Simpson's rule over each piece
        self.time_weight = np.where(at_knot[at], 0.0, np.where(u == 0.5, 4.0, 1.0) * h / 6.0)
        x1, x2, x3 = (each[at] for each in grid.derivatives)
        feed = bounds.feed[at].copy()
        self._bound_ends(bounds, feed)
        a, j = bounds.acceleration[at][:, :, None], bounds.jerk[at][:, :, None]
        zero = np.zeros_like(x1)
        self.velocity_row = np.stack([1.0 / feed, 0.0 * feed, 0.0 * feed], axis=-1)[:, None, :]
        self.acceleration_rows = np.stack([x2, x1 / 2.0, zero], axis=-1) / a
        self.jerk_rows = np.stack([x3, 1.5 * x2, x1 / 2.0], axis=-1) / j

    def _bound_ends(self, bounds: Bounds, feed: Floats) -> None:
        """Lower the bound of the feed beside the end pieces to what these allow; add their time to the weights."""
        grid, p = self.grid, self.power
        end, length = grid.end[grid.piece], np.diff(grid.breaks_mm)[grid.piece]
        at = np.flatnonzero(end)
        r, sign, e = np.where(end[at] > 0, grid.share[at], 1.0 - grid.share[at]), end[at], length[at]
        r = np.maximum(r, 1e-9)
        x1, x2, x3 = (each[at] for each in grid.derivatives)
        q, q1, q2 = r**p, sign * p * r ** (p - 1) / e, p * (p - 1) * r ** (p - 2) / e**2
        allowed = bounds.feed[at] / q
        share = abs(x2 * q[:, None] + 0.5 * x1 * q1[:, None]) / bounds.acceleration[at]
        allowed = np.minimum(allowed, 1.0 / share.max(axis=1))
        if self.jerk:
            share = abs(x3 * q[:, None] + 1.5 * x2 * q1[:, None] + 0.5 * x1 * q2[:, None]) / bounds.jerk[at]
            allowed = np.minimum(allowed, (np.sqrt(q) * share.max(axis=1)) ** (-2.0 / 3.0))
        best = np.full(grid.pieces, np.inf)
        np.minimum.at(best, grid.piece[at], allowed)
        piece, u = grid.piece[self.points], grid.share[self.points]
        for which, other in ((u == 0.0, -1), (u == 1.0, 1)):
            near = np.flatnonzero(which & (grid.end[np.clip(piece + other, 0, grid.pieces - 1)] != 0))
            feed[near] = np.minimum(feed[near], best[piece[near] + other])
            self.time_weight[near] += np.diff(grid.breaks_mm)[piece[near] + other] / (1.0 - p / 2.0)

    def values(self, z: Floats) -> Floats:
        """Return q, q' and q'' at the points, shape (p, 3)."""
        padded = np.concatenate(([0.0], z, [0.0]))
        around = np.stack([padded[self.index], padded[self.index + 1], padded[self.index + 2]], axis=-1)
        found: Floats = (self.rows @ around[:, :, None])[:, :, 0]
        return found

    def _slacks(self, v: Floats) -> tuple[Floats, Floats]:
        """Return the slacks of all limits, shape (p, k), and their gradients in q, q' and q'', shape (p, k, 3)."""
        up = np.concatenate((self.velocity_row, self.acceleration_rows, -self.acceleration_rows), axis=1)
        slack = 1.0 - (up @ v[:, :, None])[:, :, 0]
        if not self.jerk:
            return slack, -up
        root = 1.0 / np.sqrt(v[:, :1])
        both = np.concatenate((self.jerk_rows, -self.jerk_rows), axis=1)
        bend = both.copy()
        bend[:, :, 0] += 0.5 * root**3
        return np.hstack((slack, root - (both @ v[:, :, None])[:, :, 0])), -np.concatenate((up, bend), axis=1)

    def time_s(self, z: Floats) -> float:
        """Return the time of the unknowns."""
        return float((self.time_weight / np.sqrt(self.values(z)[:, 0])).sum())

    def solve(self, z: Floats) -> Floats:
        """Return the unknowns of least time from any start above zero.

        The limits need not hold at the start; at the result they hold to a small share, which scaling removes.
        """
        v = self.values(z)
        real, gradient = self._slacks(v)
        slack = np.maximum(real, 0.1 * self._unit(v))
        time = (self.time_weight / np.sqrt(v[:, 0])).sum()
        mu = 0.1 * time / (slack.size + z.size)
        dual, dual_z = mu / slack, mu / z
        step = step_dual = 0.0
        for _ in range(_MOST_STEPS):
            gap = (dual * slack).sum() + (dual_z * z).sum()
            missing = real - slack
            if gap < _GAP * time and min(step, step_dual) > 0.5:
                break
            least = min(step, step_dual)
            mu = gap / (slack.size + z.size) * (0.1 if least > 0.9 else 0.3 if least > 0.5 else 0.8)
            weight = dual / slack
            dz = self._newton(v, gradient, weight, mu / slack - weight * missing, z, mu, dual_z)
            change = (gradient @ self.values(dz)[:, :, None])[:, :, 0] + missing
            d_dual = (mu - dual * change) / slack - dual
            d_dual_z = (mu - dual_z * dz) / z - dual_z
            step = _longest((slack, change), (z, dz))
            step_dual = _longest((dual, d_dual), (dual_z, d_dual_z))
            z, dual, dual_z = z + step * dz, dual + step_dual * d_dual, dual_z + step_dual * d_dual_z
            v = self.values(z)
            real, gradient = self._slacks(v)
            slack = slack + step * change
            slack = np.where(real > slack, real, slack)
            time = (self.time_weight / np.sqrt(v[:, 0])).sum()
        return z

    def _unit(self, v: Floats) -> Floats:
        """Return the slack of each limit at rest, shape (p, k)."""
        d = self.acceleration_rows.shape[1]
        one = np.ones((v.shape[0], 1 + 2 * d))
        return np.hstack((one, np.repeat(1.0 / np.sqrt(v[:, :1]), 2 * d, axis=1))) if self.jerk else one

    def _force(self, v: Floats, gradient: Floats, dual: Floats) -> Floats:
        """Return the slope of the time less that of the limits, weighted, in each unknown."""
        pull = -dual[:, None, :] @ gradient
        pull[:, 0, 0] -= 0.5 * self.time_weight * v[:, 0] ** -1.5
        force = (pull @ self.rows)[:, 0, :]
        found: Floats = np.zeros(self.size + 2)
        for i in range(3):
            found += np.bincount(self.index + i, force[:, i], found.size)
        return found[1:-1]

    def _newton(
        self, v: Floats, gradient: Floats, weight: Floats, push: Floats, z: Floats, mu: float, dual_z: Floats
    ) -> Floats:
        """Return the step of the unknowns."""
        curve = np.swapaxes(gradient * weight[:, :, None], 1, 2) @ gradient
        curve[:, 0, 0] += 0.75 * self.time_weight * v[:, 0] ** -2.5
        local = np.swapaxes(self.rows, 1, 2) @ curve @ self.rows
        size = self.size + 2
        band = np.zeros((3, size))
        for i in range(3):
            for j in range(i, 3):
                band[2 - (j - i)] += np.bincount(self.index + j, local[:, i, j], size)
        right, band = mu / z - self._force(v, gradient, push), band[:, 1:-1]
        band[2] += dual_z / z
        scale = 1.0 / np.sqrt(band[2])
        band[1, 1:] *= scale[1:] * scale[:-1]
        band[0, 2:] *= scale[2:] * scale[:-2]
        band[2] = 1.0 + 1e-12
        step: Floats = scale * solveh_banded(band, right * scale, overwrite_ab=True, check_finite=False)
        return step


def _longest(*pairs: tuple[Floats, Floats]) -> float:
    """Return the share of a step after which one of the values has lost 95 % of itself, at most 1."""
    fall = max(float((-change / value).max()) for value, change in pairs)
    return min(1.0, 0.95 / fall) if fall > 0.0 else 1.0


def start_shape(grid: Grid, bounds: Bounds, *, jerk: bool) -> Floats:
    """Return a feed that keeps about within all limits, shape (inner pieces,).

    Notes
    -----
    Where the jerk along a line is constant, ``w = q^(3/4)`` grows with a constant slope. So ``w`` is the largest
    function of a limited slope below what each place allows alone, and its mean over a width of about ``w / slope``:
    then its bends, too, keep the jerk within a constant factor of the limit.
    """
    curvature, third = abs(grid.derivatives[1]), abs(grid.derivatives[2])
    with np.errstate(divide="ignore"):
        cap = np.minimum(bounds.feed, (bounds.acceleration / curvature).min(axis=1))
        if jerk:
            cap = np.minimum(cap, (bounds.jerk / third).min(axis=1) ** (2.0 / 3.0))
    least = np.full(grid.pieces, np.inf)
    np.minimum.at(least, grid.piece, 0.5 * cap)
    breaks, acceleration = grid.breaks_mm, 0.5 * float(bounds.acceleration.min())
    slope = np.sqrt(0.3 * float(bounds.jerk.min()))
    q = _least_slope(grid, least, acceleration)
    if not jerk:
        return np.asarray(q[grid.end == 0])
    w = _least_slope(grid, q**0.75, slope)
    middle, half = (breaks[1:] + breaks[:-1]) / 2.0, 0.5 * w / slope
    total = np.concatenate(([0.0], np.cumsum(w * np.diff(breaks))))
    mean: Floats = (np.interp(middle + half, breaks, total) - np.interp(middle - half, breaks, total)) / (2.0 * half)
    # beside a cusp the width is below the rounding of s; a limited slope allows no other means than these
    return np.asarray(np.clip(mean, 0.5 * w, 1.5 * w)[grid.end == 0] ** (4.0 / 3.0))


def _least_slope(grid: Grid, values: Floats, slope: float) -> Floats:
    """Return the largest function of a limited slope that is below values of each piece and zero at the stops."""
    breaks = grid.breaks_mm
    stop = np.concatenate((breaks[grid.first], breaks[-1:]))
    s = np.concatenate(((breaks[1:] + breaks[:-1]) / 2.0, stop))
    order = np.argsort(s, kind="stable")
    s, y = s[order], np.concatenate((values, np.zeros(stop.size)))[order]
    y = np.minimum.accumulate(y - slope * s) + slope * s
    y = np.minimum.accumulate((y + slope * s)[::-1])[::-1] - slope * s
    found = np.empty_like(y)
    found[order] = y
    return np.asarray(np.maximum(found[: values.size], 1e-9 * slope * np.diff(breaks)))
