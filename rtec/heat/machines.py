"""Warm machines to try things on: one with typical constants, and as many others as there are seeds."""

from __future__ import annotations

import numpy as np

from rtec.checks import whole_within
from rtec.heat.bearings import Bearing, Loss, Oil, jacket_w_m2_k, rotating_w_m2_k
from rtec.heat.network import ROOM, Chiller, Link, Network, Node, Room
from rtec.heat.sensors import Thermometer
from rtec.heat.spindle import Growth, WarmMachine

STEEL_J_KG_K, IRON_J_KG_K, COOLANT_J_KG_K = 460.0, 500.0, 3700.0
"""Specific heats of bearing steel, of cast iron, and of water with 30 % of glycol."""
STEEL_UM_M_K, IRON_UM_M_K = 11.5, 10.5
"""Growth of a metre for each kelvin."""
MANDREL_M = 0.16
"""Length of the test mandrel."""
STANDING_W_M2_K = 12.0
"""Heat transfer of standing surfaces, radiation included: 10 to 25 W/(m2 K)."""
SPREAD = 0.15
"""Relative standard deviation of what is drawn."""
MASSES_KG = {
    "front_inner": (1.3, STEEL_J_KG_K),
    "front_outer": (1.1, STEEL_J_KG_K),
    "rear_inner": (0.8, STEEL_J_KG_K),
    "rear_outer": (0.7, STEEL_J_KG_K),
    "mandrel": (2.5, STEEL_J_KG_K),
    "shaft_nose": (5.0, STEEL_J_KG_K),
    "rotor": (11.0, STEEL_J_KG_K),
    "stator": (13.0, 430.0),
    "housing_front": (16.0, STEEL_J_KG_K),
    "housing_rear": (14.0, STEEL_J_KG_K),
    "coolant": (14.0, COOLANT_J_KG_K),
    "head_left": (110.0, IRON_J_KG_K),
    "head_right": (110.0, IRON_J_KG_K),
    "column_front": (300.0, IRON_J_KG_K),
    "column_back": (300.0, IRON_J_KG_K),
    "bed": (1500.0, IRON_J_KG_K),
    "feed_motor": (7.0, 430.0),
    "screw_bearing": (2.0, STEEL_J_KG_K),
    "screw": (8.0, STEEL_J_KG_K),
    "nut": (2.5, STEEL_J_KG_K),
}
"""Mass and specific heat of each node."""
CONDUCTED_W_K = {
    ("front_inner", "front_outer"): 6.0,
    ("rear_inner", "rear_outer"): 4.0,
    ("front_inner", "shaft_nose"): 30.0,
    ("rear_inner", "rotor"): 22.0,
    ("shaft_nose", "rotor"): 5.0,
    ("mandrel", "shaft_nose"): 5.0,
    ("front_outer", "housing_front"): 45.0,
    ("rear_outer", "housing_rear"): 35.0,
    ("stator", "housing_rear"): 90.0,
    ("housing_front", "housing_rear"): 20.0,
    ("housing_front", "head_left"): 26.0,
    ("housing_front", "head_right"): 16.0,
    ("housing_rear", "head_left"): 14.0,
    ("housing_rear", "head_right"): 20.0,
    ("head_left", "column_front"): 18.0,
    ("head_right", "column_front"): 18.0,
    ("column_front", "column_back"): 35.0,
    ("column_front", "bed"): 18.0,
    ("column_back", "bed"): 18.0,
    ("feed_motor", "screw_bearing"): 4.0,
    ("screw_bearing", "screw"): 6.0,
    ("screw_bearing", "column_front"): 12.0,
    ("nut", "screw"): 12.0,
    ("nut", "head_left"): 4.0,
}
"""Through metal and joints."""
SURFACES_M2 = {
    "stator": 0.05, "housing_front": 0.10, "housing_rear": 0.10, "head_left": 0.45, "head_right": 0.45,
    "column_front": 1.4, "column_back": 1.5, "bed": 4.0, "feed_motor": 0.10, "nut": 0.02, "screw_bearing": 0.03,
}  # fmt: skip
"""To the room's air, standing."""
THERMOMETERS = {
    "front_bearing": "front_outer", "rear_bearing": "rear_outer", "motor": "stator", "housing": "housing_front",
    "coolant": "coolant", "head_left": "head_left", "head_right": "head_right", "column_front": "column_front",
    "column_back": "column_back", "bed": "bed", "screw_nut": "nut", "screw_bearing": "screw_bearing",
    "room": ROOM,
}  # fmt: skip
"""Name of each thermometer and its node: none sits on what rotates."""


