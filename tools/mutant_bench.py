"""Play the mutants of a copy of the package that `tools.code_mutants` has made: what finds each, a line of JSON.

It has to be started in the folder of the copy, which is then the rtec that is imported.
"""

from __future__ import annotations

import contextlib
import io
import json
import multiprocessing
import os
import sys
from collections.abc import Callable
from importlib import import_module
from pathlib import Path

import pytest

import rtec
from rtec.axis import Encoder, Imperfections
from rtec.controller import Multiplication, ReceiverSettings
from rtec.injector import Design, InjectorSettings, Processor, RealEdges, Timing
from rtec.machine import OpenPath, simulate
from rtec.verify.safety.case import ramp_jobs
from rtec.verify.safety.matrix import MatrixPlan, Outcome, PhaseJob
from rtec.verify.safety.phases import Phase
from tools.code_mutants import ROOT

_DESIGN = Design.C
_LONGEST_S = 600.0
_TESTS = {
    "decoder": ["tests/unit/controller", "tests/differential/test_signal_path_receiver.py"],
    "windows": [
        "tests/unit/requester",
        "tests/property/test_nodes_fuzz.py",
        "tests/property/test_requester_handshake.py",
        "tests/property/test_nodes_stateful.py",
    ],
}
_TESTS["PC"] = _TESTS["windows"]


def simulated() -> str:
    """Play `rtec simulate` with all decoders at several speeds, and with more counts than 16 bits hold."""
    encoder = Encoder(imperfections=Imperfections(jitter_ps=5_000))
    for design in (Design.ORIGINAL, Design.C):
        box = InjectorSettings(design=design, timing=Timing.of(design, Processor.FAST), real_edges=RealEdges.HOLD)
        for kind in Multiplication:
            for hertz, cycles, corrections in ((1e3, 200, 9), (500e3, 20_000, -9), (2e6, 2_000, 0)):
                for direction in (1, -1):
                    path = OpenPath(
                        injector=box, frequency_hz=hertz, cycles=cycles, corrections=corrections, direction=direction,
                        encoder=encoder, receiver=ReceiverSettings(multiplication=kind),
                    )  # fmt: skip
                    result = simulate(path)
                    if not result.audit or (hertz < 1e6 and not result.good):
                        return "simulate"
    return ""


Outcomes = dict[tuple[str, str], tuple[str, str]]


def safe(right: Outcomes | None) -> tuple[str, Outcomes]:
    """Play `rtec safety`: what it says against the code, and the outcome of each fault in each phase.

    Where ``right`` is given, also whether an outcome is another one than there; it ends with what is found first.
    """
    outcomes: Outcomes = {}
    plan, other = MatrixPlan(designs=(_DESIGN,), seeds=1), ""
    for phase in Phase:
        for trial in PhaseJob(plan=plan, phase=phase, design=_DESIGN, seed=0).run():
            if not trial.sound:
                return f"safety: the run without a fault, {phase.value}", outcomes
            if not trial.fired:
                continue
            if trial.outcome is Outcome.UNDETECTED and trial.variant.beyond_supervision(_DESIGN) is None:
                return f"safety: {trial.variant.name}, {phase.value}", outcomes
            key = trial.variant.name, phase.value
            outcomes[key] = trial.outcome.value, trial.reason
            if right is not None and outcomes[key] != right.get(key) and not other:
                other = f"another outcome: {trial.variant.name}, {phase.value}"
    for job in ramp_jobs(_DESIGN):
        ramp = job.run()
        if (ramp.outcome is Outcome.UNDETECTED) != (ramp.limit == "none"):
            return "safety: a PC that runs away", outcomes
    return other, outcomes


def tested(place: str) -> str:
    """Run the tests of the project that hold this place."""
    said = io.StringIO()
    with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
        options = "--import-mode=importlib --strict-markers -m 'not sweep' -p no:cacheprovider"
        code = pytest.main(
            ["-q", "-x", "-rfE", "--tb=no", "-c", str(ROOT / "pyproject.toml"), "-o", f"addopts={options}",
             *(str(ROOT / test) for test in _TESTS[place])]
        )  # fmt: skip
    if code == 0:
        return ""
    failed = [line for line in said.getvalue().splitlines() if line.startswith(("FAILED", "ERROR"))]
    return f"tests: {failed[0].split('::')[0].split('/')[-1]}" if failed else f"tests: exit {int(code)}"


def finder(place: str, right: Outcomes) -> str:
    """Return what finds the mutant that plays: the quick things first, and another outcome of a fault last."""
    if place == "decoder":
        return simulated() or tested(place)
    return tested(place) or safe(right)[0]


def _in_child(number: int, place: str, right: Outcomes, answer: Callable[[str], None]) -> None:
    import_module("rtec._chosen_mutant").CHOSEN.value = number
    answer(finder(place, right))


def main() -> None:
    """Play the mutants that are asked for."""
    assert Path(rtec.__file__).is_relative_to(Path.cwd()), "start it in the folder of the copy"
    places = {word.split(":")[1] for word in sys.argv[1:]}
    assert "decoder" not in places or simulated() == ""
    wrong, right = safe(None) if places - {"decoder"} else ("", {})
    assert wrong == ""
    context = multiprocessing.get_context("fork")
    for word in sys.argv[1:]:
        number, place = word.split(":")
        queue = context.SimpleQueue()
        child = context.Process(target=_in_child, args=(int(number), place, right, queue.put))
        child.start()
        child.join(_LONGEST_S)
        if child.is_alive():
            child.kill()
            child.join()
        said = queue.get() if child.exitcode == 0 else f"crash: {child.exitcode}"
        os.write(1, (json.dumps(said) + "\n").encode())


if __name__ == "__main__":
    main()
