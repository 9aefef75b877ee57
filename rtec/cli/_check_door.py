"""Which door an algorithm comes through, and what is asked of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rtec.cli._arguments import member, share
from rtec.conformance.contract import Contract, states_of
from rtec.errors import ArgumentError, nearest
from rtec.injector import Algorithm, Design
from rtec.units import FREQUENCY, SWEEP, parse_quantity, parse_time_ps

if TYPE_CHECKING:
    from rtec.cli.check import Options

_DESIGNS = tuple(design.value for design in Design)
_FORMS = "file.py:Name, top.v, image.ihx, or a design of rtec: " + ", ".join(_DESIGNS)
_OF_KIND = {
    "Python": ("clock",),
    "Verilog": ("clock", "pins", "simulator"),
    "machine code": ("processor", "part", "hold_latch"),
    "a design of rtec": ("timing", "real_edges"),
}
"""Options that mean something for each kind of algorithm."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Chosen:
    """An algorithm and its contract.

    Parameters
    ----------
    algorithm
        Ready to be played.
    contract
        What is asked of it.
    note
        Called when it was played: what there is to say about how it runs, or "".
    """

    algorithm: Algorithm
    contract: Contract
    note: Callable[[], str]


def choose(options: Options) -> Chosen:
    """Return what the user means.

    Raises
    ------
    RtecError
        A file that cannot be used, or an option that is wrong or means nothing here.
    """
    word = options.algorithm
    file, _, name = word.rpartition(":")
    if file.lower().endswith(".py") and name:
        return _python(options, Path(file), name)
    suffix = Path(word).suffix.lower()
    if suffix == ".py":
        raise ArgumentError("ALGORITHM", word, f"{word}:Name, the class in the file", "Name is the class with a step")
    if suffix in (".v", ".sv"):
        return _verilog(options)
    if suffix in (".ihx", ".hex"):
        return _machine_code(options)
    if word.lower() in _DESIGNS:
        return _built_in(options)
    near = nearest(word[:60].lower(), _DESIGNS)
    raise ArgumentError("ALGORITHM", repr(word[:80]), _FORMS, near if near.startswith("did") else "")


def _python(options: Options, file: Path, name: str) -> Chosen:
    from rtec.conformance.python_class import PythonClass
    from rtec.conformance.verilog import clock_of

    _refuse_others(options, "Python")
    contract = _contract(options)
    clock = None if options.clock is None else _named("--clock", clock_of, options.clock)
    algorithm = PythonClass(file, name, clock_ps=clock)

    def note() -> str:
        return f"runs as plain Python, slower: {algorithm.note}" if algorithm.note else ""

    return Chosen(algorithm=algorithm, contract=contract, note=note)


def _verilog(options: Options) -> Chosen:
    from rtec.conformance.verilog import VerilogAlgorithm, clock_of
    from rtec.conformance.verilog_pins import Pins

    _refuse_others(options, "Verilog")
    if options.clock is None:
        raise ArgumentError("--clock", None, "the frequency of the module's clock, such as 50MHz")
    if options.pins is None:
        raise ArgumentError("--pins", None, "a TOML file that names the module's ports (docs/algorithm.md)")
    contract, clock = _contract(options), _named("--clock", clock_of, options.clock)
    file, pins = Path(options.algorithm), Pins.read(options.pins)
    algorithm = VerilogAlgorithm(file, pins=pins, clock_ps=clock, simulator=options.simulator)
    return Chosen(algorithm=algorithm, contract=contract, note=lambda: algorithm.note)