class _Draw:
    """Typical values, or others near them."""

    def __init__(self, seed: int | None) -> None:
        self._rng = None if seed is None else np.random.default_rng(whole_within("seed", seed, 0, 2**63 - 1))

    def near(self, value: float, spread: float = SPREAD) -> float:
        """Return a value by a factor, log-normal within two standard deviations."""
        if self._rng is None:
            return value
        return float(value * np.exp(spread * np.clip(self._rng.normal(), -2.0, 2.0)))

    def within(self, low: float, high: float) -> float:
        """Return a value between two, or the mean of them."""
        return 0.5 * (low + high) if self._rng is None else float(self._rng.uniform(low, high))


def warm_machine(seed: int | None = None) -> WarmMachine:
    """Return a vertical machine with a motor spindle of 10 kW and a feed axis with a ball screw.

    Parameters
    ----------
    seed
        Each draws another machine of the kind: capacities, contacts, bearings, losses, chiller, lengths and room.
        Without one all constants are typical ones.

    Returns
    -------
    WarmMachine
        With 20 nodes and 13 thermometers.

    Examples
    --------
    >>> machine = warm_machine()
    >>> len(machine.network.nodes), [thermometer.name for thermometer in machine.thermometers][:3]
    (20, ['front_bearing', 'rear_bearing', 'motor'])
    >>> warm_machine(seed=1) == warm_machine(seed=2)
    False
    """
    draw = _Draw(seed)
    mean_degc = draw.within(19.0, 23.0)
    room = Room(mean_degc=mean_degc, swing_k=draw.within(0.5, 1.5), warmest_s=3600.0 * draw.within(5.0, 9.0))
    nodes = tuple(Node(name=name, capacity_j_k=draw.near(kg) * heat) for name, (kg, heat) in MASSES_KG.items())
    chilled_from = mean_degc + draw.within(3.0, 5.0)
    network = Network(
        nodes=nodes,
        links=_links(draw),
        bearings=_bearings(draw),
        losses=_losses(draw),
        chiller=Chiller(
            node="coolant",
            on_degc=chilled_from,
            off_degc=chilled_from - draw.within(0.6, 1.2),
            power_w=draw.near(1800.0),
        ),
    )
    return WarmMachine(
        network=network,
        growths=_growths(draw),
        thermometers=tuple(Thermometer(name=name, node=node) for name, node in THERMOMETERS.items()),
        room=room,
        reference_degc=mean_degc,
        axial_um_krpm2=draw.near(0.4),
        compliance_um_n=(draw.near(1 / 80), draw.near(1 / 60), draw.near(1 / 150)),
        far_mm=1e3 * MANDREL_M,
    )


def _links(draw: _Draw) -> tuple[Link, ...]:
    links = [Link(a=a, b=b, standing_w_k=draw.near(w_k)) for (a, b), w_k in CONDUCTED_W_K.items()]
    links += [Link(a=node, standing_w_k=draw.near(STANDING_W_M2_K) * m2) for node, m2 in SURFACES_M2.items()]
    jacket = jacket_w_m2_k(10.0, draw.near(16.0), glycol=True)
    links += [
        Link(a="stator", b="coolant", standing_w_k=jacket * draw.near(0.020)),
        Link(a="housing_front", b="coolant", standing_w_k=draw.near(10.0), chilled_w_k=jacket * draw.near(0.010)),
        Link(a="coolant", standing_w_k=draw.near(25.0)),
        _rotating("mandrel", ROOM, 40.0, draw.near(0.02)),
        _rotating("shaft_nose", ROOM, 90.0, draw.near(0.02)),
        _rotating("rotor", "stator", 110.0, draw.near(0.07)),
        Link(a="screw", standing_w_k=STANDING_W_M2_K * draw.near(0.12)),
    ]
    return tuple(links)


