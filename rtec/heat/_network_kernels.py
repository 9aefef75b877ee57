"""Compiled thermal network: classic Runge-Kutta steps, the switching of the chiller located within them."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from rtec._jit import Record, helper, kernel, step

Floats = npt.NDArray[np.float64]
Records = npt.NDArray[np.void]

ROOM = -1
"""Node that stands for the room, whose temperature is given."""
HEAT_IN, TO_ROOM, TO_CHILLER = 0, 1, 2
"""Places of the energies, behind the temperatures in the state."""
ENERGIES = 3
STAGES = 6
"""Rows of work space: four slopes, a place to look at, and the end of a step."""
REACH = 0.2
"""Most of a step times the bound of the network's fastest rate.

The method is stable up to 2.78; along an exponential it is off by z^4 / (120 e) of the way, 5e-6 here.
"""
COLDEST_DEGC, HOTTEST_DEGC = -40.0, 200.0
"""Between which the formula of the viscosity holds; outside, it stays as it is there."""
RUNAWAY_DEGC = 1000.0
"""At which a run ends: heat finds no way out, or the preload rises faster than heat can flow off."""
COPPER_PER_K = 0.00393
"""By how much the resistance of copper grows for each kelvin above 20 degC (IEC 60028)."""
LAMINAR = 2000.0
"""Of viscosity times speed in mm2/s rev/min: below, the moment of a bearing's oil is constant."""
HEAT_W = 1.047e-4
"""Watts of a moment of 1 N mm at 1 rev/min: 2 pi / 60 / 1000."""

LINK = np.dtype([("a", np.int64), ("b", np.int64), ("standing_w_k", np.float64), ("rotating_w_k", np.float64),
                 ("chilled_w_k", np.float64)])  # fmt: skip
BEARING = np.dtype([
    ("inner", np.int64), ("outer", np.int64), ("dm_mm", np.float64), ("f0", np.float64), ("f1", np.float64),
    ("preload_n", np.float64), ("preload_n_k", np.float64), ("force_share", np.float64), ("oil_a", np.float64),
    ("oil_b", np.float64),
])  # fmt: skip
LOSS = np.dtype([
    ("node", np.int64), ("other", np.int64), ("share", np.float64), ("of_feed", np.int64),
    ("per_speed_w", np.float64), ("per_speed2_w", np.float64), ("force2_w", np.float64), ("oil_a", np.float64),
    ("oil_b", np.float64), ("oil_at_40", np.float64),
])  # fmt: skip
CHILLER = np.dtype([("node", np.int64), ("on_degc", np.float64), ("off_degc", np.float64), ("power_w", np.float64),
                    ("runs", np.int64)])  # fmt: skip
ROOM_AIR = np.dtype([("mean_degc", np.float64), ("swing_k", np.float64), ("warmest_s", np.float64)])
DAY_S = 86400.0


@step
def viscosity_mm2_s(a: float, b: float, degc: float) -> float:
    """Return the viscosity of an oil by Walther's equation."""
    kelvin = min(max(degc, COLDEST_DEGC), HOTTEST_DEGC) + 273.15
    return math.exp(math.exp(a - b * math.log(kelvin))) - 0.7


@step
def bearing_w(bearing: Record, inner_degc: float, outer_degc: float, rpm: float, force_n: float) -> float:
    """Return the heat of a bearing by Palmgren's moments."""
    warm = viscosity_mm2_s(bearing.oil_a, bearing.oil_b, 0.5 * (inner_degc + outer_degc)) * rpm
    fluid = 1e-7 * warm ** (2.0 / 3.0) if warm >= LAMINAR else 160e-7
    load_n = max(bearing.preload_n + bearing.preload_n_k * (inner_degc - outer_degc), 0.0)
    load_n += bearing.force_share * force_n
    moment = bearing.f0 * fluid * bearing.dm_mm**3 + bearing.f1 * load_n * bearing.dm_mm
    return float(HEAT_W * rpm * moment)


@step
def loss_w(loss: Record, degc: float, speed: float, force_n: float) -> float:
    """Return the heat of a motor, a drive or a slide at a speed."""
    thick = viscosity_mm2_s(loss.oil_a, loss.oil_b, degc) / loss.oil_at_40 if loss.oil_at_40 > 0.0 else 1.0
    copper = loss.force2_w * force_n * force_n * (1.0 + COPPER_PER_K * (degc - 20.0)) if speed > 0.0 else 0.0
    return float(speed * (loss.per_speed_w + loss.per_speed2_w * speed * thick) + copper)


