"""A laser's path that no motion passes: its wavelengths change with the air, too."""

from __future__ import annotations

from collections.abc import Sequence

from rtec.effects._heat import SensorShape
from rtec.effects.conditions import Conditions, Floats
from rtec.effects.protocol import Amplitude, Card, Effect, Over, Shape, Units, own_shape
from rtec.effects.refraction import air_sensors, change_of_index, no_weather


class DeadPath(Effect):
    """The length of the dead path times the change of the air's refractive index.

    Notes
    -----
    ``deviation = dead_path * (n - n_standard)``: the way between the two reflectors where the laser was set to zero,
    which wavelength compensation does not know of. Where the air was another when it was set, the rest is an offset.

    Examples
    --------
    >>> import numpy as np
    >>> c = Conditions(
    ...     position=np.zeros(2), position_unit="mm", run=np.ones(2, dtype=np.int64),
    ...     pressure_hpa=np.array([1013.25, 983.25]),
    ... )
    >>> (1e3 * DeadPath().contribution(c, SensorShape(), [500.0])).round(1).tolist()
    [0.0, -4.0]
    """

    name = "dead_path"
    over = Over.TEMPERATURE
    shape_type = SensorShape
    in_time = True
    data_checks = (no_weather,)
    card = Card(
        title="Dead path",
        formula="`dead_path · (n − n_standard)`",
        needs="a pressure column, with air temperature and humidity where there are any",
        plot="All targets shift alike and follow the air pressure from run to run.",
        cause=(
            "The interferometer stands away from the zero of the axis: the wavelengths between change with the air, "
            "and no compensation counts them."
        ),
        consequence="The zero of a long measurement moves with the weather.",
        action="Place the interferometer close to the reflector at zero, or enter the dead path.",
        invariant_to="position, direction and feed.",
        source="Steinmetz (1990); thesis, section 2.3: the laser is zeroed where a run begins.",
    )

    def shapes(self, conditions: Conditions) -> Sequence[Shape]:
        return air_sensors(conditions)

    def columns(self, conditions: Conditions, shape: Shape) -> Floats:
        self._needed(conditions.pressure_hpa, "a pressure column")
        return change_of_index(conditions, own_shape(shape, SensorShape))[:, None]

    def amplitudes(self, shape: Shape, units: Units) -> tuple[Amplitude, ...]:
        return (Amplitude("dead_path", units.position, 1.0),)
