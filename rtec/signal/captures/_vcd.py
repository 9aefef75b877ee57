"""Value change dumps (IEEE 1364): two single-bit signals of one."""

from __future__ import annotations

import re
from array import array
from collections.abc import Container, Iterator
from fractions import Fraction
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rtec.errors import FileFormatError
from rtec.io import read_text
from rtec.signal.captures._saleae import Pick
from rtec.units import LONGEST_RUN_PS, PS_PER_S

_UNIT_S = {"s": 1, "ms": 10**3, "us": 10**6, "ns": 10**9, "ps": 10**12, "fs": 10**15}
_SHAPE = "a VCD with $timescale, $var and $enddefinitions"


def read(path: Path, pick: Pick) -> tuple[NDArray[np.int64], NDArray[np.uint8]]:
    """Return times in ps, int64, and level codes, uint8: one row for each value that is said."""
    lines = enumerate(read_text(path, "a capture").splitlines(), start=1)
    words = ((number, word) for number, line in lines for word in line.split())
    unit, names, marks = _definitions(path, words)
    a, b = (marks[at] for at in pick(names))
    if a == b:
        raise FileFormatError(path, None, f"{a!r} stands for both signals", "two signals of their own")
    levels: dict[str, int | None] = {a: None, b: None}
    times, codes = array("q"), bytearray()
    for number, t_ps, word in _values(path, words, unit, levels):
        levels[word[1:]] = int(word[0]) if word[0] in "01" else None
        low, high = levels[a], levels[b]
        if low is not None and high is not None:
            times.append(t_ps)
            codes.append(low + 2 * high)
        elif times:
            raise FileFormatError(path, number, "A or B is neither 0 nor 1", "lines with a level throughout")
    if not times:
        raise FileFormatError(path, None, "no levels of A and B", "a VCD in which both have one")
    return np.array(times, np.int64), np.frombuffer(bytes(codes), np.uint8)


def _values(
    path: Path, words: Iterator[tuple[int, str]], unit: Fraction, marks: Container[str]
) -> Iterator[tuple[int, int, str]]:
    """Yield line, time in ps and word of each value of the marks."""
    t_ps = 0
    for number, word in words:
        if word[0] == "#":
            t_ps = _time(path, number, word, unit)
        elif word == "$comment":
            next((last for _, last in words if last == "$end"), None)
        elif word[0] in "bBrRsS":  # a vector, a number or a text: its mark is a word of its own
            _, mark = next(words, (0, ""))
            if mark in marks:
                yield number, t_ps, word[-1] + mark
        elif word[1:] in marks and word[0] in "01xXzZ":
            yield number, t_ps, word


def _time(path: Path, line: int, word: str, unit: Fraction) -> int:
    if not re.fullmatch(r"#\d{1,24}", word, re.ASCII):
        raise FileFormatError(path, line, f"time {word[:30]!r}", "# and a whole number")
    t_ps = int(word[1:]) * unit
    if t_ps > LONGEST_RUN_PS:
        raise FileFormatError(path, line, f"time {word[:30]!r}", "at most 50 days")
    return int(t_ps)


def _definitions(path: Path, words: Iterator[tuple[int, str]]) -> tuple[Fraction, list[str], list[str]]:
    """Read up to the end of the definitions; return the unit in ps, the names of single bits, and their marks."""
    unit, scopes = None, list[str]()
    names, marks = list[str](), list[str]()
    said: list[str] = []
    for number, word in words:
        if word != "$end" or not said:
            said.append(word)
            continue
        kind, *body = said
        said = []
        if kind == "$timescale":
            match = re.fullmatch(r"(1|10|100)(s|ms|us|ns|ps|fs)", "".join(body))
            if match is None:
                raise FileFormatError(path, number, f"timescale {' '.join(body)[:30]!r}", "such as 1 ns")
            unit = Fraction(int(match[1]) * PS_PER_S, _UNIT_S[match[2]])
        elif kind == "$scope" and len(body) == 2:
            scopes.append(body[1])
        elif kind == "$upscope":
            scopes = scopes[:-1]
        elif kind == "$var" and len(body) >= 4 and body[1] == "1":
            names.append(".".join([*scopes, body[3]]))
            marks.append(body[2])
        elif kind == "$enddefinitions":
            if unit is None:
                raise FileFormatError(path, number, "no timescale", _SHAPE)
            return unit, names, marks
    raise FileFormatError(path, None, "no end of the definitions", _SHAPE)
