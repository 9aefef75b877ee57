"""A zero that moves with temperature: what stands between the scale and the tool grows with heat."""

from __future__ import annotations

from rtec.effects._heat import FollowsHeat, HeatShape, rise_of, unchanging
from rtec.effects.conditions import Conditions, Floats
from rtec.effects.protocol import Card, Per, Shape, own_shape


class ThermalShift(FollowsHeat):
    """Expansion of what carries the spindle, the table or the scale: the same at every position.

    Notes
    -----
    ``deviation = shift * (temperature - reference temperature)``, or ``at_1000_rpm * (speed / 1000 rpm) ** (5 / 3)``
    where the heat of the spindle is followed. What grows may lag behind the sensor. A model holds several of these
    terms: parts follow a sensor each, and two of them may follow the same one with different lags.

    Examples
    --------
    >>> import numpy as np
    >>> x, heat = np.array([0.0, 1000.0]), {"temperature": np.array([22.0, 23.0])}
    >>> c = Conditions(position=x, position_unit="mm", run=np.ones(2, dtype=np.int64), temperatures=heat)
    >>> ThermalShift().contribution(c, HeatShape(), [0.004]).round(6).tolist()
    [0.008, 0.012]
    """

    name = "thermal_shift"
    amplitude = "shift"
    amplitude_per = Per.KELVIN
    shape_type = HeatShape
    data_checks = (unchanging,)
    card = Card(
        title="Thermal shift",
        formula="`shift · (T − T_ref)`; of a spindle `at_1000_rpm · (n / 1000 rpm)^(5/3)`",
        needs="a temperature column that changes by 0.5 K at least, or a spindle that changes its speed",
        plot="All targets shift alike with temperature; cold and hot runs are parallel.",
        cause=(
            "Heat of spindle, motor or bearing lengthens what stands between scale and tool: headstock, column, "
            "bracket."
        ),
        consequence="Lengths are right, but the zero of the work moves while the machine warms up.",
        action=(
            "Set the zero again when warm, correct it by the temperature of the part that grows, or cool that part."
        ),
        invariant_to="position, direction, feed and order of the readings.",
        source="Yao et al. (2013), section 4.2; Yee (1992), introduction; ISO 230-3; Palmgren (1959).",
    )

    def columns(self, conditions: Conditions, shape: Shape) -> Floats:
        own = own_shape(shape, HeatShape)
        return rise_of(conditions, own.sensor, own.lag)[:, None]
