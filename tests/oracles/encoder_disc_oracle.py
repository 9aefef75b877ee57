"""A graduated disc, line by line: which of its lines lies under a head that stands still while the disc turns."""

import cmath

import numpy as np
from scipy.optimize import brentq


def read_under_the_head(turned_rad, centre, oval=0.0, along_rad=0.0):
    """Return the nominal angle of the line under a head at angle 0, at radius 1, in rad.

    The disc is pulled out by the share ``oval`` along a diameter at the angle ``along_rad``, and pressed together by
    as much across it; then its centre is put to ``centre``, a complex number, and all is turned about the origin.
    """
    pulled = cmath.exp(1j * along_rad)

    def line(nominal):
        around = cmath.exp(1j * nominal) / pulled
        return complex((1.0 + oval) * around.real, (1.0 - oval) * around.imag) * pulled

    def beside_the_head(nominal):
        middle = centre * cmath.exp(1j * turned_rad)
        ray = line(nominal) * cmath.exp(1j * turned_rad)
        return (ray.conjugate() * (1.0 - middle)).imag

    return brentq(beside_the_head, -turned_rad - 1.0, -turned_rad + 1.0, xtol=1e-14)


def deviations(turned_rad, centre, oval=0.0, along_rad=0.0):
    """Return how much too far an axis goes that is turned until its encoder reads the angles wanted, in rad.

    For small errors: what the encoder reads too little at each angle, shape (n,). The lines run against the turn.
    """
    read = np.array([-read_under_the_head(one, centre, oval, along_rad) for one in turned_rad])
    return turned_rad - read
