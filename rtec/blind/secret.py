"""What the game hid."""

from __future__ import annotations

from dataclasses import dataclass

from rtec.blind.hidden import Hidden


@dataclass(frozen=True, slots=True, kw_only=True)
class Secret:
    """What the game hid in a measurement.

    Parameters
    ----------
    effects
        What was hidden, with its strength as it came out.
    noise
        ``white`` or ``correlated``.
    sigma_um
        Standard deviation of the noise of one reading.
    seed
        That decided everything drawn.
    plan
        Name of the plan.
    outside
        Names of those effects that lie outside the library.
    """

    effects: tuple[Hidden, ...]
    noise: str
    sigma_um: float
    seed: int
    plan: str
    outside: tuple[str, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of what was hidden."""
        return tuple(hidden.name for hidden in self.effects)
