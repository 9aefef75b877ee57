"""rtec firmware copy, build, check: from a source of one's own to a verdict."""

import json
import re
import shlex
import shutil
from pathlib import Path

import pytest
from hex_writer import write_hex

from firmware_model import Image, read_hex
from firmware_model.images import build
from rtec.cli import main

VERB = "firmware"

NEEDS_SDCC = pytest.mark.skipif(shutil.which("sdas8051") is None, reason="sdas8051 of SDCC is not installed")
SHIPPED = Path(build.__file__).parent
SWAPPED = ("C290C291D290D291", "C291C290D291D290")
"""clr P1.0, clr P1.1, setb P1.0, setb P1.1 the other way round: an insertion of the other sign."""


def record(address, data):
    fields = [len(data), address >> 8, address & 0xFF, 0, *data]
    return ":" + bytes([*fields, -sum(fields) & 0xFF]).hex().upper()


@pytest.fixture
def image(tmp_path):
    """The shipped image of the Original with some bytes, in hex, put in other words."""

    def written(old="", new=""):
        whole = read_hex(SHIPPED / "original.ihx")
        assert bytes.fromhex(old) in whole.code
        code = whole.code.replace(bytes.fromhex(old), bytes.fromhex(new), 1) if old else whole.code
        write_hex(Image(code=code, used=whole.used, source="changed"), tmp_path / "mine.ihx")
        return tmp_path / "mine.ihx"

    return written


@pytest.fixture
def judged_once(monkeypatch):
    """The program of a test is judged once, in whatever form it is told."""
    from rtec.verify.firmware import check as firmware_check

    judge, verdicts = firmware_check.check_firmware, []

    def once(plan, progress):
        if not verdicts:
            verdicts.append(judge(plan, progress))
        return verdicts[0]

    monkeypatch.setattr(firmware_check, "check_firmware", once)


QUICK = ("--design", "original", "--phases", "1", "--frequency", "2kHz", "--tries", "16")


def test_a_good_image_passes(image, said, tmp_path, judged_once):
    figure, vcd = tmp_path / "a.png", tmp_path / "a.vcd"
    words = ["check", image(), *QUICK, "--figure", figure, "--vcd", vcd]
    code, out, err = said(*words, "--json")
    found = json.loads(out)
    assert (code, err, found["passed"]) == (0, "", True)
    assert {check["passed"] for check in found["checks"]} == {True}
    assert (found["processor"], found["part"]) == ("8051-12mhz", "8051")
    assert found["frequencies_hz"] == [2000.0]
    assert 16e3 < found["max_inserting_hz"] < 27e3  # the gate lasts 42 us, a cycle between two insertions
    assert found["max_passing_hz"] > 500e3
    assert found["worst_case"].startswith("rtec check ")
    # docs/firmware.md: the last change in cycle 9 after a look that comes up to two cycles late
    assert 9 <= found["worst_insertion_us"] <= 11.25
    assert figure.read_bytes().startswith(b"\x89PNG")
    text = vcd.read_text()
    for group in ("encoder", "controller", "box", "P1", "check"):
        assert f"$scope module {group} $end" in text
    assert text.count(" P1_") == 8
    code, out, err = said(*words)
    assert (code, out) == (2, "")
    assert "exists" in err
    code, out, _ = said(*words[:-2], "--force")  # the picture again
    assert code == 0
    assert "passed: 28 points hold" in out
    assert "slowest insertion" in out
    assert "Data sheet" in out


@pytest.mark.usefixtures("no_speeds")
def test_a_bad_image_fails_with_cycle_and_address(image, said, capsys, tmp_path, judged_once):
    file = image(*SWAPPED)
    (tmp_path / "mine.sym").write_text("0x0000 reset\n0x0290 pulses\n")
    code, out, err = said("check", file, *QUICK, "--figure", tmp_path / "b.svg", "--json")
    found = json.loads(out)
    assert (code, err, found["passed"]) == (1, "", False)
    failed = {check["name"]: check for check in found["checks"] if check["passed"] is False}
    point = failed["inserts at rest"]
    assert "counts -4 where +4 is right" in point["detail"]
    assert point["time_us"] == pytest.approx(point["cycle"], abs=1.0)
    last = point["instructions"][-1]
    assert (last["address"], last["text"], last["P1"]) == (point["pc"], "clr p1.1", 0x7D)
    assert "fails here" in (tmp_path / "b.svg").read_text()
    # what a failed check names can be played again by itself, and fails there, too
    assert point["stream"].startswith("00 500ns:r1 ")
    assert " '00 10us:r1 " in found["worst_case"]  # cut short, and its times made round
    code = main([*shlex.split(found["worst_case"])[1:], "--json"])
    (played,) = json.loads(capsys.readouterr().out)["checks"]
    assert (code, played["passed"]) == (1, False)
    assert "counts -4 where +4 is right" in played["reason"]
    code, out, _ = said("check", file, *QUICK)
    assert code == 1
    assert "FAILED" in out
    assert "clr p1.1" in out
    assert "pulses" in out
    assert f"cycle {point['cycle']}" in out.replace("\n", " ")


