"""Toolpaths in the plane and in space: NURBS by arc length, shapes, G-code, feeds, and contour errors."""

from rtec.toolpath.contour_error import ContourError, Estimate, contour_error, estimate, second_order_bound
from rtec.toolpath.gcode import parse_gcode, read_gcode
from rtec.toolpath.nurbs import Nurbs, read_nurbs
from rtec.toolpath.path import Path
from rtec.toolpath.reading import read_path
from rtec.toolpath.shapes import butterfly, circle, random_path

__all__ = [
    "ContourError",
    "Estimate",
    "Nurbs",
    "Path",
    "butterfly",
    "circle",
    "contour_error",
    "estimate",
    "parse_gcode",
    "random_path",
    "read_gcode",
    "read_nurbs",
    "read_path",
    "second_order_bound",
]
