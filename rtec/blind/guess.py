"""A player's answer against the seal: which effects were right, missed and wrong, and the points for it."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

from rtec.blind.answer import NAMES_OF_NOISE
from rtec.blind.hidden import Parameter, Secret
from rtec.blind.scenario import NOTHING, OUTSIDE, UNKNOWN
from rtec.blind.sizes import Size, read_size, size_of
from rtec.effects import LIBRARY
from rtec.errors import ArgumentError, meant

ANSWERS = (NOTHING, UNKNOWN, *(effect.name for effect in LIBRARY), *OUTSIDE)
"""Words of an answer."""
_NAME_POINTS, _SIZE_POINTS = 2, 1
_SIZE_SHARE, _WIDEST_SHARE = 0.10, 0.25
_NO_EFFECT = "offset"
"""What any record may have: it is neither right nor wrong."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Guess:
    """How an answer did."""

    right: tuple[str, ...]
    missed: tuple[str, ...]
    wrong: tuple[str, ...]
    """Names that were answered and are hidden, that are hidden only, and that were answered only."""

    @property
    def solved(self) -> bool:
        """Whether all that is hidden was answered, and nothing else."""
        return not self.missed and not self.wrong


def guessed(secret: Secret, answer: Sequence[str], own: Collection[str] = ()) -> Guess:
    """Score an answer against a secret.

    Parameters
    ----------
    secret
        What is hidden.
    answer
        Names of effects, ``unknown`` for one outside the library, or ``nothing`` alone.
    own
        Names of a player's own effects.

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
    _check(answer, own)
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


@dataclass(frozen=True, slots=True, kw_only=True)
class Points:
    """The points for one name of an answer, or for one that it misses."""

    name: str
    """Of the effect."""
    points: int
    most: int
    """What it brings, and what it could have brought."""
    why: str
    """In words."""


def read_answer(words: Sequence[str], own: Collection[str] = ()) -> dict[str, Size | None]:
    """Read an answer: names of effects, each with its size behind an equals sign where it is said.

    ``own`` has the names of a player's own effects.

    Raises
    ------
    ArgumentError
        As `guessed` and `read_size`.

    Examples
    --------
    >>> read_answer(["backlash=12 um", "drift"])
    {'backlash': Size(value=12.0, uncertainty=0.0, unit='um'), 'drift': None}
    """
    pairs = [word.partition("=") for word in words]
    _check([name.strip() for name, _, _ in pairs], own)
    return {
        name.strip(): read_size(name.strip(), text, where="EFFECT", own=own) if equals else None
        for name, equals, text in pairs
    }


def own_names_in(words: Sequence[str]) -> frozenset[str]:
    """Return the names in a kept answer that the game does not know: they were a player's own as it was given.

    Examples
    --------
    >>> own_names_in(["dent=5 um", "drift"])
    frozenset({'dent'})
    """
    return frozenset(word.partition("=")[0].strip() for word in words) - set(ANSWERS)


def points_of(secret: Secret, answer: Mapping[str, Size | None], own: Collection[str] = ()) -> tuple[Points, ...]:
    """Return the points of an answer, name by name: 2 for a right name, 1 for its size, -1 for a wrong name.

    A size is right within 10 % of the one that is hidden, or within the uncertainty that the answer states, unless
    that is more than 25 % of it. Signs do not count.

    Examples
    --------
    >>> from rtec.blind.game import play
    >>> from rtec.blind.scenario import Scenario
    >>> _, secret = play(Scenario(names=("backlash", "drift")), 1)
    >>> for one in points_of(secret, read_answer(["backlash=12.5 um", "cyclic"])):
    ...     print(one.points, "of", one.most, one.name, one.why)
    3 of 3 backlash is right; the size is 4.2 % off, within 10 %
    0 of 3 drift is missed
    -1 of 0 cyclic is not hidden
    """
    names = list(answer)
    found = guessed(secret, names, own)
    hidden = {effect.name: effect for effect in secret.effects}
    points = []
    for name in found.right:
        truth = size_of(hidden[name]) if name in hidden else None
        got, why = (0, "") if truth is None else _judged(answer[name], truth)
        most = _NAME_POINTS + (0 if truth is None else _SIZE_POINTS)
        points.append(Points(name=name, points=_NAME_POINTS + got, most=most, why=f"is right{why}"))
    for name in found.missed:
        most = _NAME_POINTS + (0 if size_of(hidden[name]) is None else _SIZE_POINTS)
        points.append(Points(name=name, points=0, most=most, why="is missed"))
    if not secret.effects:
        right = NOTHING in answer
        why = "nothing is hidden" + ("" if right else ", and it was not said")
        points.append(Points(name=NOTHING, points=_NAME_POINTS if right else 0, most=_NAME_POINTS, why=why))
    points += [Points(name=name, points=-1, most=0, why="is not hidden") for name in found.wrong]
    return tuple(points)


def total_of(points: Sequence[Points]) -> tuple[int, int]:
    """Return the sum of points, never below 0, and what could have been reached."""
    return max(sum(one.points for one in points), 0), sum(one.most for one in points)


def _judged(size: Size | None, truth: Parameter) -> tuple[int, str]:
    if size is None:
        return 0, "; its size is not said"
    if size.unit != truth.unit:
        return 0, f"; its size is no {truth.name.replace('_', ' ')} in {truth.unit}"
    true = abs(truth.value)
    off = abs(size.value - true)
    stated = size.uncertainty if size.uncertainty <= _WIDEST_SHARE * size.value else 0.0
    percent = f"; the size is {100.0 * off / true:.1f}".removesuffix(".0") + " % off"
    if off <= _SIZE_SHARE * true:
        return _SIZE_POINTS, f"{percent}, within {_SIZE_SHARE:.0%}".replace("10%", "10 %")
    if off <= stated:
        return _SIZE_POINTS, f"{percent}, within the uncertainty that is stated"
    wide = ", and its uncertainty is wider than 25 %" if size.uncertainty > stated else ""
    return 0, f"{percent}, more than 10 %{wide}"


def _check(answer: Sequence[str], own: Collection[str]) -> None:
    known = (*ANSWERS, *own)
    if not answer:
        raise ArgumentError("EFFECT", "no name", f"names of effects, or '{NOTHING}'")
    for name in answer:
        if name not in known:
            allowed = f"effects of 'rtec effects' or of --effects, '{UNKNOWN}' or '{NOTHING}'"
            raise ArgumentError("EFFECT", repr(name)[:60], allowed, meant(name, known), problem="is not an effect")
    if len(set(answer)) != len(answer):
        raise ArgumentError("EFFECT", repr(" ".join(answer)[:60]), "each name once", problem="names an effect twice")
    if NOTHING in answer and len(answer) > 1:
        problem = f"says '{NOTHING}' and more"
        raise ArgumentError("EFFECT", repr(" ".join(answer)[:60]), f"'{NOTHING}' alone, or effects", problem=problem)
