"""Options that belong together, declared once as the fields of a class, and verbs that take such classes."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator, Mapping
from typing import Any, ClassVar

import typer
from typer.core import TyperGroup

from rtec.cli._help import help_of, markup_mode
from rtec.cli._parameters import Verb


class OptionGroup:
    """Options that belong together: the base of dataclasses whose fields are declared as parameters of a verb are.

    A parameter that is annotated with such a class stands for all of its fields; so does a field of one.
    """

    PANEL: ClassVar[str | None] = None
    """In which help shows them, where an option names no panel of its own."""


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
            app.command(name, cls=Verb, help=help_of(verb))(taken_apart(verb))
    return app


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
        for option in getattr(hint, "__metadata__", ()):
            option.rich_help_panel = option.rich_help_panel or panel
        yield one.replace(annotation=hint, kind=inspect.Parameter.KEYWORD_ONLY)


def _annotations(of: Callable[..., Any]) -> dict[str, Any]:
    """Return what parameters or fields are annotated with; its names are those of the module, not of the class."""
    return inspect.get_annotations(of, locals={}, eval_str=True)


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
