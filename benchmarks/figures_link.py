"""Figures of the bus in simulated time: exchanges of box and PC frame by frame, and machines on it."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import replace

import exchange_kernels
import numpy as np
from figures import Bar, Figure, Setting, Spread, number
from open_path_job import WrongResultError

from rtec._jit import new_record
from rtec.axis.command import Move
from rtec.link import _bus_kernels
from rtec.machine.cell import Cell
from rtec.machine.station import StationSettings
from rtec.predictors import NoError
from rtec.requester import _box_node_kernels, _pc_node_kernels
from rtec.requester.settings import HandshakeSettings
from rtec.requester.supervision import SupervisionLimits
from rtec.signal import NEVER

THIS = "python benchmarks/measure.py --only link"
MS = 10**9
_TURN = 100
_ANSWERS = 3
_FIRST_PS = 300_000_000
BAR = Bar(value=1e6, unit="exchanges/s")


def exchange(exchanges: int, handshake: HandshakeSettings) -> float:
    """Let box and PC make so many exchanges over the bus; return the seconds they took.

    Raises
    ------
    WrongResultError
        Where one of them was not carried through. Each asks for one step more or less, so the totals follow from
        their number, and the frames from the time: a request for each turn of the PC, three answers for each cycle of
        the box, and what the box says at once beside them.
    """
    bus, box, pc = (
        new_record(_bus_kernels.BUS),
        new_record(_box_node_kernels.BOX_NODE),
        new_record(_pc_node_kernels.PC_NODE),
    )
    supervision = SupervisionLimits(cycle_ps=handshake.pc_period_ps)
    handshake.fill_box(box.box)
    handshake.fill_pc(pc.pc, count_mm=0.001, step_counts=4, word_limit=127)
    supervision.fill_box(box)
    supervision.fill_pc(pc, count_mm=0.001)
    box.axis = pc.axis = pc.requester = box.at_home = 1
    box.limit_steps = 127
    pc.low_mm, pc.high_mm = -1e9, 1e9
    exchange_kernels.start(bus, box, pc, 10**12 // 500_000, _FIRST_PS)
    faults = np.rec.array(np.zeros(0, dtype=_bus_kernels.FAULT))
    begun = time.perf_counter()
    last_ps = exchange_kernels.exchange_frames(bus, faults, box, pc, exchanges, _TURN, NEVER - 1)
    wall_s = time.perf_counter() - begun
    phase = exchanges % (2 * _TURN)
    turns = last_ps // handshake.pc_period_ps + 1
    cycles = (last_ps - _FIRST_PS) // supervision.cycle_ps + 1
    found = (int(pc.answered), int(box.box.accepted), int(pc.completed), int(pc.reason), int(box.box.refused))
    expected = (exchanges, min(phase, 2 * _TURN - phase), min(phase, 2 * _TURN - phase), 0, 0)
    least = turns - 2 + _ANSWERS * (cycles - 1)
    if found != expected or bus.frames < least:
        raise WrongResultError(f"answered, total, completed, reason, refused: {found}, not {expected}; {bus.frames}")
    return wall_s


def cut(axes: int, simulated_s: float, speed_mm_s: float) -> tuple[float, Cell]:
    """Run a cell with a PC for all axes; return the seconds that it took.

    A speed of zero leaves them at rest.

    Raises
    ------
    WrongResultError
        Where the machine was held.
    """
    stations = [StationSettings(axis=axis) for axis in range(1, axes + 1)]
    there, back = (Move(target_mm=target_mm, speed_mm_s=max(speed_mm_s, 1.0)) for target_mm in (20.0, 0.0))
    moves = [[there, back]] if speed_mm_s > 0.0 else [[replace(back, rest_s=1e5)]]
    cell = Cell(stations, moves * axes, NoError())
    begun = time.perf_counter()
    cell.run(until_ps=round(simulated_s * 1e12))
    wall_s = time.perf_counter() - begun
    if cell.held_ps is not None or cell.exchanges < axes * (simulated_s * 100 - 2):
        raise WrongResultError(f"{axes} axes: held at {cell.held_ps}, {cell.exchanges} exchanges")
    return wall_s, cell


def link(setting: Setting) -> Iterator[Figure]:
    """Measure exchanges over the simulated bus."""
    usual = HandshakeSettings()
    exchanges = setting.of(3_000_000, 300_001)
    for how, handshake in (
        ("two readings of the box a request", replace(usual, box_period_ps=5 * MS)),
        ("the box reads every 1 ms", usual),
    ):
        exchange(1000, handshake)
        spread = Spread(tuple(exchange(exchanges, handshake) for _ in range(setting.rounds)))
        yield Figure(
            what=f"Box and PC: {how}",
            measured=spread.text(lambda s: number(exchanges / s)) + " exchanges/s, all completed",
            value=exchanges / spread.best,
            bar=BAR,
            command=THIS,
        )
    for how, axes, speed_mm_s, simulated_s in (
        ("one axis at rest, every tick of its servo", 1, 0.0, setting.of(1000, 100)),
        ("three axes moving at 10 mm/s, every edge", 3, 10.0, setting.of(60, 6)),
    ):
        cut(axes, 1.0, speed_mm_s)
        wall_s, cell = min((cut(axes, simulated_s, speed_mm_s) for _ in range(3)), key=lambda run: run[0])
        yield Figure(
            what=f"With the machine: {how}",
            measured=f"{number(cell.exchanges / wall_s)} exchanges/s, {number(simulated_s / wall_s)} times real time",
            value=cell.exchanges / wall_s,
            bar=BAR,
            binding=False,
            command=THIS,
        )
