"""A thermal network integrated by an implicit solver of scipy from the equations, its chiller by events.

Nothing is shared with the kernels: Walther's equation in its printed form, Palmgren's moments with numbers of their
own, one matrix of conductances, and energies as integrals of what flows.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.integrate import solve_ivp

TIGHT = {"method": "Radau", "rtol": 1e-8, "atol": 1e-8}


def walther(oil):
    """Constants of log10 log10 (nu + 0.7) = A - B log10 T through both points of an oil."""
    cold, hot = math.log10(313.15), math.log10(373.15)
    upper, lower = (math.log10(math.log10(nu + 0.7)) for nu in (oil.at_40_mm2_s, oil.at_100_mm2_s))
    slope = (upper - lower) / (hot - cold)
    return upper + slope * cold, slope


def viscosity(constants, degc):
    return 10**10 ** (constants[0] - constants[1] * math.log10(degc + 273.15)) - 0.7


class HeatOracle:
    """The equations of a network for one piece of a duty after the other."""

    def __init__(self, network, room):
        self.network, self.room = network, room
        self.places = {node.name: k for k, node in enumerate(network.nodes)}
        self.capacities = np.array([node.capacity_j_k for node in network.nodes])
        self.oils = {one.name: walther(one.oil) for one in (*network.bearings, *network.losses) if one.oil}

    def conductances(self, rpm, chilled):
        """Matrix between nodes, and vector to the room."""
        size = len(self.places)
        between, outward = np.zeros((size, size)), np.zeros(size)
        for link in self.network.links:
            g = max(link.standing_w_k, link.rotating_w_k * (rpm / 1000) ** (2 / 3)) + chilled * link.chilled_w_k
            a = self.places[link.a]
            if link.b == "room":
                outward[a] += g
            else:
                between[a, self.places[link.b]] += g
                between[self.places[link.b], a] += g
        return between, outward

    def heat(self, degc, piece):
        """Heat of each node in W."""
        found = np.zeros(degc.size)
        for one in self.network.bearings:
            a, b = self.places[one.inner], self.places[one.outer]
            turned = piece.spindle_rpm * viscosity(self.oils[one.name], (degc[a] + degc[b]) / 2)
            m0 = one.f0 * one.mean_diameter_mm**3 * (1e-7 * turned ** (2 / 3) if turned >= 2000 else 1.6e-5)
            load = max(0.0, one.preload_n + one.preload_n_k * (degc[a] - degc[b])) + one.force_share * piece.force_n
            watts = 1.047e-4 * piece.spindle_rpm * (m0 + one.f1 * load * one.mean_diameter_mm)
            found[a] += watts / 2
            found[b] += watts / 2
        for one in self.network.losses:
            a = self.places[one.node]
            speed = piece.feed_mm_s if one.of_feed else piece.spindle_rpm
            thick = viscosity(self.oils[one.name], degc[a]) / one.oil.at_40_mm2_s if one.oil else 1.0
            watts = one.per_speed_w * speed + one.per_speed2_w * speed**2 * thick
            if speed > 0:
                watts += one.force2_w * piece.force_n**2 * (1 + 0.00393 * (degc[a] - 20))
            found[a] += one.share * watts
            found[self.places[one.other or one.node]] += (1 - one.share) * watts
        return found

    def run(self, duty, times_s, chilled=False):
        """Temperatures at times, shape (times, nodes), and how often the chiller switched."""
        degc = np.full(len(self.places), float(self.room.at(0.0)))
        rows = np.full((len(times_s), degc.size), np.nan)
        rows[0] = degc
        now, switched = 0.0, 0
        for piece in duty.pieces:
            end = now + piece.duration_s
            while now < end:
                found = self.stretch(now, end, degc, piece, chilled, times_s)
                wanted = (times_s > now) & (times_s <= found.t[-1])
                if wanted.any():
                    rows[wanted] = found.sol(times_s[wanted]).T
                if found.status == 1:
                    chilled = not chilled
                    switched += 1
                now, degc = found.t[-1], found.y[:, -1]
        return rows, switched

    def stretch(self, start, end, degc, piece, chilled, times_s):
        between, outward = self.conductances(piece.spindle_rpm, chilled)
        drawn = np.zeros(degc.size)
        chiller = self.network.chiller
        if chilled:
            drawn[self.places[chiller.node]] = chiller.power_w
        leaving = np.diag(between.sum(axis=1) + outward) - between

        def rates(t, y):
            gained = self.heat(y, piece) + outward * float(self.room.at(t)) - drawn - leaving @ y
            return gained / self.capacities

        def beyond(t, y):
            return y[self.places[chiller.node]] - (chiller.off_degc if chilled else chiller.on_degc)

        beyond.terminal, beyond.direction = True, -1 if chilled else 1
        events = beyond if chiller else None
        return solve_ivp(rates, (start, end), degc, events=events, dense_output=True, first_step=1e-2, **TIGHT)
