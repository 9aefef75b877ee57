"""The contract Heat: nodes that sources warm, that exchange heat, and that lose it to a room and to a chiller."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from rtec._jit import new_record
from rtec.checks import number_within
from rtec.errors import ArgumentError, unknown
from rtec.heat import _network_kernels as kernels
from rtec.heat.bearings import Bearing, Loss
from rtec.heat.duty import Duty

Floats = npt.NDArray[np.float64]

ROOM = "room"
"""The node whose temperature is given."""
FASTEST_S = 0.01
"""Shortest time constant of a node."""
MOST_ROWS = 2_000_000
"""Of a run: 23 days of seconds."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Node:
    """A lump of material at one temperature.

    Parameters
    ----------
    name
        By which links, sources and thermometers refer to it.
    capacity_j_k
        Mass times specific heat.
    """

    name: str
    capacity_j_k: float

    def __post_init__(self) -> None:
        number_within(f"node {self.name}: capacity_j_k", self.capacity_j_k, 1e-3, 1e12, unit="J/K")
        if self.name == ROOM:
            raise ArgumentError("node", ROOM, "another name", "the room's temperature is given")


@dataclass(frozen=True, slots=True, kw_only=True)
class Link:
    """A way for heat between two nodes, or from a node to the room.

    Parameters
    ----------
    a, b
        Nodes; ``b`` may be ``"room"``.
    standing_w_k
        What it conducts.
    rotating_w_k
        Convection of a rotating part at 1000 rev/min: it grows with the speed to the power 2/3, and the larger of
        both counts.
    chilled_w_k
        What is added while the chiller runs: its pump or fan.
    """

    a: str
    b: str = ROOM
    standing_w_k: float = 0.0
    rotating_w_k: float = 0.0
    chilled_w_k: float = 0.0

    def __post_init__(self) -> None:
        for name in ("standing_w_k", "rotating_w_k", "chilled_w_k"):
            number_within(f"link {self.a} - {self.b}: {name}", getattr(self, name), 0.0, 1e9, unit="W/K")
        if self.a in (ROOM, self.b):
            raise ArgumentError("link", f"{self.a} - {self.b}", "two nodes, or a node and the room")


@dataclass(frozen=True, slots=True, kw_only=True)
class Chiller:
    """A chiller with two-point control: from ``on_degc`` of its node it takes heat away until ``off_degc``."""

    node: str
    on_degc: float
    off_degc: float
    power_w: float

    def __post_init__(self) -> None:
        number_within("chiller: power_w", self.power_w, 0.0, 1e7, unit="W")
        number_within("chiller: on_degc", self.on_degc, -50.0, 200.0, unit="degC")
        if not self.off_degc <= self.on_degc - 1e-3:
            raise ArgumentError("chiller: off_degc", self.off_degc, f"less than on_degc, {self.on_degc:g}")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Room:
    """Temperature of the air around the machine: constant, a daily sine, or given.

    Parameters
    ----------
    mean_degc, swing_k
        Mean, and half of the difference between the warmest and the coldest hour.
    warmest_s
        When it is warmest, in seconds from the start.
    time_s, degc
        Where given, shape (times,) each: straight lines, held at both ends; the others mean nothing then.

    Examples
    --------
    >>> Room(mean_degc=21.0, swing_k=2.0, warmest_s=6 * 3600.0).at([0.0, 21600.0]).round(6).tolist()
    [21.0, 23.0]
    """

    mean_degc: float = 20.0
    swing_k: float = 0.0
    warmest_s: float = 6 * 3600.0
    time_s: npt.ArrayLike = ()
    degc: npt.ArrayLike = ()

    def __post_init__(self) -> None:
        number_within("room: mean_degc", self.mean_degc, -50.0, 100.0, unit="degC")
        number_within("room: swing_k", self.swing_k, 0.0, 50.0, unit="K")
        times, degc = (np.array(values, dtype=np.float64) for values in (self.time_s, self.degc))
        if times.ndim != 1 or times.shape != degc.shape or not (np.isfinite(times) & np.isfinite(degc)).all():
            raise ArgumentError("room: degc", f"{degc.size} values", f"{times.size} finite ones, one for each time")
        if (np.diff(times) <= 0.0).any():
            raise ArgumentError("room: time_s", f"{times.size} times", "times that ascend")
        object.__setattr__(self, "time_s", times)
        object.__setattr__(self, "degc", degc)

    def at(self, time_s: npt.ArrayLike) -> Floats:
        """Return the temperature at times, in degrees Celsius."""
        wanted, times = np.asarray(time_s, dtype=np.float64), np.asarray(self.time_s)
        if times.size:
            return np.asarray(np.interp(wanted, times, np.asarray(self.degc, dtype=np.float64)))
        day = 2.0 * np.pi * (wanted - self.warmest_s) / kernels.DAY_S
        return np.asarray(self.mean_degc + self.swing_k * np.cos(day))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class NetworkRun:
    """What a network did, row by row in time.

    ``degc`` has shape (times, nodes), ``heat_w`` (times, sources): bearings, then losses. ``chiller_runs`` has shape
    (times,), and so have the energies since the start: put in by sources, given to the room, carried off by the
    chiller, stored in the nodes. What is put in equals the sum of the other three.
    """

    time_s: Floats
    nodes: tuple[str, ...]
    degc: Floats
    sources: tuple[str, ...]
    heat_w: Floats
    chiller_runs: npt.NDArray[np.bool_]
    put_in_j: Floats
    to_room_j: Floats
    carried_off_j: Floats
    stored_j: Floats

    def of(self, node: str) -> Floats:
        """Return the temperatures of a node, shape (times,)."""
        if node not in self.nodes:
            raise unknown("node", node, self.nodes, noun="node")
        return self.degc[:, self.nodes.index(node)]

    @property
    def last_degc(self) -> dict[str, float]:
        """Temperatures at the end by node: where another run may start."""
        return dict(zip(self.nodes, self.degc[-1].tolist(), strict=True))


