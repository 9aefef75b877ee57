"""Single steps in motions, and the whole contract, as jobs of a campaign."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np

from rtec.axis.motion import NAMES as MOTION_NAMES, MotionKind
from rtec.injector import Design, InjectorSettings, Processor, RealEdges, Timing
from rtec.verify.campaign.job import FAILED, NOT_ACTIVATED, PASSED, Choice, JobKind, Number, Parameters, Record
from rtec.verify.campaign.own_files import NONE, OwnFile, unpacked
from rtec.verify.campaign.trace import Trace
from rtec.verify.contract import cases
from rtec.verify.contract.built_in import BuiltIn
from rtec.verify.contract.contract import Contract
from rtec.verify.contract.motion_outcome import Outcome, outcome_of
from rtec.verify.contract.motions import AIMED, insertion_window, motion_for, stream_of
from rtec.verify.contract.python_class import PythonClass
from rtec.verify.contract.shown import shown_ps
from rtec.verify.contract.suite import TRIES, check_algorithm
from rtec.verify.contract.trials import Case, Run, Trials

_LATE = 3
"""Longest times of an insertion within which it has to be booked not to count as deferred."""


@lru_cache(maxsize=8)
def _own(value: str) -> PythonClass:
    """Return a class of the user's, in a process of its own."""
    return PythonClass(*unpacked(value))


def step_in_motion(parameters: Parameters, seed: int, run: int) -> Record:
    """Let a design insert one step in a motion, and judge every count.

    Parameters
    ----------
    parameters
        ``design``, ``processor``, ``gate`` (on or off), ``latch`` (merge or hold), ``motion``: words;
        ``frequency_hz``, ``acceleration_hz_s``: the largest of the motion. ``algorithm`` may be left out: a class of
        the user's in the place of the design, to which processor, gate and latch mean nothing.
    seed, run
        Draw direction, sign and state, and number the motion among those of its kind.

    Examples
    --------
    >>> words = {"design": "c", "processor": "fast", "gate": "on", "latch": "hold", "motion": "dither"}
    >>> record = step_in_motion(words | {"frequency_hz": 5e5, "acceleration_hz_s": 1e8}, seed=1, run=0)
    >>> record["result"], record["fault"]
    ('passed', None)
    """
    trials, late_ps, done = _played(parameters, seed, run)
    if isinstance(done, str):
        return {"result": FAILED, "outcome": "wrong at rest", "fault": done, "stream": None}
    if done is None:
        return {"result": NOT_ACTIVATED, "outcome": "no insertion to aim at", "fault": None, "stream": None}
    outcome = outcome_of(done, trials.contract, late_ps=late_ps)
    broken = done.response.broken is not None
    wrong = broken or outcome in (Outcome.ILLEGAL, Outcome.UNDETECTED)
    return {
        "result": FAILED if wrong else PASSED,
        "outcome": "broken" if broken else outcome.value,
        "fault": None if done.right else str(done.judgement.violation),
        "separation_ps": done.judgement.separation_ps,
        "edges": len(done.case.stream.edges_ps),
        "stream": str(done.case.stream) if wrong else None,
    }


def trace_of(parameters: Parameters, seed: int, run: int) -> Trace | None:
    """Return what there is to see of a step in a motion, as `step_in_motion` takes it; None where there was none."""
    _, _, done = _played(parameters, seed, run)
    if done is None or isinstance(done, str):
        return None
    stimulus, violation = done.case.stream.stimulus(), done.judgement.violation
    return Trace(
        title=", ".join(str(parameters[name]) for name in ("design", "processor", "motion")),
        encoder=stimulus.edges,
        controller=done.response.edges,
        requested=stimulus.requests,
        completed=done.response.completed,
        until_ps=done.case.stream.until_ps,
        marks=() if violation is None else ((violation.time_ps, violation.fault.value),),
        shown_ps=shown_ps(done),
    )


def whole_contract(parameters: Parameters, seed: int, run: int) -> Record:
    """Hold a design to the whole contract: a verdict of ``rtec check``, with the same numbers.

    Parameters
    ----------
    parameters
        ``design``, ``processor``, ``latch``, ``algorithm``: as of `step_in_motion`; ``frequency_hz``, up to which
        every count has to be right; ``tries`` of the hunt.
    seed, run
        Their sum is the seed of the hunt.
    """
    design, own = Design.named(str(parameters["design"])), str(parameters.get("algorithm", NONE))
    timing, real_edges = Timing.of(design, Processor(parameters["processor"])), RealEdges(parameters["latch"])
    box = BuiltIn(InjectorSettings(design=design, timing=timing, real_edges=real_edges))
    contract = replace(Contract.of(design), frequency_hz=float(parameters["frequency_hz"] or 0.0))
    tried = box if own == NONE else _own(own)
    verdict = check_algorithm(tried, contract, tries=int(parameters["tries"] or 0), seed=seed + run)
    return verdict_record(verdict.to_dict())


