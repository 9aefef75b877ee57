"""Our 8051 against ucsim on random programs: registers, RAM, program counter and cycles after every few instructions.

Neither is the judge: where they part, the manual decides, and what is the peer's fault stands in
known_divergences.toml with the words of the manual.
"""

import tomllib
from pathlib import Path

import mcs51_programs as programs
import numpy as np
import pytest
import ucsim

from firmware_model import Mcs51
from firmware_model.hexfile import Image

needs_ucsim = pytest.mark.skipif(ucsim.absent(), reason="ucsim (s51) is not on PATH; package sdcc-ucsim")
KNOWN = tomllib.loads((Path(__file__).parent / "known_divergences.toml").read_text())["divergence"]
NAMES = dict(zip(programs.REGISTERS, ("P0", "P1", "P2", "P3", "SP", "DPL", "DPH", "PSW", "A", "B"), strict=True))


RAM_BYTES = {"8051": 128, "8052": 256}


def looked_at(cpu):
    found = {"PC": cpu.pc, "cycles": cpu.cycles, "instructions": cpu.instructions}
    found |= {name: int(cpu.sfr[at - 0x80]) for at, name in NAMES.items()}
    return found | {f"RAM {at:02X}H": int(value) for at, value in enumerate(cpu.iram[: RAM_BYTES[cpu.part.name]])}


def peer_looked_at(snapshot):
    found = {"PC": snapshot.pc, "cycles": snapshot.cycles, "instructions": snapshot.instructions}
    found |= {name: snapshot.sfr[at - 0x80] for at, name in NAMES.items()}
    # known_divergences.toml, "parity": the hardware sets it, whatever was written
    found["PSW"] = found["PSW"] & 0xFE | found["A"].bit_count() & 1
    return found | {f"RAM {at:02X}H": value for at, value in enumerate(snapshot.iram)}


def differences(cpu, snapshot):
    ours, theirs = looked_at(cpu), peer_looked_at(snapshot)
    return [f"{name}: ours {ours[name]:#x}, ucsim {theirs[name]:#x}" for name in ours if ours[name] != theirs[name]]


def run_to(cpu, snapshot):
    cpu.run(cycles=max(snapshot.cycles - cpu.cycles, 0))
    found = differences(cpu, snapshot)
    return found if cpu.fault is None else [*found, f"ours: {cpu.fault}"]


def follow(image, chunks, given, part):
    """Compare after each chunk of instructions; return the number of the first one that ends differently, or None."""
    cpu = Mcs51(given, part=part, timing="12-clock")
    looks = ucsim.follow(image, chunks, part=part)
    return next((k for k, look in enumerate(looks) if run_to(cpu, look)), None)


def first_difference(image, chunks, given=None, part="8052"):
    """Return None, or the first instruction after which the two part, and how.

    The chunk that ends differently is run again without a look inside, up to each of its instructions: a look may
    set right what a longer run does wrong.
    """
    given = given or image
    chunk = follow(image, chunks, given, part)
    if chunk is None:
        return None
    looks = ucsim.follow(image, [0, *chunks[:chunk], *[1] * chunks[chunk]], part=part)
    for k in range(chunk + 1, len(looks)):
        cpu = Mcs51(given, part=part, timing="12-clock")
        for look in looks[1 : chunk + 1]:
            run_to(cpu, look)
        found = run_to(cpu, looks[k])
        if found:
            before = peer_looked_at(looks[k - 1])
            state = {name: f"{value:#x}" for name, value in before.items() if not name.startswith("RAM")}
            what = programs.shown(image, before["PC"])
            number = looks[k].instructions
            where = f"{image.source}: instruction {number}, {what} at {before['PC']:#06x}"
            return f"{where}: {found}; before: {state}"
    return f"{image.source}: differs within chunk {chunk}, and not when it is run again"


