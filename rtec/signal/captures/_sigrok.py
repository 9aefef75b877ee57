"""Sessions of sigrok (.sr, version 2): samples of all channels at a constant rate, in a zip."""

from __future__ import annotations

import configparser
import re
import zipfile
import zlib
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rtec.errors import FileFormatError
from rtec.signal.captures._saleae import Pick
from rtec.units import PS_PER_S

_BLOCK = 1 << 24
_MOST_BYTES = 1 << 36
"""Of samples, unpacked; counted while they are, for the sizes that a zip names may be wrong."""
_MOST_EDGES = 1 << 25
_UNITS = {"hz": 1, "khz": 10**3, "mhz": 10**6, "ghz": 10**9}


def read(path: Path, pick: Pick) -> tuple[NDArray[np.int64], NDArray[np.uint8]]:
    """Return times in ps, int64, and level codes, uint8: the first sample, each change, the last sample."""
    try:
        with zipfile.ZipFile(path) as archive:
            return _read(path, archive, pick)
    except FileNotFoundError:
        raise FileFormatError(path, None, "there is no such file", "the path of a sigrok session") from None
    except (OSError, zipfile.BadZipFile, zlib.error, NotImplementedError, RuntimeError, EOFError) as error:
        raise FileFormatError(path, None, f"cannot be read ({error})", "a sigrok session, version 2") from None


def _read(path: Path, archive: zipfile.ZipFile, pick: Pick) -> tuple[NDArray[np.int64], NDArray[np.uint8]]:
    facts = _metadata(path, archive)
    probes = {int(key[5:]): name for key, name in facts.items() if re.fullmatch(r"probe\d{1,4}", key)}
    if not probes:
        raise FileFormatError(path, None, "no digital channel", "a session with two of them")
    rate = _rate(path, facts.get("samplerate"))
    size = facts.get("unitsize", "")
    if not re.fullmatch(r"[1-9]\d?", size) or int(size) * 8 < max(probes):
        raise FileFormatError(
            path, None, f"unitsize {size[:20]!r} for {max(probes)} channels", "a byte for 8 channels"
        )
    numbers = sorted(probes)
    chosen = [numbers[at] - 1 for at in pick([probes[number].strip() for number in numbers])]
    places: list[NDArray[np.int64]] = []
    codes: list[NDArray[np.uint8]] = []
    before, done, found = -1, 0, 0
    for samples in _blocks(path, archive, facts.get("capturefile", "logic-1"), int(size)):
        a, b = ((samples[:, bit // 8] >> np.uint8(bit % 8)) & 1 for bit in chosen)
        code = (a | (b << 1)).astype(np.uint8)
        changed = np.flatnonzero(code[1:] != code[:-1]) + 1
        if code[0] != before:
            changed = np.insert(changed, 0, 0)
        places.append(changed + done)
        codes.append(code[changed])
        before, done, found = int(code[-1]), done + code.size, found + changed.size
        if found > _MOST_EDGES:
            raise FileFormatError(path, None, f"more than {_MOST_EDGES} edges", "a shorter capture")
    if not done:
        raise FileFormatError(path, None, "no samples", "a session with samples")
    ps = Fraction(PS_PER_S) / rate
    rows = np.append(np.concatenate(places), done - 1)
    times = np.array([place * ps.numerator // ps.denominator for place in rows.tolist()], np.int64)
    return times, np.append(np.concatenate(codes), np.uint8(before))


def _metadata(path: Path, archive: zipfile.ZipFile) -> dict[str, str]:
    ini = configparser.ConfigParser(interpolation=None, strict=False)
    try:
        with archive.open("metadata") as file:
            ini.read_string(file.read(1 << 20).decode())
    except (KeyError, configparser.Error, UnicodeDecodeError):
        raise FileFormatError(path, None, "no readable metadata", "a sigrok session, version 2") from None
    device = next((name for name in ini.sections() if name.startswith("device")), None)
    if device is None:
        raise FileFormatError(path, None, "metadata names no device", "a sigrok session, version 2")
    return dict(ini[device])


def _rate(path: Path, text: str | None) -> Fraction:
    match = re.fullmatch(r"(\d{1,12}(?:\.\d{1,9})?)\s*([kMG]?Hz)?", (text or "").strip(), re.IGNORECASE)
    rate = Fraction(match[1]) * _UNITS[(match[2] or "Hz").lower()] if match else Fraction(0)
    if not 0 < rate <= PS_PER_S:
        said = "no sample rate" if text is None else f"sample rate {text[:30]!r}"
        raise FileFormatError(
            path, None, said, "a session with samplerate in its metadata: without it there is no time"
        )
    return rate


def _blocks(path: Path, archive: zipfile.ZipFile, capture: str, size: int) -> Iterator[NDArray[np.uint8]]:
    """Yield samples as uint8 of shape (n, unit size), in the order of the numbers of their files."""
    parts = {}
    for name in archive.namelist():
        if match := re.fullmatch(re.escape(capture) + r"(?:-(\d{1,9}))?", name):
            parts[int(match[1] or 0)] = name
    read, kept = 0, b""
    for number in sorted(parts):
        with archive.open(parts[number]) as file:
            while block := file.read(_BLOCK):
                read += len(block)
                if read > _MOST_BYTES:
                    raise FileFormatError(
                        path, None, f"more than {_MOST_BYTES} bytes of samples", "a shorter capture"
                    )
                block = kept + block
                whole = len(block) - len(block) % size
                kept = block[whole:]
                if whole:
                    yield np.frombuffer(block[:whole], np.uint8).reshape(-1, size)