def _rotating(a: str, b: str, diameter_mm: float, m2: float) -> Link:
    at_1000 = rotating_w_m2_k(diameter_mm, 1000.0) * m2
    return Link(a=a, b=b, standing_w_k=STANDING_W_M2_K * m2, rotating_w_k=at_1000)


def _bearings(draw: _Draw) -> tuple[Bearing, ...]:
    oil = Oil(at_40_mm2_s=draw.near(23.0), at_100_mm2_s=4.5)
    front = Bearing(
        name="front_bearing", inner="front_inner", outer="front_outer", mean_diameter_mm=85.0, f0=3 * draw.near(1.8),
        f1=3 * 0.00035, preload_n=draw.near(280.0), preload_n_k=draw.near(14.0), force_share=0.7, oil=oil,
    )  # fmt: skip
    rear = Bearing(
        name="rear_bearing", inner="rear_inner", outer="rear_outer", mean_diameter_mm=68.0, f0=2 * draw.near(1.8),
        f1=2 * 0.00035, preload_n=draw.near(200.0), preload_n_k=draw.near(8.0), force_share=0.3, oil=oil,
    )  # fmt: skip
    return front, rear


def _losses(draw: _Draw) -> tuple[Loss, ...]:
    grease = Oil(at_40_mm2_s=100.0, at_100_mm2_s=11.0)
    return (
        Loss(name="motor", node="stator", other="rotor", share=0.7, per_speed_w=draw.near(0.03),
             per_speed2_w=draw.near(5e-6), force2_w=draw.near(1.5e-3)),
        Loss(name="feed_motor", node="feed_motor", of_feed=True, per_speed_w=draw.near(0.5),
             force2_w=draw.near(2e-4)),
        Loss(name="screw_bearing", node="screw_bearing", of_feed=True, per_speed_w=draw.near(0.15),
             per_speed2_w=draw.near(2e-3), oil=grease),
        Loss(name="nut", node="nut", other="screw", share=0.5, of_feed=True, per_speed_w=draw.near(0.5),
             per_speed2_w=draw.near(5e-3), oil=grease),
    )  # fmt: skip


def _growths(draw: _Draw) -> tuple[Growth, ...]:
    """Return what each part does: it grows freely, and where its sides differ it bends like two bars side by side."""
    nose, front, arm, height = draw.near(0.14), draw.near(0.20), draw.near(0.55), draw.near(0.75)
    half_width, depth, head = draw.near(0.25), draw.near(0.45), draw.near(0.40)
    guide = IRON_UM_M_K * half_width  # the left guide holds the head
    yaw = IRON_UM_M_K * arm**2 / (4.0 * half_width)  # X of the arm's end, for a kelvin between its sides
    roll = IRON_UM_M_K * head / (4.0 * half_width)  # slope of the nose in X, for the same: half of the head is below
    reach = 0.5 * IRON_UM_M_K * arm
    lift = 0.5 * IRON_UM_M_K * height
    bend = IRON_UM_M_K * height / depth  # slope of the column's top, for a kelvin between front and back
    away = 0.5 * bend * height  # and Y of it
    screw = STEEL_UM_M_K * 1e-6
    return (
        Growth(node="mandrel", shift_um_k=(0.0, 0.0, -STEEL_UM_M_K * MANDREL_M)),
        Growth(node="shaft_nose", shift_um_k=(0.0, 0.0, -STEEL_UM_M_K * nose)),
        Growth(node="housing_front", shift_um_k=(0.0, 0.0, -STEEL_UM_M_K * front)),
        Growth(node="head_left", shift_um_k=(guide + yaw, -reach, 0.0), tilt_urad_k=(roll, 0.0)),
        Growth(node="head_right", shift_um_k=(-yaw, -reach, 0.0), tilt_urad_k=(-roll, 0.0)),
        Growth(node="column_front", shift_um_k=(0.0, away, lift + bend * arm), tilt_urad_k=(0.0, -bend)),
        Growth(node="column_back", shift_um_k=(0.0, -away, lift - bend * arm), tilt_urad_k=(0.0, bend)),
        Growth(node="screw", screw_per_k=screw, screw_um_k=STEEL_UM_M_K * draw.near(0.10)),
    )
