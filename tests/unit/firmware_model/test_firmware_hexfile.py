"""Intel HEX: written, read back, and refused where a record is not what it says.

The checksums expected here are sums worked out by ``record`` below or copied from Intel's specification.
"""

import shutil
import string
import subprocess

import pytest
from hex_writer import write_hex
from hypothesis import given, settings, strategies as st

from firmware_model.errors import FirmwareError
from firmware_model.hexfile import CODE_BYTES, FILE_LIMIT_BYTES, Image, read_hex

END = ":00000001FF"


def record(address, data, kind=0):
    """Write a record the long way: count up what makes the sum of all bytes a multiple of 256."""
    fields = [len(data), address // 256, address % 256, kind, *data]
    check = next(check for check in range(256) if (sum(fields) + check) % 256 == 0)
    return ":" + "".join(f"{value:02X}" for value in [*fields, check])


@pytest.fixture
def file_of(tmp_path):
    def written(*lines, end="\n"):
        path = tmp_path / "image.hex"
        path.write_bytes(end.join([*lines, ""]).encode("latin-1"))
        return path

    return written


def refusal(path):
    with pytest.raises(FirmwareError) as caught:
        read_hex(path)
    message = str(caught.value)
    assert str(path) in message
    assert "; use " in message
    assert "\n" not in message
    return message.removeprefix(str(path))


def test_the_example_of_the_specification(file_of):
    # 16 bytes at 0100h; the checksum 40 is printed in Intel's specification and in every description since
    image = read_hex(file_of(":10010000214601360121470136007EFE09D2190140", END))
    assert image.used == ((0x100, 0x110),)
    assert image.code[0x100:0x110].hex() == "214601360121470136007efe09d21901"
    assert image.code[:0x100] == b"\xff" * 0x100
    assert image.code[0x110:] == b"\xff" * (CODE_BYTES - 0x110)


memories = st.lists(
    st.tuples(st.integers(0, CODE_BYTES - 1), st.binary(min_size=1, max_size=70)), min_size=1, max_size=12
)


@st.composite
def images(draw):
    memory = {}
    for begin, data in draw(memories):
        memory.update({begin + k: value for k, value in enumerate(data) if begin + k < CODE_BYTES})
    return memory


def ranges(memory):
    starts = sorted(at for at in memory if at - 1 not in memory)
    ends = sorted(at + 1 for at in memory if at + 1 not in memory)
    return tuple(zip(starts, ends, strict=True))


@settings(deadline=None)
@given(images())
def test_what_is_written_is_read_back(tmp_path_factory, memory):
    code = bytes(memory.get(at, 0xFF) for at in range(CODE_BYTES))
    path = tmp_path_factory.mktemp("hex") / "image.hex"
    write_hex(Image(code=code, used=ranges(memory), source="drawn"), path)
    for line in path.read_text().splitlines():
        assert line.startswith(":")
        assert sum(bytes.fromhex(line[1:])) % 256 == 0
    image = read_hex(path)
    assert (image.code, image.used, image.source) == (code, ranges(memory), str(path))


@settings(deadline=None)
@given(st.data(), images(), st.sampled_from(["\n", "\r\n", "\r"]), st.booleans())
def test_records_in_any_order_case_and_line_end(tmp_path_factory, data, memory, end, upper):
    pieces, at = [], 0
    for begin, behind in ranges(memory):
        at = begin
        while at < behind:
            size = data.draw(st.integers(1, min(behind - at, 255)))
            pieces.append(record(at, [memory[at + k] for k in range(size)]))
            at += size
    lines = [*data.draw(st.permutations(pieces)), "", END]
    text = end.join(line if upper else line.lower() for line in lines) + data.draw(st.sampled_from(["", end, "\x1a"]))
    path = tmp_path_factory.mktemp("hex") / "image.hex"
    path.write_bytes(text.encode())
    image = read_hex(path)
    assert image.used == ranges(memory)
    assert all(image.code[at] == value for at, value in memory.items())


def test_segments_and_start_addresses(file_of):
    lines = [
        record(0, [0x0F, 0xF0], 2),  # segment 0FF0h: 0FF00h is added
        record(0x10, [1, 2]),
        record(0, [0, 0], 4),  # upper half 0: nothing is added any more
        record(0x20, [3]),
        record(0, [0, 0, 1, 0], 3),
        record(0, [0, 0, 1, 0], 5),
        record(7, []),
        END,
    ]
    image = read_hex(file_of(*lines))
    assert image.used == ((0x20, 0x21), (0xFF10, 0xFF12))


@pytest.mark.parametrize(
    ("lines", "says"),
    [
        ([record(0, [1])[:-2] + "00", END], [", line 1: ", "checksum 00", "FE for these bytes"]),
        ([record(0, [1]), END, "", record(9, [1])], [", line 4: ", "':01000900", "in line 2"]),
        ([record(0, [1]), END, END], [", line 3: "]),
        ([record(0, [1, 2, 3])[:-2], END], [", line 1: ", "2 data bytes", "3, as the record says", "cut off"]),
        ([record(0, [1, 2, 3])[:-1], END], [", line 1: ", "15 digits", "even"]),
        ([record(0, [1])[:7], END], [", line 1: ", "6 digits", "at least 10"]),
        ([record(0, [1]) + "00", END], [", line 1: ", "2 data bytes", "1, as"]),
        ([":01000000G1FE", END], [", line 1: ", "'G' in column 10", "0-9"]),
        ([": 100000001FE", END], [", line 1: ", "' ' in column 2"]),
        ([":010000000\xb9FE", END], [", line 1: ", "column 11"]),
        (["hello", END], [", line 1: ", "'hello'", "colon"]),
        ([record(0, [1], 6), END], [", line 1: ", "type 06", "types 00 to 05"]),
        ([record(0, [1], 4), END], [", line 1: ", "1 data bytes", "type 04", "use 2"]),
        ([record(0, [1, 2], 5), END], [", line 1: ", "type 05", "use 4"]),
        ([record(0, [1, 2], 1)], [", line 1: ", "type 01", "use 0"]),
        ([record(0, [1])], ["no end-of-file record", ":00000001FF"]),
        ([END], ["without code", "data record"]),
        ([record(3, []), END], ["without code"]),
        ([record(0xFFFF, [1, 2]), END], [", line 1: ", "0x0ffff to 0x10000", "0x10000 (64 KiB)"]),
        ([record(0, [0, 1], 4), record(0, [1]), END], [", line 2: ", "0x10000", "64 KiB", "banked"]),
        ([record(0, [0xFF, 0xFF], 4), record(0, [1]), END], [", line 2: ", "0xffff0000"]),
        ([record(0, [0x10, 0], 2), record(0, [1]), END], [", line 2: ", "0x10000"]),
        ([record(0, range(16)), record(15, [9]), END], [", line 2: ", "0x000f to 0x000f", "line 1 does"]),
        ([record(4, [9]), record(90, [1]), record(0, range(8)), END], [", line 3: ", "0x0004", "line 1 does"]),
        ([record(4, [9]), record(4, [9]), END], [", line 2: ", "second time", "line 1"]),
    ],
)
def test_a_damaged_file_is_refused(file_of, lines, says):
    message = refusal(file_of(*lines))
    for words in says:
        assert words in message


@pytest.mark.parametrize(
    ("raw", "says"),
    [
        (b"", "an empty file"),
        (b" \r\n\n", "an empty file"),
        (b"\x7fELF\x02\x01", "an ELF file"),
        (b"PK\x03\x04rest", "a zip archive"),
        (b"S00600004844521B\n", "S-record"),
        (b"\x02\x00\x30\xff\x00", "a binary file"),
        (b"\x1a", "without code"),
    ],
)
def test_a_file_of_another_kind_is_refused(tmp_path, raw, says):
    path = tmp_path / "image.hex"
    path.write_bytes(raw)
    if says == "without code":
        says = "no end-of-file record"
    assert says in refusal(path)


@settings(deadline=None, max_examples=200)
@given(st.binary(max_size=120))
def test_no_bytes_make_it_stumble(tmp_path_factory, raw):
    path = tmp_path_factory.mktemp("hex") / "image.hex"
    path.write_bytes(b":" + raw)
    with pytest.raises(FirmwareError):
        read_hex(path)


@given(st.integers(0, 41), st.sampled_from(string.ascii_letters + string.digits + string.punctuation))
@settings(deadline=None)
def test_one_wrong_character_is_noticed(tmp_path_factory, place, letter):
    good = ":10010000214601360121470136007EFE09D2190140"
    if good[place].upper() == letter.upper():
        return
    path = tmp_path_factory.mktemp("hex") / "image.hex"
    path.write_text(good[:place] + letter + good[place + 1 :] + "\n" + END + "\n")
    with pytest.raises(FirmwareError):
        read_hex(path)


def test_a_file_that_never_ends_is_not_read_whole(tmp_path):
    path = tmp_path / "image.hex"
    path.write_bytes(b":" * (FILE_LIMIT_BYTES + 1))
    assert "more than" in refusal(path)


def test_a_file_that_is_not_there_is_the_systems_error(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"none\.hex"):
        read_hex(tmp_path / "none.hex")


@pytest.mark.parametrize(
    ("code", "used"),
    [
        (bytes(10), ((0, 10),)),
        (bytes(CODE_BYTES), ((0, CODE_BYTES + 1),)),
        (bytes(CODE_BYTES), ((5, 5),)),
        (bytes(CODE_BYTES), ((-1, 5),)),
        (bytes(CODE_BYTES), ((0, 5), (4, 9))),
        (bytes(CODE_BYTES), ((0, 5), (5, 9))),
        (bytes(CODE_BYTES), ((7, 9), (0, 5))),
    ],
)
def test_an_image_that_is_none_is_refused(code, used):
    with pytest.raises(FirmwareError):
        Image(code=code, used=used, source="here")


@pytest.mark.parametrize(("size", "at"), [(0, 0), (CODE_BYTES + 1, 0), (2, CODE_BYTES - 1), (1, -1)])
def test_bytes_that_do_not_fit_are_refused(size, at):
    with pytest.raises(FirmwareError):
        Image.of(bytes(size), at=at)


@pytest.mark.skipif(not (shutil.which("sdas8051") and shutil.which("sdld")), reason="SDCC's assembler is absent")
def test_what_sdcc_links_is_read(tmp_path):
    source = ".module a\n.area CODE (ABS)\n.org 0x0000\nljmp main\n.org 0x0030\nmain: mov a,#0x12\nsjmp main\n"
    (tmp_path / "a.asm").write_text(source)
    subprocess.run(["sdas8051", "-o", "a.asm"], cwd=tmp_path, check=True, timeout=60)
    subprocess.run(["sdld", "-i", "a.rel"], cwd=tmp_path, check=True, timeout=60)
    image = read_hex(tmp_path / "a.ihx")
    assert image.used == ((0, 3), (0x30, 0x34))
    assert image.code[0x30:0x34].hex() == "741280fc"
    assert image.code[:3].hex() == "020030"
