"""The fault tester: a fault in one phase, why it failed, a run of it alone, a fault of her own, her CI."""

import json
import re
import shlex
import subprocess
import sys

SWAPPED = ("safety", "--fault", "A and B swapped, for 50 ms", "--phase", "at-rest", "--design", "c")
SAID = re.compile(r"A and B swapped, for 50 ms; at rest, design c, run (\d): (.*)")


def runs_told(text):
    """Return what the lines say of each run, by its number; a line of 80 columns goes on in the next."""
    one_line = re.sub(r" *\n(?!A and B|play)", " ", text)
    return {int(number): outcome for number, outcome in SAID.findall(one_line)}


def test_a_part_of_the_safety_case_fails_for_a_reason_and_its_worst_run_is_played_alone(typed):
    """At rest, 00 and 11 are the same with A and B swapped, 10 and 01 are not; four runs rest in all four states."""
    case = json.loads(typed(*SWAPPED, "--seeds", "1", "--json", code=1).stdout)  # as her CI does
    assert (case["good"], case["trials"], case["fired"], case["outcomes"]) == (False, 1, 0, {})
    assert case["reasons"] == [
        "never took effect: A and B swapped, for 50 ms, at rest; more --seeds meet it at other moments"
    ]

    *more, again = typed(*SWAPPED, "--seeds", "4").stdout.splitlines()
    assert max(map(len, more)) <= 80
    told = runs_told("\n".join(more))
    assert len(told) == 2 and all("safe stop" in outcome for outcome in told.values())

    command = shlex.split(again.removeprefix("play it again: "))
    number = int(command[command.index("--first") + 1])
    assert runs_told(typed(*command[1:]).stdout) == {number: told[number]}


HER_TEST = """
import can
from rtec.machine.fault_kinds import CABLE, FaultCategory, FaultRow, ActivatedBy

AT_CABLE = CABLE, FaultCategory.ENCODER, ActivatedBy.CABLE
SHORTED = FaultRow("B shorted to A", *AT_CABLE, "B shows A", lambda levels, before: 3 * (levels & 1))


def checksum(identifier, data):
    crc = 0xFF
    for byte in (identifier & 0xFF, identifier >> 8, *data[1:]):
        crc ^= byte
        for _ in range(8):
            crc = (crc << 1) ^ (0x12F if crc & 0x80 else 0)
    return crc ^ 0xFF


def pc_that_asks_for_nothing(bus):
    sequence, session, flags = 0, 0, 4
    for message in bus:
        if message.arbitration_id == 0x181:
            session, flags = message.data[4], 8 if message.data[3] & 7 == 1 else 4
        elif message.arbitration_id == 0x301:
            sequence = (sequence + 1) % 256
            data = bytearray([0, sequence, 0, 0, 255, 255, 1 << 5 | flags, session])
            data[0] = checksum(0x201, data)
            bus.send(can.Message(arbitration_id=0x201, data=data, is_extended_id=False))


def test_without_it_nothing_stops(rtec_box, rtec_bus):
    rtec_box.go(5.0)
    rtec_bus.play(pc_that_asks_for_nothing, 1.0, rtec_bus)
    assert rtec_box.status.name == "OK" and rtec_box.audit


def test_a_short_circuit_stops_the_machine(rtec_box, rtec_bus, rtec_faults):
    rtec_faults.arm(SHORTED, at_s=0.3)
    rtec_box.go(5.0)
    rtec_bus.play(pc_that_asks_for_nothing, 1.0, rtec_bus)
    assert rtec_box.status.name == "ENCODER_FAULT"
"""


def test_a_fault_of_her_own_is_a_row_in_her_own_test(tmp_path):
    (tmp_path / "test_short.py").write_text(HER_TEST)
    words = ("-m", "pytest", "-q", "-p", "no:cacheprovider", "test_short.py")
    done = subprocess.run(
        [sys.executable, *words], cwd=tmp_path, capture_output=True, text=True, timeout=300, check=False
    )
    assert done.returncode == 0 and "2 passed" in done.stdout, done.stdout + done.stderr
