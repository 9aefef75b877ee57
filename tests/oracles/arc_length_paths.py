"""Paths by arc length for the tests of feed planning: lines, arcs, splines and what they are joined to."""

from itertools import pairwise

import numpy as np
from scipy.interpolate import BSpline, make_interp_spline


class Spline:
    """A scipy spline by arc length: tables of Gauss-Legendre integrals, inverted by Newton's method."""

    def __init__(self, spline, closed=False, parts=24):
        self.closed = closed
        a, b = spline.t[spline.k], spline.t[-spline.k - 1]
        knots = np.unique(spline.t[(spline.t >= a) & (spline.t <= b)])
        self.c = [spline.derivative(i) if i else spline for i in range(4)]
        # one polynomial a span: each side of a knot has its own, also where rounding puts the parameter beyond it
        self.knots_u = knots
        self.taylor = np.stack([each(knots[:-1]) for each in self.c]) / np.array([1, 1, 2, 6])[:, None, None]
        self.x, self.w = np.polynomial.legendre.leggauss(8)
        self.u = np.unique(np.concatenate([np.linspace(p, q, parts + 1) for p, q in pairwise(knots)]))
        self.u[::parts] = knots
        while True:  # near a cusp the speed by the parameter has a sharp minimum
            start, width = self.u[:-1], np.diff(self.u)
            middle = start + width / 2
            length = self._length(start, width)
            halves = self._length(start, width / 2) + self._length(middle, width / 2)
            coarse = abs(length - halves) > 1e-15 * length.sum()
            if not coarse.any() or self.u.size > 5000 + parts * knots.size:
                break
            self.u = np.union1d(self.u, middle[coarse])
        self.table = np.concatenate(([0.0], np.cumsum(halves)))
        self.knots_mm, self.length_mm = self.table[np.searchsorted(self.u, knots)], self.table[-1]

    def _power(self, u, span, order):
        v, c = (u - self.knots_u[span])[..., None], self.taylor[:, span]
        if order == 0:
            return c[0] + v * (c[1] + v * (c[2] + v * c[3]))
        if order == 1:
            return c[1] + v * (2 * c[2] + v * 3 * c[3])
        return 2 * c[2] + 6 * v * c[3] if order == 2 else 6 * c[3] + 0 * v

    def _span(self, u):
        return np.clip(np.searchsorted(self.knots_u, u, side="right") - 1, 0, self.knots_u.size - 2)

    def _length(self, start, width):
        u = start[:, None] + width[:, None] * (self.x + 1) / 2
        span = np.broadcast_to(self._span(start + 0 * width)[:, None], u.shape)
        return (np.linalg.norm(self._power(u, span, 1), axis=-1) * self.w).sum(axis=1) * width / 2

    def _at(self, s, side):
        s = np.clip(np.asarray(s, float), 0.0, self.length_mm)
        cell = np.clip(np.searchsorted(self.table, s, side="right" if side > 0 else "left") - 1, 0, self.u.size - 2)
        start, span = self.u[cell], self._span(self.u[cell])
        u = start + (s - self.table[cell]) / np.diff(self.table)[cell] * np.diff(self.u)[cell]
        for _ in range(3):
            error = self.table[cell] + self._length(start, u - start) - s
            u = u - error / np.linalg.norm(self._power(u, span, 1), axis=-1)
        return u, span

    def points(self, s_mm):
        return self._power(*self._at(s_mm, 1), 0)

    def derivatives(self, s_mm, side=1):
        u, span = self._at(s_mm, side)
        r1, r2, r3 = (self._power(u, span, i) for i in (1, 2, 3))
        g = np.linalg.norm(r1, axis=1, keepdims=True)
        g1 = (r1 * r2).sum(1, keepdims=True) / g
        g2 = ((r2 * r2 + r1 * r3).sum(1, keepdims=True) - g1**2) / g
        u1, u2, u3 = 1 / g, -g1 / g**3, (3 * g1**2 / g - g2) / g**4
        return r1 * u1, r2 * u1**2 + r1 * u2, r3 * u1**3 + 3 * r2 * u1 * u2 + r1 * u3


