"""Verbs as typer takes them: their help, and options that belong together as the fields of a class."""

from __future__ import annotations

import builtins
import inspect
import shutil
import sys
from collections.abc import Callable, Iterator, Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any, ClassVar, Literal, get_args

import typer
from typer.core import TyperGroup
from typer.models import ParameterInfo

from rtec.cli._verb import Verb

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


class OptionGroup:
    """Options that belong together: the base of dataclasses whose fields are declared as parameters of a verb are.

    A parameter that is annotated with such a class stands for all of its fields; so does a field of one.
    """

    PANEL: ClassVar[str | None] = None
    """In which help shows them, where an option names no panel of its own."""

    def __post_init__(self) -> None:
        """Take the default of an option that nothing is said of."""
        for item in fields(self):  # type: ignore[arg-type]  # a dataclass, as said above
            if isinstance(option := getattr(self, item.name), ParameterInfo):
                object.__setattr__(self, item.name, option.default)


def verbs_under(
    frame: Callable[..., None], verbs: Mapping[str, Callable[..., Any] | typer.Typer], cls: type[TyperGroup]
) -> typer.Typer:
    """Return a command line with some verbs under one frame, which has the help and the options of the whole."""
    app = typer.Typer(cls=cls, rich_markup_mode=markup_mode(), pretty_exceptions_enable=False)
    app.callback(help=help_of(frame))(frame)
    for name, verb in verbs.items():
        if isinstance(verb, typer.Typer):
            app.add_typer(verb, name=name)
        else:
            apart = taken_apart(verb)
            app.command(name, cls=type("Verb", (Verb,), {"readers": _readers(apart)}), help=help_of(verb))(apart)
    return app


def _readers(verb: Callable[..., Any]) -> dict[str, Callable[[str], Any]]:
    """Return what makes a value of the text of a parameter, by its name; typer reads those that are left out."""
    found: dict[str, Callable[[str], Any]] = {}
    for one in inspect.signature(verb).parameters.values():
        outer = (one.annotation, *get_args(one.annotation))  # a kind, or a list of it, perhaps or None
        kinds = {kind for each in outer for kind in (each, *get_args(each))} & {str, Path}
        if isinstance(one.default, ParameterInfo) and one.default.parser is not None:
            found[one.name] = one.default.parser
        elif kinds:
            (found[one.name],) = kinds
    return found


def taken_apart(verb: Callable[..., Any]) -> Callable[..., Any]:
    """Return a verb that takes each option by itself, as typer wants it, in place of its groups of options."""

    def called(**given: Any) -> Any:
        return _put_together(verb, given)

    parameters = list(_parameters(verb, None))
    called.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]  # what typer looks at
    called.__annotations__ = {one.name: one.annotation for one in parameters}
    return called


def _parameters(of: Callable[..., Any], panel: str | None) -> Iterator[inspect.Parameter]:
    hints = _annotations(of)
    for one in inspect.signature(of).parameters.values():
        hint = hints[one.name]
        if _is_group(hint):
            yield from _parameters(hint, hint.PANEL or panel)
            continue
        if isinstance(one.default, ParameterInfo):
            one.default.rich_help_panel = one.default.rich_help_panel or panel
        yield one.replace(annotation=hint, kind=inspect.Parameter.KEYWORD_ONLY)


class _Names(dict[str, Any]):
    """What annotations name: as in their module, or any object where that is imported for the type check alone."""

    def __init__(self, of: Callable[..., Any]) -> None:
        self._module = vars(sys.modules[of.__module__])

    def __missing__(self, name: str) -> Any:
        return self._module.get(name, getattr(builtins, name, object))


def _annotations(of: Callable[..., Any]) -> dict[str, Any]:
    """Return what parameters or fields are annotated with.

    What stands behind some kinds of values takes a second to load; what makes a value of a text loads it.
    """
    return inspect.get_annotations(of, locals=_Names(of), eval_str=True)


def _put_together(of: Callable[..., Any], given: Mapping[str, Any]) -> Any:
    kinds = _annotations(of)
    return of(
        **{
            name: _put_together(kinds[name], given) if _is_group(kinds[name]) else given[name]
            for name in inspect.signature(of).parameters
        }
    )


def _is_group(kind: Any) -> bool:
    return isinstance(kind, type) and issubclass(kind, OptionGroup)
