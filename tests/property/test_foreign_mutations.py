"""Files that went wrong on their way: bytes lost, doubled, changed, parts of others pasted in.

Whatever comes out, it is a measurement or one clear error. The long run of 100 000 files of each format is behind the
marker ``sweep``; ``RTEC_MUTATIONS`` makes it shorter.
"""

import io
import os
import random
import resource
import sys
import zipfile

import foreign_files
import pytest

from rtec.errors import RtecError
from rtec.metrology import read_measurement

MANY = int(os.environ.get("RTEC_MUTATIONS", "100000"))
FORMATS = {
    "text": [make for make in foreign_files.ALL if not make().name.endswith((".xlsx", ".rtl", ".pos", "laser.dat"))],
    "laser": [foreign_files.thesis_laser],
    "renishaw": [foreign_files.renishaw],
    "workbook": [foreign_files.workbook],
}
PIECES = (
    b";", b",", b"\t", b"\n", b'"', b"\0", b"nan", b"1e999", b"-", b"+", b"\xff\xfe", b"\xb5m", b"::", b"Run 1",
    b"9" * 400, b"=1+1", b"#", b"[mm]", b"target_mm", b"0,5", b"1.000.000,0", b"\x1a", b"\r", b"(", b"2026-11-22T10",
)  # fmt: skip


def mutated(rng: random.Random, data: bytes, other: bytes) -> bytes:
    for _ in range(rng.randint(1, 4)):
        at, to = sorted(rng.randrange(len(data) + 1) for _ in range(2))
        to = min(to, at + rng.choice((1, 2, 10, 200)))
        change = rng.randrange(6)
        if change == 0:
            data = data[:at] + data[to:]
        elif change == 1:
            data = data[:at] + rng.choice(PIECES) + data[at:]
        elif change == 2:
            data = data[:to] + data[at:]
        elif change == 3 and at < len(data):
            data = data[:at] + bytes([rng.randrange(256)]) + data[at + 1 :]
        elif change == 4:
            start = rng.randrange(len(other))
            data = data[:at] + other[start : start + rng.choice((5, 50, 500))] + data[to:]
        else:
            data = data[:to]
    return data


def mutated_book(rng: random.Random, data: bytes) -> bytes:
    """Change one part of a workbook under its own checksum, or the archive as a whole."""
    if rng.randrange(4) == 0:
        return mutated(rng, data, data)
    stream = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(data)) as old, zipfile.ZipFile(stream, "w") as new:
        parts = {name: old.read(name) for name in old.namelist()}
        name = rng.choice([*parts, *["xl/worksheets/sheet1.xml"] * len(parts)])
        parts[name] = mutated(rng, parts[name], parts["xl/worksheets/sheet1.xml"])
        for name, content in parts.items():
            new.writestr(name, content)
    return stream.getvalue()


def read_all(kind: str, count: int, folder) -> int:
    """Read mutated files, and return how many of them are a measurement."""
    rng = random.Random(f"{kind} {count}")  # noqa: S311 - what it draws is no secret
    whole = [make().data for make in FORMATS[kind]]
    file = folder / "x"
    read = 0
    used = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for number in range(count):
        data = whole[number % len(whole)]
        data = mutated_book(rng, data) if kind == "workbook" else mutated(rng, data, rng.choice(whole))
        file.write_bytes(data)
        try:
            measurement = read_measurement(file)
        except RtecError as error:
            assert "\n" not in str(error)
            assert len(str(error)) < 1200
        else:
            read += 1
            assert all(column.values.size == measurement.rows for column in measurement.columns.values())
        if sys.platform == "linux" and number % 1000 == 999:
            assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - used < 1e6  # kB: one gigabyte
    return read


@pytest.mark.parametrize("kind", FORMATS)
@pytest.mark.filterwarnings(
    "ignore"
)  # of the library that reads workbooks: what it meets there is no warning of ours
def test_mutated_files_are_read_or_refused(kind, tmp_path):
    count = 60 if kind == "workbook" else 600
    read = read_all(kind, count, tmp_path)
    assert 0 < read < count


@pytest.mark.sweep
@pytest.mark.parametrize("kind", FORMATS)
@pytest.mark.filterwarnings("ignore")  # as above
def test_a_hundred_thousand_mutated_files(kind, tmp_path):
    assert 0 < read_all(kind, MANY, tmp_path) < MANY