@step
def room_degc(t_s: float, air: Record, times_s: Floats, degc: Floats) -> float:
    """Return the temperature of the room: given on straight lines, or a daily sine."""
    last = times_s.size - 1
    if last < 0:
        return float(air.mean_degc + air.swing_k * math.cos(2.0 * math.pi * (t_s - air.warmest_s) / DAY_S))
    if t_s <= times_s[0]:
        return float(degc[0])
    if t_s >= times_s[last]:
        return float(degc[last])
    low, high = 0, last
    while high - low > 1:
        middle = (low + high) // 2
        if times_s[middle] <= t_s:
            low = middle
        else:
            high = middle
    share = (t_s - times_s[low]) / (times_s[high] - times_s[low])
    return float(degc[low] + (degc[high] - degc[low]) * share)


@helper
def slopes(t_s: float, y: Floats, into: Floats, network: Any, chiller: Record, now: Any) -> None:
    """Write the change of temperatures (K/s) and energies (W) at a time and a state."""
    capacities, links, conductances, bearings, losses, air, room_s, given_degc = network
    rpm, feed_mm_s, force_n = now
    nodes = capacities.size
    for i in range(into.size):
        into[i] = 0.0
    room = room_degc(t_s, air, room_s, given_degc)
    for i in range(links.size):
        a, b = links[i].a, links[i].b
        conductance = conductances[i] + (links[i].chilled_w_k if chiller.runs else 0.0)
        flow = conductance * (y[a] - (room if b == ROOM else y[b]))
        into[a] -= flow
        into[nodes + TO_ROOM if b == ROOM else b] += flow
    for i in range(bearings.size):
        inner, outer = bearings[i].inner, bearings[i].outer
        heat = bearing_w(bearings[i], y[inner], y[outer], rpm, force_n)
        into[inner] += 0.5 * heat
        into[outer] += 0.5 * heat
        into[nodes + HEAT_IN] += heat
    for i in range(losses.size):
        node, other, share = losses[i].node, losses[i].other, losses[i].share
        heat = loss_w(losses[i], y[node], feed_mm_s if losses[i].of_feed else rpm, force_n)
        into[node] += share * heat
        into[other] += (1.0 - share) * heat
        into[nodes + HEAT_IN] += heat
    if chiller.runs:
        into[chiller.node] -= chiller.power_w
        into[nodes + TO_CHILLER] = chiller.power_w
    for i in range(nodes):
        into[i] /= capacities[i]


@helper
def take_step(t_s: float, h: float, y: Floats, work: Floats, network: Any, chiller: Record, now: Any) -> None:
    """Write the state after a step of the classic fourth-order Runge-Kutta method into the last row of ``work``."""
    k1, k2, k3, k4, at, end = work[0], work[1], work[2], work[3], work[4], work[5]
    slopes(t_s, y, k1, network, chiller, now)
    for i in range(y.size):
        at[i] = y[i] + 0.5 * h * k1[i]
    slopes(t_s + 0.5 * h, at, k2, network, chiller, now)
    for i in range(y.size):
        at[i] = y[i] + 0.5 * h * k2[i]
    slopes(t_s + 0.5 * h, at, k3, network, chiller, now)
    for i in range(y.size):
        at[i] = y[i] + h * k3[i]
    slopes(t_s + h, at, k4, network, chiller, now)
    for i in range(y.size):
        end[i] = y[i] + h * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]) / 6.0


@step
def passed(chiller: Record, degc: float) -> bool:
    """Return whether the coolant is beyond the temperature at which the chiller switches."""
    if chiller.node < 0:
        return False
    return bool(degc < chiller.off_degc) if chiller.runs else bool(degc > chiller.on_degc)


@step
def crossing(before: float, after: float, slope: float, end_slope: float, wanted: float) -> float:
    """Return the share of a step at which the cubic through both ends and their slopes (times the step) arrives."""
    low, high = 0.0, 1.0
    for _ in range(40):
        s = 0.5 * (low + high)
        r = 1.0 - s
        value = r * r * ((1.0 + 2.0 * s) * before + s * slope) + s * s * ((3.0 - 2.0 * s) * after - r * end_slope)
        if (value < wanted) == (before < wanted):
            low = s
        else:
            high = s
    return high


