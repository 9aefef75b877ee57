"""Games as they were played, one JSON line each: a long evidence can be stopped, resumed and compared."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from rtec.blind.confusion import GameJob, Play, seed_of
from rtec.blind.scored import Game
from rtec.errors import FileFormatError
from rtec.io import json_text, parse_json, read_bytes, read_text, write_bytes
from rtec.jobs import JobPool
from tools.evidence import Belief, Evidence, ExaminedGame, ExaminedJob, Figure, Wave, told_by

Known = Mapping[tuple[str, int], Game]
"""Games that were played before, by the title of their line and their trial."""
Record = Callable[[str, Game], None]
"""Takes down a game of the line of this title, as soon as it was played."""

_ALLOWED = "games of these lines and this seed, as the command writes them"
_NESTED = {"waves": Wave, "figures": Figure, "beliefs": Belief}


def game_line(title: str, game: Game) -> str:
    """Return a game as one line of JSON."""
    document = {"line": title, **dataclasses.asdict(game), **dataclasses.asdict(told_by(game))}
    document.pop("examined", None)
    return json_text(document) + "\n"


def appending(path: Path) -> Record:
    """Return what appends games to a file, each whole and at once.

    What was being written when the last session stopped is taken away first.
    """
    if path.exists():
        whole = read_bytes(path)
        write_bytes(path, whole[: whole.rfind(b"\n") + 1])

    def append(title: str, game: Game) -> None:
        with path.open("a", encoding="utf-8") as file:
            file.write(game_line(title, game))

    return append


def going_on(known: Known, record: Record | None = None) -> Play:
    """Return what plays the games that are not known, examines them, and has each taken down."""

    def play(pool: JobPool, jobs: Sequence[GameJob]) -> Iterator[Game]:
        fresh = iter(pool.results([ExaminedJob(job=job) for job in jobs if (job.line.title, job.trial) not in known]))
        for job in jobs:
            game = known.get((job.line.title, job.trial))
            if game is None:
                game = next(fresh)
                if record is not None:
                    record(job.line.title, game)
            yield game

    return play


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
    told = Evidence(**{key: tuple(kind(**one) for one in document.pop(key)) for key, kind in _NESTED.items()})
    document["effects"], document["names"] = tuple(document["effects"]), tuple(document["names"])
    return title, ExaminedGame(**document, examined=told)


def paired(here: Known, there: Known, titles: Sequence[str]) -> list[tuple[str, list[tuple[bool, bool]]]]:
    """Return line by line how the games went that two judges played and that count with both."""
    found = []
    for title in titles:
        both = [key for key in here if key[0] == title and key in there]
        rights = [(here[key].right, there[key].right) for key in both]
        found.append((title, [(a, b) for a, b in rights if a is not None and b is not None]))
    return found


def mcnemar(first_only: int, second_only: int) -> float:
    """Return the probability that two judges alike differ by as much on the same games.

    Parameters
    ----------
    first_only, second_only
        Games that only the first, and only the second, got right.

    Notes
    -----
    McNemar's test in its exact form: each game on which they differ is a fair coin, counted on both sides.

    References
    ----------
    Q. McNemar, Note on the sampling error of the difference between correlated proportions or percentages,
    Psychometrika 12 (1947) 153.
    """
    games, fewer = first_only + second_only, min(first_only, second_only)
    ways = sum(math.comb(games, k) for k in range(fewer + 1))
    return float(min(2 * ways / 2**games, 1.0))


def comparison(pairs: Sequence[tuple[str, Sequence[tuple[bool, bool]]]]) -> list[str]:
    """Return, line by line, how two judges did on the same games, with McNemar's test.

    Parameters
    ----------
    pairs
        Title of each line, and of each game whether the first and the second judge were right.
    """
    rows = [
        "| what is hidden | games of both | right here | right there | only here | only there | p |",
        "|---|---|---|---|---|---|---|",
    ]
    for title, games in pairs:
        here, there = sum(first for first, _ in games), sum(second for _, second in games)
        only_here = sum(first and not second for first, second in games)
        only_there = sum(second and not first for first, second in games)
        shares = [f"{right / len(games):.1%}" if games else "none" for right in (here, there)]
        p = mcnemar(only_here, only_there)
        rows.append(f"| {title} | {len(games)} | {shares[0]} | {shares[1]} | {only_here} | {only_there} | {p:.3g} |")
    return rows
