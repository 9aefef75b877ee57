"""The pins file: which port is what, and everything that a file can have wrong."""

import pytest
from verilog_modules import PINS, pins_text

from rtec.errors import ArgumentError, FileFormatError
from rtec.verify.contract.verilog_pins import Active, Pins, Port

PORTS = [
    Port("clk", True, 1), Port("a", True, 1), Port("b", True, 1), Port("asked", True, 16), Port("qa", False, 1),
    Port("qb", False, 1), Port("done", False, 16), Port("no", False, 4), Port("rst_n", True, 1),
]  # fmt: skip


def read(folder, text):
    path = folder / "p.toml"
    path.write_text(text)
    return Pins.read(path)


def test_all_keys(tmp_path):
    text = pins_text("mine", refused="no", reset="rst_n", reset_active="low") + "reset_ticks = 3\n"
    pins = read(tmp_path, text)
    assert pins == Pins(
        top="mine", **PINS, refused="no", reset="rst_n", reset_active=Active.LOW, reset_ticks=3,
        where=str(tmp_path / "p.toml"),
    )  # fmt: skip
    assert pins.outputs == ("qa", "qb", "done", "no")
    assert pins.widths(PORTS) == {port.name: port.bits for port in PORTS}


def test_what_need_not_be_said(tmp_path):
    pins = read(tmp_path, pins_text("mine"))
    assert (pins.refused, pins.reset, pins.reset_active, pins.reset_ticks) == (None, None, Active.HIGH, 8)
    assert pins.outputs == ("qa", "qb", "done")


@pytest.mark.parametrize("key", ["top", *PINS])
def test_each_of_these_keys_is_needed(tmp_path, key):
    text = "".join(line for line in pins_text("mine").splitlines(keepends=True) if not line.startswith(f"{key} "))
    with pytest.raises((FileFormatError, ArgumentError), match=rf"p\.toml.*{key}"):
        read(tmp_path, text)


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ('rest = "rst"\n', r"rest.*did you mean 'reset'"),
        ('clokc = "clk"\n', r"clokc.*did you mean 'clock'"),
        ("refused = 3\n", r"refused.*3"),
        ('reset_active = "falling"\n', r"reset_active.*falling.*high.*low"),
        ("reset_ticks = 0\n", r"reset_ticks.*0.*1.*10000"),
        ("reset_ticks = 10001\n", r"reset_ticks.*10001"),
        ("reset_ticks = 2.5\n", r"reset_ticks.*2\.5"),
        ("reset_ticks = true\n", r"reset_ticks"),
        ('reset = ""\n', r"reset: '' .*1 to 200 characters"),
        ('reset = "9x"\n', r"reset: '9x' .*plain name"),
        ('reset = "a; $finish"\n', r"reset: .*plain name"),
        ('reset = "clk"\n', r"reset: 'clk' .* not clock already"),
        ("[more]\nx = 1\n", r"more"),
        ('top = "again"\n', r"p\.toml.*(overwrite|TOML)"),
        ("= 3\n", r"p\.toml.*line"),
        ("\x00", r"p\.toml"),
    ],
)
def test_wrong_keys_and_values(tmp_path, more, said):
    with pytest.raises((FileFormatError, ArgumentError), match=said):
        read(tmp_path, pins_text("mine") + more)


def test_not_toml_at_all(tmp_path):
    path = tmp_path / "p.toml"
    path.write_bytes(b"\xff\xfe\x00PK")
    with pytest.raises(FileFormatError, match=r"p\.toml"):
        Pins.read(path)
    with pytest.raises(FileFormatError, match=r"other\.toml"):
        Pins.read(tmp_path / "other.toml")
    with pytest.raises(FileFormatError):
        Pins.read(tmp_path)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"clock": "clkk"}, r"clock: 'clkk' .* a port of mine: clk, a, b, .*; did you mean 'clk'\?"),
        ({"clock": "zzzzz"}, r"clock: 'zzzzz' .* a port of mine: [^;]*$"),
        ({"a_in": "qa", "a_out": "a"}, r"a_in: 'qa' .* an input of mine"),
        ({"refused": "rst_n"}, r"refused: 'rst_n' .* an output of mine"),
        ({"a_in": "asked", "requested": "a"}, r"a_in: 'asked' of 16 bits .* 1 bit$"),
        ({"completed": "qa", "a_out": "no"}, r"a_out: 'no' of 4 bits .* 1 bit$"),
    ],
)
def test_ports_that_do_not_fit(given, said):
    with pytest.raises(ArgumentError, match=said):
        Pins(top="mine", **{**PINS, **given}).widths(PORTS)


def test_totals_have_2_to_32_bits():
    pins = Pins(top="mine", **PINS)
    for bits, good in ((1, False), (2, True), (32, True), (33, False)):
        ports = [port if port.name != "done" else Port("done", False, bits) for port in PORTS]
        if good:
            assert pins.widths(ports)["done"] == bits
        else:
            with pytest.raises(ArgumentError, match=rf"completed: 'done' of {bits} bits .* 2 to 32 bits"):
                pins.widths(ports)
