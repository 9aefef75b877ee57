"""Messages by name: read and written, and a user's DBC held to ours."""

import re
import subprocess
import sys
import time
from importlib.resources import files
from pathlib import Path

import cantools
import pytest
from crc_oracle import frame_checksum
from hypothesis import given, settings, strategies as st

from rtec.errors import ArgumentError, FileFormatError
from rtec.link._frame_kernels import pack_request, pack_status
from rtec.link.messages import KINDS, Kind, MessageSet, Verdict

TEXT = (files("rtec.link") / "rtec.dbc").read_text()
DBC = cantools.database.load_string(TEXT, database_format="dbc")


@pytest.fixture(scope="module")
def messages():
    return MessageSet.load()


def bytes_of(payload):
    return int(payload).to_bytes(8, "little", signed=True)


# reading


@settings(deadline=None)
@given(
    kind=st.sampled_from(list(Kind)),
    axis=st.integers(1, 15),
    data=st.binary(min_size=8, max_size=8),
    sealed=st.booleans(),
)
def test_any_frame_is_read_as_by_cantools(messages, kind, axis, data, sealed):
    identifier = int(kind) + (axis if kind != Kind.HOLD else 0)
    if sealed:
        data = bytes([frame_checksum(identifier, data)]) + data[1:]
    message = messages.decode(identifier, data)
    name = kind.name.capitalize()
    assert message.name == name
    assert message.axis == (axis if kind != Kind.HOLD else data[3])
    expected = DBC.decode_message("Hold" if kind == Kind.HOLD else f"{name}_1", data, scaling=False)
    assert message.values == {key: value if isinstance(value, int) else str(value) for key, value in expected.items()}
    assert {type(value) for value in message.values.values()} <= {int, str}
    if not sealed and data[0] != frame_checksum(identifier, data):
        assert message.verdict is Verdict.WRONG_CHECKSUM
    elif kind == Kind.REQUEST and expected["Total"] % 65536 + expected["TotalInverted"] != 65535:
        assert message.verdict is Verdict.CONTRADICTORY
    else:
        assert message.verdict is Verdict.RIGHT


@pytest.mark.parametrize(
    "identifier",
    [-1, 0, 0x07F, 0x081, 0x08F, 0x180, 0x200, 0x280, 0x190, 0x300, 0x380, 0x390, 0x7FF, 0x10201, 1 << 40],
)
def test_other_identifiers_are_none_of_ours(messages, identifier):
    assert messages.decode(identifier, bytes(8)) is None


@pytest.mark.parametrize("length", [0, 1, 7, 9, 64])
def test_frame_of_another_length_has_no_fields(messages, length):
    message = messages.decode(0x201, bytes(length))
    assert (message.name, message.axis, message.values, message.verdict) == ("Request", 1, {}, Verdict.WRONG_LENGTH)


# writing


@pytest.mark.parametrize("axis", [1, 3, 4, 15])
def test_encoded_request_is_that_of_the_node(axis):
    messages = MessageSet.load()
    for sequence in (1, 2, 3):
        frame = messages.encode("Request", axis, {"Total": -77, "Enable": 1, "Requester": 5, "Session": 200})
        assert frame.identifier == 0x200 + axis
        assert frame.data == bytes_of(pack_request(axis, sequence, -77, 8, 5, 200))


@settings(deadline=None, max_examples=50)
@given(st.sampled_from(sorted(KINDS)), st.integers(1, 15), st.data())
def test_what_is_written_is_read_again(name, axis, data):
    messages = MessageSet.load()
    template = DBC.get_message_by_name("Hold" if name == "Hold" else f"{name}_1")
    values = {}
    for signal in template.signals:
        low = -(1 << signal.length - 1) if signal.is_signed else 0
        if signal.name not in ("Crc", "Axis", "TotalInverted"):
            values[signal.name] = data.draw(st.integers(low, low + (1 << signal.length) - 1))
    frame = messages.encode(name, axis, values)
    message = messages.decode(frame.identifier, frame.data)
    assert (message.name, message.axis, message.verdict) == (name, axis, Verdict.RIGHT)
    assert frame.data[0] == frame_checksum(frame.identifier, frame.data)
    again = messages.encode(name, axis, {key: message.values[key] for key in values})  # with labels
    assert again == frame


