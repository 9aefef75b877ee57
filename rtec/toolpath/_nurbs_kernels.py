"""Rational splines span by span: points, derivatives by parameter and by arc length, and the foot of a perpendicular.

A spline is ``breaks[spans + 1]``, the parameters at which its spans meet, and ``coefficients[spans, columns, degree
+ 1]``: polynomials in t, which runs from -1 to 1 over each span, the highest power first. The columns are x, y, (z,)
each times the weight, and the weight.

A path is a table of panels, each within one span: ``ends[panels + 1]``, arc lengths in mm; ``spans[panels]``;
``inverse[panels, terms]``, Chebyshev coefficients of t over the panel's arc length; the coefficients of the spline;
and whether it is rational.

All derivatives that kernels write have the shape (orders, points, dimensions).
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from rtec._jit import fused_kernel, fused_step, helper, step

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]
Orders = tuple[float, float, float, float]
"""A value and its first three derivatives."""
Table = tuple[Floats, Integers, Floats, Floats, bool]

STEPS = 200
"""Most steps of a search for a foot, to each side and within its bracket."""


@step
def _found(ends: Floats, x: float, at: int, side: int) -> int:
    """Return i with ends[i] <= x < ends[i + 1], with ``side`` < 0 ends[i] < x <= ends[i + 1]; first near ``at``."""
    last = ends.size - 2
    for near in range(at, min(at + 2, last + 1)):
        if ends[near] < x < ends[near + 1]:
            return near
    low, high = 0, last
    while low < high:
        middle = (low + high + 1) >> 1
        if ends[middle] < x or (side > 0 and ends[middle] == x):
            low = middle
        else:
            high = middle - 1
    return low


@fused_step
def _horner(coefficients: Floats, span: int, column: int, t: float) -> Orders:
    """Return a polynomial and its first three derivatives."""
    value, first, second, third = coefficients[span, column, 0], 0.0, 0.0, 0.0
    for power in range(1, coefficients.shape[2]):
        third = third * t + second
        second = second * t + first
        first = first * t + value
        value = value * t + coefficients[span, column, power]
    return value, first, 2.0 * second, 6.0 * third


@fused_step
def _over(numerator: Orders, denominator: Orders, inverse: float) -> Orders:
    """Return a quotient and its first three derivatives, of functions that come with theirs."""
    a, a1, a2, a3 = numerator
    _, w1, w2, w3 = denominator
    q = a * inverse
    q1 = (a1 - w1 * q) * inverse
    q2 = (a2 - 2.0 * w1 * q1 - w2 * q) * inverse
    q3 = (a3 - 3.0 * (w1 * q2 + w2 * q1) - w3 * q) * inverse
    return q, q1, q2, q3


@fused_step
def _curve(coefficients: Floats, span: int, t: float, rational: bool) -> tuple[Orders, Orders, Orders]:
    """Return x, y and z, each with its first three derivatives by t."""
    weight = coefficients.shape[1] - 1
    x = _horner(coefficients, span, 0, t)
    y = _horner(coefficients, span, 1, t)
    z = (0.0, 0.0, 0.0, 0.0)
    if weight == 3:
        z = _horner(coefficients, span, 2, t)
    if rational:
        w = _horner(coefficients, span, weight, t)
        inverse = 1.0 / w[0]
        x, y, z = _over(x, w, inverse), _over(y, w, inverse), _over(z, w, inverse)
    return x, y, z


@fused_kernel
def evaluate(breaks: Floats, coefficients: Floats, rational: bool, u: Floats, side: int, out: Floats) -> None:
    """Write the point and the derivatives by the parameter at each ``u``, as many orders as ``out`` has room for."""
    at = 0
    for i in range(u.size):
        at = _found(breaks, u[i], at, side)
        per = 2.0 / (breaks[at + 1] - breaks[at])
        x, y, z = _curve(coefficients, at, (u[i] - breaks[at]) * per - 1.0, rational)
        factor = 1.0
        for order in range(out.shape[0]):
            out[order, i, 0] = factor * x[order]
            out[order, i, 1] = factor * y[order]
            if out.shape[2] == 3:
                out[order, i, 2] = factor * z[order]
            factor *= per


@fused_kernel
def evaluate_curvature(
    breaks: Floats, coefficients: Floats, rational: bool, u: Floats, points: Floats, curvature: Floats
) -> None:
    """Write point and curvature at each ``u``: in the plane positive to the left, in space its magnitude."""
    at = 0
    for i in range(u.size):
        at = _found(breaks, u[i], at, 1)
        t = (u[i] - breaks[at]) * (2.0 / (breaks[at + 1] - breaks[at])) - 1.0
        x, y, z = _curve(coefficients, at, t, rational)
        points[i, 0], points[i, 1] = x[0], y[0]
        speed = x[1] * x[1] + y[1] * y[1] + z[1] * z[1]
        turn = x[1] * y[2] - y[1] * x[2]
        if points.shape[1] == 3:
            points[i, 2] = z[0]
            turn = math.sqrt(turn**2 + (y[1] * z[2] - z[1] * y[2]) ** 2 + (z[1] * x[2] - x[1] * z[2]) ** 2)
        curvature[i] = turn / (speed * math.sqrt(speed))


@fused_kernel
def speeds(coefficients: Floats, rational: bool, spans: Integers, t: Floats, out: Floats) -> None:
    """Write how fast the curve runs, in mm for each unit of t, at ``t[panel, node]`` of each panel's span."""
    for i in range(t.shape[0]):
        for j in range(t.shape[1]):
            x, y, z = _curve(coefficients, spans[i], t[i, j], rational)
            out[i, j] = math.sqrt(x[1] * x[1] + y[1] * y[1] + z[1] * z[1])