def test_a_program_that_never_answers_has_no_figure(tmp_path, said):
    file, figure = tmp_path / "wait.hex", tmp_path / "c.png"
    file.write_text(":0200000080FE80\n:00000001FF\n")  # sjmp $
    file.with_suffix(".sym").write_text("; symbols\nof another tool\n")
    code, out, err = said("check", file, "--design", "c", "--figure", figure, "--json")
    found = json.loads(out)
    assert (code, figure.exists()) == (1, False)
    assert "not written" in err
    assert "between 0000h and 0000h" in found["checks"][1]["detail"]
    assert [check["passed"] for check in found["checks"]] == [True, False, None, None]
    assert "at 0000h" in said("check", file, "--design", "c")[1]


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["--design", "d"], "--design: 'd'"),
        ([], "--design"),
        (["--design", "c", "--processor", "z80"], "--processor: 'z80'"),
        (["--design", "c", "--part", "8048"], "--part: '8048'"),
        (["--design", "c", "--frequency", "1"], "--frequency"),
        (["--design", "c", "--phases", "0"], "--phases"),
        (["--design", "c", "--figure", "a.bmp"], "--figure: a.bmp"),
    ],
)
def test_bad_words_are_one_line(image, refused, words, says, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert says in refused("check", image(), *words)


# copy, build, list


@NEEDS_SDCC
@pytest.mark.parametrize(("processor", "folder"), [("8051-12mhz", "."), ("one-clock-25mhz", "one_clock_25mhz")])
def test_a_copy_builds_to_the_shipped_image(tmp_path, said, answer, monkeypatch, processor, folder):
    monkeypatch.chdir(tmp_path)
    assert said("copy", "a", "mine.asm")[0] == 0
    assert answer("build", "mine.asm", "--processor", processor)["written"] == ["mine.ihx", "mine.lst", "mine.sym"]
    assert Path("mine.ihx").read_text() == (SHIPPED / folder / "a.ihx").read_text()
    assert "0x0030 start" in Path("mine.sym").read_text()


def test_a_copy_is_the_source_and_spares_what_is_there(tmp_path, said, refused, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert said("copy", "c", "mine.asm", "--json")[0] == 0
    assert Path("mine.asm").read_bytes() == (SHIPPED / "c.asm").read_bytes()
    for words, says in (
        (["a", "mine.asm"], "exists"),
        (["d", "other.asm"], "design: 'd'"),
        (["a", "other.txt"], "ends in .asm"),
    ):
        assert says in refused("copy", *words)
    assert said("copy", "a", "mine.asm", "--force")[0] == 0


def test_build_says_what_is_wrong(tmp_path, refused, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("mine.asm").write_text("        .module mine\n        nopp\n")
    for words, says in ((["no.asm"], "no such source"), (["mine.asm", "--processor", "z80"], "--processor: 'z80'")):
        assert says in refused("build", *words)
    monkeypatch.setenv("PATH", "")
    assert "apt-get install sdcc" in refused("build", "mine.asm")


@NEEDS_SDCC
def test_build_names_file_and_line(tmp_path, refused):
    file = tmp_path / "mine.asm"
    file.write_text("        .module mine\n        nopp\n")
    assert "mine.asm:2: Error" in refused("build", file)


@NEEDS_SDCC
def test_the_how_to_page_shows_what_happens(tmp_path, said, monkeypatch):
    page = (Path(__file__).parents[3] / "docs" / "how-to-firmware.md").read_text()
    mistake = re.search(r"```asm\n(.*?)```", page, re.DOTALL)[1]
    shown = re.search(r"```text\n(.*?)```", page, re.DOTALL)[1]
    commands = [line.split()[2:] for line in page.splitlines() if line.startswith("    rtec firmware ")]
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")
    codes, checked = [], ""
    for words in commands:
        code, out, _ = said(*words)
        codes.append(code)
        if words[0] == "copy":
            source = Path("mine.asm").read_text()
            begin, end = source.index("insert_plus:"), source.index("arm_minus:")
            Path("mine.asm").write_text(source[:begin] + mistake + source[end:])
        checked += out if words[0] == "check" else ""
    assert [words[0] for words in commands] == ["list", "copy", "build", "check", "trace"]
    assert codes == [0, 0, 0, 1, 0]
    printed = iter(checked.splitlines())
    for line in shown.splitlines():
        assert line == "..." or line in printed, line  # in this order
    assert Path("mine.png").is_file()
    assert Path("mine.vcd").is_file()