def test_sequences_count_for_each_identifier_and_wrap():
    messages = MessageSet.load()
    first = [messages.encode("Request", 1, {}).data[1] for _ in range(258)]
    assert first == [*range(1, 256), 0, 1, 2]
    assert messages.encode("Request", 2, {}).data[1] == 1
    assert messages.encode("Request", 1, {"Sequence": 40}).data[1] == 40
    assert messages.encode("Request", 1, {}).data[1] == 41


def test_inverse_may_be_given_to_contradict(messages):
    frame = messages.encode("Request", 1, {"Total": 5, "TotalInverted": 5})
    assert messages.decode(frame.identifier, frame.data).verdict is Verdict.CONTRADICTORY


def test_hold_names_its_axis(messages):
    frame = messages.encode("Hold", 0, {"Reason": "OPERATOR"})
    assert (frame.identifier, frame.data[2:4]) == (0x080, bytes([18, 0]))


@pytest.mark.parametrize(
    ("name", "axis", "values", "words"),
    [
        ("Bequest", 1, {}, "message: 'Bequest' is not a message; .*did you mean 'Request'"),
        ("Request_1", 1, {}, "did you mean 'Request'"),
        ("Request", 0, {}, "axis: 0 .* 1 to 15"),
        ("Request", 16, {}, "axis: 16"),
        ("Hold", 16, {}, "axis: 16 .* 0 to 15"),
        ("Request", 1, {"Totl": 3}, "field: 'Totl' .*'Total'"),
        ("Request", 1, {"Crc": 3}, "field: 'Crc'"),
        ("Hold", 1, {"Axis": 3}, "field: 'Axis'"),
        ("Request", 1, {"Total": -32769}, "Total: -32769 .* -32768 to 32767"),
        ("Request", 1, {"Requester": 8}, "Requester: 8 .* 0 to 7"),
        ("Request", 1, {"Total": 1.5}, "Total: 1.5 .*whole number"),
        ("Request", 1, {"Enable": True}, "Enable: True"),
        ("Request", 1, {"Total": "five"}, "Total: 'five' .*whole number"),
        ("Status", 1, {"Code": "OKAY"}, "Code: 'OKAY' .*did you mean 'OK'"),
        ("Status", 1, {"Code": 256}, "Code: 256 .* 0 to 255"),
    ],
)
def test_wrong_values_are_named(messages, name, axis, values, words):
    with pytest.raises(ArgumentError, match=words):
        messages.encode(name, axis, values)


def test_refused_message_uses_up_no_sequence_number():
    messages = MessageSet.load()
    with pytest.raises(ArgumentError):
        messages.encode("Request", 1, {"Total": 1 << 20})
    assert messages.encode("Request", 1, {}).data[1] == 1


# a DBC of the user's


def write(tmp_path, text, name="plant.dbc"):
    path = tmp_path / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


OTHERS = """
BO_ 100 Spindle: 8 PC
 SG_ Speed : 7|16@0+ (0.1,0) [0|0] "1/min" PC
BO_ 2147484161 LongIdentifier: 8 PC
 SG_ Speed : 0|16@1+ (1,0) [0|0] "" PC
"""
FOURTH = TEXT[TEXT.index("BO_ 513") : TEXT.index("BO_ 641")].replace("513 Request_1", "516 Request_4")


@pytest.mark.parametrize(
    "text",
    [
        TEXT,
        "\ufeff" + TEXT,
        TEXT.replace("\n", "\r\n"),
        DBC.as_dbc_string(),
        TEXT.replace("CM_ BO_ 128", OTHERS + "CM_ BO_ 128"),
        TEXT.replace("BO_ 642", FOURTH.replace("BOX_1", "PC") + "BO_ 642", 1),
        TEXT.replace("Every 10 ms.", 'Says: \\"400000000|8@1+ : 400000000\\" // no').replace("[0|15]", "[0|0]"),
    ],
    ids=["same", "mark", "crlf", "written by cantools", "other messages", "axis 4", "other words"],
)
def test_dbc_that_agrees_is_taken(tmp_path, text):
    messages = MessageSet.load(write(tmp_path, text))
    assert messages.encode("Request", 4, {"Total": 1}) == MessageSet.load().encode("Request", 4, {"Total": 1})


