"""How pages are rendered: templates that escape what comes from a user, figures that a page carries in itself."""

from __future__ import annotations

import base64
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


def embedded(figure: Illustration) -> str:
    """Return a figure as text that a page can carry in itself."""
    return base64.b64encode(figure.svg).decode("ascii")
