"""``rtec docs``: the pages of the documentation as they are installed, by name, heading, effect or command."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import typer

from rtec.cli._console import print_json
from rtec.errors import RtecError, meant
from rtec.io import pages_folder

_LISTED = "'rtec docs' lists the topics"
_HEADING = re.compile(r"^(#+) (.+)$", re.MULTILINE)
_FENCE = re.compile(r"^```.*?^```$", re.MULTILINE | re.DOTALL)


@dataclass(frozen=True, slots=True, kw_only=True)
class Topic:
    """A page of the documentation, or a part of one."""

    name: str
    title: str
    path: Path
    text: str


def _pages() -> list[Topic]:
    """Return the pages in the order of the index, decision records at the end."""
    folder = pages_folder()
    pages = []
    for path in sorted(folder.rglob("*.md")):
        name = path.relative_to(folder).with_suffix("").as_posix()
        text = path.read_text(encoding="utf-8")
        pages.append(Topic(name=name, title=_plain(text.splitlines()[0].lstrip("# ")), path=path, text=text))
    order = re.findall(r"\]\(([\w/-]+)\.md\)", next(page.text for page in pages if page.name == "index"))
    return sorted(pages, key=lambda page: order.index(page.name) if page.name in order else len(order))


def _plain(title: str) -> str:
    return title.replace("`", "")


def _index(pages: list[Topic]) -> dict[str, Topic]:
    """Return what may be asked for: pages, commands, headings, and the names of effects that head their cards."""
    found = {page.name.removesuffix("/README"): page for page in pages}
    parts = _commands(found)
    for page in pages:
        for part in _parts(page):
            parts.setdefault(part.title.lower(), part)
            if name := re.match(r"#+ `(\w+)`: ", part.text):
                parts.setdefault(name[1], part)
    return parts | found


def _commands(pages: dict[str, Topic]) -> dict[str, Topic]:
    """Return what the reference says of each command, and which pages show it."""
    reference = pages["reference"]
    rows: dict[str, list[str]] = {}
    for row in re.finditer(r"^\| `rtec ((?:[a-z0-9]+ ?)+).*$", reference.text, re.MULTILINE):
        words = row[1].split()
        for count in range(1, len(words) + 1):
            rows.setdefault(" ".join(words[:count]), []).append(row[0])
    found = {}
    for command, lines in rows.items():
        title = f"rtec {command}"
        shown = [f"- `{name}`: {page.title}" for name, page in pages.items() if title in page.text]
        table = ["| command | does |", "|---|---|", *lines]
        text = "\n".join(
            [
                f"# {title}",
                "",
                f"`{title} --help` lists its options.",
                "",
                *table,
                "",
                "Pages that show it:",
                "",
                *shown,
            ]
        )
        found[command] = Topic(name=command, title=title, path=reference.path, text=text + "\n")
    return found


def _parts(page: Topic) -> Iterator[Topic]:
    """Yield what stands under each heading of a page but the first."""
    code = [match.span() for match in _FENCE.finditer(page.text)]
    heads = [head for head in _HEADING.finditer(page.text) if not any(a <= head.start() < b for a, b in code)]
    for number, head in enumerate(heads[1:], 1):
        after = (later.start() for later in heads[number + 1 :] if len(later[1]) <= len(head[1]))
        text = page.text[head.start() : next(after, len(page.text))]
        yield Topic(name=f"{page.name}: {_plain(head[2])}", title=_plain(head[2]), path=page.path, text=text)


def _topic(word: str, pages: list[Topic]) -> Topic:
    """Return what a word stands for.

    Raises
    ------
    RtecError
        A word that is no topic; the message names the nearest one.
    """
    index = _index(pages)
    asked = " ".join(word.lower().split()).removesuffix(".md").removeprefix("rtec ")
    if asked in index:
        return index[asked]
    raise RtecError(f"no topic {word[:60]!r}; {meant(asked, index) or _LISTED}")


def _complete(begun: str) -> list[str]:
    return [page.name for page in _pages() if page.name.startswith(begun)]


def docs(
    topic: list[str] | None = typer.Argument(
        None, metavar="[TOPIC]", help="A page, a heading, an effect or a command.", autocompletion=_complete
    ),
    json: bool = typer.Option(False, "--json", help="One JSON document on stdout, nothing else."),
) -> None:
    """List the pages of the documentation, or show one of them or a part of it.

    On a terminal a pager shows it; into a pipe or a file goes the Markdown as it stands.

    Example: rtec docs
    Example: rtec docs tutorial
    Example: rtec docs backlash --json
    """
    pages = _pages()
    if topic:
        found = _topic(" ".join(topic), pages)
        if json:
            print_json({"name": found.name, "title": found.title, "path": str(found.path), "text": found.text})
        else:
            _show(found.text)
        return
    listed = [page for page in pages if "/" not in page.name and page.name != "index"]
    if json:
        print_json({"topics": [{"name": page.name, "title": page.title, "path": str(page.path)} for page in listed]})
        return
    width = max(len(page.name) for page in listed)
    for page in listed:
        typer.echo(f"{page.name:{width}}  {page.title}")
    typer.echo("'rtec docs TOPIC' shows a page, a heading of one, the card of an effect, or what tells of a command.")


def _show(text: str) -> None:
    from rich.console import Console
    from rich.markdown import Markdown

    console = Console()
    if not console.is_terminal:
        typer.echo(text, nl=False)
        return
    os.environ.setdefault("LESS", "-R")  # colours as they are meant
    with console.pager(styles=True):
        console.print(Markdown(text))
