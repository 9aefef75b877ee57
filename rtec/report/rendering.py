"""How pages are rendered: HTML that escapes what comes from a user and carries its figures, and Markdown."""

from __future__ import annotations

import base64
import csv
import io
from collections.abc import Iterable, Sequence
from pathlib import Path

from rtec.report.drawn import Illustration


def html_page(template: str, figures: Iterable[Illustration], **values: object) -> str:
    """Return a page in HTML; text of a user is escaped everywhere, and a name that is missing is an error.

    Parameters
    ----------
    template
        Its path in this package.
    figures
        The template finds them by name, each with its picture as text that a page can carry in itself.
    **values
        What else the template names.
    """
    import jinja2  # noqa: PLC0415 - a tenth of a second, needed only where a report is written

    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("rtec.report", "."),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    shown = {figure.name: (figure, base64.b64encode(figure.svg).decode("ascii")) for figure in figures}
    return environment.get_template(template).render(figures=shown, **values)


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


def csv_text(rows: Iterable[Sequence[object]]) -> str:
    r"""Return rows as CSV, the head line among them.

    Examples
    --------
    >>> csv_text([("name", "of"), ("a, b", 1.5)])
    'name,of\n"a, b",1.5\n'
    """
    file = io.StringIO()
    csv.writer(file, lineterminator="\n").writerows(rows)
    return file.getvalue()
