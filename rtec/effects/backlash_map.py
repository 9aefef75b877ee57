"""A reversal error that varies along the axis: play where the screw is worn, friction that winds it up."""

from __future__ import annotations

from rtec.effects import experiments
from rtec.effects._smooth import smooth_columns
from rtec.effects.conditions import Conditions, Floats
from rtec.effects.pitch_map import MapShape, PitchMap
from rtec.effects.protocol import Card, Rival, Shape, own_shape


class BacklashMap(PitchMap):
    """A natural cubic spline through nodes, times half of the direction of approach.

    Notes
    -----
    ``deviation = s(position) / 2 * direction``; the amplitudes are the reversal errors at the nodes.

    References
    ----------
    Thesis, section 3.1.2, table 3-3: separate errors forward and backward (bidirectional compensation).

    Examples
    --------
    >>> import numpy as np
    >>> x, way = np.array([0.0, 50.0, 100.0]), np.array([1.0, 1.0, -1.0])
    >>> c = Conditions(position=x, position_unit="mm", run=np.ones(3, dtype=np.int64), direction=way)
    >>> BacklashMap().contribution(c, MapShape((0.0, 50.0, 100.0)), [0.02, 0.03, 0.05]).round(9).tolist()
    [0.01, 0.015, -0.025]
    """

    name = "backlash_map"
    needs = "both directions, at three positions at least"
    contains = frozenset({"backlash", "windup"})
    rivals = (
        Rival("windup", experiments.MANY_REVERSALS),
        Rival("reversal_spike", experiments.MANY_REVERSALS),
    )
    card = Card(
        title="Backlash that varies along the axis",
        plot=(
            "The distance between forward and backward curve changes with position: larger where the axis works "
            "most, or towards the far end of the screw."
        ),
        cause=(
            "Thread and nut worn where the machine is used most; friction and length of the screw that make its "
            "wind-up change along the axis; gibs that are tight at one end."
        ),
        consequence="One backlash value in the control is right at one place and wrong at others.",
        action=(
            "Use a bidirectional compensation table; repair screw, nut or gibs where the reversal error has grown."
        ),
        invariant_to="time, feed, and the distance travelled before the reversal.",
        source=(
            "Thesis, section 3.1.2, Figure 3.2 and Table 3-3: variations of the backlash over the range of "
            "motion ask for separate tables by direction."
        ),
    )

    def untestable(self, conditions: Conditions) -> str | None:
        """Return why the data cannot show a map of the reversal error, or None."""
        return super().untestable(conditions) or (None if conditions.both_directions else "one direction only")

    def columns(self, conditions: Conditions, shape: Shape) -> Floats:
        """Return the splines times half of the direction, shape (rows, nodes)."""
        way = self._needed(conditions.direction, "directions of approach")
        return smooth_columns(conditions.position, own_shape(shape, MapShape).nodes) * (way / 2)[:, None]