_ELSEWHERE = "passed", "seed", "runs"
"""Of a verdict, what is said elsewhere; runs depend on the time that endurance has."""


def verdict_record(verdict: Mapping[str, Any], reason: str = "reason") -> Record:
    """Return a verdict, as its ``to_dict`` gives it, as numbers and words; ``reason``: the key of that of a check."""
    failing = [check for check in verdict["checks"] if check["passed"] is not True]
    plain = {
        name: value
        for name, value in verdict.items()
        if (value is None or isinstance(value, str | int | float)) and name not in _ELSEWHERE
    }
    return {
        "result": FAILED if failing else PASSED,
        "outcome": f"fails: {', '.join(check['name'] for check in failing)}" if failing else "right",
        "reason": failing[0][reason] if failing else None,
        **plain,
    }


def _played(parameters: Parameters, seed: int, run: int) -> tuple[Trials, int, Run | str | None]:
    """Return the bench, when an insertion is late, and the run; instead of it what is wrong at rest, or None."""
    design, processor = Design.named(str(parameters["design"])), Processor(parameters["processor"])
    timing = Timing.of(design, processor)
    timing = timing if parameters["gate"] == "on" else replace(timing, gate_margin=None)
    box = BuiltIn(InjectorSettings(design=design, timing=timing, real_edges=RealEdges(parameters["latch"])))
    contract = replace(
        Contract.of(design),
        frequency_hz=float(parameters["frequency_hz"] or 0.0),
        acceleration_hz_s=float(parameters["acceleration_hz_s"] or 0.0),
    )
    own = parameters.get("algorithm", NONE)
    trials = Trials(box if own == NONE else _own(str(own)), contract)
    unsettled = trials.measure_settling()
    late_ps = _LATE * (timing.worst_ps(design) if own == NONE else trials.settle_ps)
    if unsettled is not None:
        return trials, late_ps, str(unsettled)
    case = _case(trials, MotionKind(parameters["motion"]), seed, run)
    return trials, late_ps, None if case is None else trials.one(case)


def _case(trials: Trials, kind: MotionKind, seed: int, run: int) -> Case | None:
    """Return the run; None where a motion is aimed at an insertion that the design does not make."""
    generator = np.random.default_rng([seed, run])
    direction, sign = (int(way) for way in generator.choice([1, -1], 2))
    state, share = int(generator.integers(4)), float(generator.random())
    if kind is MotionKind.STEADY:
        return cases.step_in_motion(trials, trials.contract.frequency_hz, direction, sign, share)
    window = insertion_window(trials) if kind in AIMED else None
    if kind in AIMED and window is None:
        return None
    motion = motion_for(kind, run, trials.contract, direction=direction, window=window, seed=seed)
    return trials.case(kind.value, stream_of(motion, state, sign))


def _impossible(parameters: Parameters) -> str | None:
    """Return why an algorithm of the user's is not tried: once is enough of what means nothing to it."""
    if parameters.get("algorithm", NONE) != NONE and parameters["processor"] != Processor.FAST.value:
        return "an algorithm of one's own has times of its own, and is tried once, beside processor fast"
    return None


MOTION = JobKind(
    does="A design inserts a step in a motion of the axis, and every count is judged.",
    function=f"{__name__}:step_in_motion",
    parameters=(
        Choice(name="processor", words=tuple(processor.value for processor in Processor)),
        Choice(name="design", words=tuple(design.value for design in Design)),
        Choice(name="gate", words=("on", "off"), default=("on",)),
        Choice(name="latch", words=tuple(edges.value for edges in RealEdges), default=(RealEdges.HOLD.value,)),
        Choice(name="motion", words=MOTION_NAMES),
        Number(name="frequency_hz", unit="Hz", low=1.0, high=5e6, default=100e3),
        Number(name="acceleration_hz_s", unit="Hz/s", low=1.0, high=1e12, default=100e6),
        OwnFile(name="algorithm", beside="design", machine_code=False),
    ),
    by=("processor", "design", "motion"),
    impossible=_impossible,
    trace=f"{__name__}:trace_of",
)


CHECK = JobKind(
    does="A design is held to the whole contract of a corrector.",
    function=f"{__name__}:whole_contract",
    parameters=(
        Choice(name="design", words=tuple(design.value for design in Design)),
        Choice(name="processor", words=tuple(one.value for one in Processor), default=(Processor.FAST.value,)),
        Choice(name="latch", words=tuple(edges.value for edges in RealEdges), default=(RealEdges.HOLD.value,)),
        Number(name="frequency_hz", unit="Hz", low=1.0, high=5e6, default=500e3),
        Number(name="tries", low=0.0, high=1e7, default=TRIES, whole=True),
        OwnFile(name="algorithm", beside="design", machine_code=False),
    ),
    by=("design", "processor", "latch"),
    impossible=_impossible,
)