def changed(old, new, count=1):
    assert old in TEXT
    return TEXT.replace(old, new, count)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (TEXT.replace("BO_ 513", "BO_ 529").replace("SG_ 513", "SG_ 529"),
         "Request_1 has the identifier 0x211 of 11 bits; use 0x201 of 11 bits"),
        (changed("Request_1", "Demand_1"), "0x201 is that of the message Demand_1; use the message Request_1"),
        (re.sub(r"BO_ 641 .*?\n\n", "", TEXT, count=1, flags=re.DOTALL), "the message Corrections_1 is missing"),
        (changed("Hold: 8", "Hold: 7"), "Hold has 7 bytes; use 8"),
        (changed("SG_ Total : 16|16@1-", "SG_ Total : 16|16@1+"), "Request_1, signal Total: sign is unsigned"),
        (changed("SG_ Total : 16|16@1-", "SG_ Total : 16|15@1-"), "Total: length in bits is 15; use 16"),
        (changed("SG_ Total : 16|16@1-", "SG_ Total : 23|16@0-"), "Total: start bit is 23; use 16"),
        (changed("SG_ Crc : 0|8@1+", "SG_ Crc : 0|8@0+"), "overlapping|start bit|byte order"),
        (changed("16|16@1- (1,0)", "16|16@1- (0.5,0)"), "Total: scale is 0.5; use 1.0"),
        (changed("16|16@1- (1,0)", "16|16@1- (1,4)"), "Total: offset is 4.0; use 0.0"),
        (changed('"steps"', '"mm"'), "Total: unit is mm; use steps"),
        (changed(" SG_ Trips", " SG_ Tripped"), "Probe_1: the signal Trips is missing"),
        (changed('30|1@1+ (1,0) [0|1] "" PC', '30|1@1+ (1,0) [0|1] "" PC\n SG_ More : 31|1@1+ (1,0) [0|1] "" PC'),
         "Status_1: the signal More at bit 31; use only"),
        (changed('6 "REFUSED_TOO_FAST"', '6 "TOO_FAST"'), "Code: label of 6 is TOO_FAST; use REFUSED_TOO_FAST"),
        (changed('0 "NONE"', '0 "NONE" 77 "MINE"'), "Hold, signal Reason: label of 77 is MINE; use none"),
        (changed("BO_ 642", FOURTH.replace("BOX_1", "PC").replace("16|16", "16|15") + "BO_ 642"),
         "Request_4, signal Total"),
        (changed("BO_ 642", OTHERS.replace("100", "527") + "BO_ 642"), "0x20f is that of the message Spindle"),
        (changed("Enable :", "Enable M :").replace("Reset :", "Reset m1 :"), "Enable: multiplexing is multiplexed"),
    ],
)  # fmt: skip
def test_dbc_that_differs_is_refused_with_the_first_difference(tmp_path, text, words):
    with pytest.raises(FileFormatError, match=words) as error:
        MessageSet.load(write(tmp_path, text))
    assert str(error.value).startswith(f"{tmp_path / 'plant.dbc'}: ")
    assert "\n" not in str(error.value)
    assert len(str(error.value)) < 400


def test_fields_of_every_message_are_compared(tmp_path):
    places = [match.start() for match in re.finditer(r" SG_ ", TEXT)]
    places = [place for place in places if TEXT[place - 1] == "\n"]
    assert len(places) == sum(len(message.signals) for message in DBC.messages) > 100
    for place in places[::4]:  # the shortest message has four
        end = TEXT.index("\n", place)
        text = TEXT[:place] + re.sub(r"\((1|0\.1),0\)", "(2,0)", TEXT[place:end]) + TEXT[end:]
        name = TEXT[place + 5 : TEXT.index(" :", place)]
        with pytest.raises(FileFormatError, match=f"signal {name}: scale is 2.0"):
            MessageSet.load(write(tmp_path, text))


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "the file is empty"),
        (b"hello world", "no DBC"),
        (b"\x00\xff\xfe" * 1000, "a NUL byte"),
        (b'VERSION "' + b"a" * 260_000, "no DBC"),
        (b'CM_ "nothing";', "the message Hold is missing"),
        (b"VERSION" + b" " * (1 << 18), "at most 262144 bytes"),
        (changed("Hold: 8", "Hold: 400000000").encode(), "line 9: 400000000 where"),
        (changed("Hold: 8", "Hold:// :8\n+400000000").encode(), "line 10: 400000000 where"),
        (changed("8|8@1+", "8|400000000@1+").encode(), "line 11: 400000000 where"),
        (changed("8|8@1+", "400000000|8@1+").encode(), "line 11: 400000000 where"),
        (changed("8|8@1+", "8|8888888888888888888888888@1+").encode(), "line 11: 88888888888888888888 where"),
        (changed("BO_ 128", "BO_ " + "9" * 5000).encode(), "no DBC"),
        (TEXT[:3000].encode(), "no DBC|missing|label"),
    ],
)
def test_hostile_file_is_one_clear_error_soon(tmp_path, content, words):
    began = time.process_time()
    with pytest.raises(FileFormatError, match=words) as error:
        MessageSet.load(write(tmp_path, content))
    assert time.process_time() - began < 20
    assert "\n" not in str(error.value)
    assert len(str(error.value)) < 500