class Arcs:
    """Straight lines and arcs one after the other, in the plane; each piece is (length, curvature)."""

    def __init__(self, pieces, start=(0.0, 0.0), heading=0.0, turns=None, closed=False):
        self.closed = closed
        lengths, self.kappa = np.array(pieces, float).T
        self.table = np.concatenate(([0.0], np.cumsum(lengths)))
        self.knots_mm, self.length_mm = self.table.copy(), self.table[-1]
        self.heading = heading + np.concatenate(([0.0], np.cumsum(lengths * self.kappa)))[:-1]
        self.heading += np.cumsum(np.zeros(lengths.size) if turns is None else turns)
        self.start = np.zeros((lengths.size + 1, 2)) + start
        for i in range(lengths.size):
            self.start[i + 1] = self._point(np.array([self.table[i + 1]]), np.array([i]))[0]

    def _point(self, s, i):
        k, a, ds = self.kappa[i], self.heading[i], s - self.table[i]
        half = k * ds / 2
        chord = ds * np.sinc(half / np.pi)
        return self.start[i] + chord[:, None] * np.stack([np.cos(a + half), np.sin(a + half)], axis=1)

    def _piece(self, s, side):
        found = np.searchsorted(self.table, s, side="right" if side > 0 else "left") - 1
        return np.clip(found, 0, self.kappa.size - 1)

    def points(self, s_mm):
        s = np.asarray(s_mm, float)
        return self._point(s, self._piece(s, 1))

    def derivatives(self, s_mm, side=1):
        s = np.asarray(s_mm, float)
        i = self._piece(s, side)
        a, k = self.heading[i] + self.kappa[i] * (s - self.table[i]), self.kappa[i][:, None]
        t, n = np.stack([np.cos(a), np.sin(a)], 1), np.stack([-np.sin(a), np.cos(a)], 1)
        return t, k * n, -(k**2) * t


def line(length_mm, direction=(1.0, 0.0)):
    d = np.array(direction) / np.linalg.norm(direction)
    return Spline(BSpline(np.array([0.0] * 4 + [1.0] * 4), np.outer(np.arange(4) / 3 * length_mm, d), 3))


def circle(radius_mm):
    return Arcs([(2 * np.pi * radius_mm, 1 / radius_mm)], closed=True)


def periodic(points, length_mm=None):
    """Return the closed cubic through points, scaled to a length."""
    u = np.linspace(0.0, 1.0, len(points) + 1)
    closed = np.concatenate([points, points[:1]])
    path = Spline(make_interp_spline(u, closed, k=3, bc_type="periodic"), closed=True)
    return path if length_mm is None else periodic(points * (length_mm / path.length_mm))


def butterfly(length_mm=4300.0, points=240):
    """Return the first turn of Fay's curve, without its slow term, as a periodic cubic."""
    a = np.linspace(0.0, 2 * np.pi, points, endpoint=False)
    r = np.exp(np.sin(a)) - 2 * np.cos(4 * a)
    return periodic(np.stack([r * np.cos(a), r * np.sin(a)], 1), length_mm)


def random_spline(seed, points=20, size_mm=300.0, axes=2):
    """Return a random cubic B-spline, with its control points in a cube."""
    random = np.random.default_rng(seed)
    inner = np.sort(random.uniform(0.05, 0.95, points - 4))
    knots = np.concatenate(([0.0] * 4, inner, [1.0] * 4))
    return Spline(BSpline(knots, random.uniform(0.0, size_mm, (points, axes)), 3))


def joined(paths):
    """Return paths one after the other, each moved to the end of the one before: corners where they meet."""
    return Joined(paths)


class Joined:
    closed = False

    def __init__(self, paths):
        self.paths = paths
        self.table = np.concatenate(([0.0], np.cumsum([p.length_mm for p in paths])))
        self.length_mm = self.table[-1]
        self.knots_mm = np.unique(
            np.concatenate([t + p.knots_mm for t, p in zip(self.table[:-1], paths, strict=True)])
        )
        ends = [(p.points(np.array([0.0, p.length_mm]))) for p in paths]
        self.offset = np.cumsum([-ends[0][0]] + [a[1] - b[0] for a, b in pairwise(ends)], axis=0)

    def _each(self, s, side, of):
        s = np.asarray(s, float)
        found = np.searchsorted(self.table, s, side="right" if side > 0 else "left") - 1
        i = np.clip(found, 0, len(self.paths) - 1)
        out = None
        for k in np.unique(i):
            values = of(k, s[i == k] - self.table[k])
            out = np.empty((len(values), s.size, values[0].shape[1])) if out is None else out
            for o, v in zip(out, values, strict=True):
                o[i == k] = v
        return out

    def points(self, s_mm):
        return self._each(s_mm, 1, lambda k, s: [self.paths[k].points(s) + self.offset[k]])[0]

    def derivatives(self, s_mm, side=1):
        return tuple(self._each(s_mm, side, lambda k, s: self.paths[k].derivatives(s, side)))