def _machine_code(options: Options) -> Chosen:
    from firmware_model import read_hex
    from firmware_model.isa.parts import PARTS
    from rtec.board import Microcontroller
    from rtec.campaign.firmware_algorithm import Firmware
    from rtec.campaign.firmware_check_bench import Bench
    from rtec.cli._arguments import choice
    from rtec.cli.firmware import as_bad_input

    _refuse_others(options, "machine code")
    if options.design is None:
        raise ArgumentError("--design", None, ", ".join(_DESIGNS), "whose circuits stand around the processor?")
    contract = _contract(options)
    with as_bad_input():
        chip = _named("--processor", Microcontroller.named, options.processor or "8051-12mhz")
        known = "8051" if chip.timing == "12-clock" else "8052"
        part: Any = known if options.part is None else choice(options.part, PARTS, name="--part")
        latch = options.hold_latch is not False
        image = read_hex(Path(options.algorithm))
        bench = Bench(Design.named(options.design), replace(chip, part=part), image, hold_latch=latch)
        algorithm = Firmware(bench)
    if options.delay is None:
        contract = replace(contract, delay_ps=max(contract.delay_ps, algorithm.delay_ps))
    return Chosen(algorithm=algorithm, contract=contract, note=_nothing)


def _built_in(options: Options) -> Chosen:
    from rtec.conformance.built_in import BuiltIn
    from rtec.injector import InjectorSettings, Processor, RealEdges, Timing

    _refuse_others(options, "a design of rtec")
    for name in ("design", "step", "states"):
        if (said := getattr(options, name)) is not None:
            raise ArgumentError(f"--{name}", said, f"nothing beside {options.algorithm}, which has its own contract")
    design = Design.named(options.algorithm)
    processor = member(options.timing or "fast", Processor, name="--timing")
    edges = member(options.real_edges or "hold", RealEdges, name="--real-edges")
    settings = InjectorSettings(design=design, timing=Timing.of(design, processor), real_edges=edges)
    contract = _contract(replace(options, design=options.algorithm))
    return Chosen(algorithm=BuiltIn(settings), contract=contract, note=_nothing)


def _nothing() -> str:
    return ""


def _refuse_others(options: Options, kind: str) -> None:
    """Refuse options that mean nothing for this kind of algorithm."""
    for other, names in _OF_KIND.items():
        for name in names:
            if name not in _OF_KIND[kind] and getattr(options, name) is not None:
                said = getattr(options, name)
                raise ArgumentError("--" + name.replace("_", "-"), said, f"nothing here; it is for {other}")


def _contract(options: Options) -> Contract:
    """Return what is asked of the algorithm."""
    limits: dict[str, Any] = {}
    if options.frequency is not None:
        limits["frequency_hz"] = parse_quantity(options.frequency, FREQUENCY, name="--frequency")
    if options.acceleration is not None:
        limits["acceleration_hz_s"] = parse_quantity(options.acceleration, SWEEP, name="--acceleration")
    if options.jitter is not None:
        limits["jitter"] = share(options.jitter, name="--jitter")
    if options.separation is not None:
        limits["separation_ps"] = parse_time_ps(options.separation, name="--separation")
    if options.delay is not None:
        limits["delay_ps"] = parse_time_ps(options.delay, name="--delay")
    try:
        if options.design is not None:
            if options.step is not None or options.states is not None:
                raise ArgumentError("--step", "given beside --design", "one of the two")
            return Contract.of(_named("--design", Design.named, options.design), **limits)
        if options.step is None:
            allowed = "--design original|a|b|c, or --step N and --states 00"
            raise ArgumentError("--design", None, allowed, "how many counts is one step, and where is it made?")
        states = (0, 1, 2, 3) if options.states is None else _named("--states", states_of, options.states)
        return Contract(step_counts=options.step, states=states, **limits)
    except ArgumentError as error:
        name = {"step_counts": "--step", "separation_ps": "--separation", "delay_ps": "--delay"}.get(error.name)
        if name is None and not error.name.startswith("--"):
            name = f"--{error.name}"
        raise ArgumentError(name or error.name, error.value, error.allowed, error.hint) from error


def _named(option: str, read: Callable[[str], Any], text: str) -> Any:
    """Read a text, naming the option where it is wrong."""
    try:
        return read(text)
    except ArgumentError as error:
        raise ArgumentError(option, error.value, error.allowed, error.hint) from error