def test_a_dbc_from_before_the_setups_still_describes_the_rest(tmp_path):
    blocks = [block for block in TEXT.split("\n\n") if not re.match(r"BO_ \d+ (Setup|Expected)_", block)]
    old = "\n\n".join(blocks)
    old = "\n".join(line for line in old.splitlines() if not re.search(r" (25[789]|32[123]) ", line)) + "\n"
    assert "Setup" not in old
    assert "Expected" not in old
    assert MessageSet.load(write(tmp_path, old)).decode(0x101, bytes(8)).name == "Setup"
    with pytest.raises(FileFormatError, match="identifier 0x101 is that of the message Mine"):
        MessageSet.load(write(tmp_path, old.replace("BO_ 128 Hold", "BO_ 257 Mine: 8 PC\n\nBO_ 128 Hold")))


def test_path_that_is_no_file(tmp_path):
    with pytest.raises(FileFormatError, match="no such file"):
        MessageSet.load(tmp_path / "none.dbc")
    with pytest.raises(FileFormatError, match="is no regular file"):
        MessageSet.load(tmp_path)
    with pytest.raises(FileFormatError, match="is no regular file"):
        MessageSet.load("/dev/zero")
    with pytest.raises(FileFormatError, match="null"):
        MessageSet.load("a\0b")


def test_cantools_is_loaded_only_when_messages_are():
    code = "import rtec.link.messages, sys; sys.exit('cantools' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


# the page


PAGE = (Path(__file__).parents[3] / "docs" / "messages.md").read_text(encoding="utf-8")


def rows(heading):
    section = PAGE.split(f"\n## {heading}\n")[1].split("\n## ")[0]
    lines = [line for line in section.splitlines() if line.startswith("| ") or line.startswith("||")]
    return [[cell.strip().strip("`") for cell in line.strip("|").split("|")] for line in lines[1:]]


def signals_of(kind):
    return DBC.get_message_by_name("Hold" if kind == "Hold" else f"{kind}_1").signals


def test_page_lists_every_field():
    table = rows("Fields")
    for kind in KINDS:
        shown = {
            (name, int(bit), int(bits), sign) for owner, name, bit, bits, sign, _ in table if owner in ("every", kind)
        }
        assert shown == {
            (s.name, s.start, s.length, "signed" if s.is_signed else "unsigned") for s in signals_of(kind)
        }


def test_page_lists_every_identifier_and_label():
    assert {name: int(number.split(" ")[0], 16) for name, number, *_ in rows("Identifiers")} == KINDS
    for heading, kind, field in (("Codes of the box", "Status", "Code"), ("Reasons of a hold", "Hold", "Reason")):
        choices = next(signal for signal in signals_of(kind) if signal.name == field).choices
        assert {int(number): label for number, label, *_ in rows(heading)} == {n: str(c) for n, c in choices.items()}


def test_loads_of_the_page_are_those_of_its_frames():
    # 135 bits a frame, 5000 bits in 10 ms; 2 us a bit
    for _, frames, load, through in rows("Bus load"):
        assert load == f"{int(frames) * 135 / 50:.1f} %"
        assert through == f"{int(frames) * 135 * 0.002:.2f} ms"


def test_program_of_the_page_talks_to_the_nodes(messages):
    code = re.search(r"^```python\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)[1]
    program = {}
    exec(compile(code, "messages.md", "exec"), program)  # noqa: S102 - it is our own page
    identifier, data = program["request"](sequence=7, total=-3, session=200)
    assert (identifier, data) == (0x201, bytes_of(pack_request(1, 7, -3, 8, 0, 200)))
    frame = bytes_of(pack_status(1, 3, 4, 1, 9, 1, 2, 3))
    assert str(program["status"](frame)["Code"]) == "I_DONT_BELIEVE_YOU"
    with pytest.raises(ValueError, match="not to be believed"):
        program["status"](frame[:-1] + b"\x00")
    line = re.search(r'^    python -c "(.*)"$', PAGE, re.MULTILINE)[1]
    found = subprocess.run([sys.executable, "-c", line], capture_output=True, text=True, check=True).stdout.strip()
    assert Path(found).read_text() == TEXT
