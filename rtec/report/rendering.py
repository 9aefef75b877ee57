"""How pages are rendered: HTML that escapes what comes from a user and carries its figures, and Markdown."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rtec.report.illustrations import Illustration

if TYPE_CHECKING:
    import jinja2


def page_environment() -> jinja2.Environment:
    """Return what renders templates: text of a user is escaped everywhere, and a name that is missing is an error."""
    import jinja2  # noqa: PLC0415 - a tenth of a second, needed only where a report is written

    return jinja2.Environment(
        loader=jinja2.PackageLoader("rtec.report", "."),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )


def markdown_page(template: Path, **values: object) -> str:
    """Return a page in Markdown; ``{{ rows | table("a", "b") }}`` in its template makes a table.

    Parameters
    ----------
    template
        A Jinja template; nothing is escaped, and a name that is missing is an error.
    **values
        What the template names.
    """
    import jinja2  # noqa: PLC0415 - as above

    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(template.parent),
        autoescape=False,  # noqa: S701 - Markdown, of figures that are ours
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters["table"] = lambda rows, *headings: markdown_table(headings, rows)
    return environment.get_template(template.name).render(**values)


def markdown_table(headings: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Return a table in Markdown.

    Examples
    --------
    >>> print(markdown_table(["a", "b"], [[1, 2]]))
    | a | b |
    |---|---|
    | 1 | 2 |
    """
    lines = [headings, *rows]
    shown = ["| " + " | ".join(str(cell) for cell in line) + " |" for line in lines]
    return "\n".join([shown[0], "|" + "---|" * len(headings), *shown[1:]])


def embedded(figure: Illustration) -> str:
    """Return a figure as text that a page can carry in itself."""
    return base64.b64encode(figure.svg).decode("ascii")
