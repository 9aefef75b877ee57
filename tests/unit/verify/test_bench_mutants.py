"""Mutants of decoder, windows, PC and firmware: the page has them all, and a few are found again."""

import ast
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from rtec.injector import Design
from rtec.verify.firmware.check import FirmwareCheckPlan
from tools import code_mutants, firmware_mutants
from tools.mutants import BOX_CHECKS

ROOT = Path(__file__).parents[3]
PAGE = (ROOT / "docs" / "mutants.md").read_text(encoding="utf-8")
DRAWN = firmware_mutants.drawn()
COUNTS = """
import sys
from rtec._chosen_mutant import CHOSEN
from rtec.controller import Receiver, ReceiverSettings
from rtec.signal import EdgeStream
CHOSEN.value = int(sys.argv[1])
receiver = Receiver(ReceiverSettings())
receiver.process(EdgeStream([10**6 * k for k in range(1, 9)], [1, 3, 2, 0] * 2, initial=0))
print(receiver.result(at_ps=10**7).count)
"""


def section(title):
    return PAGE.partition(f"\n## {title}\n")[2].partition("\n## ")[0]


def test_the_page_has_the_mutants_of_the_code_and_the_code_still_has_their_places():
    listed, table = section("Decoder, windows and PC"), code_mutants.table()
    rows = {f"| `{mutant.function}` | {mutant.wrong} |" for mutant in table}
    assert len(rows) == len(table)
    for mutant in table:
        _, source = code_mutants.functions(ROOT / mutant.file)[mutant.function]
        ast.parse(mutant.source(source))
    shown = [" |".join(line.split(" |")[:2]) + " |" for line in listed.splitlines() if line.startswith("| `")]
    assert sorted(shown) == sorted(rows)


def test_a_mutant_is_chosen_while_the_program_runs(tmp_path):
    """Of the four states that an x4 decoder goes through, the first mutant does not count out of one."""
    code_mutants.make_copy(tmp_path, code_mutants.table()[:3])
    environment = os.environ | {"NUMBA_DISABLE_JIT": "1", "PYTHONPATH": str(tmp_path)}
    said = [
        subprocess.run(
            [sys.executable, "-c", COUNTS, number],
            cwd=tmp_path, env=environment, capture_output=True, text=True, check=True,
        ).stdout
        for number in ("0", "1")
    ]  # fmt: skip
    assert said == ["8\n", "6\n"]


def test_the_page_tells_of_every_survivor_of_the_firmware():
    listed = re.findall(r"^\| `(\w+ [0-9A-F]{4}h: [^`]*)` \|", section("Firmware"), re.M)
    assert listed == [mutant.name for mutant in DRAWN if mutant.name in firmware_mutants.notes()]
    assert set(listed) == set(firmware_mutants.notes())
    assert f"{len(DRAWN)} are drawn" in section("Firmware")


@pytest.mark.parametrize("design", Design)
def test_a_mutant_of_an_image_is_found_again(design):
    mutant = next(m for m in DRAWN if m.design is design and m.rule == "condition inverted")
    plan = FirmwareCheckPlan(image=mutant.image, design=design, microcontroller=firmware_mutants.CHIP)
    assert firmware_mutants.of_the_box(plan) in {"answers", "home", *BOX_CHECKS}
