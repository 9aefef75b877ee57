"""The text of a verb's help, from its docstring."""

from __future__ import annotations

import inspect
import shutil
from collections.abc import Callable
from typing import Any, Literal

EXAMPLE = "Example: "
_NARROW = 70


def markup_mode() -> Literal["rich"] | None:
    """Return how help is drawn: in frames, or plainly where those would cut options off."""
    return "rich" if shutil.get_terminal_size().columns >= _NARROW else None


def help_of(verb: Callable[..., Any]) -> str:
    r"""Return the docstring of a verb, a line for each paragraph and for each example, to flow at any width.

    Examples
    --------
    >>> def verb():
    ...     '''Do it.
    ...
    ...     In a paragraph of
    ...     two lines.
    ...
    ...     Example: rtec verb
    ...     Example: rtec verb --more
    ...     '''
    >>> help_of(verb)
    'Do it.\n\nIn a paragraph of two lines.\n\nExample: rtec verb\nExample: rtec verb --more'
    """
    paragraphs = inspect.cleandoc(verb.__doc__ or "").split("\n\n")
    flowing = (" ".join(paragraph.split("\n")) for paragraph in paragraphs)
    between = "\n" if markup_mode() else "\n\n"  # plain help fills the lines of a paragraph
    return "\n\n".join(paragraph.replace(f" {EXAMPLE}", f"{between}{EXAMPLE}") for paragraph in flowing)
