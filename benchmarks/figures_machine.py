"""Figures of the whole machine: the thesis's calibration in closed loop, and PC and box exchanging requests."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import replace

import exchange_kernels
from figures import Bar, Figure, Setting, Spread, number
from open_path_job import WrongResultError, box

from rtec.injector import Design
from rtec.machine import LoopResult, Machine, measuring_run, run_machine
from rtec.requester.settings import HandshakeSettings
from rtec.study import Study, builtin_study
from rtec.units import MM_PER_INCH

THIS = "python benchmarks/measure.py --only"
READINGS = 12_488
_TURN = 100
_COME_TO_REST_S = 1e-3


def lathe(design: Design, study: Study | None = None) -> Machine:
    """Return the built-in study's machine with a design."""
    study = study or builtin_study()
    return Machine(
        axis_error=study.axis_error,
        model=study.axis_error,
        injector=study.injector(design),
        encoder=study.encoder,
        servo=study.servo,
        receiver=study.receiver,
        handshake=study.handshake,
        laser=study.laser,
    )


def calibrate(increment_inch: float, runs: int, *, skip_rest: bool = True) -> tuple[float, LoopResult]:
    """Carry out the thesis's calibration with design B; return the seconds it took, planning included.

    Raises
    ------
    WrongResultError
        Where the counts at the controller are not all accounted for.
    """
    study = builtin_study()
    begun = time.perf_counter()
    task = measuring_run(replace(study.plan, increment_mm=increment_inch * MM_PER_INCH, runs=runs), study.limits)
    result = run_machine(lathe(Design.B, study), task, skip_rest=skip_rest)
    wall_s = time.perf_counter() - begun
    if not result.audit or result.deviation_mm.size != task.target_mm.size or result.pending_steps:
        raise WrongResultError(f"calibration: audit {result.audit}, {result.pending_steps} steps pending")
    return wall_s, result


def calibration(setting: Setting) -> Iterator[Figure]:
    """Measure the thesis's calibration: four bidirectional runs every 0.025 inch."""
    bar, command = Bar(value=20.0, unit="s", at_most=True), f"{THIS} calibration"
    calibrate(0.52, 1)
    for how, skip_rest, rounds in (
        ("", True, setting.of(5, 2)),
        (", every servo tick computed", False, 1),
    ):
        seconds = []
        for _ in range(rounds):
            wall_s, result = calibrate(0.025, 4, skip_rest=skip_rest)
            seconds.append(wall_s)
        if result.deviation_mm.size != READINGS:
            raise WrongResultError(f"calibration: {result.deviation_mm.size} readings instead of {READINGS}")
        spread = Spread(tuple(seconds))
        yield Figure(
            what=(
                f"The thesis's calibration, closed loop, design B: {READINGS} readings, "
                f"{result.simulated_s / 3600:.1f} h of machine time{how}"
            ),
            measured=spread.text(lambda s: f"{s:.2f} s"),
            value=spread.best,
            bar=bar,
            binding=skip_rest,
            command=command,
        )


def converse(exchanges: int, handshake: HandshakeSettings) -> float:
    """Let PC and box make so many exchanges; return the seconds they took.

    Raises
    ------
    WrongResultError
        Where one of the exchanges was not carried through. Every one asks for one step more or less than the one
        before, so as many steps are accepted as exchanges made, and where the total stands follows from their
        number; so does how often the box has looked, from the two periods.
    """
    state = Machine(injector=box(Design.C), handshake=handshake).state()
    box_first, pc_first = int(state.node.box.next_ps), int(state.pc.next_ps)
    begun = time.perf_counter()
    steps = exchange_kernels.exchange(state, exchanges, _TURN)
    wall_s = time.perf_counter() - begun
    phase = exchanges % (2 * _TURN)
    # the first look of the PC finds no home, the others make an exchange each; the last request is then sampled, too
    last_ps = pc_first + exchanges * handshake.pc_period_ps + handshake.latency_ps
    looks = -(-(last_ps - box_first) // handshake.box_period_ps) + 1
    found = (
        steps,
        int(state.node.box.accepted),
        int(state.node.box.readings),
        int(state.pc.requests),
        int(state.node.box.refused),
    )
    expected = (exchanges, min(phase, 2 * _TURN - phase), looks, exchanges, 0)
    if found != expected:
        raise WrongResultError(f"steps, total, looks, requests, refusals: {found} instead of {expected}")
    return wall_s


def handshake(setting: Setting) -> Iterator[Figure]:
    """Measure PC and box exchanging requests."""
    exchanges = setting.of(3_000_000, 300_001)
    usual = HandshakeSettings()
    for how, handshake in (
        ("the box samples every 1 ms, the PC asks every 10 ms", usual),
        ("one sample of the box for each request", replace(usual, box_period_ps=usual.pc_period_ps)),
    ):
        converse(1000, handshake)
        spread = Spread(tuple(converse(exchanges, handshake) for _ in range(setting.rounds)))
        yield Figure(
            what=how[:1].upper() + how[1:],
            measured=spread.text(lambda s: f"{number(exchanges / s)}") + " exchanges/s, all accepted",
            value=exchanges / spread.best,
            bar=Bar(value=1e6, unit="exchanges/s"),
            command=f"{THIS} handshake",
        )