@fused_step
def _series(coefficients: Floats, panel: int, x: float) -> float:
    """Return a Chebyshev series at ``x``, -1 to 1, by Clenshaw's recurrence."""
    one, two = 0.0, 0.0
    for term in range(coefficients.shape[1] - 1, 0, -1):
        one, two = coefficients[panel, term] + 2.0 * x * one - two, one
    return float(coefficients[panel, 0] + x * one - two)


@fused_kernel
def invert(arc: Floats, speed: Floats, nodes: Floats, out: Floats) -> None:
    """Write where in its panel, -1 to 1, the arc length has come to each node: -1 is none of it, 1 all of it.

    ``arc`` is the integral of ``speed`` from -1, both as Chebyshev series of each panel.
    """
    for i in range(arc.shape[0]):
        length = _series(arc, i, 1.0)
        for j in range(nodes.size):
            x = nodes[j]
            for _ in range(8):
                step = (_series(arc, i, x) - 0.5 * length * (nodes[j] + 1.0)) / _series(speed, i, x)
                x = min(max(x - step, -1.0), 1.0)
                if abs(step) < 1e-15:
                    break
            out[i, j] = x


@fused_step
def _by_arc_length(q: Orders, v: float, v1: float, v2: float) -> Orders:
    """Return a coordinate and its derivatives by arc length, from those by t and the speed with its derivatives."""
    first = q[1] / v
    second = (q[2] - first * v1) / (v * v)
    third = (q[3] - 3.0 * second * v * v1 - first * v2) / (v * v * v)
    return q[0], first, second, third


@helper
def _place(s: float, panel: int, table: Table) -> tuple[Orders, Orders, Orders]:
    """Return x, y and z at an arc length within a panel, each with three derivatives by arc length."""
    ends, spans, inverse, coefficients, rational = table
    part = (2.0 * s - ends[panel] - ends[panel + 1]) / (ends[panel + 1] - ends[panel])
    x, y, z = _curve(coefficients, spans[panel], _series(inverse, panel, part), rational)
    v = math.sqrt(x[1] * x[1] + y[1] * y[1] + z[1] * z[1])
    v1 = (x[1] * x[2] + y[1] * y[2] + z[1] * z[2]) / v
    square = x[2] * x[2] + y[2] * y[2] + z[2] * z[2] + x[1] * x[3] + y[1] * y[3] + z[1] * z[3]
    v2 = (square - v1 * v1) / v
    return _by_arc_length(x, v, v1, v2), _by_arc_length(y, v, v1, v2), _by_arc_length(z, v, v1, v2)


