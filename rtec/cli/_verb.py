"""A verb as typer takes it: what its parameters make of the words, and how errors name them."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from typing import Any, ClassVar

import typer
from typer.core import TyperCommand

from rtec.checks import as_written
from rtec.errors import ArgumentError

_PARAMETER = re.compile(r"\b[a-z]+(?:_[a-z0-9]+)+\b")
_SAID = "rtec.said"


class Verb(TyperCommand):
    """A verb that says what a face refuses under the name of the option that the user wrote."""

    readers: ClassVar[Mapping[str, Callable[[str], Any]]] = {}
    """As of `read_quickly`."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Read the words, and keep them for `said`."""
        read_quickly(self.get_params(ctx), self.readers)
        ctx.meta[_SAID] = self.make_parser(ctx).parse_args(args=list(args))[0]
        return super().parse_args(ctx, args)

    def invoke(self, ctx: Any) -> Any:
        """Carry out the verb.

        Raises
        ------
        ArgumentError
            As the verb raises it, with options and numbers as the user wrote them.
        """
        try:
            return super().invoke(ctx)
        except ArgumentError as error:

            def text(words: str) -> str:
                return _PARAMETER.sub(lambda match: self.option_behind(match[0]), words)

            option = self.option_behind(error.name)
            written = next((ctx.meta[_SAID].get(one.name) for one in self.params if option in one.opts), None)
            seen = as_written(error, option, written) if isinstance(written, str) else error.of(option)
            raise ArgumentError(
                option, seen.value, text(seen.allowed), text(seen.hint), problem=seen.problem
            ) from error

    def option_behind(self, name: str) -> str:
        """Return the option whose parameter has a name; the name itself where there is none."""
        for parameter in self.params:
            if parameter.name == name and parameter.opts[0].startswith("-"):
                return parameter.opts[0]
        return name


def read_quickly(parameters: Iterable[Any], readers: Mapping[str, Callable[[str], Any]]) -> None:
    """Let parameters of a command make their values without typer, which loads pydantic for it: that takes 0.06 s.

    Parameters
    ----------
    parameters
        As click has them.
    readers
        What makes a value of a text, by the name of the parameter; typer makes the values of others that are said.
    """
    for one in parameters:
        one.process_value = partial(_read, one, one.process_value, readers.get(one.name))


def _read(
    parameter: Any,
    by_typer: Callable[[Any, Any], Any],
    reader: Callable[[str], Any] | None,
    context: typer.Context,
    value: Any,
) -> Any:
    several = parameter.multiple or parameter.nargs != 1
    if not value and parameter.required:
        return by_typer(context, value)
    if value is None:
        value = () if several else None
    elif reader is not None:
        value = [reader(each) for each in value] if several else reader(value)
    else:
        return by_typer(context, value)
    return value if parameter.callback is None else parameter.callback(context, parameter, value)


def said(context: typer.Context, *names: str) -> list[str]:
    """Return some options with their values as the user wrote them.

    Parameters
    ----------
    context
        Of the verb.
    names
        Of the parameters; what the user did not say is left out.
    """
    texts = context.meta.get(_SAID, {})
    by_name = {parameter.name: parameter for parameter in context.command.params}
    words: list[str] = []
    for name in names:
        text = texts.get(name)
        for each in text if isinstance(text, list) else [] if text is None else [text]:
            parameter = by_name[name]
            if isinstance(each, bool):
                words.append(parameter.opts[-1] if each else parameter.secondary_opts[-1])
            else:
                words += [parameter.opts[-1], str(each)]
    return words
