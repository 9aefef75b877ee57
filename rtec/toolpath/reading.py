"""A toolpath as people name it: butterfly, circle, random, or a file."""

from __future__ import annotations

from pathlib import Path as FilePath

from rtec.errors import ArgumentError, FileFormatError, meant
from rtec.toolpath.gcode import BLEND_MM, read_gcode
from rtec.toolpath.nurbs import read_nurbs
from rtec.toolpath.path import Path
from rtec.toolpath.shapes import butterfly, circle, random_path

SHAPES = ("butterfly", "circle", "random")
ENDINGS = (".json", ".nc", ".ngc", ".gcode")


def read_path(text: str, *, blend_mm: float = BLEND_MM, seed: int = 1) -> Path:
    """Return the path that a word or a file name means.

    Parameters
    ----------
    text
        ``butterfly``, ``circle``, ``random``; a NURBS (.json) or a G-code program (.nc, .ngc, .gcode).
    blend_mm
        Tolerance of the corners of a program that states none.
    seed
        Of a random path.

    Raises
    ------
    ArgumentError
        Another word; a seed or a tolerance outside its range.
    FileFormatError
        As `read_nurbs` and `read_gcode`, and a curve that is no path.

    Examples
    --------
    >>> read_path("buterfly")
    Traceback (most recent call last):
        ...
    rtec.errors.ArgumentError: --path: 'buterfly' is not a path; use butterfly, circle, random, or a file (.json, \
.nc, .ngc, .gcode); did you mean 'butterfly'?
    """
    word = text.strip().lower()
    if word in SHAPES:
        return {"butterfly": butterfly, "circle": circle, "random": lambda: random_path(seed)}[word]()
    if word.endswith(ENDINGS[1:]):
        return read_gcode(text, blend_mm=blend_mm)
    if word.endswith(".json"):
        try:
            return Path(name=FilePath(text).name, curve=read_nurbs(text))
        except ArgumentError as error:
            raise FileFormatError(text, None, f"the curve {error.problem}", error.allowed) from None
    allowed = f"{', '.join(SHAPES)}, or a file ({', '.join(ENDINGS)})"
    raise ArgumentError("--path", repr(text[:60]), allowed, meant(word[:60], SHAPES), problem="is not a path")