@dataclass(frozen=True, slots=True, kw_only=True)
class Network:
    """A lumped thermal network.

    Parameters
    ----------
    nodes, links
        What stores heat, and where it flows.
    bearings, losses
        Where it comes from.
    chiller
        What takes it away, besides the room.

    Raises
    ------
    ArgumentError
        A name that is twice or unknown, or a node so small that it follows its neighbours within 0.01 s.

    Notes
    -----
    C dT/dt = sum of g (T_neighbour - T) + heat(speed, T) - chiller. Fourth-order Runge-Kutta steps whose length times
    a bound of the fastest rate (Gershgorin) is at most 0.2, so that exponentials are off by at most 5e-6 of their
    way. They begin anew where the duty or the room has a corner, and where the chiller switches, which is found on
    the cubic through both ends of a step. The energies are integrated with the same steps, so their balance holds to
    rounding.

    Examples
    --------
    >>> from rtec.heat.duty import Piece
    >>> block = Node(name="block", capacity_j_k=1000.0)
    >>> heater = Loss(name="heater", node="block", per_speed_w=0.1)
    >>> network = Network(nodes=(block,), links=(Link(a="block", standing_w_k=10.0),), losses=(heater,))
    >>> run = network.run(Duty((Piece(duration_s=100.0, spindle_rpm=1000.0),)))
    >>> round(float(run.of("block")[-1]), 4)  # 20 + 10 (1 - 1 / e)
    26.3212
    """

    nodes: tuple[Node, ...]
    links: tuple[Link, ...]
    bearings: tuple[Bearing, ...] = ()
    losses: tuple[Loss, ...] = ()
    chiller: Chiller | None = None

    def __post_init__(self) -> None:
        names = [node.name for node in self.nodes]
        for kind, found in (("node", names), ("source", [*self.sources])):
            if twice := {name for name in found if found.count(name) > 1}:
                raise ArgumentError(kind, ", ".join(sorted(twice)), "each name once")
        wanted = [name for one in self.links for name in (one.a, one.b) if name != ROOM]
        wanted += [name for one in self.bearings for name in (one.inner, one.outer)]
        wanted += [name for one in self.losses for name in (one.node, one.other or one.node)]
        wanted += [self.chiller.node] if self.chiller else []
        for name in wanted:
            if name not in names:
                raise unknown("node", name, names, noun="node")
        self._check_rates()

    @property
    def sources(self) -> tuple[str, ...]:
        """Names of what gives heat: bearings, then losses."""
        return (*(one.name for one in self.bearings), *(one.name for one in self.losses))

    def _check_rates(self) -> None:
        conducted = dict.fromkeys((node.name for node in self.nodes), 0.0)
        for link in self.links:
            for end in {link.a, link.b} - {ROOM}:
                conducted[end] += link.standing_w_k + link.rotating_w_k + link.chilled_w_k
        for node in self.nodes:
            if node.capacity_j_k < FASTEST_S * conducted[node.name]:
                raise ArgumentError(
                    f"node {node.name}: capacity_j_k", f"{node.capacity_j_k:g} J/K",
                    f"at least {FASTEST_S * conducted[node.name]:.3g} J/K", "or join it with its neighbour",
                    problem="is too small for its links",
                )  # fmt: skip

    def run(
        self,
        duty: Duty,
        *,
        room: Room | None = None,
        every_s: float = 1.0,
        start_degc: Mapping[str, float] | None = None,
        chiller_runs: bool = False,
    ) -> NetworkRun:
        """Let the network warm and cool over a duty.

        Parameters
        ----------
        duty
            Speed, feed and force over time.
        room
            Around it; 20 degC where none is given.
        every_s
            Between rows of the result; the last one is at the end of the duty.
        start_degc
            Temperatures by node at the start; nodes that are not named start at the temperature of the room.
        chiller_runs
            Whether it does so at the start.

        Raises
        ------
        ArgumentError
            An unknown node, a temperature that cannot be, more than two million rows, or a node that rises above
            1000 degC.
        """
        room = Room() if room is None else room
        number_within("every_s", every_s, max(1e-3, duty.duration_s / MOST_ROWS), 1e6)
        before = np.arange(int(np.ceil(duty.duration_s / every_s - 1e-9)), dtype=np.float64)
        rows_s = np.append(before * every_s, duty.duration_s)
        corners = np.concatenate((duty.starts_s, np.asarray(room.time_s, dtype=np.float64)))
        grid_s = np.union1d(rows_s, corners[(corners > 0.0) & (corners < duty.duration_s)])
        shown = np.full(grid_s.size, -1)
        shown[np.searchsorted(grid_s, rows_s)] = np.arange(rows_s.size)
        pieces = np.array([(one.spindle_rpm, one.feed_mm_s, one.force_n) for one in duty.pieces])
        piece_of = np.searchsorted(duty.starts_s, grid_s, side="right") - 1

        y = np.concatenate((self._start(room, start_degc), np.zeros(kernels.ENERGIES)))
        start = y.copy()
        states = np.empty((rows_s.size, y.size))
        heats = np.empty((rows_s.size, len(self.bearings) + len(self.losses)))
        running = np.empty(rows_s.size, dtype=np.int64)
        runaway = kernels.run_network(
            grid_s, piece_of, shown, pieces, self._parts(room), self._chiller_record(chiller_runs), y,
            np.empty((kernels.STAGES, y.size)), states, heats, running,
        )  # fmt: skip
        if runaway >= 0:
            raise ArgumentError(
                f"node {self.nodes[runaway].name}",
                "",
                "less heat, more ways out, or less preload_n_k of its bearing",
                problem=f"rises above {kernels.RUNAWAY_DEGC:g} degC",
            )
        degc, energies = np.split(states, [len(self.nodes)], axis=1)
        capacities = np.array([node.capacity_j_k for node in self.nodes])
        return NetworkRun(
            time_s=rows_s,
            nodes=tuple(node.name for node in self.nodes),
            degc=degc,
            sources=self.sources,
            heat_w=heats,
            chiller_runs=running.astype(np.bool_),
            put_in_j=energies[:, kernels.HEAT_IN],
            to_room_j=energies[:, kernels.TO_ROOM],
            carried_off_j=energies[:, kernels.TO_CHILLER],
            stored_j=(degc - start[: len(self.nodes)]) @ capacities,
        )

    def _start(self, room: Room, start_degc: Mapping[str, float] | None) -> Floats:
        found = dict.fromkeys((node.name for node in self.nodes), float(room.at(0.0)))
        for name, degc in (start_degc or {}).items():
            if name not in found:
                raise unknown("start_degc", name, found, noun="node")
            found[name] = number_within(f"start_degc: {name}", degc, -50.0, kernels.RUNAWAY_DEGC, unit="degC")
        return np.array([*found.values()])

    def _parts(self, room: Room) -> tuple[Any, ...]:
        places = {node.name: place for place, node in enumerate(self.nodes)} | {ROOM: kernels.ROOM}
        links = [(places[one.a], places[one.b], one.standing_w_k, one.rotating_w_k, one.chilled_w_k)
                 for one in self.links]  # fmt: skip
        bearings = [
            (places[one.inner], places[one.outer], one.mean_diameter_mm, one.f0, one.f1, one.preload_n,
             one.preload_n_k, one.force_share, *one.oil.constants)
            for one in self.bearings
        ]  # fmt: skip
        losses = [
            (places[one.node], places[one.other or one.node], one.share, one.of_feed, one.per_speed_w,
             one.per_speed2_w, one.force2_w, *((0.0, 0.0, 0.0) if one.oil is None else
                                               (*one.oil.constants, one.oil.at_40_mm2_s)))
            for one in self.losses
        ]  # fmt: skip
        air = new_record(kernels.ROOM_AIR)
        air.mean_degc, air.swing_k, air.warmest_s = room.mean_degc, room.swing_k, room.warmest_s
        return (
            np.array([node.capacity_j_k for node in self.nodes]),
            np.array(links, dtype=kernels.LINK).view(np.recarray),
            np.zeros(len(links)),
            np.array(bearings, dtype=kernels.BEARING).view(np.recarray),
            np.array(losses, dtype=kernels.LOSS).view(np.recarray),
            air,
            np.asarray(room.time_s, dtype=np.float64),
            np.asarray(room.degc, dtype=np.float64),
        )

    def _chiller_record(self, runs: bool) -> Any:
        record = new_record(kernels.CHILLER)
        record.node = -1
        if self.chiller is not None:
            record.node = [node.name for node in self.nodes].index(self.chiller.node)
            record.on_degc, record.off_degc = self.chiller.on_degc, self.chiller.off_degc
            record.power_w, record.runs = self.chiller.power_w, runs
        return record
