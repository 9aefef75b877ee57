"""Games as they were played, one JSON line each: a long evidence can be stopped, resumed and compared."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rtec.blind.confusion import Known, Record, seed_of
from rtec.blind.found import Belief, Figure, Wave
from rtec.blind.scored import Game
from rtec.errors import FileFormatError
from rtec.io import json_text, parse_json, read_bytes, read_text, write_bytes

_ALLOWED = "games of these lines and this seed, as the command writes them"
_NESTED = {"waves": Wave, "figures": Figure, "beliefs": Belief}


def game_line(title: str, game: Game) -> str:
    """Return a game as one line of JSON.

    Examples
    --------
    >>> game_line("a", Game(trial=0, seed=1, plan="base", hidden="nothing", said="NONE", right=True))[:32]
    '{"line": "a", "trial": 0, "seed"'
    """
    return json_text({"line": title, **dataclasses.asdict(game)}) + "\n"


def appending(path: Path) -> Record:
    """Return what appends games to a file, each whole and at once.

    What was being written when the last session stopped is taken away first.

    Examples
    --------
    >>> import tempfile
    >>> file = Path(tempfile.mkdtemp()) / "games.jsonl"
    >>> appending(file)("a", Game(trial=0, seed=1, plan="base", hidden="nothing", said="NONE", right=True))
    >>> len(file.read_text().splitlines())
    1
    """
    if path.exists():
        whole = read_bytes(path)
        write_bytes(path, whole[: whole.rfind(b"\n") + 1])

    def append(title: str, game: Game) -> None:
        with path.open("a", encoding="utf-8") as file:
            file.write(game_line(title, game))

    return append


def read_games(path: Path, seed: int) -> dict[tuple[str, int], Game]:
    """Return the games that a file holds, by title of their line and trial.

    Parameters
    ----------
    path
        The file; one that does not exist holds none. A last line that is not whole is left out.
    seed
        Of all games.

    Raises
    ------
    FileFormatError
        A line that is no game, or a game of another seed.
    """
    if not path.exists():
        return {}
    text = read_text(path, may_be_empty=True)
    known = {}
    for number, line in enumerate(text[: text.rfind("\n") + 1].splitlines(), start=1):
        try:
            title, game = _game_from(parse_json(line))
        except (AttributeError, KeyError, TypeError, ValueError):
            raise FileFormatError(path, number, "this is no game", _ALLOWED) from None
        if game.seed != seed_of(seed, title, game.trial):
            raise FileFormatError(path, number, f"the game was not played with --seed {seed}", _ALLOWED)
        known[title, game.trial] = game
    return known


def _game_from(document: dict[str, Any]) -> tuple[str, Game]:
    title = str(document.pop("line"))
    for key, kind in _NESTED.items():
        document[key] = tuple(kind(**one) for one in document[key])
    document["effects"], document["names"] = tuple(document["effects"]), tuple(document["names"])
    return title, Game(**document)


def paired(here: Known, there: Known, titles: Sequence[str]) -> list[tuple[str, list[tuple[bool, bool]]]]:
    """Return line by line how the games went that two judges played and that count with both.

    Examples
    --------
    >>> one = Game(trial=0, seed=1, plan="base", hidden="nothing", said="NONE", right=True)
    >>> other = dataclasses.replace(one, right=False)
    >>> paired({("a", 0): one}, {("a", 0): other}, ["a"])
    [('a', [(True, False)])]
    """
    found = []
    for title in titles:
        both = [key for key in here if key[0] == title and key in there]
        rights = [(here[key].right, there[key].right) for key in both]
        found.append((title, [(a, b) for a, b in rights if a is not None and b is not None]))
    return found
