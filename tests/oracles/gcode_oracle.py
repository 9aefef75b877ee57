"""A machine that runs a few words of G-code, with an axis that errs: where its tool goes, point after point.

It shares nothing with rtec: words by a regular expression, arcs by rotating a vector, play as a gap between stops.
"""

import math
import re

import numpy as np
from scipy.spatial import cKDTree

INCH = 25.4


def commands(text, *, steps):
    """Return the commanded points of X, Y, Z in mm, shape (points, 3): so many of a feed move, the end of a rapid."""
    at, points = np.full(3, np.nan), []
    unit, absolute, motion, plane = 1.0, True, None, (0, 1, 2)
    for raw in text.replace("%", "").splitlines():
        words = re.findall(r"([A-Z])([-+.\d]+)", re.sub(r"\(.*?\)|;.*", "", raw.upper()).replace(" ", ""))
        given = {}
        for letter, number in words:
            code = f"G{float(number):g}" if letter == "G" else letter
            if code in ("G20", "G21"):
                unit = INCH if code == "G20" else 1.0
            elif code in ("G90", "G91"):
                absolute = code == "G90"
            elif code in ("G0", "G1", "G2", "G3"):
                motion = code
            elif code in ("G17", "G18", "G19"):
                plane = {"G17": (0, 1, 2), "G18": (2, 0, 1), "G19": (1, 2, 0)}[code]
            elif letter in "XYZIJKR":
                given[letter] = float(number) * unit
        if not given:
            continue
        target = at.copy()
        for k, letter in enumerate("XYZ"):
            if letter in given:
                target[k] = given[letter] if absolute else at[k] + given[letter]
        share = np.linspace(0.0, 1.0, steps + 1)[1:, None]
        path = at + share * (target - at)
        path[-1] = target
        if motion in ("G2", "G3"):
            path[:, plane[:2]] = arc(
                at[list(plane[:2])], target[list(plane[:2])], given, plane, motion == "G3", steps
            )
        points.extend(path[-1:] if motion == "G0" or not np.isfinite(path).all() else path)
        at = target
    return np.array(points).reshape(-1, 3)


def arc(start, end, given, plane, left, steps):
    if "R" in given:
        chord = end - start
        length, radius = math.hypot(*chord), given["R"]
        height = math.sqrt(max(radius**2 - length**2 / 4.0, 0.0)) * (1 if (radius > 0) == left else -1)
        out = chord / 2.0 + height * np.array([-chord[1], chord[0]]) / length
    else:
        out = np.array([given.get("IJK"[plane[k]], 0.0) for k in range(2)])
    seen, last = -out, end - start - out
    angle = math.atan2(seen[0] * last[1] - seen[1] * last[0], seen @ last)
    if left and angle <= 1e-7:
        angle += 2.0 * math.pi
    if not left and angle >= -1e-7:
        angle -= 2.0 * math.pi
    turned = np.linspace(0.0, angle, steps + 1)[1:]
    round_ = np.stack([np.cos(turned), np.sin(turned)]), np.stack([-np.sin(turned), np.cos(turned)])
    path = (start + out)[:, None] + seen[0] * round_[0] + seen[1] * round_[1]
    path[:, -1] = end
    return path.T


def tool(points, axis, error_mm, play_mm):
    """Return where the tool goes: one axis is off by a curve of what is commanded, and hangs in a play."""
    found = points.copy()
    state = points[0, axis] - play_mm / 2.0
    for k, sent in enumerate(points[:, axis]):
        state = min(max(state, sent - play_mm / 2.0), sent + play_mm / 2.0)
        found[k, axis] = state + error_mm(sent)
    return found


def farthest(points, path):
    """Return how far any point is from a path of dense points, between which straight lines run."""
    nearest = cKDTree(path).query(points, k=min(16, len(path)))[1].reshape(len(points), -1)
    apart = np.full(len(points), np.inf)
    for before in (*nearest.T, *(nearest.T - 1)):
        begin = path[np.clip(before, 0, len(path) - 2)]
        along = path[np.clip(before, 0, len(path) - 2) + 1] - begin
        square = np.maximum((along**2).sum(axis=1), 1e-30)
        share = np.clip(((points - begin) * along).sum(axis=1) / square, 0.0, 1.0)
        apart = np.minimum(apart, np.linalg.norm(begin + share[:, None] * along - points, axis=1))
    return float(apart.max())
