"""A player's answer against the seal: which effects were right, missed and wrong."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from rtec.blind.answer import NAMES_OF_NOISE
from rtec.blind.scenario import OUTSIDE
from rtec.blind.secret import Secret
from rtec.effects import LIBRARY
from rtec.errors import ArgumentError, nearest

NOTHING = "nothing"
"""The answer where no effect is hidden."""
UNKNOWN = "unknown"
"""The answer where something is hidden that lies outside the library."""
ANSWERS = (NOTHING, UNKNOWN, *(effect.name for effect in LIBRARY), *OUTSIDE)
"""Words of an answer."""
_NO_EFFECT = "offset"
"""What any record may have: it is neither right nor wrong."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Guess:
    """How an answer did.

    Parameters
    ----------
    right, missed, wrong
        Names that were answered and are hidden, that are hidden only, and that were answered only.
    """

    right: tuple[str, ...]
    missed: tuple[str, ...]
    wrong: tuple[str, ...]

    @property
    def solved(self) -> bool:
        """Whether all that is hidden was answered, and nothing else."""
        return not self.missed and not self.wrong


def guessed(secret: Secret, answer: Sequence[str]) -> Guess:
    """Score an answer against a secret.

    Parameters
    ----------
    secret
        What is hidden.
    answer
        Names of effects, ``unknown`` for one outside the library, or ``nothing`` alone.

    Raises
    ------
    ArgumentError
        No answer, a name that is no effect (the nearest is suggested), one twice, or ``nothing`` beside others.

    Notes
    -----
    ``unknown`` stands for all that lies outside the library. An offset is neither right nor wrong, nor is an offset
    of each run where that is the noise.

    Examples
    --------
    >>> from rtec.blind.game import play
    >>> from rtec.blind.scenario import Scenario
    >>> _, secret = play(Scenario(names=("backlash", "drift")), 1)
    >>> guessed(secret, ["backlash", "cyclic"])
    Guess(right=('backlash',), missed=('drift',), wrong=('cyclic',))
    """
    _check(answer)
    said = [name for name in answer if name not in (NOTHING, _NO_EFFECT)]
    hidden = list(secret.names)
    if UNKNOWN in said:
        hidden = [name for name in hidden if name not in secret.outside] + ([UNKNOWN] if secret.outside else [])
    forgiven = NAMES_OF_NOISE.get(secret.noise, frozenset())
    return Guess(
        right=tuple(name for name in said if name in hidden),
        missed=tuple(name for name in hidden if name not in said),
        wrong=tuple(name for name in said if name not in hidden and name not in forgiven),
    )


def _check(answer: Sequence[str]) -> None:
    if not answer:
        raise ArgumentError("EFFECT", "no name", f"names of effects, or '{NOTHING}'")
    for name in answer:
        if name not in ANSWERS:
            hint = nearest(name, ANSWERS)
            allowed = f"effects of 'rtec effects', '{UNKNOWN}' or '{NOTHING}'"
            raise ArgumentError("EFFECT", repr(name)[:60], allowed, "" if hint.startswith("known") else hint)
    if len(set(answer)) != len(answer):
        raise ArgumentError("EFFECT", " ".join(answer)[:60], "each name once")
    if NOTHING in answer and len(answer) > 1:
        raise ArgumentError("EFFECT", " ".join(answer)[:60], f"'{NOTHING}' alone, or names of effects")
