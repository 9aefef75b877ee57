"""rtec firmware: images are run and listed. Expected cycles and states are worked out by hand from the manual."""

import json

import pytest

from rtec.cli import main


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


def said(capsys, *words):
    code = main(["firmware", *words])
    return code, *capsys.readouterr()


def test_run_says_where_it_is(image, capsys):
    # MOV A,#12H; ADD A,#34H; MOV 30H,A; INC 30H, a cycle each; SJMP $, two cycles each: 4 + 48 x 2 = 100
    words = ["run", image((0, "7412 2434 F530 0530 80FE")), "--cycles", "100"]
    code, out, err = said(capsys, *words, "--json")
    assert (code, err, out.count("\n")) == (0, "", 1)
    found = json.loads(out)
    assert {"instructions", "cycles", "pc", "iram", "wall_s", "instructions_per_s"} <= set(found)
    assert (found["instructions"], found["cycles"], found["pc"]) == (52, 100, 8)
    ram = bytearray(256)
    ram[0x30] = 0x47
    assert found["iram"] == ram.hex()
    assert (found["fault"], found["reason"], found["part"], found["timing"]) == (None, "budget", "8052", "12-clock")
    assert found["wall_s"] > 0
    assert found["instructions_per_s"] == pytest.approx(52 / found["wall_s"])
    code, out, err = said(capsys, *words)
    assert (code, err) == (0, "")
    assert "52 instructions in 100 cycles (12-clock); PC 0008" in out
    assert "30  47 00 00" in out


def test_the_budget_ends_within_an_instruction(image, capsys):
    # cycles 0, 2, 4, ...: a budget of 3 is met at 4
    found = json.loads(said(capsys, "run", image((0, "80FE")), "--cycles", "3", "--json")[1])
    assert (found["cycles"], found["instructions"]) == (4, 2)


def test_an_endless_program_runs_in_slices(image, capsys, monkeypatch):
    monkeypatch.setattr("rtec.cli.firmware._SLICE_CYCLES", 7)
    found = json.loads(said(capsys, "run", image((0, "7412 80FE")), "--cycles", "1001", "--json")[1])
    assert (found["cycles"], found["instructions"]) == (1001, 501)


def test_the_one_clock_part_counts_clocks(image, capsys):
    # MOV A,#12H 2 clocks, SJMP $ 3 clocks: data sheet of the C8051F120, table 11.1
    words = ["--cycles", "32", "--timing", "one-clock", "--json"]
    found = json.loads(said(capsys, "run", image((0, "7412 80FE")), *words)[1])
    assert (found["cycles"], found["instructions"], found["timing"]) == (32, 11, "one-clock")


def test_a_fault_is_a_result(image, capsys):
    words = ["run", image((0, "00 00 A5")), "--cycles", "50"]
    code, out, err = said(capsys, *words, "--json")
    assert (code, err) == (0, "")
    found = json.loads(out)
    assert found["reason"] == "fault"
    assert "reserved" in found["fault"].pop("kind")
    assert found["fault"] == {"pc": 2, "opcode": 0xA5, "cycle": 2}
    assert found["instructions"] == 2
    code, out, _ = said(capsys, *words)
    assert code == 0
    assert "fault: reserved" in out
    assert "opcode A5 at 0002 in cycle 2" in out


def test_the_small_part_has_less_ram(image, capsys):
    # MOV R0,#80H; MOV @R0,#55H
    code = image((0, "7880 7655 80FE"))
    large = json.loads(said(capsys, "run", code, "--cycles", "10", "--json")[1])
    assert bytes.fromhex(large["iram"])[0x80] == 0x55
    small = json.loads(said(capsys, "run", code, "--cycles", "10", "--part", "8051", "--json")[1])
    assert small["fault"] == {"kind": "internal RAM that the part lacks", "pc": 2, "opcode": 0x76, "cycle": 1}


def test_disassemble_lists_each_range(image, capsys):
    path = image((0, "020030"), (0x30, "7412 D290 B5E0FC 80FE"))
    code, out, err = said(capsys, "disassemble", path)
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
    code, out, _ = said(capsys, "disassemble", path, "--json")
    lines = json.loads(out)["lines"]
    assert [(line["address"], line["code"]) for line in lines][:2] == [(0, "020030"), (0x30, "7412")]


