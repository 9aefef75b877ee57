"""Which interface an algorithm has, and which contract it is held to."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rtec.cli._parameters import apart
from rtec.errors import ArgumentError, meant
from rtec.injector import Algorithm, Design
from rtec.verify.contract.contract import Contract

if TYPE_CHECKING:
    from rtec.cli.check import ContractOptions, Options, RunnerOptions

_DESIGNS = tuple(design.value for design in Design)
_FORMS = "file.py:Name, top.v, image.ihx, or a design of rtec: " + ", ".join(_DESIGNS)
_OF_KIND = {
    "Python": ("clock_ps",),
    "Verilog": ("clock_ps", "pins"),
    "machine code": ("processor", "part", "hold_latch"),
    "a design of rtec": ("timing", "real_edges"),
}
"""Options that mean something for each kind of algorithm."""
_LIMITS = ("frequency_hz", "acceleration_hz_s", "jitter", "separation_ps", "delay_ps")


@dataclass(frozen=True, slots=True, kw_only=True)
class Chosen:
    """An algorithm and its contract."""

    word: str
    """What the user calls it."""
    algorithm: Algorithm
    """Ready to be played."""
    contract: Contract
    """What is asked of it."""

    def note(self) -> str:
        """Return what there is to say about how it runs, once it was played, or nothing."""
        return getattr(self.algorithm, "note", "")


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
        allowed = f"{word}:Name, the name of the class with a step"
        raise ArgumentError("ALGORITHM", word, allowed, problem="does not say which class")
    if suffix in (".v", ".sv"):
        return _verilog(options)
    if suffix in (".ihx", ".hex"):
        return _machine_code(options)
    if word.lower() in _DESIGNS:
        return _built_in(options)
    hint = meant(word[:60].lower(), _DESIGNS)
    raise ArgumentError("ALGORITHM", repr(word[:80]), _FORMS, hint, problem="is not an algorithm")


def _python(options: Options, file: Path, name: str) -> Chosen:
    from rtec.verify.contract.python_class import PythonClass

    _refuse_others(options.runner, "Python")
    contract = _contract(options.contract)
    algorithm = PythonClass(file, name, clock_ps=options.runner.clock_ps)
    return Chosen(word=options.algorithm, algorithm=algorithm, contract=contract)


def _verilog(options: Options) -> Chosen:
    from rtec.verify.contract.verilog import VerilogAlgorithm
    from rtec.verify.contract.verilog_pins import Pins

    _refuse_others(options.runner, "Verilog")
    if options.runner.clock_ps is None:
        raise ArgumentError("--clock", None, "the frequency of the module's clock, such as 50MHz")
    if options.runner.pins is None:
        raise ArgumentError("--pins", None, "a TOML file that names the module's ports (docs/algorithm.md)")
    contract, pins = _contract(options.contract), Pins.read(options.runner.pins)
    algorithm = VerilogAlgorithm(Path(options.algorithm), pins=pins, clock_ps=options.runner.clock_ps)
    return Chosen(word=options.algorithm, algorithm=algorithm, contract=contract)


def _machine_code(options: Options) -> Chosen:
    from firmware_model import read_hex
    from rtec.board import Microcontroller
    from rtec.cli._image import as_bad_input, with_part
    from rtec.verify.bench import Bench
    from rtec.verify.firmware.algorithm import Firmware

    _refuse_others(options.runner, "machine code")
    if options.contract.design is None:
        allowed = f"the design whose circuits stand around the processor: one of {', '.join(_DESIGNS)}"
        raise ArgumentError("--design", None, allowed)
    contract = _contract(options.contract)
    chip = with_part(options.runner.processor or Microcontroller.named("8051-12mhz"), options.runner.part)
    with as_bad_input():
        image = read_hex(Path(options.algorithm))
        bench = Bench(options.contract.design, chip, image, hold_latch=options.runner.hold_latch is not False)
        algorithm = Firmware(bench)
    if options.contract.delay_ps is None:
        contract = replace(contract, delay_ps=max(contract.delay_ps, algorithm.delay_ps))
    return Chosen(word=options.algorithm, algorithm=algorithm, contract=contract)


def _built_in(options: Options) -> Chosen:
    from rtec.injector import InjectorSettings, Processor, RealEdges, Timing
    from rtec.verify.contract.built_in import BuiltIn

    _refuse_others(options.runner, "a design of rtec")
    design = Design.named(options.algorithm)
    for name in ("design", "step_counts", "states"):
        if getattr(options.contract, name) is not None:
            raise apart(name, f"the design {design.value}", "a design of rtec has its own contract")
    settings = InjectorSettings(
        design=design,
        timing=Timing.of(design, options.runner.timing or Processor.FAST),
        real_edges=options.runner.real_edges or RealEdges.HOLD,
    )
    contract = _contract(replace(options.contract, design=design))
    return Chosen(word=options.algorithm, algorithm=BuiltIn(settings), contract=contract)


def _refuse_others(options: RunnerOptions, kind: str) -> None:
    """Refuse options that mean nothing for this kind of algorithm."""
    for name in dict.fromkeys(name for names in _OF_KIND.values() for name in names):
        if name not in _OF_KIND[kind] and getattr(options, name) is not None:
            others = " or ".join(other for other, names in _OF_KIND.items() if name in names)
            raise ArgumentError(name, "", f"it for {others}", problem=f"means nothing for {kind}")


def _contract(options: ContractOptions) -> Contract:
    said = {name: getattr(options, name) for name in _LIMITS}
    limits: dict[str, Any] = {name: value for name, value in said.items() if value is not None}
    if options.design is not None:
        if options.step_counts is not None or options.states is not None:
            name = "--states" if options.step_counts is None else "--step"
            raise apart(name, "--design", "a design has its own contract")
        return Contract.of(options.design, **limits)
    if options.step_counts is None:
        allowed = "--design original|a|b|c, or --step N and --states 00"
        raise ArgumentError("--design", None, allowed, "they say how many counts one step has, and where it is made")
    limits |= {} if options.states is None else {"states": options.states}
    return Contract(step_counts=options.step_counts, **limits)
