"""``rtec blind``: the hidden-effect game - play it, measure again, guess, open it, and score the diagnosis."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from rtec.cli import _measured
from rtec.cli._console import note, print_json, progress
from rtec.cli._groups import verbs_under
from rtec.cli._parameters import apart, force, needs, option, whole, written
from rtec.cli._words import EFFECTS, PLANS, completing
from rtec.errors import ArgumentError, OutputError

if TYPE_CHECKING:
    from rtec.blind.confusion import Confusion
    from rtec.blind.guess import Points
    from rtec.blind.hidden import Secret
    from rtec.blind.scenario import Scenario
    from rtec.blind.scored import LineScore
    from rtec.effects.protocol import Effect


_MISSED = 1
_TRIALS = 20
_PATIENCE = 4
"""Times the trials that are played at most until so many count."""


def frame() -> None:
    """Hide physical effects in an emulated axis, and find out whether they are named.

    Example: rtec blind new --seed 7 -o data.csv && rtec diagnose data.csv && rtec blind guess data.csv backlash
    Example: rtec blind new --hide 'backlash=3 um' -o data.csv && rtec blind guess data.csv 'backlash=3.2 um' --by Ada
    Example: rtec blind score data.csv
    """


def new(
    output: Path = written("-o --output", "data.csv", "The measurement.", default=...),
    seed: int | None = whole("--seed", "Decides everything; another one each time without it.", low=0, high=1 << 62),
    hide: list[str] | None = option(
        "--hide",
        "EFFECT[=SIZE]",
        "What to hide, and how much of it, as backlash='3 um'; may be given again. Five times the noise "
        "without a size; the seed decides without --hide.",
        complete=completing(EFFECTS),
    ),
    plan: str | None = option(
        "--plan", "NAME", "Of the measurement, with --hide; base without it.", complete=completing(PLANS)
    ),
    own: Path | None = _measured.EFFECTS,
    force: bool = force("Write over files that exist."),
    json: bool = _measured.JSON,
) -> None:
    """Hide none to three effects in the emulated axis, measure it, and seal the secret beside the data.

    The seal keeps the secret from a glance only. A size is the number of the effect that 'rtec blind reveal' shows;
    its sign is drawn. With --effects, an effect of yours can be hidden in readings at rest; its size is its amplitude
    in um. Without --hide, one of yours is hidden, alone or beside others.

    Example: rtec blind new --seed 7 -o data.csv
    Example: rtec blind new --hide 'backlash=3 um' --hide 'cyclic=6 um' -o data.csv
    Example: rtec blind new --effects mine.py --hide dent='5 um' --plan dense -o data.csv
    """
    from secrets import randbelow

    from rtec.blind.sealing import new as played
    from rtec.effects.own_file import library_of_file

    drawn = seed is None
    number = randbelow(1 << 31) if seed is None else seed
    scenario = _scenario(hide or [], plan, number, library_of_file(own).own)
    with_own = "" if own is None else f" --effects {own}"
    seal = played(number, output, scenario=scenario, force=force)
    if json:
        print_json({"data": str(output), "sealed": str(seal), "seed": number})
    else:
        typer.echo(f"Measured: {output}; try: rtec diagnose {output}{with_own}")
        typer.echo(f"Sealed: {seal}; open it with: rtec blind reveal {output}")
        if drawn:
            typer.echo(f"Seed: {number}, drawn; --seed {number} plays the same game again")


def _scenario(hide: list[str], plan: str | None, seed: int, own: tuple[Effect, ...]) -> Scenario:
    from rtec.blind.plan import plan_named
    from rtec.blind.scenario import Scenario, scenario_of
    from rtec.blind.sizes import plans_showing, read_size, scenario_of_sizes

    if not hide and plan is not None:
        raise needs("--plan", "--hide", "without, the seed decides on the plan, too")
    pairs = [(name.strip(), equals, text) for name, equals, text in (word.partition("=") for word in hide)]
    names = tuple(name for name, _, _ in pairs)
    own_names = [effect.name for effect in own]
    try:
        if not hide:
            return scenario_of(seed, own)
        measured_by = plan_named(plan or "base")
        Scenario(names=names, plan=measured_by, own=own)  # a wrong name is said before a wrong size
        sizes = [
            (name, read_size(name, text, where="--hide", own=own_names) if equals else None)
            for name, equals, text in pairs
        ]
        return scenario_of_sizes(sizes, measured_by, seed, own)
    except ArgumentError as error:
        name = {"names": "--hide", "plan": "--plan", "own": "--effects"}.get(error.name, error.name)
        others = plans_showing(str(error.value), own) if error.value in names else ()
        hint = f"{error.hint}; it shows in the plans {', '.join(others)}" if others else error.hint
        raise ArgumentError(name, error.value, error.allowed, hint, problem=error.problem) from None


def measure(
    data: Path = typer.Argument(..., help="A measurement of 'new' or 'measure'.", show_default=False),
    plan: Path = option("--plan", "P.toml", "The experiment, as 'diagnose --suggest' writes it.", default=...),
    output: Path = written("-o --output", "SECOND.csv", "The measurement.", default=...),
    seed: int | None = whole(
        "--seed", "Of noise and surroundings; one seed, one set of readings.", low=1, high=1 << 62
    ),
    own: Path | None = _measured.EFFECTS,
    force: bool = force("Write over files that exist."),
    json: bool = _measured.JSON,
) -> None:
    """Carry out an experiment on the same axis, with the same effects in it, and seal the secret beside the new data.

    A game that hides an effect of --effects needs the same file again.

    Example: rtec diagnose data.csv --suggest plan.toml && rtec blind measure data.csv --plan plan.toml -o second.csv
    Example: rtec blind measure data.csv --plan plan.toml -o second.csv --seed 4
    Example: rtec blind measure data.csv --plan plan.toml --effects mine.py -o second.csv --force --json
    """
    from rtec.blind.sealing import measure as measured
    from rtec.effects.own_file import library_of_file

    seal = measured(data, plan, output, seed=seed, own=library_of_file(own).own, force=force)
    if json:
        print_json({"data": str(output), "sealed": str(seal), "plan": str(plan)})
    else:
        with_own = "" if own is None else f" --effects {own}"
        typer.echo(f"Measured: {output}; try: rtec diagnose {output}{with_own}")
        typer.echo(f"Sealed: {seal}; answer with: rtec blind guess {output}{with_own} EFFECT...")


def reveal(
    data: Path = typer.Argument(..., help="The measurement that 'new' wrote.", show_default=False),
    json: bool = _measured.JSON,
) -> None:
    """Say what is hidden in a measurement.

    Example: rtec blind reveal data.csv
    Example: rtec blind reveal data.csv --json
    Example: rtec blind guess data.csv backlash && rtec blind reveal data.csv
    """
    from rtec.blind.sealing import document_of, reveal as opened

    secret = opened(data)
    if json:
        print_json(document_of(secret))
    else:
        _show_secret(secret)


def guess(
    data: Path = typer.Argument(..., help="A measurement of 'new' or 'measure'.", show_default=False),
    effects: list[str] = typer.Argument(
        ...,
        metavar="EFFECT[=SIZE]...",
        help="What is hidden, and how much of it, as backlash='12 um' or backlash='12 +- 0.5 um'; 'unknown' for "
        "what no effect is, or 'nothing'.",
        show_default=False,
        autocompletion=completing(("nothing", "unknown", *EFFECTS)),
    ),
    by: str = option("--by", "NAME", "Whose answer it is, for a class.", default=""),
    own: Path | None = _measured.EFFECTS,
    json: bool = _measured.JSON,
) -> None:
    """Score an answer against the seal, and keep it with the game: which effects are right, missed and wrong.

    2 points for a right name, 1 for its size within 10 % or within the uncertainty that is stated, -1 for a wrong
    name. The answer is kept in DATA.answers, sealed against later change; 'rtec blind score DATA' shows all of them.
    Exit code 1: the answer does not name all that is hidden, or more.

    Example: rtec blind guess data.csv backlash cyclic
    Example: rtec blind guess data.csv 'backlash=12 +- 0.5 um' 'drift=20 um/h' --by Ada
    Example: rtec blind guess data.csv --effects mine.py dent='5 um' --json
    """
    from rtec.blind.guess import guessed, points_of, read_answer, total_of
    from rtec.blind.kept_answers import KeptAnswer, answers_path, keep
    from rtec.blind.sealing import reveal
    from rtec.effects.own_file import library_of_file

    own_names = [effect.name for effect in library_of_file(own).own]
    answer = read_answer(effects, own_names)
    if len(by) > 80 or not by.isprintable():
        raise ArgumentError("--by", repr(by[:60]), "a name of at most 80 printable letters")
    secret = reveal(data)
    found, points = guessed(secret, list(answer), own_names), points_of(secret, answer, own_names)
    kept: Path | None = answers_path(data)
    try:
        number = keep(
            data, KeptAnswer(by=by, at=datetime.now(UTC).isoformat(timespec="seconds"), words=tuple(effects))
        )
    except OutputError as error:  # a teacher's folder that nobody else may write into
        kept, number = None, 0
        note(f"not kept: {error}")
    reached, most = total_of(points)
    if json:
        lists = {"right": list(found.right), "missed": list(found.missed), "wrong": list(found.wrong)}
        document = {"data": str(data), "solved": found.solved, **lists, "points": reached, "most_points": most}
        more = {"reasons": _reasons(points), "kept": kept and str(kept), "by": by, "number": number or None}
        print_json(document | more)
    else:
        typer.echo("Solved." if found.solved else "Not solved.")
        for heading, names in (("Right", found.right), ("Missed", found.missed), ("Wrong", found.wrong)):
            if names:
                typer.echo(f"{heading}: {', '.join(names)}")
        typer.echo(f"Points: {reached} of {most}")
        for reason in _reasons(points):
            typer.echo(f"  {reason}")
        if kept is not None:
            typer.echo(f"Kept: answer {number} in {kept}")
    raise typer.Exit(0 if found.solved else _MISSED)


def _reasons(points: tuple[Points, ...]) -> list[str]:
    return [f"{one.points} of {one.most}: {one.name} {one.why}" for one in points]


def score(
    data: list[Path] | None = typer.Argument(
        None, metavar="[DATA]...", help="Games whose answers to show; the diagnosis plays without."
    ),
    trials: int | None = whole("--trials", f"Games on each line; {_TRIALS} without it.", low=1, high=100_000),
    output: Path | None = written("-o --output", "FILE.md", "Write the table, with all matrices."),
    force: bool = force("Write over a file that exists."),
    seed: int | None = whole("--seed", "Of all games; 0 without it.", low=0, high=1 << 32),
    jobs: int | None = whole(
        "--jobs", "Games played at the same time, 1 without it; the result is the same.", low=1, high=64
    ),
    json: bool = _measured.JSON,
) -> None:
    """Show the answers that people gave to games; or let the diagnosis play many, and print how often it is right.

    Of each person the first answer counts. Where games of the diagnosis are too weak to count, others are played in
    their place. Exit code 1: a share of right answers of the diagnosis lies below its bar.

    Example: rtec blind score --trials 200 --jobs 2 -o confusion.md
    Example: rtec blind score data.csv
    Example: rtec blind score monday.csv tuesday.csv --json
    """
    if data:
        for name, value in (("--trials", trials), ("-o", output), ("--seed", seed), ("--jobs", jobs)):
            if value is not None:
                raise apart(name, "the data of a game", "it is for the diagnosis")
        _show_answers(data, json)
        return
    from rtec.blind.confusion import confusion
    from rtec.blind.judged import judged, refitted
    from rtec.blind.lines import the_lines
    from rtec.io import write_lines

    with progress("games") as show:
        result = confusion(
            the_lines(),
            _TRIALS if trials is None else trials,
            judged,
            seed or 0,
            lambda _, share: show(share),
            refit=refitted,
            workers=jobs or 1,
            patience=_PATIENCE,
        )
    if output is not None:
        write_lines(output, result.as_markdown().splitlines())
    if json:
        print_json(_document(result) | ({} if output is None else {"table": str(output)}))
    else:
        typer.echo(result.as_markdown(), nl=False)
    reached = all(line.reached for line in result.scores) and all(pool.reached for pool in result.pools)
    raise typer.Exit(0 if reached else _MISSED)


def _show_answers(games: list[Path], as_json: bool) -> None:
    found: list[dict[str, Any]] = [{"data": str(data), "answers": _answers(data)} for data in games]
    if as_json:
        print_json({"games": found})
        return
    from rich.box import SIMPLE
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    console = Console(highlight=False)
    for data, game in zip(games, found, strict=True):
        if not game["answers"]:
            console.print(f"{data}: no answers yet", markup=False)
            continue
        table = Table(title=Text(str(data)), title_justify="left", box=SIMPLE, padding=(0, 1, 0, 0))
        for heading in ("by", "points", "answer", "why"):
            table.add_column(heading)
        for one in game["answers"]:
            points = f"{one['points']} of {one['most_points']}"
            counts = points if one["counts"] else f"({points})"
            table.add_row(
                Text(one["by"] or "-"), counts, Text("\n".join(one["answer"])), Text("\n".join(one["reasons"]))
            )
        console.print(table)
    console.print("(points): a later answer of the same person, which does not count.")


def _answers(data: Path) -> list[dict[str, Any]]:
    """Return the answers to a game as plain data; of each person the first one counts."""
    from rtec.blind.guess import guessed, own_names_in, points_of, read_answer, total_of
    from rtec.blind.kept_answers import read_answers
    from rtec.blind.sealing import reveal

    secret = reveal(data)
    rows: list[dict[str, Any]] = []
    for number, kept in enumerate(read_answers(data), start=1):
        own = own_names_in(kept.words)
        answer = read_answer(kept.words, own)
        points = points_of(secret, answer, own)
        reached, most = total_of(points)
        rows.append(
            {
                "number": number,
                "by": kept.by,
                "at": kept.at,
                "answer": list(kept.words),
                "solved": guessed(secret, list(answer), own).solved,
                "points": reached,
                "most_points": most,
                "counts": not kept.by or all(row["by"] != kept.by for row in rows),
                "reasons": _reasons(points),
            }
        )
    return rows


def _document(result: Confusion) -> dict[str, object]:
    return {"trials": result.trials, "seed": result.seed, "lines": [_line_document(line) for line in result.scores]}


def _line_document(scored: LineScore) -> dict[str, object]:
    return {
        "title": scored.line.title,
        "right_is": scored.line.rule.value,
        "bar": scored.line.share,
        "right": scored.right,
        "trials": scored.trials,
        "left_out": scored.left_out,
        "share": scored.share,
        "wilson_95": scored.interval,
        "reached": scored.reached,
        "confusion": [{"hidden": hidden, "answered": said, "count": count} for hidden, said, count in scored.cells],
        "games": [
            {
                "trial": game.trial,
                "seed": game.seed,
                "plan": game.plan,
                "hidden": game.hidden,
                "answered": game.said,
                "right": game.right,
                "effects": game.effects,
            }
            for game in scored.games
        ],
    }


def application(group: type[typer.core.TyperGroup]) -> typer.Typer:
    """Return the verbs of the game as one."""
    return verbs_under(frame, {verb.__name__: verb for verb in (new, measure, guess, reveal, score)}, group)


def _show_secret(secret: Secret) -> None:
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    console = Console(highlight=False)
    noise = f"{secret.noise} noise of {secret.sigma_um:.3g} um, {secret.plan} plan, seed {secret.seed}"
    if not secret.effects:
        console.print(f"Nothing is hidden: {noise}.", markup=False)
        return
    table = Table(title=Text(noise), title_justify="left", box=None, padding=(0, 2, 0, 0))
    for heading, justify in (("hidden", "left"), ("RMS (um)", "right"), ("in sigma", "right"), ("what", "left")):
        table.add_column(heading, justify=justify)  # type: ignore[arg-type]  # two of rich's words
    for hidden in secret.effects:
        outside = " (outside the library)" if hidden.name in secret.outside else ""
        values = ", ".join(f"{p.name} {p.value:.4g} {p.unit}".rstrip() for p in hidden.parameters)
        what = f"{hidden.description}{outside}" + (f"; {values}" if values else "")
        rms = f"{hidden.rms_sigma * secret.sigma_um:.3g}"
        table.add_row(Text(hidden.name), rms, f"{hidden.rms_sigma:.3g}", Text(what))
    console.print(table)