@pytest.mark.parametrize("verb", ["run", "disassemble"])
def test_a_bad_image_is_one_line(tmp_path, capsys, verb):
    path = tmp_path / "bad.hex"
    path.write_text(":0200000080FE81\n:00000001FF\n")
    code, out, err = said(capsys, verb, str(path))
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert f"{path}, line 1: checksum 81" in err
    assert "use 80" in err


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["run"], "IMAGE.hex"),
        (["run", "no.hex"], "no.hex: No such file"),
        (["run", "IMAGE", "--cycles", "0"], "--cycles"),
        (["run", "IMAGE", "--cycles", "1.5"], "--cycles"),
        (["run", "IMAGE", "--part", "8048"], "--part: '8048'"),
        (["run", "IMAGE", "--timing", "6-clock"], "--timing: '6-clock'"),
        (["disassemble", "no.hex"], "no.hex: No such file"),
        (["disasemble", "IMAGE"], "did you mean 'disassemble'?"),
    ],
)
def test_bad_words_are_one_line(image, capsys, words, says):
    path = image((0, "80FE"))
    code, out, err = said(capsys, *(path if word == "IMAGE" else word for word in words))
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert says in err


# trace and list

TOGGLE = (0, "B290 00 80FB")  # loop: CPL P1.0 (1 cycle); NOP (1); SJMP loop (2)


def test_trace_lists_what_is_executed_with_the_ports_it_changes(image, capsys):
    code, out, err = said(capsys, "trace", image(TOGGLE), "--instructions", "4", "--json")
    assert (code, err) == (0, "")
    rows = json.loads(out)["rows"]
    assert [(row["cycle"], row["address"], row["text"]) for row in rows] == [
        (0, 0, "cpl p1.0"),
        (1, 2, "nop"),
        (2, 3, "sjmp 0x0000"),
        (4, 0, "cpl p1.0"),
    ]
    assert [row["ports"] for row in rows] == [{"P1": 0xFE}, {}, {}, {"P1": 0xFF}]
    code, out, _ = said(capsys, "trace", image(TOGGLE), "--from", "4", "--instructions", "1")
    assert (code, out.split()) == (0, ["4", "0000", "B2", "90", "cpl", "p1.0", "P1=FF"])


def test_trace_ends_at_a_fault_and_at_power_down(image, capsys):
    code, out, _ = said(capsys, "trace", image((0, "00 A5")))
    assert code == 0
    assert out.splitlines()[-1].startswith("Ended by a fault: reserved opcode at 0001h")
    code, out, _ = said(capsys, "trace", image((0, "758702 00")), "--json")  # MOV PCON,#2
    assert code == 0
    assert len(json.loads(out)["rows"]) == 1


def test_trace_writes_waveforms(image, capsys, tmp_path):
    file = tmp_path / "toggle.vcd"
    words = ["trace", image(TOGGLE), "--instructions", "5", "--vcd", str(file), "--clock", "24MHz"]
    assert said(capsys, *words)[0] == 0
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
    assert said(capsys, *words)[0] == 2  # it exists
    assert file.read_text() == text
    assert said(capsys, *words, "--force")[0] == 0


@pytest.mark.parametrize(
    "words", [["--clock", "fast"], ["--part", "8096"], ["--instructions", "0"], ["--from", "-1"]]
)
def test_trace_refuses_what_it_cannot_do(image, capsys, words):
    code, out, err = said(capsys, "trace", image(TOGGLE), *words)
    assert (code, out) == (2, "")
    assert words[0] in err


def test_list_names_the_images_and_they_run(capsys):
    code, out, _ = said(capsys, "list", "--json")
    found = json.loads(out)["images"]
    assert code == 0
    assert [row["design"] for row in found] == ["a", "b", "c", "original"] * 3
    for row in found:
        assert row["bytes"] > 100
        assert said(capsys, "run", row["image"], "--cycles", "1000")[0] == 0
    assert "original" in said(capsys, "list")[1]