@fused_kernel
def along(table: Table, s: Floats, side: int, out: Floats) -> None:
    """Write the point and the derivatives by arc length at each ``s``, as many orders as ``out`` has room for."""
    at = 0
    for i in range(s.size):
        at = _found(table[0], s[i], at, side)
        x, y, z = _place(s[i], at, table)
        for order in range(out.shape[0]):
            out[order, i, 0] = x[order]
            out[order, i, 1] = y[order]
            if out.shape[2] == 3:
                out[order, i, 2] = z[order]


@helper
def _ahead(s: float, at: int, point: Floats, closed: bool, table: Table) -> tuple[float, float, float, int]:
    """Return how far ahead of ``s`` a point lies, how fast that falls with s, its distance squared, and the panel."""
    if closed:
        s -= table[0][-1] * math.floor(s / table[0][-1])
    at = _found(table[0], s, at, 1)
    x, y, z = _place(s, at, table)
    dx, dy = point[0] - x[0], point[1] - y[0]
    dz = point[2] - z[0] if point.size == 3 else 0.0
    fall = 1.0 - (dx * x[2] + dy * y[2] + dz * z[2])
    return dx * x[1] + dy * y[1] + dz * z[1], fall, dx * dx + dy * dy + dz * dz, at


@helper
def _foot(s: float, at: int, point: Floats, closed: bool, near: float, table: Table) -> tuple[float, float, int]:
    """Return the arc length of the foot of a point that is found from ``s``, its distance squared, and the panel.

    The search goes the way that comes nearer, in growing steps until the next would lead away, and closes in between
    by Newton's method, or by bisection where that leaves the bracket.
    """
    length = table[0][-1]
    f, fall, square, at = _ahead(s, at, point, closed, table)
    sign = 1.0 if f > 0.0 else -1.0
    low, high = s, s
    stride = abs(f) / max(fall, 0.25) + near
    for _ in range(STEPS):
        high = low + sign * stride
        if not closed:
            high = min(max(high, 0.0), length)
        f, fall, square, at = _ahead(high, at, point, closed, table)
        if sign * f <= 0.0:
            break
        if high == low:  # the end of the path
            return high, square, at
        low = high
        stride *= 1.5
    s = high
    for _ in range(STEPS):
        guess = s + f / fall if fall > 0.0 else 0.5 * (low + high)
        if sign * (guess - low) < 0.0 or sign * (high - guess) < 0.0:
            guess = 0.5 * (low + high)
        moved = abs(guess - s)
        s = guess
        if moved <= near:
            break
        f, fall, square, at = _ahead(s, at, point, closed, table)
        if sign * f > 0.0:
            low = s
        else:
            high = s
    return s, square, at


@fused_kernel
def project(table: Table, closed: bool, commanded: Floats, actual: Floats, near: float, out: Floats) -> None:
    """Write the arc length of the foot of each actual point.

    One search starts as far from the commanded arc length as the foot of the point before was, another one there:
    behind an inner corner the first stays on the leg before. The nearer foot counts. On a closed path it may lie
    before 0 or behind the length.
    """
    at, carried = 0, 0.0
    for i in range(commanded.size):
        s = commanded[i] + carried
        if not closed:
            s = min(max(s, 0.0), table[0][-1])
        s, square, at = _foot(s, at, actual[i], closed, near, table)
        other, nearer, _ = _foot(commanded[i], at, actual[i], closed, near, table)
        if nearer < square - near * near:
            s = other
        out[i] = s
        carried = s - commanded[i]
