"""A simulated machine that warms: how its parts move the spindle and the feed axis, and what is measured of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import numpy.typing as npt

from rtec.checks import number_within, one_of_types, whole_within
from rtec.errors import ArgumentError, unknown
from rtec.heat.course import HeatCourse
from rtec.heat.duty import Duty
from rtec.heat.network import ROOM, Network, NetworkRun, Room
from rtec.heat.sensors import Thermometer
from rtec.io.whole_file import WholeFile

Floats = npt.NDArray[np.float64]

CHANNELS = ("x1", "x2", "y1", "y2", "z")
"""Displacement sensors of ISO 230-3: X1, Y1 at the end of the test mandrel, X2, Y2 nearer to the nose, Z axial."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Growth:
    """By how much a part that is warmer than the machine's reference moves the spindle, and the screw.

    Parameters
    ----------
    node
        The part.
    shift_um_k
        Of the spindle for each kelvin: its nose along X and Y, the end of the mandrel along Z.
    tilt_urad_k
        Of the spindle, as slope of X and of Y along the mandrel, for each kelvin.
    screw_per_k
        Growth of a millimetre of the screw for each kelvin.
    screw_um_k
        Growth of the screw between its fixed bearing and position 0, for each kelvin.
    """

    node: str
    shift_um_k: tuple[float, float, float] = (0.0, 0.0, 0.0)
    tilt_urad_k: tuple[float, float] = (0.0, 0.0)
    screw_per_k: float = 0.0
    screw_um_k: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class WarmMachine:
    """A machine that warms, with its thermometers and a nest of five displacement sensors.

    `rtec.heat.warm_machine` makes one; docs/warm-machine.md lists its parts.

    Parameters
    ----------
    network
        Its parts.
    growths
        What they do to the spindle and the screw.
    thermometers
        What the PC sees.
    room
        Around it, where a run gives no other.
    reference_degc
        Temperature at which nothing is displaced.
    axial_um_krpm2
        Axial displacement by the bearings' balls at speed, for each (1000 rev/min)^2; at once, without heat.
    compliance_um_n
        Of the spindle's nose along X, Y, Z for each N of cutting force.
    near_mm, far_mm
        From the nose to X2, Y2 and to X1, Y1 along the mandrel.
    """

    network: Network
    growths: tuple[Growth, ...]
    thermometers: tuple[Thermometer, ...]
    room: Room = field(default_factory=Room)
    reference_degc: float = 20.0
    axial_um_krpm2: float = 0.0
    compliance_um_n: tuple[float, float, float] = (0.0, 0.0, 0.0)
    near_mm: float = 40.0
    far_mm: float = 160.0

    def __post_init__(self) -> None:
        names = [node.name for node in self.network.nodes]
        for growth in self.growths:
            if growth.node not in names:
                raise unknown("growth", growth.node, names, noun="node")
        seen: set[str] = set()
        for one in self.thermometers:
            if one.node not in (*names, ROOM):
                raise unknown(f"thermometer {one.name}", one.node, [*names, ROOM], noun="node")
            if one.name in seen:
                raise ArgumentError("thermometer", one.name, "each name once")
            seen.add(one.name)
        number_within("reference_degc", self.reference_degc, -50.0, 100.0, unit="degC")

    def run(
        self,
        duty: Duty,
        *,
        seed: int = 0,
        room: Room | None = None,
        every_s: float = 1.0,
        start_degc: Mapping[str, float] | None = None,
        chiller_runs: bool = False,
    ) -> WarmRun:
        """Let the machine warm and cool over a duty.

        Parameters
        ----------
        duty
            Speed, feed and force over time.
        seed
            From which the offsets of the thermometers are drawn: runs of one seed have the same thermometers.
        room, every_s, start_degc, chiller_runs
            As of `Network.run`; the room is the machine's own where none is given. ``run.heat.last_degc`` of another
            run starts a machine that is still warm.

        Returns
        -------
        WarmRun
            Temperatures, readings, displacements, powers.

        Examples
        --------
        >>> from rtec.heat import Duty, warm_machine
        >>> run = warm_machine(seed=1).run(Duty.paper(spindle_rpm=4000.0), seed=1)
        >>> run.time_s.size, sorted(run.displacement_um)
        (16201, ['x1', 'x2', 'y1', 'y2', 'z'])
        """
        one_of_types("duty", duty, Duty)
        whole_within("seed", seed, 0, 2**63 - 1)
        room = self.room if room is None else room
        heat = self.network.run(duty, room=room, every_s=every_s, start_degc=start_degc, chiller_runs=chiller_runs)
        rng = np.random.default_rng(seed)
        readings = {}
        for one in self.thermometers:
            degc = room.at(heat.time_s) if one.node == ROOM else heat.of(one.node)
            readings[one.name] = one.readings(heat.time_s, degc, offset_k=rng.uniform(-one.offset_k, one.offset_k))
        inputs = duty.at(heat.time_s)
        shift, tilt, screw_mm, per_mm = self._grown(heat, inputs)
        places = {"1": self.far_mm, "2": self.near_mm}
        displaced = {
            f"{axis}{which}": shift[:, k] + 1e-3 * tilt[:, k] * place
            for k, axis in enumerate("xy")
            for which, place in places.items()
        }
        return WarmRun(
            heat=heat,
            spindle_rpm=inputs[:, 0],
            feed_mm_s=inputs[:, 1],
            force_n=inputs[:, 2],
            thermometers=readings,
            displacement_um={**displaced, "z": shift[:, 2]},
            screw_shift_mm=screw_mm,
            screw_per_mm=per_mm,
        )

    def _grown(self, heat: NetworkRun, inputs: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        """Return shift (um) and tilt (urad) of the spindle, shift (mm) of the screw and growth of its millimetre."""
        warmer = np.column_stack([heat.of(one.node) for one in self.growths]) - self.reference_degc
        shift = warmer @ np.array([one.shift_um_k for one in self.growths])
        shift += inputs[:, 2:] * np.array(self.compliance_um_n)
        shift[:, 2] += self.axial_um_krpm2 * (inputs[:, 0] / 1000.0) ** 2
        tilt = warmer @ np.array([one.tilt_urad_k for one in self.growths])
        screw_mm = 1e-3 * warmer @ np.array([one.screw_um_k for one in self.growths])
        return shift, tilt, screw_mm, warmer @ np.array([one.screw_per_k for one in self.growths])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WarmRun:
    """What a warm machine did: rows in time, every second where nothing else was asked for.

    Parameters
    ----------
    heat
        Temperatures of all nodes, heat of all sources, energies.
    spindle_rpm, feed_mm_s, force_n
        Of the duty, shape (times,); each holds until the next row.
    thermometers
        What they say in degrees Celsius, shape (times,), by name.
    displacement_um
        What the nest's sensors x1, x2, y1, y2 and z say without noise, shape (times,) each, positive along the
        machine's axes: the spindle points along -Z, away from the column along -Y.
    screw_shift_mm, screw_per_mm
        What the growing ball screw adds to the deviation of axis z at position 0 and for each millimetre.
    """

    heat: NetworkRun
    spindle_rpm: Floats
    feed_mm_s: Floats
    force_n: Floats
    thermometers: Mapping[str, Floats]
    displacement_um: Mapping[str, Floats]
    screw_shift_mm: Floats
    screw_per_mm: Floats

    @property
    def time_s(self) -> Floats:
        """Times of all rows, shape (times,)."""
        return self.heat.time_s

    def course(self, axis: str = "z") -> HeatCourse:
        """Return what an axis and the PC's thermometers see of it.

        Parameters
        ----------
        axis
            x or y: the end of the mandrel, where a tool would be, moves as x1 or y1 says. z: as z says, and the ball
            screw grows with the position.

        Raises
        ------
        ArgumentError
            Another axis.
        """
        if axis not in ("x", "y", "z"):
            raise unknown("axis", axis, ("x", "y", "z"), noun="axis")
        has_screw = axis == "z"
        shift_mm = 1e-3 * self.displacement_um[{"x": "x1", "y": "y1", "z": "z"}[axis]]
        return HeatCourse(
            time_s=self.time_s,
            thermometers=self.thermometers,
            shift_mm=shift_mm + self.screw_shift_mm if has_screw else shift_mm,
            per_mm=self.screw_per_mm if has_screw else None,
            spindle_rpm=self.spindle_rpm,
        )

    def write_csv(self, path: str | Path, *, every_s: float = 60.0, noise_um: float = 0.0, seed: int = 0) -> None:
        """Write what a person would have measured, for ``rtec train`` and ``rtec diagnose``.

        Parameters
        ----------
        path
            File: ``time_s``, ``spindle_rpm``, ``feed_mm_s``, ``force_n``, the channels ``x1_um`` to ``z_um``, and
            ``temperature_NAME_degc`` by thermometer.
        every_s
            Between rows; the nearest rows of the run are taken.
        noise_um
            Standard deviation of the displacements' noise.
        seed
            Of the noise.

        Raises
        ------
        ArgumentError
            Rows closer than those of the run.
        OutputError
            The file cannot be written.
        """
        number_within("noise_um", noise_um, 0.0, 1e6, unit="um")
        whole_within("seed", seed, 0, 2**63 - 1)
        apart_s = float(self.time_s[1] - self.time_s[0])
        if not apart_s <= every_s <= 1e6:
            raise ArgumentError("every_s", every_s, f"{apart_s:g} s, the step of the run, or more")
        wanted = np.arange(0.0, self.time_s[-1] + 1e-9, every_s)
        rows = np.searchsorted(self.time_s, wanted - 0.5 * apart_s)
        noise = np.random.default_rng(seed).normal(0.0, 1.0, (rows.size, len(CHANNELS))) * noise_um
        columns = {"time_s": self.time_s[rows], "spindle_rpm": self.spindle_rpm[rows]}
        columns |= {"feed_mm_s": self.feed_mm_s[rows], "force_n": self.force_n[rows]}
        columns |= {f"{name}_um": self.displacement_um[name][rows] + noise[:, k] for k, name in enumerate(CHANNELS)}
        columns |= {f"temperature_{name}_degc": values[rows] for name, values in self.thermometers.items()}
        table = zip(*(np.round(values, 4).tolist() for values in columns.values()), strict=True)
        lines = [",".join(columns), *(",".join(f"{value:.10g}" for value in row) for row in table)]
        with WholeFile(path) as file:
            file.write(("\n".join(lines) + "\n").encode())