@helper
def advance(t_s: float, h: float, y: Floats, work: Floats, network: Any, chiller: Record, now: Any) -> None:
    """Carry the state on by ``h``, in as many parts as the chiller's switching asks for."""
    left = h
    while left > 0.0:
        take_step(t_s, left, y, work, network, chiller, now)
        part, switched, node = left, passed(chiller, work[5, chiller.node]), chiller.node
        if switched:
            after, slope = work[5, node], left * work[0, node]
            slopes(t_s + left, work[5], work[4], network, chiller, now)
            wanted = chiller.off_degc if chiller.runs else chiller.on_degc
            part = left * crossing(y[node], after, slope, left * work[4, node], wanted)
            take_step(t_s, part, y, work, network, chiller, now)
        for i in range(y.size):
            y[i] = work[5, i]
        if switched:
            chiller.runs = 1 - chiller.runs
        t_s += part
        left -= part


@step
def set_conductances(capacities: Floats, links: Records, conductances: Floats, rates: Floats, rpm: float) -> float:
    """Write what links conduct at a speed; return a bound of the fastest rate in 1/s (Gershgorin)."""
    for i in range(capacities.size):
        rates[i] = 0.0
    for i in range(links.size):
        rotating = links[i].rotating_w_k * (rpm / 1000.0) ** (2.0 / 3.0)
        conductances[i] = max(links[i].standing_w_k, rotating)
        rates[links[i].a] += conductances[i] + links[i].chilled_w_k
        if links[i].b != ROOM:
            rates[links[i].b] += conductances[i] + links[i].chilled_w_k
    fastest = 0.0
    for i in range(capacities.size):
        fastest = max(fastest, 2.0 * rates[i] / capacities[i])
    return fastest


@helper
def carry_on(
    t_s: float, length: float, fastest: float, y: Floats, work: Floats, network: Any, chiller: Record, now: Any
) -> int:
    """Carry the state on by ``length`` in equal steps; return a node that became too hot, where it ends, or -1."""
    steps = max(int(math.ceil(length * fastest / REACH)), 1)
    for i in range(steps):
        advance(t_s + i * length / steps, length / steps, y, work, network, chiller, now)
        for node in range(network[0].size):
            if not y[node] < RUNAWAY_DEGC:
                return node
    return -1


@helper
def write_heats(y: Floats, into: Floats, bearings: Records, losses: Records, now: Any) -> None:
    """Write the heat of each source: bearings, then losses."""
    rpm, feed_mm_s, force_n = now
    for i in range(bearings.size):
        into[i] = bearing_w(bearings[i], y[bearings[i].inner], y[bearings[i].outer], rpm, force_n)
    for i in range(losses.size):
        speed = feed_mm_s if losses[i].of_feed else rpm
        into[bearings.size + i] = loss_w(losses[i], y[losses[i].node], speed, force_n)


@kernel
def run_network(
    grid_s: Floats, piece_of: npt.NDArray[np.int64], shown: npt.NDArray[np.int64], pieces: Floats, network: Any,
    chiller: Record, y: Floats, work: Floats, states: Floats, heats_w: Floats, running: npt.NDArray[np.int64],
) -> int:  # fmt: skip
    """Carry the state over a grid of times; write states, heats by source and the chiller where they are shown.

    ``piece_of`` is the row of ``pieces`` (rpm, mm/s, N) that holds from each time of the grid on; ``shown`` the row
    to write at it, or -1. Returns a node that became hotter than anything may be, where the run ends, or -1.
    """
    capacities, links, conductances, bearings, losses, _, _, _ = network
    piece, fastest, hot = -1, 0.0, -1
    now = (0.0, 0.0, 0.0)
    if passed(chiller, y[chiller.node]):
        chiller.runs = 1 - chiller.runs
    for g in range(grid_s.size):
        if piece_of[g] != piece:
            piece = piece_of[g]
            now = (pieces[piece, 0], pieces[piece, 1], pieces[piece, 2])
            fastest = set_conductances(capacities, links, conductances, work[4], now[0])
        row = shown[g]
        if row >= 0:
            for i in range(y.size):
                states[row, i] = y[i]
            running[row] = chiller.runs
            write_heats(y, heats_w[row], bearings, losses, now)
        if g + 1 < grid_s.size:
            hot = carry_on(grid_s[g], grid_s[g + 1] - grid_s[g], fastest, y, work, network, chiller, now)
        if hot >= 0:
            return hot
    return -1
