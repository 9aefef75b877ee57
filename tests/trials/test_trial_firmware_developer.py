"""The firmware developer: an insertion algorithm in Python, an 8051 image, Verilog, and a decoder of his own."""

import json
import re
import shlex
from pathlib import Path

HIS = Path(__file__).parent / "firmware" / "ring.py"
BUG, MENDED = "elif moved == 3 and self.left <= 0:", "elif moved == 3:"
COUNTS = re.compile(r"the controller counts ([+-]\d+) where ([+-]\d+) is right, .* since (\S+ \S+)$", re.MULTILINE)


def decoded(file, scope):
    """Return the counts and illegal transitions of A and B of a scope of a VCD, by the Gray code."""
    head, body = file.read_text().split("$enddefinitions $end")
    scopes = re.findall(rf"\$scope module {scope} \$end(.*?)\$upscope", head, re.DOTALL)
    codes = dict(re.findall(r"\$var wire 1 (\S+) \w+_([AB]) \$end", "".join(scopes)))
    levels, instants = {}, [[]]
    for line in body.split():
        if line.startswith("#"):
            instants.append([])
        elif line[1:] in codes:
            instants[-1].append((codes[line[1:]], int(line[0])))
    counts, illegal, before = 0, 0, None
    for changes in instants:
        levels |= dict(changes)
        place = None if len(levels) < 2 else [0, 1, 3, 2][levels["A"] + 2 * levels["B"]]
        if before is not None:
            step = (place - before + 1) % 4 - 1
            counts, illegal = counts + step * (step != 2), illegal + (step == 2)
        before = place
    return counts, illegal


def test_his_algorithm_is_told_which_rule_it_breaks_and_when_and_passes_once_mended(rtec, tmp_path):
    (tmp_path / "ring.py").write_text(HIS.read_text())
    words = ("check", "ring.py:Ring", "--design", "c", "--tries", "16")
    said = rtec(*words, "--figure", "worst.png", "--vcd", "worst.vcd", code=1).stdout
    assert max(map(len, said.split("worst case:")[0].splitlines())) <= 80
    assert re.search(r"runs +│ passed", said) and re.search(r"passes +│ passed", said)
    assert re.search(r"reversals +│ FAILED │ \+1 step", said)  # it loses an edge back, while a step is under way
    assert "plain Python" not in said
    counted, right, _ = COUNTS.search(said).groups()

    # the picture is there, and his own decoder finds in the waveforms what was said
    assert (tmp_path / "worst.png").read_bytes().startswith(b"\x89PNG")
    encoder, controller = decoded(tmp_path / "worst.vcd", "encoder"), decoded(tmp_path / "worst.vcd", "controller")
    assert controller == (int(counted), 0) and encoder[1] == 0
    completed = (int(right) - encoder[0]) / 2
    assert completed in (0, 1) and int(counted) == int(right) + 1  # one edge back is missing

    again = shlex.split(re.search(r"^play it again: rtec (.*)$", said, re.MULTILINE)[1])
    (tmp_path / "ring.py").write_text(HIS.read_text().replace(BUG, MENDED))
    assert "passed: every count right" in rtec(*again).stdout
    document = json.loads(rtec(*words, "--json").stdout)
    assert document["passed"] and all(check["passed"] for check in document["checks"])


def test_an_image_with_one_byte_wrong_is_told(rtec, tmp_path):
    """The step of two counts inverts one line, then the other; with one byte wrong it inverts one line twice."""
    images = json.loads(rtec("firmware", "list", "--json").stdout)["images"]
    (image,) = (each for each in images if (each["design"], each["processor"]) == ("c", "8051-12mhz"))
    lines = Path(image["image"]).read_text().splitlines()
    at = next(n for n, line in enumerate(lines) if "B291B290" in line)  # cpl p1.1, cpl p1.0
    lines[at] = lines[at].replace("B291B290", "B290B290")
    hex_file = tmp_path / "mine.hex"
    hex_file.write_text("\n".join(lines))
    words = ("check", "mine.hex", "--design", "c", "--frequency", "20kHz")
    refused = rtec(*words, code=2).stderr
    assert f"mine.hex, line {at + 1}: checksum" in refused and refused.count("\n") == 1

    sums = -sum(bytes.fromhex(lines[at][1:-2])) % 256
    lines[at] = f"{lines[at][:-2]}{sums:02X}"
    hex_file.write_text("\n".join(lines))
    said = rtec(*words, "--tries", "16", code=1).stdout
    assert re.search(r"passes +│ passed", said)  # it inserts nothing there
    assert re.search(r"inserts in motion +│ FAILED", said)
    again = shlex.split(re.search(r"^play it again: rtec (.*)$", said, re.MULTILINE)[1])
    hex_file.write_text(Path(image["image"]).read_text())
    assert "passed: every count right" in rtec(*again).stdout