def compare(seed, units, every, steps, part="8052"):
    """Compare so many instructions; return how many both have done."""
    image = programs.program(seed, units, ram_bytes=RAM_BYTES[part])
    chunks = [every] * (steps // every)
    assert first_difference(image, chunks, part=part) is None
    return sum(chunks)


@needs_ucsim
@pytest.mark.parametrize(
    ("seed", "every", "part"), [(0, 4, "8052"), (1, 97, "8052"), (2, 4, "8051"), (3, 97, "8051")]
)
def test_random_steps(seed, every, part):
    assert compare(seed, 1800, every, 2000, part) >= 1900


@needs_ucsim
@pytest.mark.parametrize(
    ("code", "psw"),
    # the PSW reads 01H, then it is counted up, down, down with a branch; A keeps P at 1
    [("7401 05D0", 0x03), ("7401 15D0", 0x01), ("7401 D5D000", 0x01)],
)
def test_parity_is_read_within_a_run(code, psw):
    image = Image.of(bytes.fromhex(code) + bytes(8))
    look = ucsim.follow(image, [2])[0]
    assert peer_looked_at(look)["PSW"] == psw
    cpu = Mcs51(image, part="8052", timing="12-clock")
    cpu.run(cycles=look.cycles)
    assert cpu.sfr[programs.PSW - 0x80] == psw


@needs_ucsim
def test_random_steps_meet_every_opcode():
    met = set()
    for seed in range(2):
        image = programs.program(seed, 1800)
        cpu = Mcs51(image, part="8052", timing="12-clock")
        for _ in range(2000):
            met.add(image.code[cpu.pc])
            cpu.step()
    assert met == programs.OPCODES


@needs_ucsim
def test_external_memory_is_the_same_after_random_steps():
    image = programs.program(7, 5000)
    cpu = Mcs51(image, part="8052", timing="12-clock")
    for _ in range(5000):
        cpu.step()
    theirs = np.frombuffer(ucsim.xram_after(image, 5000), np.uint8)
    assert np.count_nonzero(theirs) > 20
    assert np.array_equal(cpu.xram, theirs)


@needs_ucsim
@pytest.mark.sweep
@pytest.mark.parametrize("block", range(10))
def test_a_million_random_steps(block):
    seeds = range(100 + 5 * block, 105 + 5 * block)
    steps = [compare(seed, 20_000, (20, 50, 100, 200, 1000)[seed % 5], 20_000) for seed in seeds]
    assert sum(steps) == 100_000


@needs_ucsim
@pytest.mark.sweep
def test_many_random_steps_of_the_8051():
    assert sum(compare(seed, 18_000, 100, 20_000, "8051") for seed in range(200, 205)) == 100_000


@needs_ucsim
@pytest.mark.parametrize(
    ("opcode", "other", "says"),
    [(0x24, 0x34, "A:"), (0x04, 0x14, "A:"), (0x84, 0xA4, "B:"), (0xD4, 0x00, "A:"), (0xA3, 0x00, "PC:")],
)
def test_a_planted_error_is_found(opcode, other, says):
    # ADD as ADDC, INC as DEC, DIV as MUL, DA A and INC DPTR as NOP: ours runs what the peer does not
    image = programs.program(3, 1800)
    code = bytearray(image.code)
    cpu = Mcs51(image, part="8052", timing="12-clock")
    for _ in range(2000):
        if image.code[cpu.pc] == opcode:
            code[cpu.pc] = other
        cpu.step()
    message = first_difference(image, [20] * 100, Image.of(bytes(code)))
    assert message is not None
    assert says in message
    assert f", {opcode:02x}" in message


def schedule(entry):
    """Return runs of steps and the levels of ports between them."""
    actions, done = [], 0
    for step, port, levels in entry.get("pins", []):
        actions += [step - done, ucsim.Pins(port, levels)]
        done = step
    return [*actions, entry["steps"] - done]


def ours_after(entry, image):
    cpu = Mcs51(image, part=entry.get("part", "8052"), timing="12-clock")
    opcode = None
    for action in schedule(entry):
        if isinstance(action, ucsim.Pins):
            cpu.pins[action.port] = action.levels
            continue
        for _ in range(action):
            opcode = image.code[cpu.pc]
            cpu.step()
    assert opcode == entry.get("opcode", opcode)
    return int(cpu.sfr[entry["register"] - 0x80])


@needs_ucsim
@pytest.mark.parametrize("entry", KNOWN, ids=[entry["name"] for entry in KNOWN])
def test_a_known_divergence_is_still_there(entry):
    code = bytearray(256)
    for at, piece in {"0": entry["code"], **entry.get("code_at", {})}.items():
        piece_bytes = bytes.fromhex(piece)
        code[int(at, 16) : int(at, 16) + len(piece_bytes)] = piece_bytes
    image = Image.of(bytes(code))
    assert ours_after(entry, image) == entry["ours"], entry["manual"]
    if ucsim.version() != entry["peer"]:
        pytest.skip(f"found in {entry['peer']}, here is {ucsim.version()}")
    part = entry.get("peer_part", entry.get("part", "8052"))
    theirs = ucsim.play(image, schedule(entry), part=part)[-1].sfr[entry["register"] - 0x80]
    assert theirs == entry["theirs"] != entry["ours"]
