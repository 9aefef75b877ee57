"""rtec firmware: images are run and listed. Expected cycles and states are worked out by hand from the manual."""

import json

import pytest

VERB = "firmware"


def record(address, data):
    fields = [len(data), address >> 8, address & 0xFF, 0, *data]
    return ":" + bytes([*fields, -sum(fields) & 0xFF]).hex().upper()


@pytest.fixture
def image(tmp_path):
    def written(*pieces):
        path = tmp_path / "image.hex"
        lines = [record(at, bytes.fromhex(code)) for at, code in pieces]
        path.write_text("\n".join([*lines, ":00000001FF", ""]))
        return str(path)

    return written


def test_run_says_where_it_is(image, said, answer):
    # MOV A,#12H; ADD A,#34H; MOV 30H,A; INC 30H, a cycle each; SJMP $, two cycles each: 4 + 48 x 2 = 100
    words = ["run", image((0, "7412 2434 F530 0530 80FE")), "--cycles", "100"]
    found = answer(*words)
    assert {"instructions", "cycles", "pc", "iram", "wall_s", "instructions_per_s"} <= set(found)
    assert (found["instructions"], found["cycles"], found["pc"]) == (52, 100, 8)
    ram = bytearray(256)
    ram[0x30] = 0x47
    assert found["iram"] == ram.hex()
    assert (found["fault"], found["reason"], found["part"], found["timing"]) == (None, "budget", "8052", "12-clock")
    assert found["wall_s"] > 0
    assert found["instructions_per_s"] == pytest.approx(52 / found["wall_s"])
    code, out, err = said(*words)
    assert (code, err) == (0, "")
    assert "52 instructions in 100 cycles (12-clock); PC 0008" in out
    assert "30  47 00 00" in out


def test_a_fault_is_a_result(image, said):
    words = ["run", image((0, "00 00 A5")), "--cycles", "50"]
    code, out, err = said(*words, "--json")
    assert (code, err) == (0, "")
    found = json.loads(out)
    assert found["reason"] == "fault"
    assert "reserved" in found["fault"].pop("kind")
    assert found["fault"] == {"pc": 2, "opcode": 0xA5, "cycle": 2}
    assert found["instructions"] == 2
    code, out, _ = said(*words)
    assert code == 0
    assert "fault: reserved" in out
    assert "opcode A5 at 0002 in cycle 2" in out


def test_disassemble_lists_each_range(image, said):
    path = image((0, "020030"), (0x30, "7412 D290 B5E0FC 80FE"))
    code, out, err = said("disassemble", path)
    assert (code, err) == (0, "")
    rows = [line.split(None, 1) for line in out.splitlines()]
    assert [row[0] for row in rows] == ["0000", "0030", "0032", "0034", "0037"]
    for row, (bytes_of, mnemonic) in zip(
        rows,
        [("02 00 30", "LJMP"), ("74 12", "MOV"), ("D2 90", "SETB"), ("B5 E0 FC", "CJNE"), ("80 FE", "SJMP")],
        strict=True,
    ):
        assert row[1].startswith(bytes_of)
        assert row[1].removeprefix(bytes_of).split()[0].upper() == mnemonic
    code, out, _ = said("disassemble", path, "--json")
    lines = json.loads(out)["lines"]
    assert [(line["address"], line["code"]) for line in lines][:2] == [(0, "020030"), (0x30, "7412")]


@pytest.mark.parametrize("verb", ["run", "disassemble"])
def test_a_bad_image_is_one_line(tmp_path, refused, verb):
    path = tmp_path / "bad.hex"
    path.write_text(":0200000080FE81\n:00000001FF\n")
    err = refused(verb, str(path))
    assert f"{path}, line 1: checksum 81" in err
    assert "use 80" in err


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["run"], "IMAGE.hex"),
        (["run", "no.hex"], "no.hex: No such file"),
        (["run", "IMAGE", "--cycles", "0"], "--cycles"),
        (["run", "IMAGE", "--part", "8048"], "--part: '8048'"),
        (["run", "IMAGE", "--timing", "6-clock"], "--timing: '6-clock'"),
    ],
)
def test_bad_words_are_one_line(image, refused, words, says):
    path = image((0, "80FE"))
    assert says in refused(*(path if word == "IMAGE" else word for word in words))


# trace and list

TOGGLE = (0, "B290 00 80FB")  # loop: CPL P1.0 (1 cycle); NOP (1); SJMP loop (2)


def test_trace_lists_what_is_executed_with_the_ports_it_changes(image, said):
    code, out, err = said("trace", image(TOGGLE), "--instructions", "4", "--json")
    assert (code, err) == (0, "")
    rows = json.loads(out)["rows"]
    assert [(row["cycle"], row["address"], row["text"]) for row in rows] == [
        (0, 0, "cpl p1.0"),
        (1, 2, "nop"),
        (2, 3, "sjmp 0x0000"),
        (4, 0, "cpl p1.0"),
    ]
    assert [row["ports"] for row in rows] == [{"P1": 0xFE}, {}, {}, {"P1": 0xFF}]
    code, out, _ = said("trace", image(TOGGLE), "--from", "4", "--instructions", "1")
    assert (code, out.split()) == (0, ["4", "0000", "B2", "90", "cpl", "p1.0", "P1=FF"])


def test_trace_ends_at_a_fault_and_at_power_down(image, said):
    code, out, _ = said("trace", image((0, "00 A5")))
    assert code == 0
    assert out.splitlines()[-1].startswith("Ended by a fault: reserved opcode at 0001h")
    code, out, _ = said("trace", image((0, "758702 00")), "--json")  # MOV PCON,#2
    assert code == 0
    assert len(json.loads(out)["rows"]) == 1


def test_trace_writes_waveforms(image, said, tmp_path):
    file = tmp_path / "toggle.vcd"
    words = ["trace", image(TOGGLE), "--instructions", "5", "--vcd", str(file), "--clock", "24MHz"]
    assert said(*words)[0] == 0
    text = file.read_text()
    name = next(line.split()[3] for line in text.splitlines() if line.startswith("$var") and " P1_0 " in line)
    moments = [line for line in text.split("$enddefinitions $end")[1].splitlines() if line]
    at, seen = None, []
    for line in moments:
        at = int(line[1:]) if line.startswith("#") else at
        if line in (f"0{name}", f"1{name}") and at:
            seen.append((at, int(line[0])))
    # at 24 MHz a cycle takes 0.5 us: the first CPL ends after one, the second after five
    assert seen == [(500_000, 0), (2_500_000, 1)]
    assert said(*words)[0] == 2  # it exists
    assert file.read_text() == text
    assert said(*words, "--force")[0] == 0


@pytest.mark.parametrize(
    "words", [["--clock", "fast"], ["--part", "8096"], ["--instructions", "0"], ["--from", "-1"]]
)
def test_trace_refuses_what_it_cannot_do(image, said, words):
    code, out, err = said("trace", image(TOGGLE), *words)
    assert (code, out) == (2, "")
    assert words[0] in err


def test_list_names_the_images_and_they_run(said):
    code, out, _ = said("list", "--json")
    found = json.loads(out)["images"]
    assert code == 0
    assert [row["design"] for row in found] == ["a", "b", "c", "original"] * 3
    for row in found:
        assert row["bytes"] > 100
        assert said("run", row["image"], "--cycles", "1000")[0] == 0
    assert "original" in said("list")[1]
